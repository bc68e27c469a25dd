"""bvhsdk: BVH in and out."""

import bvhsdk
from given import BACK_BVH, BVH

bvhsdk.WriteBVH(bvhsdk.ReadFile(BVH), str(BACK_BVH.rsplit("/", 1)[0]), "back")
