"""Settings of every structure have an effect exactly where they say so.

What comes out is compared: the figures of the structure, the order of its triangles, and the
counters of rays that run through it.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import json

import pytest
from accelscope.core.evaluation.rays.workloads import random_lines
from accelscope.core.geometry.rays import ALL, CLOSEST, Rays
from accelscope.core.settings import GIVEN, OPEN, has_effect, key_of
from accelscope.core.structures import general_structures, structures

SCENES = ("suzanne", "mess", "cubes")
"""Round; dwarfs beside a giant, where short Morton codes are the same; faces in walls of cells."""

SCENES_OF = {"two_level": ("overlapping",)}
"""Where one object has no second level."""

MORE_SCENES = {"size_bits": ["teapot_in_stadium"]}
"""For settings that change nothing in those: large triangles around small ones."""

DIRECTIONAL = set(structures()) - set(general_structures())
"""Which routed leads to as well: these need a light, or a camera's rays."""

FIELDS = [
    (name, field)
    for name, entry in general_structures().items()
    for field in dataclasses.fields(entry.Settings)
]
CONDITIONAL = [(name, field) for name, field in FIELDS if field.metadata["only_for"]]
ALWAYS = [(name, field) for name, field in FIELDS if not field.metadata["only_for"]]


def ids(fields):
    return [f"{name}-{key_of(field)}" for name, field in fields]


def field_of(name, condition):
    return structures()[name].Settings.__dataclass_fields__[condition]


def values_of(field):
    """Return values of a setting of every kind: all choices, or the default and some others."""
    default, meta = field.default, field.metadata
    if meta["choices"]:
        return [choice for choice in meta["choices"] if choice not in DIRECTIONAL]
    if isinstance(default, bool):
        return [False, True]
    if isinstance(default, tuple):
        return [default, (4, 5, 6)]
    if isinstance(default, str):  # of settings of a part, one that all parts have
        return [default, "C_isect=2"]
    if field.name == "budget":  # far more than the first split makes, far less than all
        return [default, 201]
    kind = type(default)
    low, high = meta["minimum"], meta["maximum"]
    more = kind(min(2 * default + 3, high))
    # A minimum below zero leaves the setting open, as the default does.
    return [default, more] + [kind(low)] * (low >= 0 and low != default)


def settings_where(name, conditions):
    """Return the default settings with every value of some others, each met and not met."""
    choices = [values_of(field_of(name, condition)) for condition in conditions]
    for values in itertools.product(*choices):
        yield structures()[name].Settings(**dict(zip(conditions, values, strict=True)))


@functools.cache
def outcome(lab, name, scene_name, settings):
    """Return all that can be seen of a structure, but for the constants that it repeats."""
    scene = lab.small_scene(scene_name)
    built = structures()[name].build(scene, settings)
    rays = Rays.from_arrays(*random_lines(scene.lower, scene.upper, 200, 1))
    counters = [built.trace(rays, query)[1].values.tobytes() for query in (CLOSEST, ALL)]
    figures = built.statistics().to_json()  # of what rays have made, too
    del figures["sah_constants"]
    # Sums depend on the order of nodes in their last digits.
    rounded = json.loads(json.dumps(figures), parse_float=lambda text: f"{float(text):.12g}")
    return json.dumps(rounded), built.geometry.ids.tobytes(), *counters


def changes_something(lab, name, field, settings):
    """Say whether any value of a setting makes a difference beside the others."""
    smallest = {"max_leaf_size": 1, "min_rays": 1}
    fine = {key: value for key, value in smallest.items() if hasattr(settings, key)}
    fine.pop(field.name, None)
    flush = {"padding": 0.0} if hasattr(settings, "padding") else {}
    for changed in ({}, fine, flush, fine | flush):
        base = dataclasses.replace(settings, **changed)
        others = [value for value in values_of(field) if value != getattr(base, field.name)]
        scenes = [*MORE_SCENES.get(field.name, []), *SCENES_OF.get(name, SCENES)]
        for scene_name, value in itertools.product(scenes, others):
            other = dataclasses.replace(base, **{field.name: value})
            if outcome(lab, name, scene_name, base) != outcome(lab, name, scene_name, other):
                return True
    return False


def test_there_is_something_to_test():
    assert len(CONDITIONAL) >= 20
    assert len(ALWAYS) >= 45
    assert {name for name, _ in FIELDS} == set(general_structures())
    assert {"grid", "macro_grid", "octree", "kdtree", "bsp", "bvh", "two_level"} == {
        name for name, _ in CONDITIONAL
    }
    words = {str(c) for _, field in CONDITIONAL for c in field.metadata["only_for"].values()}
    assert {GIVEN, OPEN} < words


@pytest.mark.parametrize(("name", "field"), CONDITIONAL, ids=ids(CONDITIONAL))
def test_a_setting_changes_something_exactly_where_it_says_so(lab, name, field):
    conditions = list(field.metadata["only_for"])
    wrong, seen = [], set()
    for settings in settings_where(name, conditions):
        seen.add(has_effect(field, settings))
        if changes_something(lab, name, field, settings) != has_effect(field, settings):
            wrong.append({condition: getattr(settings, condition) for condition in conditions})
    assert wrong == []
    assert seen == {False, True}


@pytest.mark.parametrize(("name", "field"), ALWAYS, ids=ids(ALWAYS))
def test_a_setting_without_conditions_changes_something_always(lab, name, field):
    """Whatever those are set to on which others depend."""
    mains = {c for n, other in CONDITIONAL if n == name for c in other.metadata["only_for"]}
    without = "enters no figure here" in field.metadata["description"]
    wrong = []
    for condition in sorted(mains - {field.name}) or [()]:
        for settings in settings_where(name, [condition] if condition else []):
            if changes_something(lab, name, field, settings) == without:
                wrong.append((condition, condition and getattr(settings, condition)))
    assert wrong == []
