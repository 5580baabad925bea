"""Lessons "two_levels", "rebraiding" and "ray_through_levels": what they draw is in the structure.

Figures are its counters.
"""

import dataclasses

import numpy as np
import pytest
from accelscope.core.geometry.box_shape import box_segments
from accelscope.core.geometry.instances import moved_points
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.drawing import BLUE, GREEN, ORANGE
from accelscope.core.lessons.figures import lines_through
from accelscope.core.progress import SILENT
from accelscope.sample_scenes import make_sample


def played(name, sample=None):
    lesson = lesson_named(name)
    scene = make_sample(sample or lesson.sample)
    subject = lesson.subject(scene)
    return lesson, subject, lesson.play(subject, lesson.Settings(), SILENT)


def coloured(picture, colour):
    """The segments of one hue, whatever their opacity."""
    return picture.segments[(picture.colours[:, :3] == np.array(colour[:3])).all(axis=1)]


def same_segments(found, wanted):
    def ordered(segments):
        ends = np.sort(segments.reshape(len(segments), 2, 3).round(9), axis=1).reshape(-1, 6)
        return ends[np.lexsort(ends.T)]

    np.testing.assert_allclose(ordered(found), ordered(wanted), atol=1e-7)


def test_levels_end_with_the_deepest_of_the_mesh():
    lesson, subject, play = played("two_levels", "crowd:figures=4,triangles=1000")
    structure = subject.structures[0]
    top = int(structure.cells().depth.max())
    below = max(int(bottom.cells().depth.max()) for _, bottom in structure.bottoms)
    assert play.ends == {"level": top + 1 + below + 1, "mesh": 1}
    for level in play.film(lesson):
        picture = play.picture(lesson.Settings(level))
        assert np.isfinite(picture.points()).all()
        assert picture.caption.startswith(
            "Top level" if level <= top else "The items" if level == top + 1 else "Bottom level"
        )


def test_instances_are_drawn_as_their_boxes():
    lesson, subject, play = played("two_levels", "crowd:figures=4,triangles=1000")
    level = int(subject.structures[0].cells().depth.max()) + 1
    picture = play.picture(lesson.Settings(level))
    boxes = subject.structures[0].scene.geometry.boxes
    same_segments(coloured(picture, ORANGE), box_segments(boxes))


def test_boxes_of_the_mesh_stand_in_its_space_and_in_every_place():
    lesson, subject, play = played("two_levels", "crowd:figures=4,triangles=1000")
    structure = subject.structures[0]
    geometry = structure.scene.geometry
    mesh = int(np.argmax(np.bincount(geometry.which)))
    cells = structure.bottom_of(geometry.meshes[mesh]).cells()
    start = int(structure.cells().depth.max()) + 2
    for depth in (0, 3):
        shown = (cells.depth == depth) | (cells.is_leaf & (cells.depth < depth))
        own = box_segments(cells.boxes[shown])
        space = play.space(mesh)
        wanted = [space.points(own)]
        only = play.picture(lesson.Settings(start + depth, everywhere=False))
        same_segments(coloured(only, BLUE), wanted[0])
        wanted += [
            moved_points(own, geometry.matrices[number])
            for number in np.flatnonzero(geometry.which == mesh)
        ]
        picture = play.picture(lesson.Settings(start + depth))
        same_segments(coloured(picture, BLUE), np.concatenate(wanted))
    # Beside the scene, not in it.
    assert space.points(own)[..., 0].min() > structure.scene.upper[0]


def test_opened_nodes_are_drawn_one_after_the_other():
    lesson, subject, play = played("rebraiding", "overlapping:spheres=5,segments=8")
    after = subject.structures[1]
    opened = after.braid.opened
    assert play.ends["opened"] == len(opened) > 3
    for number in (0, 1, 3):
        picture = play.picture(lesson.Settings(number, items=False))
        assert len(coloured(picture, GREEN)) == 12 * number
    owner, node = opened[0]
    box = after.instances.forest.volumes.boxes()[[node]]
    moved = moved_points(box_segments(box), after.scene.geometry.matrices[owner])
    one = play.picture(lesson.Settings(1, items=False))
    same_segments(coloured(one, GREEN), moved + play.shift)


def test_its_figures_are_those_of_the_counters():
    lesson, subject, play = played("rebraiding", "overlapping:spheres=5,segments=8")
    rows = {row.label: row.text.split(", ") for row in play.picture(lesson.Settings()).rows}
    rays = lines_through(subject.scene)
    for place, structure in enumerate(subject.structures):
        means = structure.trace(rays)[1].means()
        assert rows["Entered"][place] == f"{means['instances_entered']:.2f}"
        assert rows["N_TS"][place] == f"{means['N_TS'] + means['N_TS_1']:.2f}"
        assert rows["N_IT"][place] == f"{means['N_IT_1']:.2f}"
    assert len(rows["SAH Cost"]) == 3


def test_a_ray_through_levels_counts_as_its_structure_and_moves_as_its_matrix():
    lesson, subject, play = played("ray_through_levels")
    last = play.ends["event"]
    structure = subject.structures[0]
    hits, counts = structure.trace(play.rays)
    assert hits.primitive[0] >= 0
    assert counts["instances_entered"][0] >= 2
    rows = {row.label: row.text for row in play.picture(lesson.Settings(last)).rows}
    for counter in structure.counters:
        assert rows[counter.label] == str(counts[counter.name][0])
    instance = play.instance_at(last)
    matrix = structure.scene.geometry.matrices[instance]
    here = np.array([float(each) for each in rows["o in the Mesh"].strip("()").split(", ")])
    there = matrix[:, :3] @ here + matrix[:, 3]
    np.testing.assert_allclose(there, play.rays.origins[0], atol=0.02)
    for event in range(0, last, 5):
        assert np.isfinite(play.picture(lesson.Settings(event)).points()).all()


def test_the_hit_is_at_the_same_t_on_both_sides():
    lesson, subject, play = played("ray_through_levels")
    hits, _ = subject.structures[0].trace(play.rays)
    picture = play.picture(lesson.Settings(play.ends["event"]))
    assert f"t = {hits.t[0]:.4g} on both sides" in [mark.text for mark in picture.marks]


@pytest.mark.parametrize("name", ["two_levels", "ray_through_levels"])
@pytest.mark.parametrize("blas", ["grid", "kdtree"])
def test_other_bottom_levels_are_shown_as_well(name, blas):
    lesson = lesson_named(name)
    from accelscope.core.lessons.lesson import build

    scene = make_sample("crowd:figures=3,triangles=1000")
    subject = lesson.subject(scene, given=[build(scene, f"two_level:blas={blas}")])
    play = lesson.play(subject, lesson.Settings(), SILENT)
    for value in list(play.film(lesson))[::7]:
        picture = play.picture(dataclasses.replace(lesson.Settings(), **{lesson.film: value}))
        assert np.isfinite(picture.points()).all()
