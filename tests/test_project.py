"""The files around the code say what is true: environment, lock, map, reference, imports."""

import ast
import doctest
import graphlib
import importlib.util
import json
import re
import shutil
import subprocess
import sys
import tomllib
from itertools import chain
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

import motionlab

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "motionlab"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")

# The line of CONTRIBUTING.md: a module may import from its own group and from those before it.
GROUPS = [
    {group.strip().rstrip("/") for group in part.split(",")}
    for part in re.search(r"\n    (skeleton.*?)\n\n", CONTRIBUTING, re.DOTALL)[1].split("<-")
]


def tracked(*under: str) -> list[Path]:
    """Files that git keeps or would keep: not what .gitignore names."""
    if shutil.which("git") is None:
        pytest.skip("no git on this machine: apt-get install git")
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", *under],
        cwd=ROOT, capture_output=True, text=True, encoding="utf-8",
    )  # fmt: skip
    if listed.returncode:
        pytest.skip("not a git checkout: clone the repository instead of unpacking an archive")
    return [ROOT / line for line in listed.stdout.splitlines() if (ROOT / line).exists()]


def test_environment_installs_the_lock_and_every_extra():
    environment = yaml.safe_load((ROOT / "environment.yml").read_text(encoding="utf-8"))
    *conda, pip = environment["dependencies"]
    python = next(d for d in conda if d.startswith("python=")).removeprefix("python=")
    assert SpecifierSet(PROJECT["requires-python"]).contains(python)
    assert "-r requirements-lock.txt" in pip["pip"]
    editable = next(line for line in pip["pip"] if line.startswith("-e "))
    assert set(Requirement("motionlab" + editable[4:]).extras) == set(
        PROJECT["optional-dependencies"]
    )


def test_lock_pins_every_dependency_inside_its_range():
    lines = (ROOT / "requirements-lock.txt").read_text(encoding="utf-8").splitlines()
    lock = [Requirement(line) for line in lines if line and not line.startswith("#")]
    wanted = list(chain(PROJECT["dependencies"], *PROJECT["optional-dependencies"].values()))
    for requirement in map(Requirement, wanted):
        name = canonicalize_name(requirement.name)
        pins = [r for r in lock if canonicalize_name(r.name) == name]
        assert pins, f"{name} is not in the lock file"
        for pin in pins:
            version = str(pin.specifier).removeprefix("==")
            assert requirement.specifier.contains(version), f"{requirement}, locked {version}"
    assert "torch==2.13.0" in lines
    assert not any("://" in line for line in lines if not line.startswith("#"))


def test_version_is_the_same_everywhere():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert PROJECT["version"] == motionlab.__version__ == citation["version"]
    assert PROJECT["license"] == citation["license"] == "MIT"


def test_map_in_contributing_is_the_tree():
    block = re.search(r"```text\n.*?```", CONTRIBUTING, re.DOTALL)[0]
    named: dict[tuple[str, ...], set[str]] = {}  # folders of the map, with those below them
    inner: set[str] = set()
    for below, folder in re.findall(r"^(  )?([a-z_/]+)/ ", block, re.MULTILINE):
        if not below:
            inner = named[tuple(folder.split("/"))] = set()
        else:
            inner.add(folder)
    folders = {p.relative_to(ROOT).parts for p in tracked()}
    outer = {f[0] for f in folders if len(f) > 1 and not f[0].startswith(".")}
    assert {folder[0] for folder in named} == outer
    for folder in (("experiments",), ("src", "motionlab")):
        deep = len(folder)
        there = {f[deep] for f in folders if f[:deep] == folder and len(f) > deep + 1}
        assert named[folder] == there


SCRIPTS = [path for path in sorted((ROOT / "experiments").rglob("*.py"))
           if '__name__ == "__main__"' in path.read_text(encoding="utf-8")]  # fmt: skip


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda p: f"{p.parent.name}-{p.stem}")
def test_a_script_says_how_it_is_run(path):
    module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    said = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    assert re.search(rf"^ *(\w+=\w+ )?python -m {module}( |$)", said, re.MULTILINE)


def module_of(path: Path) -> str:
    """The dotted name of a file, without `motionlab.`; a package's own is its folder's."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(path): path for path in sorted(PACKAGE.rglob("*.py"))}
# Methods that hand over to what stands to the right of them, and import it when they are called.
HAND_OVER = {("motion", "retargeting")}  # Motion.retarget


def import_statements(tree: ast.AST):
    """Those that run, also in functions, each with what it stands in: not those for type checkers."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node
        yield from import_statements(node)


