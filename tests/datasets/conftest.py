"""A source of three tiny clips on a local web server, in place of the real ones."""

from __future__ import annotations

import gc
import hashlib
import http.server
import threading
import zipfile
from types import SimpleNamespace

import pytest
from tiny_bvh import tiny_bvh

from motionlab.datasets import files, registry

PATHS = ["toy/01.bvh", "toy/02.bvh", "toy/walk.bvh"]
SPLITS = ["train", "test", "train"]


class Handler(http.server.BaseHTTPRequestHandler):
    """Serves `server.files`; a value (bytes, length) claims another length than it sends."""

    def do_GET(self) -> None:
        self.server.requests.append(self.path)
        found = self.server.files.get(self.path.lstrip("/"))
        if found is None:
            self.send_error(404)
            return
        data, length = found if isinstance(found, tuple) else (found, len(found))
        self.send_response(200)
        self.send_header("Content-Length", str(length))
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, *_) -> None:
        pass


@pytest.fixture
def server():
    """A web server on this machine; `files` maps paths to what is served."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    server.files, server.requests = {}, []
    server.url = f"http://127.0.0.1:{server.server_port}/"
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    yield server
    server.shutdown()
    server.server_close()
    thread.join()


@pytest.fixture
def toy(tmp_path, monkeypatch, server):
    """The data set "toy": 60 frames each, the first a T-pose, header rate 120, true rate 60.

    Nothing is at hand at first. `serve()` puts the clips on the server, `zip()` and `tree()` into
    the folder that MOTIONLAB_DATA then names.
    """
    contents = {path: tiny_bvh(60, seed=i) for i, path in enumerate(PATHS)}
    columns = [
        "source",
        "path",
        "sha256",
        "bytes",
        "frames",
        "fps",
        "skip",
        "action",
        "style",
        "performance",
        "split",
    ]
    rows = [
        ["toy", path, hashlib.sha256(data).hexdigest(), len(data), 59, 60, 1, "walk", "", "", split]
        for (path, data), split in zip(contents.items(), SPLITS, strict=True)
    ]
    texts = {
        "clips.tsv": "\n".join("\t".join(map(str, row)) for row in [columns, *rows]) + "\n",
        "sources.toml": f"""
            [toy]
            title = "A toy"
            url = "{server.url}"
            home = ""
            units = 0.01
            licence = "CC BY-NC 4.0"
            commercial = false
            citation = "nobody"
            quirks = []
            [examples]
            title = "Examples"
            clips = ["toy/walk", "toy/toy_01"]
        """,
    }
    monkeypatch.setattr(registry, "_text", texts.__getitem__)
    monkeypatch.setattr(files, "_RETRIES", 0)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("MOTIONLAB_DATA", raising=False)
    folder = tmp_path / "data"

    def use_folder() -> None:
        folder.mkdir(exist_ok=True)
        monkeypatch.setenv("MOTIONLAB_DATA", str(folder))

    def make_zip(members: dict[str, bytes] | None = None) -> None:
        use_folder()
        with zipfile.ZipFile(folder / "toy.zip", "w", zipfile.ZIP_LZMA) as archive:
            for name, data in (contents if members is None else members).items():
                archive.writestr(name, data)

    def make_tree(inside: str = "toy") -> None:
        use_folder()
        for path, data in contents.items():
            (folder / inside / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / inside / path).write_bytes(data)

    caches = registry._toml, registry.sources, registry.clips
    for cached in caches:
        cached.cache_clear()
    yield SimpleNamespace(
        contents=contents,
        folder=folder,
        cache=tmp_path / "cache/motionlab",
        server=server,
        serve=lambda: server.files.update(contents),
        zip=make_zip,
        tree=make_tree,
    )
    for cached in caches:
        cached.cache_clear()
    gc.collect()  # sockets that requests left open, before another test is blamed for them
