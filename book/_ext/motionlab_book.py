"""What the book needs of Sphinx beyond its configuration: buttons, scripts, the record of the build."""

import json
import shutil
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from motionlab.viewer import bundle_path
from motionlab.viewer.live.scene_page import write_viewer

EXECUTED = Path(__file__).resolve().parents[1] / "_build" / "executed"  # by book/chapters.py

# Search reads each found page for an excerpt; browsers forbid that to a page opened from disk.
SEARCH_FROM_DISK = (
    'if (location.protocol === "file:") DOCUMENTATION_OPTIONS.SHOW_SEARCH_SUMMARY = false;'
)


def drop_buttons_without_repository(app: Sphinx, config) -> None:
    """Launch and repository buttons are there if, and only if, `repository: url:` is set."""
    options = config.html_theme_options
    known = bool(options.get("repository_url"))
    if not known:
        options.pop("repository_url", None)
        options.pop("launch_buttons", None)
    options["use_repository_button"] = options["use_issues_button"] = known
    options["use_source_button"] = known


def add_player(app: Sphinx, pagename, templatename, context, doctree) -> None:
    """Load the one player script on the pages that hold a player."""
    body = context.get("body", "")
    if any(f"motionlab-{kind}" in body for kind in ("player", "dream", "path")):
        app.add_js_file("motionlab-player.js", loading_method="defer")


def drop_formulas(app: Sphinx, pagename, templatename, context, doctree) -> None:
    """No MathJax, two megabytes, on a page that has no formula: its cells alone would bring it."""
    if 'class="math' not in context.get("body", ""):
        needed = lambda script: "mathjax" not in (getattr(script, "filename", "") or "")
        context["script_files"] = list(filter(needed, context.get("script_files", [])))


def copy_scripts(app: Sphinx, error) -> None:
    """One player and one viewer of scenes for the whole book; weights that chapters left for pages."""
    if error is None and app.builder.format == "html":
        static = Path(app.outdir) / "_static"
        for old in static.glob("motionlab-weights-*.js"):
            old.unlink()
        for folder in executed(app.env):
            for script in folder.glob("scripts/*.js"):
                shutil.copyfile(script, static / script.name)
        (static / "motionlab-player.js").write_bytes(bundle_path().read_bytes())
        write_viewer(static)


def executed(env) -> list[Path]:
    """Folders of what was executed, of the pages that this book has."""
    names = sorted(Path(page).name for page in env.found_docs)
    return [EXECUTED / name for name in names if (EXECUTED / name / "record.json").is_file()]


class BuildRecord(SphinxDirective):
    """A table of what was executed for this book, and what it cost."""

    def run(self) -> list[nodes.Node]:
        rows = [("Page", "Cells", "Threads", "Seconds of processors", "By the clock", "Ended")]
        for folder in executed(self.env):
            record = json.loads((folder / "record.json").read_text(encoding="utf-8"))
            used = [f"{record.get(key, 0):.0f}" for key in ("processor_seconds", "seconds")]
            told = (str(record["cells"]), record.get("threads", ""), *used)
            rows.append((folder.name, *told, "failed" if record["error"] else "well"))
        return [table_of(rows)]


def table_of(rows: list[tuple[str, ...]]) -> nodes.table:
    """A table whose first row is its head."""
    group = nodes.tgroup("", *(nodes.colspec(colwidth=1) for _ in rows[0]), cols=len(rows[0]))
    filled = [
        nodes.row("", *(nodes.entry("", nodes.paragraph(text=cell)) for cell in row))
        for row in rows
    ]
    group += [nodes.thead("", filled[0]), nodes.tbody("", *filled[1:])]
    return nodes.table("", group)


def setup(app: Sphinx) -> dict:
    app.connect("config-inited", drop_buttons_without_repository)
    app.connect("html-page-context", add_player)
    app.connect("html-page-context", drop_formulas, priority=900)  # when all have added theirs
    app.add_directive("build-record", BuildRecord)
    app.connect("build-finished", copy_scripts)
    app.add_js_file(None, body=SEARCH_FROM_DISK, priority=800)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
