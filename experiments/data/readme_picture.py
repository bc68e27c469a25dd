"""The picture on top of the README: a recorded walk above, a procedural one below.

Needs the clip `Male1_B3_Walk` of the source `accad` and the extra `book`:

    python -m experiments.data.readme_picture book/static/filmstrip.png
"""

import sys

from PIL import Image

from motionlab import datasets, viewer
from motionlab.datasets import gaits


def main(path: str) -> None:
    (recorded,) = datasets.load("accad", clips=["Male1_B3_Walk"])
    made = gaits.make(seconds=recorded.seconds, speed=1.3, seed=3)
    strips = [
        viewer.filmstrip(recorded[30:150], color="mocap"),
        viewer.filmstrip(made[30:150], color="RNN"),
    ]
    width = max(strip.width for strip in strips)
    page = Image.new("RGBA", (width, sum(strip.height for strip in strips)))
    top = 0
    for strip in strips:
        page.paste(strip, (0, top))
        top += strip.height
    page.quantize(192).save(path, optimize=True)


if __name__ == "__main__":
    main(sys.argv[1])
