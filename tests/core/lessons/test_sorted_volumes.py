"""Lessons of sorted volumes: what is grey was not tested by the recorded walk; the order is t's."""

import numpy as np
import pytest
from accelscope.core.contract.events import TEST, VOLUME_TEST
from accelscope.core.geometry.instances import instanced, owners_of
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.lessons.drawing import GREEN, GREY, ORANGE
from accelscope.core.lessons.lesson import build
from accelscope.core.progress import SILENT
from accelscope.core.scene import Scene
from accelscope.core.structures import structures

NAMES = "volumes_along_a_ray", "sorted_volumes"


@pytest.mark.parametrize("name", ["suzanne", "mess", "one", "flat", "balls"])
def test_the_walk_is_the_recorded_one(lab, play_lesson, name):
    scene = lab.small_scene(name)
    walk = play_lesson("sorted_volumes", scene).play.walk
    offsets, steps = walk.structure.arrays.offsets, walk.steps
    # Every volume is tested, whatever becomes of it: O(N).
    assert sorted(walk.tested) == list(range(len(offsets) - 1))
    assert (np.diff(walk.enters) >= 0.0).all()
    assert np.array_equal(walk.order[: len(walk.visited)], walk.visited)
    tested = set(steps.primitive[steps.events_of(TEST)].tolist())
    assert set(walk.items_of(walk.visited)) == tested
    assert not tested & set(walk.items_of(walk.skipped))
    assert not tested & set(walk.items_of(walk.missed()))
    # It ends since the hit lies before what is left.
    if len(walk.skipped):
        assert walk.t_hit < walk.enters[len(walk.visited)]
    kind = structures()["naive"]
    hits, _ = kind.build(scene, kind.Settings()).trace(walk.rays)
    assert walk.t_hit == hits.t[0]
    assert walk.primitive == hits.primitive[0]
    if walk.primitive >= 0:
        assert walk.primitive in walk.items_of(np.array([walk.object_of_hit()]))


def test_the_grey_objects_are_those_that_were_not_tested(play_lesson):
    played = play_lesson("volumes_along_a_ray")
    walk = played.play.walk
    assert len(walk.visited) >= 2
    assert len(walk.skipped) >= 2
    picture = played.picture(stage="objects")
    corners = played.scene.triangles
    for colour, cells in ((GREY, walk.skipped), (GREEN, [walk.object_of_hit()])):
        own = (picture.face_colours[:, :3] == colour[:3]).all(axis=1)
        assert own.any()
        items = {row.tobytes() for row in corners[walk.items_of(np.array(cells))]}
        assert {row.tobytes() for row in picture.faces[own]} <= items
    orange = (picture.face_colours[:, :3] == ORANGE[:3]).all(axis=1)
    assert orange.any() == (len(walk.visited) > 1)
    assert f"{len(walk.skipped)} never" in picture.caption
    # The numbers stand on the ray, where the volumes begin.
    for number, mark in enumerate(picture.marks):
        assert mark.text == str(number + 1)
        t = np.linalg.norm(mark.position - walk.rays.origins[0])
        t /= np.linalg.norm(walk.rays.directions[0])
        assert t == pytest.approx(walk.enters[number], rel=1e-9)


def test_counters_grow_event_by_event_up_to_those_of_the_ray(play_lesson):
    played = play_lesson("sorted_volumes")
    walk, last = played.play.walk, played.play.ends["event"]
    n_tests = len(walk.tests)
    assert last == n_tests + len(walk.visited)
    for event in range(n_tests):
        assert played.row("Volume Tests", event=event) == f"{event + 1} of {n_tests}"
        verdict = "hit" if walk.tested[event] in walk.order else "missed"
        assert f"Volume {event + 1} of {n_tests}: {verdict}" in played.picture(event=event).caption
    sizes = np.diff(walk.structure.arrays.offsets)[walk.visited]
    for done in range(1, len(walk.visited) + 1):
        tests = int(sizes[:done].sum())
        text = f"{tests:,} of {len(played.scene):,}".replace(",", " ")
        assert played.row("N_IT", event=n_tests + done - 1) == text
    _, counts = walk.structure.trace(walk.rays)
    assert counts["N_IT"][0] == sizes.sum()
    assert counts["cells_skipped"][0] == len(walk.skipped)
    assert len(walk.steps.events_of(VOLUME_TEST)) == counts["volume_tests"][0]
    assert "The end" in played.picture(event=last).caption


def test_another_list_of_another_kind_of_volume(lab, play_lesson):
    played = play_lesson("sorted_volumes", lab.small_scene("suzanne"))
    structure = build(played.scene, "sorted_volumes:volume=kdop14,parts=9")
    subject = played.lesson.subject(played.scene, given=[structure])
    play = played.lesson.play(subject, played.settings, SILENT)
    assert len(play.walk.tested) == 9
    assert play.picture(play.within(played.lesson.Settings(9))).caption
    assert played.lesson.suits(build(played.scene, "bvh"))


def test_over_instances_the_objects_are_instances(lab, play_lesson):
    mesh = all_triangles(lab.small_scene("suzanne").triangles)
    places = np.tile(np.eye(3, 4), (3, 1, 1))
    places[:, :, 3] = np.array([[0.0, 0, 0], [2.0, 1.7, -0.5], [4.0, 3.4, -1.0]])
    scene = Scene.from_instances(
        instanced([mesh], [0, 0, 0], places), "three", object_ids=np.arange(3),
        object_names=("a", "b", "c"),
    )  # fmt: skip
    played = play_lesson("volumes_along_a_ray", scene)
    walk = played.play.walk
    assert sorted(walk.tested) == [0, 1, 2]
    offsets, ids = walk.structure.arrays.offsets, walk.structure.geometry.ids
    hit = walk.object_of_hit()
    (owner,), _ = owners_of(scene.geometry, np.array([walk.primitive]))
    assert ids[offsets[hit] : offsets[hit + 1]].tolist() == [owner]
    assert set(walk.skipped) | set(walk.visited) == set(walk.order)
    for name in ("naive_cost", "solid_efficiency", "sub_volumes", "kdop_levels"):
        assert play_lesson(name, scene).picture().caption
