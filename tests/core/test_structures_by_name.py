"""Structures are found by the names of their modules, and only what is asked for is imported."""

import subprocess
import sys

import pytest
from accelscope.core.errors import InputError
from accelscope.core.structures import module_names, structure_named, structures

ALONE = """
import sys
from accelscope.core.structures import structure_named
assert structure_named({name!r}).name == {name!r}
others = set({others!r}) & {{m.split(".")[3] for m in sys.modules
                            if m.startswith("accelscope.core.structures.")}}
print(",".join(sorted(others)))
"""


def test_every_structure_is_called_as_its_module():
    for name, structure in structures().items():
        assert structure.name == name
        assert structure.__module__.split(".")[3] == name
        assert structure_named(name) is structure
    assert set(structures()) <= set(module_names())


@pytest.mark.parametrize("name", ["subdivision", "bhv", "", "naive.py"])
def test_what_is_none_is_refused_with_all_names(name):
    with pytest.raises(InputError, match="known are: bsp, bvh, grid, image_directory"):
        structure_named(name)


@pytest.mark.parametrize("name", ["bvh", "grid"])
def test_the_others_are_not_imported(name):
    others = [each for each in structures() if each != name]
    done = subprocess.run(
        [sys.executable, "-c", ALONE.format(name=name, others=others)],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout.strip() == ""
