"""The triangles are sorted once along an axis; moving the plane is a look-up."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from accelscope.core.geometry.box import boxes_of
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.lessons.split_plane import Settings, SplitPlaneOfScene
from accelscope.core.progress import SILENT, Cancelled, Progress
from accelscope.core.sah.split_plane import evaluate_plane, sort_along
from accelscope.sample_scenes import make_sample


def prepared(spec, axis=0):
    scene = make_sample(spec)
    return scene, np.concatenate([scene.lower, scene.upper]), boxes_of(scene.triangles), axis


def test_a_move_looks_at_as_few_numbers_of_many_triangles_as_of_few(counter):
    def numbers(spec):
        play = SplitPlaneOfScene(make_sample(spec), SILENT)
        play.axes = [counter.wrap(along) for along in play.axes]
        play.scene = dataclasses.replace(play.scene, geometry=counter.wrap(play.scene.geometry))

        def move():
            for axis, share in itertools.product("xyz", np.linspace(0.1, 0.9, 5)):
                play.picture(Settings(axis, float(share)))

        return counter.numbers(move)

    few, many = numbers("soup:count=5000"), numbers("soup:count=50000")
    assert 0 < few == many


@pytest.mark.parametrize("axis", range(3))
def test_figures_are_those_of_counting(axis):
    _, box, boxes, axis = prepared("soup:count=3000", axis)
    along = sort_along(boxes, axis)
    middles = 0.5 * (boxes[:, axis] + boxes[:, 3 + axis])
    for position in [*np.linspace(box[axis], box[3 + axis], 40), *middles[:20]]:
        plane = evaluate_plane(along, box, float(position), 3.0, 1.0)
        assert (middles < position).sum() == plane.N_L
        assert (middles >= position).sum() == plane.N_R
        left = box.copy()
        left[3 + axis] = position
        assert plane.p_L == pytest.approx(surface_area(left) / surface_area(box), abs=1e-12)


def test_sorting_can_be_cancelled():
    class Stop(Progress):
        def report(self, done, total, text):
            raise Cancelled

    with pytest.raises(Cancelled):
        sort_along(np.zeros((10, 6)), 0, Stop())


@pytest.mark.bpy
def test_in_blender_a_move_plays_nothing(bpy, monkeypatch):
    from accelscope.addon.results import lesson_view

    bpy.ops.mesh.primitive_monkey_add()
    bpy.context.scene.accelscope.teaching.lesson = "split_plane"
    bpy.ops.accelscope.use_my_mesh()
    view, group = lesson_view.current, bpy.context.scene.accelscope.lessons.split_plane
    asked, seen = [], set()
    monkeypatch.setattr(lesson_view, "ask", lambda *arguments, **named: asked.append(arguments))
    for share in (0.1, 0.5, 0.9):
        group.position = share
        seen.add(view.picture.caption)
    assert asked == []
    assert len(seen) == 3
    view.clear()
