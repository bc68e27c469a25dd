"""Files in and out."""

from .acclaim import read_amc
from .bvh import read_bvh, write_bvh
from .gltf import read_gltf, write_gltf

__all__ = ["read_amc", "read_bvh", "read_gltf", "write_bvh", "write_gltf"]
