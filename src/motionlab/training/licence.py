"""Under which licence weights stand: that of the data they learned from, and of what they began with.

It is kept with the weights as ``about["licence"]``:

* `sources`, a line for each source of the training clips;
* `commercial`, false if one of them, or of what the weights began with, forbids commercial use;
* `own`, true if clips are of nobody's known: then what their owner allows holds as well;
* `base`, of weights that began with others: their `name`, `sha256` and `licence`; else None.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections import Counter
from pathlib import Path

from .. import datasets
from .checkpoints import load_weights
from .prepared import Prepared

_FORBIDS = "Not for commercial use"
_COPY = re.compile(r"_mirrored$|_\d+/\d+$")  # what `prepare` writes after a clip's name


def licence(data: Prepared, start: str | os.PathLike | None = None) -> dict:
    """Of weights that learn from data, and began with those of a file; fit for JSON."""
    found = _of_data(data)
    if start is None:
        return found | {"base": None}
    base = Path(start)
    _, about = load_weights(base)
    card = base.with_suffix(".md")
    its = of_weights(about, card.read_text(encoding="utf-8") if card.is_file() else "")
    return found | {
        "commercial": found["commercial"] and its["commercial"],
        "own": found["own"] or its["own"],
        "base": {
            # shipped weights are named, those of a training lie in a folder that is
            "name": about["name"] if "command" in about else f"{base.resolve().parent.name}/{base.name}",
            "sha256": hashlib.sha256(base.read_bytes()).hexdigest(),
            "licence": its,
        },
    }  # fmt: skip


def in_words(found: dict) -> str:
    """A licence in Markdown."""
    forbids = f"{_FORBIDS}: some of its data are not."
    allows = "The licences of its data allow commercial use."
    if found["own"]:
        allows = (
            "The licences of its other data allow commercial use; of clips of your own you decide."
        )
    lines = [
        allows if found["commercial"] else forbids,
        "Who passes these weights on names the sources:",
        "",
    ]
    while found is not None:
        lines += [f"* {line}" for line in found["sources"]]
        base = found["base"]
        if base is not None:
            lines += [
                "",
                f"They began with `{base['name']}`, sha256 {base['sha256']}, which learned from:",
                "",
            ]
        found = base and base["licence"]
    return "\n".join(lines)


def _of_data(data: Prepared) -> dict:
    """The sources of the training clips, the largest first."""
    frames: Counter[str] = Counter()
    clips: dict[str, set[str]] = {}
    rows = zip(data.names, data.splits, data.lengths.tolist(), strict=True)
    for name, split, length in rows:
        source, _, clip = name.partition("/")
        if split == "train":
            frames[source] += length
            clips.setdefault(source, set()).add(_COPY.sub("", clip))
    lines, commercial, own = [], True, False
    for source, count in frames.most_common():
        share = f"(`{source}`), {100 * count / frames.total():.1f} % of the frames"
        # a folder may be called as a data set is
        if source in datasets.names() and clips[source] & set(datasets.table(source).name):
            about = datasets.info(source)
            lines.append(f"{about.title} {share}: {about.licence}. {about.citation}")
            commercial &= about.commercial
        else:
            lines.append(f"Clips of a folder {share}: as their owner says.")
            own = True
    return {"sources": lines, "commercial": commercial, "own": own}


def of_weights(about: dict, card: str) -> dict:
    """As weights say themselves, in what is kept with them, or else as their card does (Markdown, or "");
    what nothing is known of is not for commercial use."""
    if about.get("licence"):
        return about["licence"]
    said = card.partition("\n## Licence\n")[2]
    sources = [line.removeprefix("* ") for line in said.splitlines() if line.startswith("* ")]
    return {
        "sources": sources or ["Of its data nothing is known."],
        "commercial": bool(said) and _FORBIDS not in said,
        "own": False,
        "base": None,
    }
