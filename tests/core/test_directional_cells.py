"""Cells of directional structures and their lists: closed forms, and what rays of a cell hit."""

import itertools

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays.workloads import (
    CameraSettings,
    CameraWorkload,
)
from accelscope.core.geometry.rays import ANY, CLOSEST, Rays
from accelscope.core.scene import Scene
from accelscope.core.scene.camera_rays import CLASS_NAMES
from accelscope.core.scene.light import point_lights
from accelscope.core.structures.directional.faces import cube, faces_of, picture_of
from accelscope.core.structures.directional.lists import cell_at
from directional_cases import (
    CAMERAS,
    LIGHT_BUFFER,
    SCENES,
    SETTINGS,
    built,
    changed,
    lit,
    shadow_rays_of,
)

LONG = [
    pytest.param(name, marks=[] if name == "teapot" else pytest.mark.exhaustive) for name in SCENES
]


@pytest.mark.parametrize("text", SETTINGS)
@pytest.mark.parametrize("name", LONG)
def test_lists_hold_whatever_a_ray_of_their_cell_hits(lab, name, text):
    """Also of what lies behind the first hit: all hits of each ray, up to where the list ends."""
    scene = lit(lab.small_scene(name))
    structure = built(lab, LIGHT_BUFFER, scene, text)
    rng = np.random.default_rng(3)
    naive = built(lab, "naive", scene)
    origin = scene.lights[1].position
    ways = rng.normal(size=(400, 3))
    rays = Rays.from_arrays(np.tile(origin, (400, 1)), ways)
    begin = np.zeros(400)
    for _ in range(6):
        hits, _ = naive.trace(changed(rays, t_min=begin), CLOSEST)
        found = np.flatnonzero(hits.primitive >= 0)
        for index in found:
            cell = structure.cell_of(1, ways[index])
            lists = structure.lists
            listed = lists.references[lists.first[cell] : lists.last[cell]]
            distance = hits.t[index] * np.linalg.norm(ways[index])
            assert hits.primitive[index] in listed or distance > lists.far[cell]
        begin[found] = np.nextafter(hits.t[found], np.inf)
        rays, begin = rays.select(found), begin[found]
        ways = ways[found]
        if not len(found):
            break


def test_faces_of_a_cube_share_all_directions(lab):
    scene = lit(lab.small_scene("suzanne"))
    for text in SETTINGS:
        structure = built(lab, LIGHT_BUFFER, scene, text)
        weights = np.where(structure.lists.children < 0, structure.weights, 0.0)
        by_face = np.bincount(structure.squares.face, weights)
        is_cube = structure.is_of_cube
        assert np.allclose(by_face[is_cube], 1.0 / 6.0, rtol=1e-12)
        assert np.allclose(by_face[~is_cube], 1.0, rtol=1e-12)


def test_a_cell_of_a_cube_has_the_solid_angle_of_its_rays(lab):
    """Directions spread evenly over a sphere fall into cells as often as their angles say."""
    scene = lit(lab.small_scene("one"))
    structure = built(lab, LIGHT_BUFFER, scene, "division=uniform,cells=2")
    ways = np.random.default_rng(1).normal(size=(24_000, 3))
    cells = np.array([structure.cell_of(0, way) for way in ways[:6000]])
    counts = np.bincount(cells, minlength=24)[:24]
    # All 24 have the same angle, by symmetry; a binomial count has this standard deviation.
    assert np.allclose(structure.weights[:24], 1.0 / 24.0)
    assert np.abs(counts - 250).max() < 4.5 * np.sqrt(6000 * (1 / 24) * (23 / 24))


def test_a_direction_comes_back_out_of_its_place():
    faces = cube(np.array([1.0, 2.0, 3.0]))
    rng = np.random.default_rng(2)
    for way in rng.normal(size=(100, 3)):
        axis = np.abs(way).argmax()
        face = 2 * axis + (way[axis] < 0.0)
        u, v, w = faces.axes[face] @ way
        assert w > 0.0
        assert max(abs(u), abs(v)) <= w
        back = u / w * faces.back[face, 0] + v / w * faces.back[face, 1] + faces.back[face, 2]
        assert np.allclose(back * w, way, rtol=1e-15)


