"""Where the bytes of a clip come from.

In this order: the folder that MOTIONLAB_DATA names, which may be read-only and holds <source>.zip
or the unpacked files; what was downloaded before; a download from the clip's public address. Every
file is checked against the SHA-256 in the table of clips.
"""

from __future__ import annotations

import hashlib
import logging
import lzma
import os
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Self
from urllib.parse import urlsplit

from tqdm import tqdm

from ..errors import DataError
from .registry import Clip, File, files_of, sources

_UNREADABLE = (OSError, EOFError, RuntimeError, zipfile.BadZipFile, lzma.LZMAError, zlib.error)
# More than this is only downloaded when asked for.
IMPLICIT_BYTES = 10_000_000
_TIMEOUT = 20  # seconds without an answer
_PARALLEL = 8  # downloads at a time
_RETRIES = 1


def data_folder() -> Path | None:
    """The folder that MOTIONLAB_DATA names, None if it is not set.

    Raises
    ------
    DataError : it is set and there is no such folder.
    """
    name = os.environ.get("MOTIONLAB_DATA")
    if not name:
        return None
    folder = Path(name).expanduser()
    if not folder.is_dir():
        raise DataError(
            f"MOTIONLAB_DATA is {name!r}, which is not a folder; let it name the folder that holds "
            f"{next(iter(sources()))}.zip and the like, or unset it."
        )
    return folder


def cache_folder() -> Path:
    """The user's cache folder for motionlab; XDG_CACHE_HOME moves it."""
    import pooch

    base = os.environ.get("XDG_CACHE_HOME")
    return Path(base) / "motionlab" if base else Path(pooch.os_cache("motionlab"))


def download_folder(source: str) -> Path:
    return cache_folder() / "clips" / source


class Shelf:
    """The files of one source that are on this machine."""

    def __init__(self, source: str) -> None:
        folder = data_folder()
        self.folders = [download_folder(source)]
        self.archive: zipfile.ZipFile | None = None
        if folder is not None:
            self.folders = [folder / source, folder, *self.folders]
            path = folder / f"{source}.zip"
            self.archive = _open_zip(path) if path.is_file() else None
        self._in_archive = set(self.archive.namelist()) if self.archive else set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_) -> None:
        if self.archive:
            self.archive.close()

    def place(self, file: File) -> str | None:
        """Where the file lies, for people to read; None if it is not here."""
        if file.path in self._in_archive:
            return f"{self.archive.filename}:{file.path}"
        return next((str(f / file.path) for f in self.folders if (f / file.path).is_file()), None)

    def read(self, file: File) -> bytes:
        """The file's bytes, checked.

        Raises
        ------
        DataError : the file is damaged or can't be read.
        """
        place = self.place(file)
        try:
            if file.path in self._in_archive:
                data = self.archive.read(file.path)
            else:
                data = Path(place).read_bytes()
        except _UNREADABLE as error:
            raise DataError(f"{place}: can't be read ({error}); copy or fetch it again.") from error
        found = hashlib.sha256(data).hexdigest()
        if found != file.sha256:
            raise DataError(
                f"{place}: is not the file it should be (SHA-256 {found}, expected {file.sha256}); "
                "it is damaged or edited: remove it, or let MOTIONLAB_DATA name another folder, and "
                f"run `python -m motionlab data fetch {file.source}`."
            )
        return data


def _open_zip(path: Path) -> zipfile.ZipFile:
    try:
        archive = zipfile.ZipFile(path)
    except (OSError, zipfile.BadZipFile) as error:
        raise DataError(
            f"{path}: can't be opened as a zip file ({error}); copy it again or remove it."
        ) from error
    for name in archive.namelist():
        windows = PureWindowsPath(name)
        if PurePosixPath(name).is_absolute() or windows.anchor or ".." in windows.parts:
            archive.close()
            raise DataError(
                f"{path}: member {name!r} points outside of the archive; this is not one of "
                "motionlab's files and may be harmful: remove it."
            )
    return archive


def _by_source(files: Sequence[File]) -> Iterator[tuple[Shelf, list[File]]]:
    groups: dict[str, list[File]] = {}
    for file in files:
        groups.setdefault(file.source, []).append(file)
    for source, members in groups.items():
        with Shelf(source) as shelf:
            yield shelf, members


def missing(files: Sequence[File]) -> list[File]:
    """Those of the files that are not on this machine."""
    return [f for shelf, members in _by_source(files) for f in members if shelf.place(f) is None]


def read(clips: Sequence[Clip]) -> Iterator[tuple[Clip, list[bytes]]]:
    """Clips, which must be at hand, and the checked bytes of their file and of those besides."""
    for shelf, members in _by_source(clips):
        for clip in members:
            yield clip, [shelf.read(file) for file in (clip, *clip.besides)]


