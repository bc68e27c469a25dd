"""Results of the claims S and what their rules say of them."""


def opened(alive=1.0, looping=0.0, period=3.0, moves=1.0, steps=1.0):
    return {
        "alive": alive, "failed": {"frozen": round(50 * (1 - alive))},
        "in loops, of those alive": looping, "periods (s)": [period] * round(50 * looping),
        "movement, last minute, over real": moves, "largest shared end": 0.1,
        "bones, mean (cm)": 0.3, "steps across seams": steps,
    }  # fmt: skip


def extrapolation(plain=None, noise=None, without=None, **more):
    row = {"open loop, noise 0": plain or opened()}
    row |= {"open loop, noise 0.05": noise} if noise else {}
    row |= {"open loop, noise 0, without residual": without} if without else {}
    return {"split": "test", "starts": 50, "frames": 20_000, "rows": {"ship": row},
            "noise": [0.0, 0.05] if noise else [0.0]} | more  # fmt: skip


def gone():
    return {"alive": 0.0, "failed": {"diverged": 50}, "seconds until failure": [1.0]}


def denoised(strnn=(0.01, 0.01), sc=(0.02, 0.02), plain=0.01, filters=(0.03, 0.02), **more):
    of = lambda error: {"squared error": error}
    rows = {
        f"positions 0.3, contacts {bits}": {"strnn": of(ours), "sc": of(theirs)}
        for bits, ours, theirs in zip((3, 5), strnn, sc, strict=True)
    }
    rows["positions 0.3"] = {
        "strnn": of(plain), "gaussian": of(filters[0]), "savitzky-golay": of(filters[1]),
        "wiener": of(0.01), "nothing": of(0.09),
    }  # fmt: skip
    rows["clean"] = {"strnn, reconstructed": {"mean joint error (cm)": 1.0}}
    return {"split": "test", "windows": 512, "rows": rows} | more


CASES = [
    ("S2-seams", "reproduced", extrapolation(opened(steps=1.09), without=opened(steps=1.2))),
    ("S2-seams", "partly", extrapolation(opened(steps=1.15), without=opened(steps=1.2))),
    ("S2-seams", "partly", extrapolation(opened(steps=1.05), without=opened(steps=1.0))),
    ("S2-seams", "not", extrapolation(opened(steps=1.3), without=opened(steps=1.2))),
    ("S2-seams", "open", extrapolation(opened())),
    ("S2-seams", "open", extrapolation(opened(), without=gone())),
    ("S2-seams", "open", extrapolation(opened(), without=opened(), split="val")),
    ("S3", "reproduced", extrapolation(opened(0.96, 0.24, moves=0.5))),
    ("S3", "reproduced", extrapolation(opened(looping=0.9, period=11.0))),
    ("S3", "partly", extrapolation(opened(0.94))),
    ("S3", "partly", extrapolation(opened(looping=0.26))),
    ("S3", "partly", extrapolation(opened(moves=0.49))),
    ("S3", "not", extrapolation(opened(0.48))),
    ("S3", "not", extrapolation(gone())),
    ("S3", "open", extrapolation(starts=24)),
    ("S3", "open", extrapolation(frames=5_000)),
    ("S3", "open", extrapolation(split="val")),
    ("S3-noise", "reproduced", extrapolation(opened(0.1), noise=opened())),
    ("S3-noise", "partly", extrapolation(noise=opened(0.9))),
    ("S3-noise", "not", extrapolation(noise=gone())),
    ("S3-noise", "open", extrapolation()),
    ("S4", "reproduced", denoised(strnn=(0.019, 0.019))),
    ("S4", "partly", denoised(strnn=(0.019, 0.0195))),
    ("S4", "not", denoised(strnn=(0.03, 0.02))),
    ("S4", "open", denoised(windows=100)),
    ("S4", "open", denoised(split="val")),
    ("S4-filters", "reproduced", denoised(plain=0.016)),
    ("S4-filters", "partly", denoised(plain=0.019, filters=(0.02, 0.03))),
    ("S4-filters", "not", denoised(plain=0.02)),
]