def test_the_picture_is_the_cameras():
    for camera in CAMERAS.values():
        faces = picture_of(camera, 40, 30)
        scene = Scene.from_triangles(np.eye(3)[None], "one", camera=camera)
        rays = CameraWorkload.make(scene, CameraSettings(width=40, height=30, pixel="corner"))
        ends = rays.origins + rays.directions - faces.origins[0]
        a = ends @ faces.axes[0].T
        places = a[:, :2] if faces.is_parallel[0] else a[:, :2] / a[:, 2:]
        u, v = np.meshgrid(np.linspace(-1, 1, 40), np.linspace(1, -1, 30))
        assert np.allclose(places, np.stack([u.ravel(), v.ravel()], axis=1), atol=1e-12)


def test_one_item_covers_what_lies_behind_it(lab):
    """A large triangle before a small one: only the large one is listed, and it alone is tested."""
    near = np.array([[-50.0, -50, -1], [50, -50, -1], [0, 80, -1]])
    far = np.array([[-0.1, -0.1, -2], [0.1, -0.1, -2], [0, 0.1, -2]])
    scene = Scene.from_triangles(np.array([near, far]), "two", lights=point_lights((0.0, 0.0, 0.0)))
    structure = built(lab, LIGHT_BUFFER, scene, "division=uniform,cells=3")
    middle = structure.cell_of(0, np.array([0.0, 0.0, -1.0]))
    assert structure.lists.cover[middle] == 0
    assert structure.lists.references[structure.lists.first[middle]] == 0
    assert structure.lists.last[middle] - structure.lists.first[middle] == 1
    # The corner of the cell is at (1/3, 1/3, -1).
    assert structure.lists.far[middle] == pytest.approx(np.sqrt(11.0) / 3.0, rel=1e-5)
    origins = np.array([[0.0, 0, -3], [0, 0, -0.5]])
    rays = Rays.from_arrays(origins, -origins, 1.0, queries=ANY, classes=1,
                            class_names=CLASS_NAMES, targets=0)  # fmt: skip
    hits, counts = structure.trace(rays)
    assert (hits.primitive >= 0).tolist() == [True, False]
    assert counts["covered"].tolist() == [1, 0]
    assert counts["N_IT"].tolist() == [1, 0]
    without = built(lab, LIGHT_BUFFER, scene, "division=uniform,cells=3,full_occlusion=false")
    assert without.lists.last[middle] - without.lists.first[middle] == 2
    assert not np.isfinite(without.lists.far).any()


def test_a_cell_up_to_the_border_of_an_item_is_not_covered(lab):
    """A ray along that border may pass beside the item; cells a little inside are covered."""
    triangle = np.array([[[0.0, -50, -1], [0, 50, -1], [90, 0, -1]]])
    scene = Scene.from_triangles(triangle, "one", lights=point_lights((0.0, 0.0, 0.0)))
    for size, begin in ((2, 1), (3, 2)):
        structure = built(lab, LIGHT_BUFFER, scene, f"division=uniform,cells={size}")
        cover = structure.lists.cover.reshape(6, size, size)[5]
        # With two cells in a row the border of the item is that of the second one.
        is_inside = (np.arange(size) >= begin) & (size == 3)
        assert np.array_equal(cover == 0, np.tile(is_inside, (size, 1)))


def test_a_cell_whose_parts_would_list_as_much_is_not_divided(lab):
    """Twenty triangles on top of each other: all are seen through all parts of the face below."""
    plane = np.array([[-50.0, -50, -1], [50, -50, -1], [0, 80, -1]])
    scene = Scene.from_triangles(
        np.tile(plane, (20, 1, 1)), "twenty", lights=point_lights((0.0, 0.0, 0.0))
    )
    text = "full_occlusion=false,max_list_size=8,max_depth=3"
    structure = built(lab, LIGHT_BUFFER, scene, text)
    lists, squares = structure.lists, structure.squares
    below = squares.face == 5
    assert below.sum() == 1
    assert lists.last[below] - lists.first[below] == 20
    # To the sides they are seen through the lower half alone, and through all of that.
    for face in range(4):
        assert squares.depth[squares.face == face].tolist() == [0, 1, 1, 1, 1]


def test_exact_insertion_lists_no_cell_that_a_triangle_does_not_touch(lab):
    """A right triangle in the plane before the origin: cells on and below its long side."""
    triangle = np.array([[[-1.0, -1, 1], [1, -1, 1], [-1, 1, 1]]])
    scene = Scene.from_triangles(triangle, "one", lights=point_lights((0.0, 0.0, 0.0)))
    structure = built(lab, LIGHT_BUFFER, scene, "division=uniform,cells=8,full_occlusion=false")
    squares, lists = structure.squares, structure.lists
    listed = (lists.last - lists.first) > 0
    up = squares.face == 4
    below = squares.u[up] + squares.v[up] <= 1e-9
    assert np.array_equal(listed[up], below)
    # Its border lies in the borders of other faces: there the cells along it see it, too.
    assert listed[~up].sum() == 2 * 8 + 2
    rectangle = built(lab, LIGHT_BUFFER, scene, "division=uniform,cells=8,insert=box")
    assert ((rectangle.lists.last - rectangle.lists.first)[up] == 1).all()


