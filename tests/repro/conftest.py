"""The scenes, rays and comparisons of the core's tests, and arrays that count, for repro tests."""

import copy
import dataclasses
import importlib.util
import sys
from pathlib import Path
from typing import ClassVar

import numpy as np
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


class Counted(np.ndarray):
    """An array that counts how many of its numbers are computed with, compared or copied.

    A slice is free, and so is a binary search, unless NumPy would convert the array for it.
    """

    numbers: ClassVar[int] = 0

    def __array_ufunc__(self, ufunc, method, *inputs, **options):
        return getattr(ufunc, method)(*map(_counting, inputs), **options)

    def __array_function__(self, function, types, arguments, options):
        if function is np.searchsorted:
            array, *sought = map(np.asarray, arguments)
            if np.result_type(array, *sought) != array.dtype:
                Counted.numbers += array.size
            return function(array, *sought, **options)
        return function(*map(_counting, arguments), **options)

    def __getitem__(self, index):
        found = super().__getitem__(index)
        if isinstance(found, Counted):
            is_view = np.may_share_memory(found.view(np.ndarray), self.view(np.ndarray))
            Counted.numbers += 0 if is_view else found.size
        return found

    def astype(self, *arguments, **options):
        Counted.numbers += self.size
        return super().astype(*arguments, **options)


def _counting(each):
    """Return an argument as it is, or as a plain array once its numbers are counted."""
    if isinstance(each, (list, tuple)):
        return type(each)(map(_counting, each))
    if not isinstance(each, Counted):
        return each
    Counted.numbers += each.size
    return each.view(np.ndarray)


def _with_counted_arrays(thing):
    """Return a copy of records and objects, however nested, in which all arrays count."""
    if isinstance(thing, np.ndarray):
        return thing.view(Counted)
    if isinstance(thing, tuple) and hasattr(thing, "_fields"):
        return type(thing)(*map(_with_counted_arrays, thing))
    if isinstance(thing, (list, tuple)):
        return type(thing)(map(_with_counted_arrays, thing))
    if isinstance(thing, dict):
        return {name: _with_counted_arrays(value) for name, value in thing.items()}
    if dataclasses.is_dataclass(thing) or type(thing).__module__.startswith("accelscope."):
        made = copy.copy(thing)
        for name, value in vars(thing).items():
            object.__setattr__(made, name, _with_counted_arrays(value))  # frozen or not
        return made
    return thing


class Counter:
    """What the fixture `counter` gives."""

    wrap = staticmethod(_with_counted_arrays)

    @staticmethod
    def numbers(work):
        """Return how many numbers of wrapped arrays `work` goes through."""
        Counted.numbers = 0
        work()
        return Counted.numbers


@pytest.fixture
def counter():
    """Count, rather than time, what goes through arrays: ``counter.numbers(work)``.

    ``counter.wrap(thing)`` is a copy of whatever has arrays in it, to be used by the work.
    """
    return Counter
