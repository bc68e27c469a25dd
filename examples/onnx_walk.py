"""A walk from an exported network, with onnxruntime and numpy alone: no torch, no motionlab.

    motionlab export lstm-gmm-permissive --onnx
    motionlab export refiner-permissive --onnx
    python onnx_walk.py lstm-gmm-permissive.onnx walk.bvh --refiner refiner-permissive.onnx

Everything is y up, z ahead, x to the left, in metres and radians; the BVH is in centimetres.
"""

import argparse
import json
import os
from itertools import islice

import numpy as np

os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")  # too late once it is imported
import onnxruntime  # noqa: E402


def network(path, kind):
    """What runs the network, and what the file says about it; kind : LstmGmm or Refiner."""
    if not os.path.isfile(path):
        raise SystemExit(f"{path}: there is no such file; motionlab export NAME --onnx makes one.")
    try:
        session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
        about = json.loads(session.get_modelmeta().custom_metadata_map["motionlab"])
    except Exception:  # the runtime has a kind of its own for each fault
        raise SystemExit(f"{path}: is no file of motionlab export NAME --onnx.") from None
    if about["kind"] != kind:
        raise SystemExit(f"{path}: holds a network of kind {about['kind']}; {kind} is wanted here.")
    return session, about


def chance(about, seed):
    """What each frame is drawn with: normal numbers for the pose, Gumbel's for the component."""
    random, wish, noise = np.random.default_rng(seed), about["sampling"], None
    while True:
        fresh, keep = random.standard_normal(about["inputs"]["noise"]), wish["memory"]
        noise = fresh if noise is None else keep * noise + (1 - keep**2) ** 0.5 * fresh
        gumbel = random.gumbel(size=about["inputs"]["gumbel"])
        yield wish["temperature"] * noise, wish["component_temperature"] * gumbel


def frames(session, start, chance):
    """Rows of features, one after the other, as long as there is chance."""
    state = {part: np.float32([start[part]]) for part in ("frame", "hidden", "cell")}
    wanted = ["features", *(f"{part}_after" for part in state)]
    for noise, gumbel in chance:
        inputs = state | {"noise": np.float32([noise]), "gumbel": np.float32([gumbel])}
        features, *after = session.run(wanted, inputs)
        state = dict(zip(state, after, strict=True))
        yield features[0]


def refined(session, about, rows):
    """The same rows, corrected: feet slide less."""
    hidden = cell = np.zeros((1, *about["inputs"]["hidden"]), np.float32)
    before = None
    for row in rows:
        before = row if before is None else before
        inputs = {"features": row[None], "before": before[None], "hidden": hidden, "cell": cell}
        better, hidden, cell = session.run(["refined", "hidden_after", "cell_after"], inputs)
        before = row
        yield better[0]


def turn(x, y, z):
    """Matrix (3, 3) of a rotation vector: the axis, as long as the angle."""
    angle = max((x * x + y * y + z * z) ** 0.5, 1e-9)
    x, y, z = x / angle, y / angle, z / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def poses(about, rows):
    """Of each row the root's place (3) and each joint's rotation (joints, 3, 3) in its parent."""
    mean, x, z, yaw = np.array(about["encoding"]["mean_pose"]), 0.0, 0.0, 0.0
    first, last = about["features"]["slices"]["pose"]
    for count, row in enumerate(rows):
        left, ahead, turned, height, tilt_x, tilt_z = map(float, row[:6])
        if count:  # the first frame has made no step
            sine, cosine = np.sin(yaw), np.cos(yaw)
            x += left * cosine + ahead * sine
            z += ahead * cosine - left * sine
            yaw += turned
        vectors = row[first:last].reshape(-1, 3).astype(float)
        joints = [rest @ turn(*vector) for rest, vector in zip(mean[1:], vectors, strict=True)]
        root = turn(0, yaw, 0) @ turn(tilt_x, 0, tilt_z)
        yield np.array([x, height, z]), np.stack([root, *joints])


