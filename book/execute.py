"""Execute one page of the book in a process of its own: `python book/execute.py notebooks/01_motion_data.ipynb`.

Says which cell it is at and, if one fails, what it said. With `--into FOLDER`, as the build calls it,
the executed page (page.ipynb), the scripts it leaves for the book (scripts/) and a record of its
cells, its error and its cost (record.json) are put there.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import sys
import time
from pathlib import Path
from queue import Empty

import nbformat
from myst_nb.core.config import NbParserConfig
from myst_nb.core.read import create_nb_reader
from myst_parser.config.main import MdParserConfig
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError, CellTimeoutError, DeadKernelError

ROOT = Path(__file__).resolve().parent.parent
CELL_SECONDS = 3600  # a cell that hangs must end some day; a slow machine must never meet this
COLOURS = re.compile(r"\x1b\[[0-9;]*m")


def read_page(path: Path) -> nbformat.NotebookNode | None:
    """A page as MyST-NB will read it; None if it holds no code."""
    text = path.read_text(encoding="utf-8")
    reader = create_nb_reader(str(path), MdParserConfig(), NbParserConfig(), text)
    return reader and reader.read(text)


def set_environment(scripts: Path | None) -> None:
    """What pages find when they are made for the book."""
    os.environ["MOTIONLAB_VIEWER"] = "page"  # players that live without a kernel
    # Networks of the book are small: two threads wait for each other longer than they work, and far
    # longer where other programs want the same cores (benchmarks/README.md).
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    if folder := os.environ.get("MOTIONLAB_DATA"):
        os.environ["MOTIONLAB_DATA"] = str(Path(folder).resolve())  # pages run in their folder
    if scripts:
        scripts.mkdir(parents=True, exist_ok=True)
        os.environ["MOTIONLAB_SCRIPTS"] = str(scripts.resolve())


class Client(NotebookClient):
    """nbclient's, but it never waits for longer than a second without looking.

    Where a cell shows an ipywidgets Output, nbclient sends on the socket on which it waits for the
    end of the cell, and may then sleep through that end for good, more often the busier the
    machine (nbclient issue 312). Whoever asks anew finds the message.
    """

    async def async_start_new_kernel_client(self, **kwargs):
        client = await super().async_start_new_kernel_client(**kwargs)
        look = client.shell_channel.get_msg

        async def get_msg(timeout: float | None = None) -> dict:
            end = math.inf if timeout is None else time.monotonic() + timeout
            while True:
                try:
                    return await look(timeout=min(1, max(0, end - time.monotonic())))
                except Empty:
                    if time.monotonic() >= end:
                        raise

        client.shell_channel.get_msg = get_msg
        return client


class Run:
    """One page under way: `error` is what stopped it, if anything did."""

    def __init__(self, path: Path, say):
        self.path, self.say, self.error = path, say, None
        self.notebook = read_page(path)
        self.code = [i for i, c in enumerate(self.notebook.cells) if c.cell_type == "code"]
        self.at = 0  # which code cell
        self.parent = os.getppid()

    def execute(self) -> None:
        client = Client(
            self.notebook,
            timeout=CELL_SECONDS,
            record_timing=False,  # it would stand in the cells, which then are others
            kernel_name=self.notebook.metadata.get("kernelspec", {}).get("name", "python3"),
            resources={"metadata": {"path": str(self.path.parent)}},
            on_cell_execute=self._begin,
        )
        try:
            client.execute()
        except CellExecutionError as error:
            self._fail(COLOURS.sub("", f"{error.ename}: {error.evalue}"), error.traceback)
        except CellTimeoutError:
            self._fail(f"it ran for more than {CELL_SECONDS / 3600:g} hour.")
        except DeadKernelError:
            self._fail("its Python ended: killed from outside, or for want of memory.")

    def _begin(self, cell, cell_index: int) -> None:
        if os.getppid() != self.parent:
            sys.exit("The build that wanted this page is gone.")
        self.at = self.code.index(cell_index) + 1
        self.say(self.at, len(self.code))

    def _fail(self, message: str, traceback: str = "") -> None:
        source = self.notebook.cells[self.code[self.at - 1]].source.strip().splitlines()
        self.error = {
            "cell": self.at,
            "of": len(self.code),
            "source": "\n".join(source[:3] + ["..."] * (len(source) > 3)),
            "message": message,
            "traceback": traceback,
        }


def cost(begin: float) -> dict:
    """Seconds by the clock, and of processors: of this process and of the kernel it waited for."""
    return {
        "seconds": round(time.monotonic() - begin, 1),
        "processor_seconds": round(sum(os.times()[:4]), 1),
        "threads": os.environ["OMP_NUM_THREADS"],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("page", type=Path)
    parser.add_argument("--into", type=Path, help="folder for what comes out")
    options = parser.parse_args()
    if not options.page.is_file():
        sys.exit(f"{options.page}: there is no such page; they are in notebooks/ and book/.")
    begin = time.monotonic()
    set_environment(options.into and options.into / "scripts")
    say = lambda at, of: print(
        json.dumps([at, of]) if options.into else f"cell {at} of {of}", flush=True
    )
    if read_page(options.page) is None:
        sys.exit(f"{options.page}: holds no code.")
    run = Run(options.page, say)
    run.execute()
    if options.into:
        nbformat.write(run.notebook, options.into / "page.ipynb")
        record = {**cost(begin), "cells": len(run.code), "error": run.error}
        (options.into / "record.json").write_text(json.dumps(record), encoding="utf-8")
    elif run.error:
        sys.exit(
            f"{run.error['traceback']}\n{options.page}, cell {run.error['cell']}: {run.error['message']}"
        )


if __name__ == "__main__":
    main()