def imports_of(path: Path) -> set[str]:
    """Modules of motionlab that a file imports, now or later, dotted, without `motionlab.`"""
    package = ["motionlab", *path.relative_to(PACKAGE).parent.parts]
    found = set()
    for node in import_statements(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
            continue
        base = package[: len(package) + 1 - node.level] if node.level else []
        module = ".".join([*base, *([node.module] if node.module else [])])
        names = {alias.name: f"{module}.{alias.name}" for alias in node.names}
        inner = {name for name in names.values() if name.removeprefix("motionlab.") in MODULES}
        found |= inner | ({module} if len(inner) < len(names) else set())
    ours = {module for module in found if module.split(".")[0] == "motionlab"}
    return {module.removeprefix("motionlab").lstrip(".") for module in ours}


def group_of(module: str) -> int | None:
    """Which group of the line a dotted module (without `motionlab.`) belongs to."""
    return next((i for i, names in enumerate(GROUPS) if module.split(".")[0] in names), None)


def test_the_line_of_imports_names_every_room():
    outside = {"", "__main__", "errors", "version"}  # the package itself, and what all may use
    assert {m for m in MODULES if group_of(m) is None} == outside
    rooms = {m.split(".")[0] for m in MODULES}
    elsewhere = {"experiments", "notebooks"}
    assert set().union(*GROUPS) - elsewhere <= rooms


@pytest.mark.parametrize("module", [m for m in MODULES if group_of(m) is not None])
def test_imports_point_left(module):
    for other in imports_of(MODULES[module]):
        theirs = group_of(other)
        if theirs is not None and (module, other.split(".")[0]) not in HAND_OVER:
            assert theirs <= group_of(module), f"{module} imports motionlab.{other}"


def test_no_circle_of_modules():
    graph = {module: imports_of(path) - {module} for module, path in MODULES.items()}
    assert not [m for m in graph if m != "__main__" and "" in graph[m]], (
        "ask a module, not motionlab"
    )
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        pytest.fail(" -> ".join(f"motionlab.{module}" for module in reversed(error.args[1])))


def test_a_circle_is_seen(tmp_path, monkeypatch):
    """Also one that is closed inside a function; not one of types alone."""
    monkeypatch.setitem(globals(), "PACKAGE", tmp_path)
    (tmp_path / "a.py").write_text("def f():\n    from .b import g\n")
    (tmp_path / "b.py").write_text(
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from .a import f\n"
    )
    monkeypatch.setitem(
        globals(), "MODULES", {name: tmp_path / f"{name}.py" for name in ("a", "b")}
    )
    test_no_circle_of_modules()
    (tmp_path / "b.py").write_text("from motionlab import a\n")
    with pytest.raises(pytest.fail.Exception, match=r"motionlab\.a"):
        test_no_circle_of_modules()


def test_import_loads_torch_and_nothing_else_that_takes_its_time():
    """roma loads torch's compiler, which takes as long as torch."""
    heavy = {
        "roma",
        "torch._dynamo",
        "pandas",
        "scipy",
        "matplotlib",
        "anywidget",
        "pyvista",
        "tyro",
    }
    code = "import sys, motionlab; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not heavy & set(run.stdout.split())


def test_what_was_skipped_is_told_with_the_remedy(pytestconfig):
    (plugin,) = {
        p for p in pytestconfig.pluginmanager.get_plugins()
        if Path(getattr(p, "__file__", None) or ".") == ROOT / "tests" / "conftest.py"
    }  # fmt: skip
    skip = lambda reason: SimpleNamespace(longrepr=("test.py", 1, f"Skipped: {reason}"))
    said = []
    plugin.pytest_terminal_summary(SimpleNamespace(
        stats={"skipped": [skip("no Chromium: install it")] * 2 + [skip("could not import 'x': no")]},
        section=said.append, write_line=said.append,
    ))  # fmt: skip
    assert said[0].startswith("not tested here")
    assert said[1].split(maxsplit=2) == ["2", "x", "no Chromium: install it"]
    assert "'x': pip install" in said[2]


def public_modules() -> set[str]:
    packages = {m for m, path in MODULES.items() if path.stem.startswith("_")}
    return set(MODULES) - packages


BOOK = ROOT / "book"
REFERENCE = {
    path.relative_to(BOOK).as_posix(): path.read_text(encoding="utf-8")
    for path in (BOOK / "api.md", *sorted((BOOK / "api").glob("*.md")))
}


def test_reference_names_every_public_module():
    text = "\n".join(REFERENCE.values())
    named = set(re.findall(r"auto\w+:: motionlab\.(\S+)", text))
    internal = set(re.search(r"% inner modules, not for readers: (.*)", text)[1].split())
    missing = {m for m in public_modules() - internal if m not in named}
    missing = {m for m in missing if not any(n.startswith(m + ".") for n in named)}
    assert not missing, f"no page in book/api has a section for {sorted(missing)}"


def test_index_of_the_reference_leads_to_every_page_and_to_names_on_it():
    rows = re.findall(r"^\| \[\]\((api/\w+\.md)\) \| .+ \| (.+) \|$", REFERENCE["api.md"], re.M)
    assert sorted(page for page, _ in rows) == sorted(REFERENCE.keys() - {"api.md"})
    toc = (BOOK / "_toc.yml").read_text(encoding="utf-8")
    for page, cell in rows:
        assert f"- file: book/{page.removesuffix('.md')}\n" in toc
        written = re.findall(r"auto\w+:: (\S+)", REFERENCE[page])
        for name in re.findall(r"`~(\S+)`", cell):
            module, _, short = name.rpartition(".")
            there = module in written and hasattr(importlib.import_module(module), short)
            assert there or name in written, f"{name} is not on {page}"


def test_functions_of_the_reference_are_where_it_says():
    """As one writes them after `import motionlab`, whatever file they stand in."""
    names = re.findall(r"autofunction:: motionlab\.(\S+)", "\n".join(REFERENCE.values()))
    assert {"contacts.label", "solvers.lock_feet", "viewer.show", "viewer.plots.curves"} <= {*names}
    for name in names:
        assert callable(find_public(f"motionlab.{name}")), name


def find_public(name: str) -> object:
    """What a dotted name leads to from `import motionlab`, with modules imported on the way."""
    found, path = motionlab, "motionlab"
    for part in name.split(".")[1:]:
        path += f".{part}"
        if not hasattr(found, part):
            importlib.import_module(path)
        found = getattr(found, part)
    return found


EXAMPLE = re.compile(r">>> (?!.*doctest: \+SKIP)")  # one of them needs a slider that is on a page
SHOWN = [name for name, path in MODULES.items() if EXAMPLE.search(path.read_text("utf-8"))]


@pytest.mark.parametrize("name", SHOWN)
def test_examples_of_the_reference_run(name):
    tried = doctest.testmod(importlib.import_module(f"motionlab.{name}"))
    assert tried.failed == 0 and tried.attempted


def test_examples_between_the_lines_of_the_reference_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    motionlab.write_bvh(motionlab.datasets.gaits.make(seconds=1), "walk.bvh", units="cm")
    shown = {
        page: re.findall(r"```python\n(.*?)```", text, re.DOTALL)
        for page, text in REFERENCE.items()
    }
    assert shown["api.md"]
    for page, examples in shown.items():
        for example in examples:
            exec(compile(example, page, "exec"), {})


@pytest.mark.parametrize("path", sorted((ROOT / "notebooks").glob("*.ipynb")), ids=lambda p: p.stem)
def test_notebook_is_stored_without_outputs(path):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    assert not [c for c in cells if c.get("outputs") or c.get("execution_count")]
    for cell in cells:
        assert "".join(cell["source"]).count("\n") < 25 or cell["cell_type"] != "code"


def test_every_chapter_is_in_the_table_of_contents():
    toc = (ROOT / "book" / "_toc.yml").read_text(encoding="utf-8")
    for path in (ROOT / "notebooks").glob("*.ipynb"):
        assert f"notebooks/{path.stem}" in toc


@pytest.mark.parametrize("url", ["", "https://example.org/motionlab"])
def test_buttons_are_there_if_the_repository_is_known(url):
    pytest.importorskip("sphinx")
    path = ROOT / "book" / "_ext" / "motionlab_book.py"
    spec = importlib.util.spec_from_file_location("motionlab_book", path)
    extension = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(extension)
    launch = {"binderhub_url": "https://mybinder.org"}
    options = {"repository_url": url, "launch_buttons": launch, "show_toc_level": 2}
    extension.drop_buttons_without_repository(None, SimpleNamespace(html_theme_options=options))
    assert options.pop("show_toc_level") == 2
    known = {"repository_url": url, "launch_buttons": launch} if url else {}
    buttons = ("use_repository_button", "use_issues_button", "use_source_button")
    assert options == known | dict.fromkeys(buttons, bool(url))


def test_files_are_small_and_nothing_large_is_kept():
    files = tracked()
    assert sum(p.stat().st_size for p in files) < 46 * 2**20
    for path in files:
        if path.suffix in {".py", ".js", ".ts"}:
            lines = path.read_text(encoding="utf-8").count("\n")
            assert lines <= 400, f"{path.name} has {lines} lines"
    assert not [p for p in files if p.suffix in {".bvh", ".zip", ".ckpt"}]
