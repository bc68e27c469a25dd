"""Files in and out."""

from .bvh import read_bvh, write_bvh

__all__ = ["read_bvh", "write_bvh"]
