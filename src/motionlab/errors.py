"""Errors a person can act on: each says what is wrong, where, and what to do."""


class MotionLabError(Exception):
    """Base of every error that motionlab raises on purpose."""


class MotionFileError(MotionLabError):
    """A file of motion that can't be read or written; the message names file and remedy."""


class BvhError(MotionFileError):
    """A BVH file that can't be read or written; the message names file, line and remedy."""


class AmcError(MotionFileError):
    """An Acclaim .amc or .asf file that can't be read; the message names file, line and remedy."""


class GltfError(MotionFileError):
    """A glTF file that can't be read or written; the message names file, fault and remedy."""


class GodotError(MotionFileError):
    """A file of the engine Godot that can't be read."""


class SkeletonError(MotionLabError):
    """A skeleton that is not a tree of joints, or that lacks what was asked of it."""


class MotionError(MotionLabError):
    """Arrays that do not make a motion, or motions that do not fit together."""


class DataError(MotionLabError):
    """A data set, clip or cache that is missing, damaged or unknown."""


class ViewerError(MotionLabError):
    """Something that can't be drawn."""


class IkError(MotionLabError):
    """Inverse kinematics can't be done with what was given."""


class RetargetError(MotionLabError):
    """A motion can't be brought to another skeleton."""


class EncodingError(MotionLabError):
    """A motion can't be encoded, or features can't be decoded."""


class MetricError(MotionLabError):
    """A metric can't be computed from what was given."""


class ModelError(MotionLabError):
    """A model was asked for something it can't do, or its weights do not fit."""


class TrainingError(MotionLabError):
    """A training that can't start, can't go on where it was, or has gone wrong."""


class DivergedError(TrainingError):
    """A training whose loss or gradient is no longer a number."""


class WayError(MotionLabError):
    """A line on the ground that is none, or that nobody can go along."""


class SolverError(MotionLabError):
    """A search was asked for what no motion can do, or what a model can't tell."""


class StudyError(MotionLabError):
    """A study that can't be built, or answers that can't be analysed."""
