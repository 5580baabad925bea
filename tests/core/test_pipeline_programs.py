"""Programs that ship: compiled as in plain Python, through every structure, on any threads."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
from accelscope.core import kernels
from accelscope.core.geometry.instances import instanced
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.kernels import has_numba
from accelscope.core.pipeline.launch import Pipeline
from accelscope.core.pipeline.loading import program_from, program_named, program_names, source_of
from accelscope.core.pipeline.stage import STAGE_NAMES
from accelscope.core.scene import Scene, point_lights
from accelscope.core.scene.camera_rays import camera_rays, framing_camera
from accelscope.core.settings import parse, parse_spec
from accelscope.core.structures import structure_named
from accelscope.sample_scenes import make_sample

SIZE = 12

PROCEDURAL = {"spheres", "torus"}

STRUCTURES = ("naive", "bvh", "kdtree", "grid")
TWO_LEVELS = (
    "two_level", "two_level:rebraid=partial", "two_level:blas=grid", "two_level:shared=false",
)  # fmt: skip


def scene_for(name):
    """A small scene that a program has something to show of."""
    return make_sample("balls:size=1" if name in PROCEDURAL else "soup:count=40,edge=0.4")


def crowd():
    """Instances of two meshes, turned, stretched and masked."""
    rng = np.random.default_rng(5)
    meshes = [all_triangles(rng.normal(size=(12, 1, 3)) + 0.6 * rng.normal(size=(12, 3, 3)))
              for _ in range(2)]  # fmt: skip
    matrices = np.array([
        np.column_stack([np.linalg.qr(turn)[0] * rng.uniform(0.5, 1.5, 3), place])
        for turn, place in zip(rng.normal(size=(9, 3, 3)), rng.normal(size=(9, 3)) * 4.0)
    ])  # fmt: skip
    masks = np.array([1, 2, 4, 3, 5, 6, 7, 255, 0])
    # Programs with two classes of rays have two hit groups for each geometry.
    hit_groups = 2 * rng.integers(0, 3, 9)
    return Scene.from_instances(
        instanced(meshes, rng.integers(0, 2, 9), matrices, masks, hit_groups=hit_groups),
        "crowd",
    )


def build(scene, spec):
    name, texts = parse_spec(spec)
    kind = structure_named(name)
    return kind.build(scene, parse(kind.Settings, texts, spec))


def rays_of(scene, size):
    return camera_rays(scene.camera or framing_camera(scene, 1.0), size, size)


def launch(scene, name, structure="bvh", size=SIZE, threads=1, plain=False):
    made = Pipeline(build(scene, structure), program_named(name))
    with kernels.plain(plain):
        return made.launch(rays_of(scene, size), size, size, threads=threads)


@pytest.mark.parametrize("over", ["items", "instances"])
@pytest.mark.parametrize("name", program_names())
def test_every_structure_gives_the_same_picture(name, over):
    if over == "instances" and name in PROCEDURAL:
        pytest.skip("instances of solids are like those of triangles")
    scene = crowd() if over == "instances" else scene_for(name)
    structures = (*STRUCTURES, *TWO_LEVELS) if over == "instances" else STRUCTURES
    pictures = {each: launch(scene, name, each, plain=True) for each in structures}
    first = pictures["naive"]
    assert first.totals["closest_hit"] > 0
    for each, picture in pictures.items():
        np.testing.assert_array_equal(picture.colours, first.colours, err_msg=each)
        # In which order candidates come, and so how many are asked, is a matter of the structure.
        for stage in ("ray_generation", "trace_ray", "closest_hit", "miss"):
            assert picture.totals[stage] == first.totals[stage], (each, stage)


@pytest.mark.skipif(not has_numba(), reason="nothing is compiled")
@pytest.mark.parametrize("name", program_names())
def test_compiled_shaders_do_what_plain_python_does(name):
    scenes = [scene_for(name)] + ([] if name in PROCEDURAL else [crowd()])
    for scene in scenes:
        plainly, compiled = (launch(scene, name, plain=plain) for plain in (True, False))
        np.testing.assert_array_equal(compiled.colours, plainly.colours)
        np.testing.assert_array_equal(compiled.calls, plainly.calls)
        assert compiled.by_type == plainly.by_type


@pytest.mark.parametrize("name", ["leaves", "mirror"])
def test_threads_change_nothing(name):
    scene = scene_for(name)
    alone, *others = (launch(scene, name, size=64, threads=threads) for threads in (1, 2, 8))
    for other in others:
        np.testing.assert_array_equal(other.colours, alone.colours)
        np.testing.assert_array_equal(other.calls, alone.calls)
        assert other.by_type == alone.by_type


@pytest.mark.parametrize("structure", ["naive", "bvh"])
def test_the_lectures_picture_is_the_barycentrics_of_naive_hits(structure):
    """The edge functions of Woop, Benthin and Wald over their sum, here in NumPy."""
    scene = make_sample("suzanne:subdivisions=1")
    rays = rays_of(scene, 96)
    hits, _ = build(scene, "naive").trace(rays)
    hit = np.flatnonzero(hits.primitive >= 0)
    assert len(hit) > 1000
    o, d = rays.origins[hit], rays.directions[hit]
    kz = np.zeros(len(hit), int)
    for axis in (1, 2):
        rows = np.arange(len(hit))
        kz = np.where(np.abs(d[rows, axis]) > np.abs(d[rows, kz]), axis, kz)
    rows, kx, ky = np.arange(len(hit)), (kz + 1) % 3, (kz + 2) % 3
    shear_x, shear_y = d[rows, kx] / d[rows, kz], d[rows, ky] / d[rows, kz]
    corners = scene.triangles[hits.primitive[hit]]
    x, y = np.empty((3, len(hit))), np.empty((3, len(hit)))
    for corner in range(3):
        z = corners[rows, corner, kz] - o[rows, kz]
        x[corner] = corners[rows, corner, kx] - o[rows, kx] - shear_x * z
        y[corner] = corners[rows, corner, ky] - o[rows, ky] - shear_y * z
    u, v, w = x[2] * y[1] - x[1] * y[2], x[0] * y[2] - x[2] * y[0], x[1] * y[0] - x[0] * y[1]
    second, third = v / (u + v + w), w / (u + v + w)
    expected = np.zeros((96 * 96, 4))
    expected[hit] = np.stack([second, third, 1.0 - second - third, np.ones(len(hit))], axis=1)
    picture = launch(scene, "lecture", structure, size=96)
    np.testing.assert_array_equal(picture.colours.reshape(-1, 4), expected)
    assert picture.totals == dict.fromkeys(STAGE_NAMES, 0) | {
        "ray_generation": 96 * 96, "trace_ray": 96 * 96, "closest_hit": len(hit),
    }  # fmt: skip


@pytest.mark.parametrize("name", ["shadows", "mirror", "leaves", "spheres"])
def test_states_of_a_pixel_are_what_was_counted_for_it(name):
    scene = scene_for(name)
    made = Pipeline(build(scene, "bvh"), program_named(name))
    rays = rays_of(scene, SIZE)
    launched = made.launch(rays, SIZE, SIZE)
    busiest = np.argsort(-launched.calls.sum(axis=2).ravel())[:5]
    for pixel in busiest.tolist():
        states, _ = made.record(rays, SIZE, SIZE, pixel)
        told = [sum(state.name == stage for state in states) for stage in STAGE_NAMES]
        assert told == launched.calls.reshape(-1, len(STAGE_NAMES))[pixel].tolist()
        assert states[0].name == "ray_generation"
        assert max(state.depth for state in states) <= made.program.max_recursion_depth


def test_shadow_rays_between_two_plates_have_closed_forms():
    """A small plate above a large one, lit from straight above: every pixel's calls are known."""
    plate = np.array([[[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]]])
    corners = np.concatenate([10.0 * plate, plate + np.array([0.0, 0.0, 1.0])])
    scene = Scene.from_triangles(corners, "plates")
    scene = dataclasses.replace(scene, lights=point_lights((0.0, 0.0, 4.0)))
    n = 20
    x, y = (grid.ravel() for grid in np.meshgrid(np.arange(n) - 9.5, np.arange(n) - 9.5))
    # From below the small plate, so that only the large one is seen.
    origins = np.stack([x / 4.0, y / 4.0, np.full(n * n, 0.5)], axis=1)
    rays = Rays.from_arrays(origins, np.tile([0.0, 0.0, -1.0], (n * n, 1)))
    launched = Pipeline(build(scene, "bvh"), program_named("shadows")).launch(rays, n, n)
    # The shadow is 4/3 as large as the plate: half its side is 4/3.
    is_dark = (np.abs(x / 4.0) < 4.0 / 3.0) & (np.abs(y / 4.0) < 4.0 / 3.0)
    calls = launched.calls.reshape(-1, len(STAGE_NAMES))
    counts = dict(zip(STAGE_NAMES, calls.T))
    np.testing.assert_array_equal(counts["trace_ray"], 2)
    np.testing.assert_array_equal(counts["closest_hit"], 1)
    np.testing.assert_array_equal(counts["miss"], ~is_dark)
    assert launched.by_type["shadow"]["miss"] == (~is_dark).sum()


