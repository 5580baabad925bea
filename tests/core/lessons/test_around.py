"""What lessons on volumes share: the hull of a scene, shapes in pieces, copies side by side."""

import numpy as np
import pytest
from accelscope.core.geometry.geometry import hulls_of
from accelscope.core.geometry.hull import hull_area
from accelscope.core.lessons.around import (
    below,
    beside_each_other,
    hull_surface,
    surface_of,
)
from accelscope.core.sah.volume_around import volume_around


@pytest.mark.parametrize(
    "name", ["suzanne", "bunny", "soup", "mess", "one", "flat", "cubes", "balls"]
)
def test_what_lies_within_does_not_change_the_hull(lab, name):
    scene = lab.small_scene(name)
    corners, _ = hulls_of(scene.geometry)
    assert hull_surface(scene) == pytest.approx(hull_area(corners.reshape(-1, 3)), rel=1e-9)


@pytest.mark.parametrize("kind", ["aabb", "obb", "kdop14", "kdop26", "smallest_sphere"])
def test_a_surface_has_the_area_of_its_volume(lab, kind):
    volume = volume_around(lab.small_scene("suzanne"), kind)
    sides = surface_of(volume)
    cross = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    area = 0.5 * np.linalg.norm(cross, axis=1).sum()
    # 1280 triangles with their corners on the sphere have a little less than it.
    tolerance = 0.01 if "sphere" in kind else 1e-6
    assert area == pytest.approx(float(volume.areas()[0]), rel=tolerance)


def test_triangles_are_cut_where_heights_change_their_sign():
    rng = np.random.default_rng(3)
    triangles = rng.random((200, 3, 3))
    heights = triangles[:, :, 2] - 0.5
    kept = below(triangles, heights)
    other = below(triangles, -heights)
    assert (kept[:, :, 2] <= 0.5 + 1e-12).all()
    assert (other[:, :, 2] >= 0.5 - 1e-12).all()

    def area(each):
        cross = np.cross(each[:, 1] - each[:, 0], each[:, 2] - each[:, 0])
        return 0.5 * np.linalg.norm(cross, axis=1).sum()

    assert area(kept) + area(other) == pytest.approx(area(triangles), rel=1e-12)


@pytest.mark.parametrize("name", ["suzanne", "one", "flat", "mess"])
def test_copies_do_not_lie_in_each_other(lab, name):
    scene = lab.small_scene(name)
    size = scene.upper - scene.lower
    for count in (1, 2, 3, 4):
        places = beside_each_other(scene, count)
        assert len(places) == count
        assert not places[0].any()
        for i, a in enumerate(places):
            for b in places[:i]:
                assert (np.abs(a - b) > size).any()
