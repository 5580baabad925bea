"""BSP trees that several tests look at, and what they are looked at with."""

import dataclasses
import functools

import numpy as np
from accelscope.core.evaluation.rays.workloads import random_lines
from accelscope.core.geometry.rays import Rays
from accelscope.core.structures import structures

TREES = ("planes=autopartition", "planes=sah", "planes=fixed", "planes=fixed,directions=13")
WALKS = ("recursive", "march", "segments", "heap")


@functools.cache
def tree_of(lab, scene_name, text):
    structure = structures()["bsp"]
    settings = lab.settings_of(structure, f"{text},max_leaf_size=2")
    return structure.build(lab.small_scene(scene_name), settings, log=True)


def walked(tree, walk, mailbox=False):
    """Give a built tree another walk."""
    tree.settings = dataclasses.replace(tree.settings, walk=walk, mailbox=mailbox)
    tree.with_walk(tree.arrays.tree)
    return tree


def by_number(cells, values):
    """Return figures of cells in the order of their numbers."""
    ordered = np.empty_like(values)
    ordered[cells.numbers] = values
    return ordered


def assert_mean(values, expected):
    error = values.std() / np.sqrt(len(values))
    assert abs(values.mean() - expected) < 4 * error + 1e-12, (values.mean(), expected, error)


def lines(tree, count, seed=1):
    """Random lines through the root's cell."""
    box = tree.arrays.tree.box
    return Rays.from_arrays(*random_lines(box[:3], box[3:], count, seed))