def test_parallel_mirrors_are_as_deep_as_they_may_be():
    """A ray between two mirrors never leaves: six rays, each of which hits."""
    plate = np.array([[[-9, -9, 0], [9, -9, 0], [0, 9, 0]]], float)
    scene = Scene.from_triangles(
        np.concatenate([plate, plate + np.array([0.0, 0.0, 2.0])]), "mirrors"
    )
    rays = Rays.from_arrays(np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, -1.0]]))
    launched = Pipeline(build(scene, "bvh"), program_named("mirror")).launch(rays, 1, 1)
    assert launched.by_type["primary"]["trace_ray"] == 1
    assert launched.by_type["reflected"]["trace_ray"] == 5
    assert launched.totals["closest_hit"] == 6
    assert launched.totals["miss"] == 0


def test_procedural_spheres_are_where_the_built_in_ones_are():
    scene = make_sample("balls:size=1")
    rays = rays_of(scene, 48)
    hits, _ = build(scene, "bvh").trace(rays)
    is_ball = hits.primitive >= 0
    is_ball[is_ball] = scene.geometry.kinds[hits.primitive[is_ball]] == 3
    launched = launch(scene, "spheres", size=48)
    assert launched.totals["closest_hit"] == is_ball.sum() + 0


# --------------------------------------------------------------------------------- bad programs


