"""Small studies of short clips."""

from __future__ import annotations

import pytest
from study_cases import sources

from motionlab.studies.build import build


@pytest.fixture(scope="session")
def rated():
    return build(sources(), seed=3)


@pytest.fixture(scope="session")
def paired():
    return build(sources(), design="pairs", seed=3)
