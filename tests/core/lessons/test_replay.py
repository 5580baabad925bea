"""Lesson "replay": after every step there is what the log has made and not replaced."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.contract.build_log import SPLIT
from accelscope.core.errors import InputError
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.drawing import RED
from accelscope.core.lessons.lesson import Subject, build
from accelscope.core.lessons.replay import MOST_NEWEST, Settings
from accelscope.core.progress import SILENT

LESSON = lesson_named("replay")

DOWN = (
    "kdtree:max_leaf_size=3", "kdtree:planes=cyclic,order=depth_first,budget=40", "bsp:max_depth=7",
    "octree:max_depth=4,order=priority,budget=90", "bvh:builder=sweep_sah", "bvh:builder=lbvh",
)  # fmt: skip
OTHERS = (
    "bvh:builder=ploc", "bvh:builder=agglomerative", "bvh:builder=rtree_insert",
    "bvh:builder=binned_sah,optimise=reinsert", "bvh:arity=4", "bvh:volume=kdop14",
)  # fmt: skip


def steps_of(play):
    return sorted({round(step) for step in np.linspace(0, play.ends["step"], 20)})


@pytest.mark.parametrize("spec", DOWN)
@pytest.mark.parametrize("name", ["one", "mess", "suzanne"])
def test_a_step_from_the_top_down_divides_what_the_log_says(lab, name, spec):
    scene = lab.small_scene(name)
    structure = build(scene, spec)
    play = LESSON.play(Subject(scene, (structure,)), Settings(), SILENT)
    log, cells = structure.build_log, play.cells
    for step in steps_of(play):
        there = play.there(step)
        done = (log.kind == SPLIT) & (log.step <= step)
        # Every cell that was divided has given way to its children.
        nodes, first = np.unique(log.node[done], return_index=True)
        children = log.children[done][first]
        inner, made = log.cells[nodes], log.cells[children[children >= 0]]
        want = set(made[made >= 0].tolist()) | {0} - {-1}
        assert set(cells.numbers[there].tolist()) == want - set(inner.tolist())
        picture = play.picture(Settings(step))
        assert np.isfinite(picture.points()).all()
        assert f"Step {step} of" in picture.caption
        events = play.events(step)
        newest = cells.numbers[(play.made == step) & (step > 0)]
        below = log.children[events]
        assert set(newest.tolist()) <= set(log.cells[below[below >= 0]].tolist())
    last = play.there(play.ends["step"])
    np.testing.assert_array_equal(last, cells.is_leaf)


@pytest.mark.parametrize("spec", OTHERS)
def test_any_other_building_ends_with_the_tree(lab, spec):
    scene = lab.small_scene("suzanne")
    structure = build(scene, spec)
    play = LESSON.play(Subject(scene, (structure,)), Settings(), SILENT)
    for step in steps_of(play):
        picture = play.picture(Settings(step))
        assert np.isfinite(picture.points()).all()
        assert len(picture.segments) < 20_000
    last = play.there(play.ends["step"])
    bottom_up = play.log.is_bottom_up
    ends = play.cells.parents < 0 if bottom_up else play.cells.is_leaf
    np.testing.assert_array_equal(last, ends)


@pytest.mark.parametrize("spec", ["kdtree:max_leaf_size=8", "octree:max_depth=4"])
def test_the_plane_is_that_of_the_log(lab, spec):
    scene = lab.small_scene("suzanne")
    structure = build(scene, spec)
    play = LESSON.play(Subject(scene, (structure,)), Settings(), SILENT)
    log = structure.build_log
    for step in steps_of(play)[1:]:
        events = play.events(step)
        assert len(events) <= MOST_NEWEST
        picture = play.picture(Settings(step))
        red = (picture.face_colours == (*RED[:3], 0.3)).all(axis=1)
        faces = picture.faces[red].reshape(len(events), 6, 3)
        drawn = sorted(
            (int(np.ptp(face, axis=0).argmin()), float(face[0, np.ptp(face, axis=0).argmin()]))
            for face in faces
        )
        want = sorted(zip(log.axis[events].tolist(), log.position[events].tolist(), strict=True))
        assert drawn == want
        if len(events) == 1:
            rows = {row.label: row.text for row in picture.rows}
            left, right = log.counts[events[0]]
            assert rows["N_L, N_R"] == f"{left}, {right}"
            assert rows["Cost"] == f"{log.cost[events[0]]:.4g}"


def test_what_has_no_log_is_refused_in_one_line(lab):
    scene = lab.small_scene("one")
    for spec in ("grid", "naive"):
        with pytest.raises(InputError, match="no log"):
            LESSON.play(Subject(scene, (build(scene, spec),)), Settings(), SILENT)


def test_a_film_goes_faster_and_ends(lab):
    play = LESSON.play(
        Subject(lab.small_scene("suzanne"), (build(lab.small_scene("suzanne"), "bvh"),)),
        Settings(), SILENT,
    )  # fmt: skip
    film = list(play.film(LESSON))
    assert film[0] == 0
    assert film[-1] == play.ends["step"]
    assert film == sorted(set(film))
    assert len(film) <= 121


@pytest.mark.parametrize("spec", ["kdtree:max_leaf_size=8", "octree:max_depth=4"])
def test_chosen_cells_and_planes_are_drawn(lab, spec):
    scene = lab.small_scene("suzanne")
    structure = build(scene, spec)
    play = LESSON.play(Subject(scene, (structure,)), Settings(), SILENT)
    cells, log = play.cells, structure.build_log
    is_empty = cells.is_leaf & (cells.count == 0)
    assert is_empty.any()
    for step in (1, 9, 30):
        there = play.there(step)
        for choice, chosen in (
            ("leaves", there), ("full", there & ~is_empty), ("all", play.made <= step),
        ):  # fmt: skip
            picture = play.picture(Settings(step, cells=choice))
            ends = picture.segments.reshape(-1, 3)
            # Every corner of a cell that is chosen is the end of a line.
            corners = cells.boxes[chosen][:, [0, 1, 2]], cells.boxes[chosen][:, [3, 4, 5]]
            drawn = {tuple(point) for point in ends.tolist()}
            for corner in np.concatenate(corners).tolist():
                assert tuple(corner) in drawn
        every = play.picture(Settings(step, planes="all"))
        n_planes = ((log.kind == SPLIT) & (log.step <= step)).sum()
        filled = every.face_colours[:, 3]
        # Two triangles a plane: those of this step stand out.
        assert np.isclose(filled, 0.3).sum() == 2 * len(play.events(step))
        assert np.isclose(filled, 0.08).sum() == 2 * (n_planes - len(play.events(step)))


def test_as_many_cells_are_drawn_as_are_asked_for(lab):
    scene = lab.small_scene("suzanne")
    play = LESSON.play(Subject(scene, (build(scene, "kdtree"),)), Settings(), SILENT)
    last = play.ends["step"]
    few = play.picture(Settings(last, most=10))
    newest = ((play.made == last) & play.there(last)).sum()
    assert f"drawn: the largest {10 + newest}" in few.caption
    assert "drawn" not in play.picture(Settings(last, most=5000)).caption
    every = play.picture(Settings(last, cells="all", most=5000))
    assert every.caption.endswith(f", drawn: {len(play.cells)} cells")
