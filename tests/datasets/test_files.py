"""Downloads from a web server on this machine that does what servers and networks do."""

import pytest

from motionlab import datasets
from motionlab.datasets import files, registry
from motionlab.errors import DataError

# requests leaves a socket to the garbage collector if the server says 404
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")


def downloaded(toy):
    """Files under the cache folder, part-downloads among them."""
    return sorted(p.relative_to(toy.cache).as_posix() for p in toy.cache.rglob("*") if p.is_file()
                  and "parsed" not in p.parts)  # fmt: skip


def test_small_data_is_fetched_unasked(toy):
    toy.serve()
    assert len(datasets.load("toy")) == 3
    assert downloaded(toy) == [f"clips/toy/{path}" for path in toy.contents]
    toy.server.files.clear()
    assert len(datasets.load("toy", clips=["walk"])) == 1
    assert len(toy.server.requests) == 3


def test_only_what_is_wanted_is_fetched(toy):
    toy.serve()
    datasets.load("toy", "test")
    assert toy.server.requests == ["/toy/02.bvh"]


def test_large_data_is_fetched_only_when_asked(toy, monkeypatch):
    toy.serve()
    monkeypatch.setattr(files, "IMPLICIT_BYTES", 1000)
    with pytest.raises(DataError) as caught:
        datasets.load("toy")
    for word in (
        "toy/01.bvh",
        toy.server.url + "toy/01.bvh",
        "MOTIONLAB_DATA",
        "python -m motionlab data fetch toy",
        "motionlab.datasets.load('gaits')",
    ):
        assert word in str(caught.value)
    assert toy.server.requests == []
    assert len(datasets.load("toy", download=True)) == 3


def test_download_false(toy):
    toy.serve()
    with pytest.raises(DataError, match="3 of 3 files of 'toy' are not on this machine"):
        datasets.load("toy", download=False)
    assert toy.server.requests == []


@pytest.mark.parametrize(
    ("served", "reason"),
    [
        (b"another file", "another SHA-256"),
        (None, "404"),
        ((b"half a fi", 5000), "IncompleteRead|ChunkedEncoding"),
        (b"", "another SHA-256"),
    ],
)
def test_a_download_that_goes_wrong(toy, served, reason):
    toy.serve()
    toy.server.files["toy/02.bvh"] = served
    with pytest.raises(DataError, match=rf"toy/02\.bvh failed \(.*({reason})"):
        datasets.load("toy")
    assert "clips/toy/toy/02.bvh" not in downloaded(toy)
    assert not [name for name in downloaded(toy) if not name.endswith(".bvh")]  # nothing half
    toy.serve()
    assert len(datasets.load("toy")) == 3


def test_no_network(toy, monkeypatch):
    toy.server.shutdown()
    toy.server.server_close()
    offline_first = (
        r"(?s)failed \(127\.0\.0\.1 does not answer: no network\?\)"
        r".*MOTIONLAB_DATA=.*load\('gaits'\).*data fetch toy +tries again"
    )
    with pytest.raises(DataError, match=offline_first) as caught:
        datasets.load("toy")
    assert "HTTPConnection" not in str(caught.value)
    assert toy.server.url + "toy/" in str(caught.value)
    assert downloaded(toy) == []


def test_a_download_that_was_damaged_later(toy):
    toy.serve()
    datasets.load("toy", clips=["toy_01"])  # part of a split: downloaded, not cached
    path = toy.cache / "clips/toy/toy/01.bvh"
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(DataError, match=r"01\.bvh: is not the file it should be"):
        datasets.load("toy")
    clip = registry.members("toy")[0]
    assert next(fault for _, fault in files.verify([clip])) is not None
    files.fetch([clip], "toy")
    assert [fault for _, fault in files.verify([clip])] == [None]
