"""Our docstrings on the API pages: numpy's sections, with one line for a name.

    Parameters
    ----------
    offsets : (joints, 3) metres, each joint
        relative to its parent.

numpydoc takes what follows the colon for a type. We say the shape and the unit there, and what it
is, so a section becomes a list of names and their descriptions.
"""

import re

from sphinx.application import Sphinx

ITEM = re.compile(r"(?P<names>[*\w]+(, [*\w]+)*) : (?P<text>.+)")


def rewrite(lines: list[str]) -> list[str]:
    """reStructuredText for the lines of a docstring."""
    written, inside = [], False
    for number, line in enumerate(lines):
        following = lines[number + 1] if number + 1 < len(lines) else ""
        if line and re.fullmatch("-{3,}", following):
            written += [f".. rubric:: {line}", ""]
            inside = True
        elif inside and re.fullmatch("-{3,}", line):
            continue
        elif inside and (item := ITEM.fullmatch(line)):
            names = ", ".join(f"``{name}``" for name in item["names"].split(", "))
            written.append(f"* {names}: {item['text']}")
        elif inside and line.startswith("    "):
            written.append(f"  {line.strip()}")
        elif inside and line and written[-1].startswith(("* ", "  ")):
            written += ["", line]  # plain words after the list
        else:
            written.append(line)
    return written


def says_nothing(obj: object) -> bool:
    """Whether it is a field of a named tuple, whose docstring is Python's own: its number."""
    return (getattr(obj, "__doc__", None) or "").startswith("Alias for field number")


def setup(app: Sphinx) -> dict:
    def process(app, what, name, obj, options, lines):
        lines[:] = rewrite(lines)

    def skip(app, what, name, obj, skipped, options):
        return True if says_nothing(obj) else None

    app.connect("autodoc-process-docstring", process)
    app.connect("autodoc-skip-member", skip)
    return {"parallel_read_safe": True}
