"""bvhio: BVH in, its hierarchy, and out."""

import bvhio
from given import BACK_BVH, BVH, WAY

if WAY == "hierarchy":
    root = bvhio.readAsHierarchy(BVH)
    rate = bvhio.readAsBvh(BVH).FrameTime
    bvhio.writeHierarchy(BACK_BVH, root, rate)
else:
    bvhio.writeBvh(BACK_BVH, bvhio.readAsBvh(BVH))
