"""pybvh: BVH in and out."""

import pybvh
from given import BACK_BVH, BVH

pybvh.write_bvh_file(pybvh.read_bvh_file(BVH), BACK_BVH)
