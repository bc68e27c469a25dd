"""upc-pymotion: BVH in and out; `as angles` writes the angles that it makes of its quaternions."""

from given import BACK_BVH, BVH, WAY
from pymotion.io.bvh import BVH as Clip

clip = Clip()
clip.load(BVH)
if WAY == "through quaternions":
    rotations, positions, *_ = clip.get_data()
    clip.set_data(rotations, positions)
clip.save(BACK_BVH)
