"""Signatures on the reference pages: one line to read, their types under a line that unfolds.

Sphinx gives each parameter a line of its own with its type, and wraps every sign of it in two
elements. Shapes and units stand in the docstring below, so what a call looks like comes first:

    forward_kinematics(skeleton, root_positions, rotations) → tuple[Tensor, Tensor]   types
"""

import re
from fractions import Fraction

from bs4 import BeautifulSoup, Tag
from sphinx.application import Sphinx

SIGNATURE = re.compile(r'<dt class="sig sig-object py".*?</dt>', re.DOTALL)
FUNCTION = re.compile(r"<function ([\w.]+)[^>]*>")
NUMBER = re.compile(r"\d+\.\d+")
NAMELESS = re.compile(r"<factory>|<function <lambda>[^>]*>")
KEPT = {"sig-prename", "sig-name", "viewcode-link", "arguments", "parameter"}


def rewrite(body: str) -> str:
    """The same HTML with its signatures made so."""
    return SIGNATURE.sub(lambda found: _signature(found[0]), body)


def parsable(signature: str | None) -> str | None:
    """A signature whose defaults are Python: a function by its name, "..." for what has none.

    Sphinx would give up on "<function wishes>" and "<factory>", and write the whole of it as it stands.
    """
    return signature and FUNCTION.sub(r"\1", NAMELESS.sub("...", signature))


def _signature(html: str) -> str:
    soup = BeautifulSoup(html, "html.parser")
    line = soup.dt
    if long := line.dl:  # Sphinx's way to write one parameter a line
        given = long.find_all("em", "sig-param")
        short = soup.new_tag("span", attrs={"class": ["arguments"]})
        short.string = ", ".join(_argument(parameter) for parameter in given)
        for gap in (long.previous_sibling, long.next_sibling):
            gap.extract()  # line breaks that would be spaces in the parentheses
        long.replace_with(short)
        line.append(_types(soup, given))
    for element in line.find_all("span"):
        if not KEPT.intersection(element.get("class", [])):
            element.unwrap()
    soup.smooth()
    return str(soup)


def _argument(parameter: Tag) -> str:
    """A parameter without its type: its name, and its default if it has one."""
    named = parameter.get_text()
    default = parameter.find(class_="default_value")
    name = re.match(r"\**\w*|/", named)[0]
    return f"{name}={_short(default.get_text())}" if default else name


def _short(default: str) -> str:
    """1/30, which Sphinx knows as 0.03333333333333333 only; all else as it is."""
    if len(default) < 10 or not NUMBER.fullmatch(default):
        return default
    simple = Fraction(float(default)).limit_denominator(100)
    return str(simple) if float(simple) == float(default) else default


def _types(soup: BeautifulSoup, given: list[Tag]) -> Tag:
    """What unfolds: a line for each parameter, as Sphinx wrote it."""
    fold = soup.new_tag("details", attrs={"class": ["types"]})
    summary = soup.new_tag("summary")
    summary.string = "types"
    fold.append(summary)
    for parameter in given:
        if ":" in parameter.get_text():
            parameter.name = "span"
            parameter["class"] = ["parameter"]
            fold.append(parameter.extract())
    return fold if len(fold.contents) > 1 else soup.new_tag("span")


def setup(app: Sphinx) -> dict:
    def process(app, pagename, templatename, context, doctree):
        if "body" in context:
            context["body"] = rewrite(context["body"])

    def parse(app, what, name, obj, options, signature, returned):
        return parsable(signature), returned

    app.connect("html-page-context", process)
    app.connect("autodoc-process-signature", parse)
    return {"parallel_read_safe": True}
