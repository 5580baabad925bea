"""Kernels compiled before the first call."""

import pytest
from accelscope.core.evaluation.records.experiment import warm_up
from accelscope.core.structures import structures


@pytest.fixture(scope="session", autouse=True)
def compiled():
    """Compile all kernels first: the command announces that once, on stderr."""
    for structure in structures().values():
        warm_up(structure, structure.Settings())
