"""The lesson on a ray: its events are the log's, its figures the counters, what waits the stack."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.contract.events import SKIP, VISIT_INNER, VISIT_LEAF, VOLUME_TEST
from accelscope.core.geometry.rays import Rays
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.lesson import Subject
from accelscope.core.lessons.ray import Settings, own_rays, up_to, waiting
from accelscope.core.progress import SILENT

LESSON = lesson_named("ray")


@pytest.mark.parametrize("scene", ["suzanne", "one", "mess", "flat"])
@pytest.mark.parametrize("name", ["bvh", "grid", "kdtree", "naive"])
def test_figures_of_the_last_event_are_the_counters(name, scene, lab, build):
    structure = build(name, lab.small_scene(scene))
    rays = own_rays(structure.scene)
    hits, counts = structure.trace(rays)
    for ray in (0, 100, len(rays) - 1):
        subject = Subject(structure.scene, (structure,), rays, 0)
        play = LESSON.play(subject, Settings(ray=ray), SILENT)
        assert play.ends["ray"] == len(rays) - 1
        last = Settings(event=play.ends["event"], ray=ray)
        rows = {row.label: row.text for row in play.picture(last).rows}
        for counter in structure.counters:
            assert rows[counter.label] == str(counts[counter.name][ray])
        assert (rows["Hit"] == "nothing") == (hits.primitive[ray] < 0)
        if hits.primitive[ray] >= 0:
            owner, within = subject.scene.object_of(int(hits.primitive[ray]))
            assert f" {within} of {owner} at" in rows["Hit"]
        whole = play.picture(dataclasses.replace(last, whole=True))
        assert f"{last.event + 1} events" in whole.caption


def test_what_waits_is_the_stack_of_the_walk(lab, build):
    """Retold with a stack, as the walk of two children does it: the nearer goes on."""
    structure = build("bvh", lab.small_scene("suzanne"), "max_leaf_size=1")
    rays = own_rays(structure.scene)
    told = 0
    for ray in range(0, len(rays), 37):
        steps = structure.record(rays, ray)
        stack: list[int] = []
        for event in range(len(steps)):
            kind, cell = steps.kind[event], int(steps.cell[event])
            if kind == VOLUME_TEST and np.isfinite(steps.t_enter[event]):
                stack.append(cell)
            elif kind in (VISIT_INNER, VISIT_LEAF, SKIP):
                stack.remove(cell)
            assert waiting(steps, event).tolist() == sorted(stack)
            told += len(stack) > 1
        assert up_to(steps, len(steps) - 1).tally() == steps.tally()
    assert told > 50


def test_own_rays_are_seen_from_the_side(lab):
    scene = lab.small_scene("suzanne")
    rays = own_rays(scene)
    assert len(rays) == 32 * 24
    np.testing.assert_allclose(rays.directions, np.tile(rays.directions[0], (len(rays), 1)))


def test_a_ray_from_afar_is_drawn_from_near_the_scene(lab, build):
    structure = build("bvh", lab.small_scene("suzanne"))
    scene = structure.scene
    centre = 0.5 * (scene.lower + scene.upper)
    for far in (1.0, 1e6):
        way = np.array([0.1, 1.0, -0.2])
        rays = Rays.from_arrays((centre - far * scene.diagonal * way)[None], (3.0 * way)[None])
        play = LESSON.play(Subject(scene, (structure,), rays, 0), Settings(), SILENT)
        for settings in (Settings(), Settings(event=10), Settings(whole=True)):
            points = play.picture(play.within(settings)).points()
            away = np.linalg.norm(points - centre, axis=1)
            assert away.max() < 0.8 * scene.diagonal