def test_lists_of_exact_insertion_are_the_shortest(lab):
    for name in ("suzanne", "teapot", "gears", "tree"):
        scene = lit(lab.small_scene(name))
        for text in ("", "division=uniform"):
            exact = built(lab, LIGHT_BUFFER, scene, text)
            assert exact.statistics().extra["list_over_exact"] == 1.0
            for how in ("box", "cone"):
                loose = built(lab, LIGHT_BUFFER, scene, f"{text}{',' * bool(text)}insert={how}")
                assert loose.statistics().extra["list_over_exact"] >= 1.0


def test_merged_lists_are_shorter_together_and_lack_nothing(lab):
    scene = lit(lab.small_scene("suzanne"))
    for text in ("", "division=uniform,"):
        plain, equal, similar = (
            built(lab, LIGHT_BUFFER, scene, f"{text}merge={how}").lists
            for how in ("none", "equal", "similar")
        )
        assert len(plain.references) > len(equal.references) > len(similar.references)
        for cell in np.flatnonzero(plain.children < 0).tolist():
            own = plain.references[plain.first[cell] : plain.last[cell]]
            same = equal.references[equal.first[cell] : equal.last[cell]]
            more = similar.references[similar.first[cell] : similar.last[cell]]
            assert np.array_equal(own, same)
            assert set(own) <= set(more)
            assert len(more) <= max(1.25 * len(own), len(own))


def test_what_was_drawn_misses_less_the_more_it_is_dilated(lab):
    """Rays of a mesh whose triangles are smaller than pixels; dilated cells overlook fewer."""
    scene = lit(lab.small_scene("suzanne"))
    rays = shadow_rays_of(scene, count=1000)
    overlooked = []
    for dilation in (0, 1, 4):
        text = f"division=uniform,cells=16,insert=raster,dilation={dilation}"
        structure = built(lab, LIGHT_BUFFER, scene, text)
        _, counts = structure.trace(rays)
        overlooked.append(int(counts["overlooked"].sum()))
        lists = structure.lists
        for cell in range(0, len(lists.first), 7):
            seen = structure.drawn_into(cell)
            listed = lists.references[lists.first[cell] : lists.last[cell]]
            assert dilation or set(seen) <= set(listed)
    assert overlooked[0] > overlooked[1] > overlooked[2]
    with pytest.raises(InputError, match="choose division=uniform"):
        built(lab, LIGHT_BUFFER, scene, "insert=raster")


def test_a_ray_along_an_edge_of_the_cube_goes_through_the_first_of_its_faces(lab):
    """x before y before z, in the walk as where cells are asked for."""
    triangle = np.array([[[-3.0, -3, -2], [3, -3, -2], [0, 4, -2]]])
    scene = Scene.from_triangles(triangle, "one", lights=point_lights((0.0, 0.0, 0.0)))
    for text in ("", "division=uniform,cells=3"):
        structure = built(lab, LIGHT_BUFFER, scene, text)
        ways = np.array([way for way in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
        rays = Rays.from_arrays(ways, -ways, 1.0, queries=ANY, classes=1, class_names=CLASS_NAMES,
                                targets=0)  # fmt: skip
        for index, way in enumerate(ways):
            cell = structure.record(rays, index).cell[0]
            axis = int(np.abs(way).argmax())
            assert cell == structure.cell_of(0, way)
            assert structure.squares.face[cell] == 2 * axis + (way[axis] < 0.0)


def test_a_place_on_the_border_belongs_to_one_cell(lab):
    scene = lit(lab.small_scene("suzanne"))
    lists = built(lab, LIGHT_BUFFER, scene, "division=uniform,cells=7").lists
    for u, v in itertools.product((-1.0 - 1e-13, -1.0, 0.0, 1.0, 1.0 + 1e-13), repeat=2):
        assert 0 <= cell_at(lists, 2, u, v) - 2 * 49 < 49
    assert faces_of(np.zeros((1, 3)), np.eye(3)[None], np.zeros(1, bool)).spread[0] > np.sqrt(3.0)
