"""bvhtools: BVH in and out."""

from bvhTools.bvhIO import readBvh, writeBvh
from given import BACK_BVH, BVH

writeBvh(readBvh(BVH), BACK_BVH)