def hierarchy(skeleton, joint=0, depth=0):
    """The skeleton as BVH has it, and the joints in the order in which they stand there."""
    tab, cm = "\t" * depth, lambda offset: " ".join(f"{100 * c:.6f}" for c in offset)
    places = "" if joint else "Xposition Yposition Zposition "
    lines = [f"{tab}{'JOINT' if joint else 'ROOT'} {skeleton['names'][joint]}", f"{tab}{{",
             f"{tab}\tOFFSET {cm(skeleton['offsets'][joint])}",
             f"{tab}\tCHANNELS {3 if joint else 6} {places}Zrotation Xrotation Yrotation"]  # fmt: skip
    order = [joint]
    for child, parent in enumerate(skeleton["parents"]):
        if parent == joint:
            more, below = hierarchy(skeleton, child, depth + 1)
            lines, order = lines + more, order + below
    for parent, end in zip(skeleton["end_parents"], skeleton["end_offsets"], strict=True):
        if parent == joint:
            lines += [f"{tab}\tEnd Site", f"{tab}\t{{", f"{tab}\t\tOFFSET {cm(end)}", f"{tab}\t}}"]
    return [*lines, f"{tab}}}"], order


def bvh(about, poses):
    """The text of a BVH file."""
    lines, order = hierarchy(about["skeleton"])
    rows = []
    for place, turns in poses:
        r = turns[order]
        z, y = np.arctan2(-r[:, 0, 1], r[:, 1, 1]), np.arctan2(-r[:, 2, 0], r[:, 2, 2])
        x = np.arcsin(r[:, 2, 1].clip(-1, 1))
        angles = np.degrees(np.stack([z, x, y], 1)).ravel()
        rows.append(" ".join(f"{value:.6f}" for value in [*(100 * place), *angles]))
    head = ["MOTION", f"Frames: {len(rows)}", f"Frame Time: {1 / about['fps']:.8f}"]
    return "\n".join(["HIERARCHY", *lines, *head, *rows, ""])


if __name__ == "__main__":
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("network")
    words.add_argument("out")
    words.add_argument("--refiner")
    words.add_argument("--seconds", type=float, default=10)
    words.add_argument("--start", default="walk", help="how the name of a start begins")
    words.add_argument("--seed", type=int, default=0)
    asked = words.parse_args()
    if asked.seed < 0:
        words.error(f"--seed {asked.seed}: must be 0 or more.")
    if not os.path.isdir(os.path.dirname(asked.out) or "."):
        raise SystemExit(f"{asked.out}: there is no such folder; make it.")
    session, about = network(asked.network, "LstmGmm")
    if not 1 <= asked.seconds * about["fps"] < 1e6:
        words.error(f"--seconds {asked.seconds:g}: must be a frame at least, 1/{about['fps']:g}.")
    starts = [each for each in about["starts"] if each["name"].startswith(asked.start)]
    if not starts:
        known = "; ".join(each["name"] for each in about["starts"])
        raise SystemExit(f"--start {asked.start}: there is none. There are {known}.")
    start = starts[0]
    rows = frames(session, start, chance(about, asked.seed))
    if asked.refiner:
        refiner, its = network(asked.refiner, "Refiner")
        if its["features"] != about["features"]:
            raise SystemExit(
                f"{asked.refiner}: corrects frames of another kind than {asked.network}."
            )
        rows = refined(refiner, its, rows)
    made = list(poses(about, islice(rows, round(asked.seconds * about["fps"]))))
    with open(asked.out, "w") as file:
        file.write(bvh(about, made))
    x, _, z = made[-1][0]
    print(
        f"{asked.out}: {len(made)} frames from {start['name']!r}; it ends {z:.1f} m ahead, "
        f"{abs(x):.1f} m to the {'left' if x > 0 else 'right'}"
    )
