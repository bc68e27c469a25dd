"""Signatures of the reference: one line to read, types under a line that unfolds."""

import ast

import pytest
from bs4 import BeautifulSoup


@pytest.fixture(scope="module")
def signatures(extension):
    return extension("signatures")


def named(name, kind="", default="", before=""):
    """A parameter as Sphinx writes it."""
    kind = (
        kind and f'<span class="p"><span class="pre">:</span></span><span class="w"> </span>{kind}'
    )
    default = default and (
        '<span class="w"> </span><span class="o"><span class="pre">=</span></span>'
        f'<span class="w"> </span><span class="default_value"><span class="pre">{default}</span></span>'
    )
    text = f'<span class="n"><span class="pre">{before}{name}</span></span>{kind}{default}'
    return f'<em class="sig-param">{text}</em>'


HEAD = (
    '<dt class="sig sig-object py" id="motionlab.read">\n'
    '<span class="sig-prename descclassname"><span class="pre">motionlab.</span></span>'
    '<span class="sig-name descname"><span class="pre">read</span></span>'
)
LINK = '<a class="reference internal" href="#motionlab.Path"><span class="pre">Path</span></a>'
TAIL = '<span class="sig-return"><span class="pre">Motion</span></span><a href="s"><span class="viewcode-link"><span class="pre">[source]</span></span></a></dt>'


def long(*parameters):
    lines = "".join(f"<dd>{parameter},</dd>\n" for parameter in parameters)
    brackets = [f'<span class="sig-paren">{sign}</span>' for sign in "()"]
    return f"{HEAD}{brackets[0]}\n\n<dl>\n{lines}</dl>\n\n{brackets[1]} → {TAIL}"


def test_a_long_signature_is_one_line_and_its_types_unfold(signatures):
    body = long(
        named("path", LINK),
        named("*"),
        named("fps", "float | None", "None"),
        named("more", before="**"),
    )
    line = BeautifulSoup(signatures.rewrite(body), "html.parser").dt
    fold = line.find("details", "types").extract()
    assert line.get_text().strip() == "motionlab.read(path, *, fps=None, **more) → Motion[source]"
    assert [p.get_text() for p in fold.find_all(class_="parameter")] == [
        "path: Path", "fps: float | None = None",
    ]  # fmt: skip
    assert fold.a["href"] == "#motionlab.Path" and not fold.has_attr("open")
    assert line["id"] == "motionlab.read" and line.find(class_="viewcode-link")


def test_without_types_nothing_unfolds(signatures):
    found = signatures.rewrite(long(named("path"), named("fps", default="30")))
    assert "details" not in found and ">path, fps=30<" in found


def test_a_short_signature_keeps_its_types_in_line(signatures):
    body = f'{HEAD}<span class="sig-paren">(</span>{named("path", LINK)}<span class="sig-paren">)</span>{TAIL}'
    line = BeautifulSoup(signatures.rewrite(body), "html.parser").dt
    assert line.get_text().strip() == "motionlab.read(path: Path)Motion[source]"
    assert not line.find(class_="pre") and not line.details


def test_what_is_no_signature_stays(signatures):
    body = '<dl><dt>word</dt><dd><span class="pre">what it means</span></dd></dl>'
    assert signatures.rewrite(body) == body


def test_defaults_that_are_no_python_can_be_parsed(signatures):
    written = signatures.parsable(
        "(rules: Rules = <factory>, wish: Wish = <function wishes>, enough=<function <lambda>>)"
    )
    assert written == "(rules: Rules = ..., wish: Wish = wishes, enough=...)"
    ast.parse(f"def made{written}: pass")
    assert signatures.parsable(None) is None


def test_a_default_that_is_a_fraction_is_one(signatures):
    page = signatures.rewrite(long(named("step", "float", "0.03333333333333333"), named("rate", "float", "0.1234567891")))  # fmt: skip
    seen = BeautifulSoup(page, "html.parser").find(class_="arguments").text
    assert seen == "step=1/30, rate=0.1234567891"
