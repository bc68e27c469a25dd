"""Files in and out."""

from .bvh import read_bvh, write_bvh
from .gltf import write_gltf

__all__ = ["read_bvh", "write_bvh", "write_gltf"]