def verify(files: Sequence[File]) -> Iterator[tuple[File, str | None]]:
    """Files that are at hand, and what is wrong with them, None if nothing is."""
    for shelf, members in _by_source(files):
        for file in members:
            if shelf.place(file) is not None:
                try:
                    shelf.read(file)
                    yield file, None
                except DataError as error:
                    yield file, str(error)


def get(name: str, clips: Sequence[Clip], download: bool | None = None) -> None:
    """Bring the clips' files onto this machine, or say why not and what can be done.

    `download` None downloads at most 10 MB, True anything, False nothing.
    """
    wanted = files_of(clips)
    absent = missing(wanted)
    if not absent:
        return
    size = sum(file.bytes for file in absent)
    if download or (download is None and size <= IMPLICIT_BYTES):
        fetch(absent, name)
    else:
        raise DataError(_absent(name, absent, len(wanted), "they are not downloaded unasked"))


def _absent(
    name: str, absent: Sequence[File], wanted: int, reason: str, failed: bool = False
) -> str:
    """What is missing, why, and what helps; a download that has `failed` is the last advice."""
    size = sum(file.bytes for file in absent) / 1e6
    first = absent[0]
    folder = os.environ.get("MOTIONLAB_DATA")
    looked = f"MOTIONLAB_DATA={folder}" if folder else "MOTIONLAB_DATA is not set"
    command = f"  python -m motionlab data fetch {name}    "
    offline = [
        f"  MOTIONLAB_DATA=folder    with {first.source}.zip or {first.source}/{first.path} in it",
        "  motionlab.datasets.load('gaits')    needs neither files nor network",
    ]
    if failed:
        ways = [*offline, f"{command}tries again, {size:.1f} MB, once there is a network"]
    else:
        ways = [f"{command}downloads {size:.1f} MB, such as {first.url}", *offline]
    return "\n".join(
        [
            f"{len(absent)} of {wanted} files of {name!r} are not on this machine ({looked}), such "
            f"as {first.path}; {reason}. Any of these helps:",
            *ways,
        ]
    )


def fetch(files: Sequence[File], name: str, quiet: bool = False) -> None:
    """Download files into the user's cache folder, a few at a time, with a progress bar.

    What is there with the right hash is kept; a file gets its name only when it is whole and right.

    Raises
    ------
    DataError : a download fails or brings something else than expected.
    """
    bar = tqdm(
        total=sum(file.bytes for file in files), desc=f"fetching {name}", unit="B",
        unit_scale=True, leave=False, delay=0.5, disable=quiet or None,
    )  # fmt: skip
    pool = ThreadPoolExecutor(_PARALLEL)
    jobs = {pool.submit(_fetch_one, file): file for file in files}
    done = 0
    try:
        for job in as_completed(jobs):
            file = jobs[job]
            try:
                job.result()
            except Exception as error:  # requests, urllib3, pooch and the disk each have their own
                left = [file, *(f for f in files if f is not file)][: len(files) - done]
                reason = f"downloading {file.url} failed ({_in_short(error, file)})"
                raise DataError(_absent(name, left, len(files), reason, failed=True)) from error
            done += 1
            bar.update(file.bytes)
    finally:
        pool.shutdown(cancel_futures=True)
        bar.close()


def _fetch_one(file: File) -> None:
    import pooch

    pooch.get_logger().setLevel(logging.ERROR)
    folder = download_folder(file.source)
    # pooch makes folders too, but two of its threads may get in each other's way
    (folder / file.path).parent.mkdir(parents=True, exist_ok=True)
    pooch.create(
        path=folder,
        base_url=sources()[file.source].url,
        registry={file.path: f"sha256:{file.sha256}"},
        urls={file.path: file.url},
        retry_if_failed=_RETRIES,
    ).fetch(file.path, downloader=pooch.HTTPDownloader(timeout=_TIMEOUT))


def _in_short(error: BaseException, file: File) -> str:
    import requests

    silent = isinstance(error, requests.ConnectionError | requests.Timeout)
    if silent and not isinstance(error, requests.exceptions.SSLError):
        return f"{urlsplit(file.url).hostname} does not answer: no network?"
    if isinstance(error, ValueError) and "hash" in str(error).lower():
        return f"what came has another SHA-256 than {file.sha256}"
    # requests wraps urllib3's error, which wraps the one that says what happened
    while True:
        inner = getattr(error, "reason", None) or (error.args[0] if error.args else None)
        if not isinstance(inner, BaseException):
            return f"{type(error).__name__}: {str(error).split('>: ')[-1]}"
        error = inner
