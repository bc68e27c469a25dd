"""Foot contacts, under the short name: see `motionlab.feet.contacts`."""

from .feet.contacts import *  # noqa: F403
