"""The scenes, rays and comparisons of the core's tests, for repro tests of the core."""

import importlib.util
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def lab():
    """The module ``tests/core/conftest.py``."""
    path = Path(__file__).parents[1] / "core" / "conftest.py"
    specification = importlib.util.spec_from_file_location("core_lab", path)
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    specification.loader.exec_module(module)
    return module


@pytest.fixture
def build(lab):
    """Build a structure by name and settings text over a scene."""

    def build_one(name, scene, text=""):
        structure = lab.structures()[name]
        return structure.build(scene, lab.settings_of(structure, text))

    return build_one
