"""Lessons "grid_traversal", "dda_constants", "dda_step": the ladder is the walk's, to the bit."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.geometry.marks import stars
from accelscope.core.geometry.rays import Rays
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.dda import AxisSettings
from accelscope.core.lessons.drawing import RED
from accelscope.core.lessons.grid_traversal import AXIS_COLOURS, CellSettings
from accelscope.core.lessons.lesson import Subject, build
from accelscope.core.progress import SILENT
from accelscope.sample_scenes import make_sample

NAMES = "grid_traversal", "dda_constants", "dda_step"


@functools.cache
def subject_of(name, lab):
    scene = lab.small_scene(name) if name in lab.HAND_MADE else make_sample(name)
    return Subject(scene, (build(scene, "grid:resolution=8x8x8"),))


def played(lesson, subject, rays=None, ray=0):
    subject = Subject(subject.scene, subject.structures, rays, ray)
    return lesson_named(lesson).play(subject, None, SILENT)


def rays_through(scene, count=40, seed=3):
    """Rays of any direction and length, some parallel to an axis."""
    rng = np.random.default_rng(seed)
    size = max(float((scene.upper - scene.lower).max()), 1e-9)
    ways = rng.normal(size=(count, 3)) * 10.0 ** rng.integers(-3, 4, size=(count, 1))
    ways[::5, rng.integers(3)] = 0.0
    inside = scene.lower + rng.random((count, 3)) * (scene.upper - scene.lower)
    lengths = np.linalg.norm(ways, axis=1, keepdims=True)
    return Rays.from_arrays(inside - 2.0 * size * ways / lengths, ways)


@pytest.mark.parametrize("name", ["suzanne:subdivisions=1", "one", "flat", "mess"])
def test_the_ladder_is_the_walks_own_to_the_bit(lab, name):
    subject = subject_of(name, lab)
    grid = subject.structures[0]
    rays = rays_through(subject.scene)
    batches = [(None, 0), *((rays, ray) for ray in range(len(rays)))]
    seen = 0
    for batch, ray in batches:
        try:
            play = played("dda_step", subject, batch, ray)
        except InputError:
            continue  # it misses the grid
        seen += 1
        ladder, t, t_exit = play.ladder, play.t, play.t_exit
        assert len(t) == play.walked.counts["N_ETS"]
        assert ladder.walls.min(axis=1).tobytes() == t_exit.tobytes()
        assert t[1:].tobytes() == t_exit[:-1].tobytes()
        # The cell changes along the axis of the least, by one, in the ray's direction.
        change = np.diff(ladder.cell, axis=0)
        axes = [play.axis_of(cell) for cell in range(len(t) - 1)]
        direction = play.walked.rays.directions[0]
        want = np.zeros_like(change)
        want[np.arange(len(axes)), axes] = np.sign(direction[axes])
        np.testing.assert_array_equal(change, want)
        # Along the ladder each wall comes one D after the last, within rounding of the walls; the
        # outermost ones stand a hair outside.
        reach = np.abs(grid.arrays.box).max() + np.abs(play.walked.rays.origins[0]).max()
        for axis in range(3):
            steps = np.diff(play.crossings(axis))
            hair = np.abs(np.diff(grid.walls(axis)) - grid.arrays.cell_size[axis]).max()
            bound = 64 * np.finfo(float).eps * reach + hair
            assert hair <= 1e-5 * (subject.scene.upper - subject.scene.lower).max()
            with np.errstate(divide="ignore"):
                bound /= abs(play.walked.rays.directions[0, axis])
            assert np.abs(steps - ladder.spacing[axis]).max(initial=0.0) <= bound
        # End conditions.
        last = ladder.cell[-1].copy()
        axis = play.axis_of(len(t) - 1)
        last[axis] += int(np.sign(direction[axis]))
        outside = last[axis] in (-1, grid.arrays.resolution[axis])
        hit = np.isfinite(play.walked.t_hit)
        assert hit or outside
        assert not hit or play.walked.t_hit <= t_exit[-1]
        assert ("hit, at" in play.end_text()) == hit
    assert seen > 5


DOTS = *AXIS_COLOURS, RED


def dots_of(play, picture, colour):
    """The arms of the dots of a colour in a picture: no other line of it is as short."""
    segments = picture.segments[(picture.colours == colour).all(axis=1)]
    lengths = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    return segments[np.isclose(lengths, 0.035 * play.size)]


def dots_on(play, t):
    """The arms of dots on the ray in the section, at some t."""
    return stars(play.at(t), np.full(1, 0.035 * play.size))


@pytest.mark.parametrize("lesson", NAMES)
@pytest.mark.parametrize("name", ["suzanne:subdivisions=1", "one", "flat", "mess"])
def test_pictures_say_what_the_ladder_has(lab, lesson, name):
    play = played(lesson, subject_of(name, lab))
    if lesson == "dda_constants":
        for axis in range(3):
            picture = play.picture(AxisSettings("xyz"[axis]))
            rows = {row.label: row.text for row in picture.rows}
            assert rows["t"] == f"{play.t[0]:.4g}"
            for each in range(3):
                left = play.ladder.walls[0, each] - play.t[0]
                assert rows["L" + "xyz"[each]] == f"{left:.4g}"
                assert rows["D" + "xyz"[each]] == f"{play.ladder.spacing[each]:.4g}"
            assert picture.caption.startswith(f"{len(play.crossings(axis))} wall")
            dots = np.concatenate([dots_of(play, picture, colour) for colour in DOTS])
            np.testing.assert_array_equal(dots, dots_on(play, play.crossings(axis)))
        return
    for cell in range(play.ends["cell"] + 1):
        picture = play.picture(CellSettings(cell))
        assert np.isfinite(picture.points()).all()
        rows = {row.label: row.text for row in picture.rows}
        assert rows["Cell"] == "[{}, {}, {}]".format(*play.ladder.cell[cell])
        if lesson == "dda_step":
            # The next walls have dots as far as the ladder goes, red that of the least.
            walls, leaves = play.ladder.walls[cell], play.axis_of(cell)
            assert walls[leaves] <= play.end or cell == play.ends["cell"]
            for axis, colour in enumerate(DOTS[:3]):
                met = walls[[axis]][(walls[[axis]] <= play.end) & (axis != leaves)]
                np.testing.assert_array_equal(
                    dots_of(play, picture, colour), dots_on(play, met)
                )  # fmt: skip
            met = walls[[leaves]][walls[[leaves]] <= play.end]
            np.testing.assert_array_equal(dots_of(play, picture, RED), dots_on(play, met))
            left = walls - play.t[cell]
            assert rows["D = min"] == f"{left.min():.4g}"
            assert ("Next Cell" in rows) == (cell < play.ends["cell"])
            if "Next Cell" in rows:
                assert rows["Next Cell"] == play.name_of(cell + 1)


def test_crossings_lie_in_walls(lab):
    play = played("dda_step", subject_of("suzanne:subdivisions=1", lab))
    grid = play.walked.structure
    for axis in range(3):
        met = play.walked.at(play.crossings(axis))[:, axis]
        distance = np.abs(met[:, None] - grid.walls(axis)).min(axis=1, initial=np.inf)
        assert (distance <= 1e-12 * play.size).all()
    assert sum(len(play.crossings(axis)) for axis in range(3)) == len(play.t)


def test_what_is_walked_otherwise_is_refused(lab):
    subject = subject_of("suzanne:subdivisions=1", lab)
    far = Rays.from_arrays([[-1e9, 0.0, 0.0]], [[1.0, 0.0, 0.0]])
    with pytest.raises(InputError, match="too far away"):
        played("dda_step", subject, far)
    past = Rays.from_arrays([[0.0, 0.0, 99.0]], [[1.0, 0.0, 0.0]])
    with pytest.raises(InputError, match="misses the grid"):
        played("dda_step", subject, past)
    macro = build(subject.scene, "macro_grid:resolution=4x4x4")
    assert lesson_named("dda_step").suits(macro)
    lazy = build(subject.scene, "grid:resolution=40x4x4,lazy=true")
    assert not lesson_named("dda_step").suits(lazy)
    fine = build(subject.scene, "grid:resolution=4x41x4")
    assert "more than 40 cells" in lesson_named("dda_step").suits(fine)