def test_a_copy_of_a_program_is_one():
    program = program_from(source_of("shadows"), "mine.py")
    scene = scene_for("shadows")
    pictures = [
        Pipeline(build(scene, "bvh"), each).launch(rays_of(scene, 4), 4, 4).colours
        for each in (program, program_named("shadows"))
    ]
    np.testing.assert_array_equal(*pictures)


@pytest.mark.skipif(not has_numba(), reason="nothing is compiled")
def test_what_is_compiled_is_found_again_by_the_next_process(tmp_path):
    """Calls by address, and recursion through them, in two processes over one cache."""
    code = f"""
import sys
sys.path[:0] = {sys.path!r}
from pathlib import Path
from accelscope.core import kernel_cache
kernel_cache.set_cache_root(Path({str(tmp_path)!r}))
import numba.core.event as event
class Heard(event.Listener):
    count = 0
    def on_start(self, event): Heard.count += 1
    def on_end(self, event): pass
event.register("numba:compile", Heard())
sys.path.insert(0, {str(__file__.rpartition("/")[0])!r})
import accelscope.core.structures.bvh.forest
import test_pipeline_programs as tests
made = tests.launch(tests.crowd(), "mirror", "naive")
print(made.totals["closest_hit"], made.colours.sum(), Heard.count > 0)
"""
    told = [
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        for _ in range(2)
    ]
    assert not any(each.returncode for each in told), told[0].stderr
    first, second = (each.stdout.split() for each in told)
    assert first[:2] == second[:2]
    assert (first[2], second[2]) == ("True", "False")
