"""Files in and out."""

from .acclaim import read_amc
from .bvh import read_bvh, write_bvh
from .gltf import write_gltf

__all__ = ["read_amc", "read_bvh", "write_bvh", "write_gltf"]
