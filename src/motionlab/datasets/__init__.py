"""Named data sets: real motion capture, fetched, checked and cached; and procedural gaits.

>>> from motionlab import datasets
>>> datasets.names()
['gaits', 'examples', 'bandai-locomotion', 'bandai-actions', 'aclstm-cmu', 'accad', 'cmu']
"""

from .loader import from_folder, load
from .registry import Info, info, names, table

__all__ = ["Info", "from_folder", "info", "load", "names", "table"]
