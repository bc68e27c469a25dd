"""Named data sets: real motion capture, fetched, checked and cached; its locomotion, or
all of it, on one skeleton; and procedural gaits.

>>> from motionlab import datasets
>>> datasets.names()[:5]
['gaits', 'examples', 'locomotion', 'everything', 'bandai-locomotion']
"""

from .about import Info
from .loader import from_folder, load
from .registry import info, names, table

__all__ = ["Info", "from_folder", "info", "load", "names", "table"]
