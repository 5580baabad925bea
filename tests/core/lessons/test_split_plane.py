"""Lesson "split_plane": a plane anywhere, counted one by one; see core/sah for its figures."""

import numpy as np
import pytest
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.lessons.drawing import BLUE, ORANGE, RED
from accelscope.core.lessons.split_plane import SAMPLES, Settings

SHARES = 0.0, 0.3, 1.0


@pytest.mark.parametrize("name", ["suzanne", "one", "flat", "mess", "balls"])
def test_a_plane_of_any_scene_against_counting(lab, play_lesson, name):
    scene = lab.small_scene(name)
    played = play_lesson("split_plane", scene)
    boxes = scene.boxes()
    middles = 0.5 * (boxes[:, :3] + boxes[:, 3:])
    box = np.concatenate([scene.lower, scene.upper])
    for number, axis in enumerate("xyz"):
        for share in SHARES:
            picture = played.picture(axis=axis, position=share, t_tra=2.0, t_tri=0.5)
            position = box[number] + share * (box[3 + number] - box[number])
            n_left = int((middles[:, number] < position).sum())
            halves = np.stack([box, box])
            halves[0, 3 + number] = halves[1, number] = position
            area = surface_area(box)
            shares = surface_area(halves) / area if area > 0.0 else np.ones(2)
            counts = np.array([n_left, len(scene) - n_left])
            rows = {row.label: row.text for row in picture.rows}
            assert [rows["N_L"], rows["N_R"]] == [str(count) for count in counts]
            assert rows["p_L"] == f"{shares[0]:.2f}"
            assert f"Cost = {2.0 + 0.5 * shares @ counts:.2f};" in picture.caption
            assert np.isfinite(picture.points()).all()
            # The plane lies where it is said to be, in lines and faces.
            is_red = (picture.face_colours[:, :3] == RED[:3]).all(axis=1)
            assert (picture.faces[is_red][..., number] == position).all()


def test_items_have_the_colour_of_their_side(lab, play_lesson):
    scene = lab.small_scene("suzanne")
    played = play_lesson("split_plane", scene)
    picture = played.picture(axis="y", position=0.4)
    position = scene.lower[1] + 0.4 * (scene.upper[1] - scene.lower[1])
    boxes = scene.boxes()
    is_left = 0.5 * (boxes[:, 1] + boxes[:, 4]) < position
    edges = np.stack([scene.triangles, np.roll(scene.triangles, -1, axis=1)], axis=2)

    def drawn(colour):
        lines = picture.segments[(picture.colours == colour).all(axis=1)]
        return {line.tobytes() for line in lines}

    for side, colour in ((is_left, BLUE), (~is_left, ORANGE)):
        assert {edge.tobytes() for edge in edges[side].reshape(-1, 2, 3)} <= drawn(colour)
        assert not {edge.tobytes() for edge in edges[~side].reshape(-1, 2, 3)} & drawn(colour)


def test_the_curve_passes_through_the_plane_and_stands_beside_the_model(play_lesson, read_charts):
    played = play_lesson("split_plane")
    scene = played.scene
    for axis in "xyz":
        segments = played.picture(axis=axis, position=0.5).segments
        beside = (segments < scene.lower - 0.1) | (segments > scene.upper + 0.05)
        assert beside.any()
        for sample in (60, 120):
            share = sample / (SAMPLES - 1)
            (chart,) = read_charts(played.play, Settings(axis, share))
            curve, point = chart.curve(ORANGE), chart.lines(RED)[0, 1]
            assert len(curve) == SAMPLES
            cost = played.row("Cost(V -> {L, R})", axis=axis, position=share)
            assert point[1] == pytest.approx(float(cost), rel=1e-3)  # which has a few digits
            np.testing.assert_allclose(curve[sample], point, atol=1e-9)
    cheapest = played.play.on_page(played.lesson, played.settings)[1:]
    for settings in cheapest:
        costs = [
            float(played.row("Cost(V -> {L, R})", axis=settings.axis, position=share))
            for share in np.linspace(0.0, 1.0, 41)
        ]
        best = float(
            played.row("Cost(V -> {L, R})", axis=settings.axis, position=settings.position)
        )
        assert best <= min(costs)
