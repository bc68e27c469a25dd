"""What a network sees: motion as rows of numbers, and back.

>>> from motionlab import Skeleton, datasets, encodings
>>> encoding = encodings.JointAngles(Skeleton.canonical())
>>> motion = datasets.load("gaits", "train")[0]
>>> features = encoding.encode(motion)             # (frames, dim)
>>> points = encoding.positions(features)          # (frames, points, 3)

`JointAngles` (RNN-GAN), `RootRelative` (acLSTM) and `BodyFrame` (STRNN) keep the same contract,
`Encoding`; `Normalizer` gives their features zero mean and unit variance.
"""

from ..errors import EncodingError
from ..skeleton import Skeleton
from .base import Encoding
from .body_frame import BodyFrame
from .joint_angles import JointAngles
from .normalizer import Normalizer
from .root_relative import RootRelative

__all__ = ["BodyFrame", "Encoding", "JointAngles", "Normalizer", "RootRelative", "from_config"]

_KINDS = {kind.__name__: kind for kind in (JointAngles, RootRelative, BodyFrame)}


def from_config(config: dict) -> Encoding:
    """The encoding that ``encoding.config()`` described; stored with a model's weights.

    Raises
    ------
    EncodingError : not such a description.
    """
    try:
        settings = dict(config)
        kind = _KINDS[settings.pop("encoding")]
        skeleton = Skeleton(**settings.pop("skeleton"))
        return kind(skeleton, **settings)
    except (TypeError, KeyError, ValueError) as error:
        raise EncodingError(
            f"This is not the description of an encoding ({error!r}); it must come from "
            "encoding.config()."
        ) from error
