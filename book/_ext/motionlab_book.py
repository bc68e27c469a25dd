"""What the book needs of Sphinx beyond its configuration: buttons, scripts, the time budget."""

import os
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.util import logging

from motionlab.viewer import bundle_path
from motionlab.viewer.live.scene_page import write_viewer

CHAPTER_SECONDS = 150

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


def take_weights(app: Sphinx, config) -> None:
    """Chapters leave the weights of networks that run in the page among the book's scripts."""
    static = Path(app.outdir) / "_static"
    for old in static.glob("motionlab-weights-*.js"):
        old.unlink()
    os.environ["MOTIONLAB_SCRIPTS"] = str(static)


def add_player(app: Sphinx, pagename, templatename, context, doctree) -> None:
    """Load the one player script on the pages that hold a player."""
    body = context.get("body", "")
    if "motionlab-player" in body or "motionlab-dream" in body:
        app.add_js_file("motionlab-player.js", loading_method="defer")


def copy_scripts(app: Sphinx, error) -> None:
    """One player and one viewer of scenes for the whole book."""
    if error is None and app.builder.format == "html":
        static = Path(app.outdir) / "_static"
        (static / "motionlab-player.js").write_bytes(bundle_path().read_bytes())
        write_viewer(static)


def check_time(app: Sphinx, env) -> None:
    """A chapter that takes too long to execute fails the (strict) build."""
    for page, data in env.nb_metadata.items():
        seconds = data.get("exec_data", {}).get("runtime") or 0
        if seconds > CHAPTER_SECONDS:
            logging.getLogger(__name__).warning(
                "%s took %.0f s; a chapter has %d s", page, seconds, CHAPTER_SECONDS, location=page
            )


def setup(app: Sphinx) -> dict:
    app.connect("config-inited", drop_buttons_without_repository)
    app.connect("config-inited", take_weights)
    app.connect("html-page-context", add_player)
    app.connect("env-updated", check_time)
    app.connect("build-finished", copy_scripts)
    app.add_js_file(None, body=SEARCH_FROM_DISK, priority=800)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
