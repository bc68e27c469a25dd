"""What the chapters cost in time of processors: `python book/budget.py`. Fails if one costs too much.

For those who write chapters, and for CI. It asks processors, not the clock, so that a machine which
is slow or busy fails nobody; a reader's build never asks.
"""

import sys

import chapters

SECONDS = 150  # of processors, a chapter


def main() -> None:
    over = []
    for chapter in chapters.find():
        record = chapter.record
        if "processor_seconds" not in record:
            sys.exit(f"{chapter.shown}: was not executed yet; `make book` does that.")
        used = record["processor_seconds"]
        print(f"{used:6.1f} s of {SECONDS} s  {chapter.shown}")
        over += [chapter.shown] if used > SECONDS else []
    if over:
        sys.exit(f"Over the budget: {', '.join(over)}. Make them lighter, or show a stored result.")


if __name__ == "__main__":
    main()
