"""Meshes in several places stay one: what is read either way is the same to a ray."""

import base64
import json
import os
import subprocess
import sys

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.records.experiment import build, describe_scene
from accelscope.core.files import load_mesh_file
from accelscope.core.geometry.geometry import normals_at
from accelscope.core.geometry.instances import Instanced, inverted, owners_of
from accelscope.core.geometry.rays import Rays
from accelscope.core.scene.placing import FLATTEN, KEEP, Mesh, PlacedMesh, scene_of
from accelscope.core.settings import parse
from accelscope.core.structures import structure_named

ROUNDINGS = 64
"""In how many roundings of the largest number on its way a hit may differ from one in world space.

A point of the ray is moved by a matrix and the triangle met there: some ten roundings each, of
numbers as large as the way to the scene and the scene itself, seen through the matrix and back."""


def blob(count=40, seed=0):
    """Return a mesh of triangles all about a cube."""
    random = np.random.default_rng(seed)
    vertices = random.uniform(-1, 1, (count, 3))
    corners = np.concatenate([random.permutation(count) for _ in range(2)])
    return Mesh(vertices, corners[: len(corners) // 3 * 3].reshape(-1, 3))


def placed(matrix=None, move=(0, 0, 0)):
    """Return a matrix, (4, 4)."""
    whole = np.eye(4)
    whole[:3, :3] = np.eye(3) if matrix is None else matrix
    whole[:3, 3] = move
    return whole


def turned(seed):
    """Return a rotation."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def rays_at(scene, count=600, seed=3):
    """Return rays from around a scene of triangles to points of theirs."""
    random = np.random.default_rng(seed)
    size = max(scene.diagonal, 1e-300)
    middle = 0.5 * (scene.lower + scene.upper)
    origins = random.normal(size=(count, 3))
    origins = middle + size * origins / np.linalg.norm(origins, axis=1, keepdims=True)
    shares = random.dirichlet((1, 1, 1), count)[:, :, None]
    targets = (scene.triangles[random.integers(len(scene), size=count)] * shares).sum(axis=1)
    return Rays.from_arrays(origins, (targets - origins) / size)


def built(scene, spec="bvh"):
    kind = structure_named(spec.partition(":")[0])
    texts = dict(part.split("=") for part in spec.partition(":")[2].split(",") if part)
    return build(scene, kind, parse(kind.Settings, texts, spec)).structure


def assert_same_hits(kept, flat, rays=None, worst=1.0):
    """Compare two scenes, the same but for their instances, by what rays hit.

    Parameters
    ----------
    worst : float
        By how much the worst of the matrices enlarges roundings: its condition number.
    """
    assert isinstance(kept.geometry, Instanced)
    assert not isinstance(flat.geometry, Instanced)
    rays = rays_at(flat) if rays is None else rays
    (near, _), (far, _) = built(kept).trace(rays), built(flat).trace(rays)
    exact, _ = built(kept, "naive").trace(rays)
    assert np.array_equal(near.t, exact.t)
    assert np.array_equal(near.primitive, exact.primitive)
    hit = far.primitive >= 0
    assert hit.mean() > 0.1
    length = np.linalg.norm(rays.directions, axis=1)
    reach = np.abs(rays.origins).max() + np.abs([flat.lower, flat.upper]).max()
    slack = ROUNDINGS * np.finfo(float).eps * worst * reach / length
    both = hit & (near.primitive >= 0)
    # Beside an edge one may be hit and the other not.
    assert (hit == both).mean() > 0.995
    assert (near.primitive >= 0).sum() - both.sum() <= 0.005 * len(rays)
    same = near.primitive[both] == far.primitive[both]
    assert same.mean() > 0.995
    # Seen edge-on a triangle's t is as uncertain as it is slanting.
    points = rays.origins[both] + far.t[both, None] * rays.directions[both]
    normals = normals_at(flat.geometry, far.primitive[both], points, rays.times[both])
    slant = np.abs((normals * rays.directions[both]).sum(axis=1)) / length[both]
    apart = np.abs(near.t[both] - far.t[both]) * np.maximum(slant, 1e-3)
    assert (apart <= slack[both])[same].all()


# ------------------------------------------------------------------------------------- matrices

SHEAR = np.array([[1, 0.7, -0.3], [0, 1, 0.5], [0, 0, 1]])


@pytest.mark.parametrize(
    "matrices",
    [
        [placed(turned(1), (3, 0, 0)), placed(turned(2), (-3, 1, 0)), placed(move=(0, 4, 2))],
        [placed(np.diag([-1, 1, 1])), placed(-turned(3), (2.5, 0, 0))],
        [placed(SHEAR @ turned(4)), placed(SHEAR.T, (0, 3, 0))],
        [placed(1e-6 * turned(5)), placed(1e-6 * np.eye(3), (1e-6, 2e-6, 0))],
        [placed(1e6 * turned(6)), placed(1e6 * SHEAR, (3e6, 0, 0))],
        [placed(np.diag([1e3, 1.0, 1e-3])), placed(np.diag([1e-3, 1e3, 1.0]), (0, 1, 0))],
    ],
    ids=["turned", "mirrored", "sheared", "tiny", "huge", "stretched"],
)
def test_matrices_of_every_kind(matrices):
    mesh = blob()
    objects = [PlacedMesh(str(k), mesh, matrix) for k, matrix in enumerate(matrices)]
    kept, flat = (scene_of(objects, how, "m") for how in (KEEP, FLATTEN))
    conditions = [np.linalg.cond(matrix[:3, :3]) for matrix in matrices]
    assert_same_hits(kept, flat, worst=max(conditions))
    assert describe_scene(kept)["instances"] == {
        "count": len(matrices), "meshes": 1, "triangles": len(mesh.triangles)
    }  # fmt: skip
    assert describe_scene(kept)["triangles"] == describe_scene(flat)["triangles"]
    assert np.allclose(
        kept.flat().triangles, flat.triangles, rtol=1e-14, atol=1e-14 * flat.diagonal
    )


def test_numbers_and_names_are_those_of_the_flattened_scene():
    """What is in one place only stands in world space, between the others."""
    shared, single, other = blob(), blob(21, 1), blob(30, 2)
    objects = [
        PlacedMesh("a", single, placed(turned(1), (5, 0, 0))),
        PlacedMesh("b", shared, placed(turned(2))),
        PlacedMesh("c", other, placed(2 * turned(3), (0, 5, 0))),
        PlacedMesh("d", shared, placed(move=(0, -4, 0))),
        PlacedMesh("nothing", Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)), placed()),
    ]  # fmt: skip
    kept, flat = (scene_of(objects, how, "m") for how in (KEEP, FLATTEN))
    assert_same_hits(kept, flat)
    assert kept.object_names == flat.object_names == ("a", "b", "c", "d", "nothing")
    assert np.array_equal(kept.flat().object_ids, flat.object_ids)
    for primitive in range(len(flat)):
        name, within = kept.object_of(primitive)
        assert name == flat.object_of(primitive)[0]
        assert within == primitive - np.flatnonzero(flat.object_ids == "abcd".index(name))[0]
    assert kept.geometry.which.tolist() == [0, 1, 2, 1]
    own = kept.geometry.meshes[0].corners
    assert np.array_equal(own, flat.triangles[: len(own)])
    assert np.array_equal(kept.geometry.matrices[0], np.eye(3, 4))


def test_what_follows_each_other_in_world_space_is_one_mesh():
    """So it has one tree, as it had; what is between instances stays between them."""
    shared = blob()
    alone = [PlacedMesh(f"a{k}", blob(15, k), placed(turned(k), (k, 0, 0))) for k in range(7)]
    objects = [
        *alone[:3], PlacedMesh("b", shared, placed()), *alone[3:6],
        PlacedMesh("c", shared, placed(move=(0, 4, 0))), alone[6],
    ]  # fmt: skip
    kept, flat = (scene_of(objects, how, "m") for how in (KEEP, FLATTEN))
    assert_same_hits(kept, flat)
    assert kept.geometry.which.tolist() == [0, 1, 2, 1, 3]
    assert np.array_equal(kept.flat().object_ids, flat.object_ids)
    assert np.array_equal(kept.geometry.meshes[2].corners, flat.triangles[56:86])
    names = [kept.object_of(primitive)[0] for primitive in range(len(flat))]
    assert names == [flat.object_of(primitive)[0] for primitive in range(len(flat))]


def test_flat_instances_stand_in_world_space():
    """No ray can be moved into a mesh through a singular matrix, but it hits what that makes."""
    mesh = blob()
    onto_plane = turned(1) @ np.diag([1.0, 1.0, 0.0]) @ turned(2)
    objects = [
        PlacedMesh("whole", mesh, placed(move=(0, 0, 5))),
        PlacedMesh("flat", mesh, placed(onto_plane)),
        PlacedMesh("gone", mesh, placed(np.zeros((3, 3)))),
        PlacedMesh("again", mesh, placed(move=(4, 0, 0))),
    ]  # fmt: skip
    kept, flat = (scene_of(objects, how, "m") for how in (KEEP, FLATTEN))
    assert inverted(kept.geometry.matrices)[1].tolist() == [False, False, True, False]
    assert kept.geometry.which.tolist() == [0, 1, 0, 0]
    starts = np.random.default_rng(1).uniform((-2, -2, 20), (5, 2, 20), (800, 3))
    down = Rays.from_arrays(starts, np.tile([0.02, 0.01, -1.0], (800, 1)))
    assert_same_hits(kept, flat, down)
    found = built(kept).trace(down)[0].primitive
    owners, _ = owners_of(kept.geometry, found[found >= 0])
    assert set(owners.tolist()) == {0, 1, 3}


def test_an_object_in_a_point_is_no_reason_to_flatten():
    mesh = blob()
    objects = [
        PlacedMesh("a", mesh, placed()), PlacedMesh("b", mesh, placed(move=(4, 0, 0))),
        PlacedMesh("point", blob(9, 4), placed(np.zeros((3, 3)), (0, 0, 9))),
    ]  # fmt: skip
    kept, flat = (scene_of(objects, how, "m") for how in (KEEP, FLATTEN))
    assert kept.notes == ()
    assert_same_hits(kept, flat)


# ----------------------------------------------------------------------------- what is not kept


def test_meshes_in_one_place_each_are_triangles_as_before():
    objects = [PlacedMesh(str(k), blob(seed=k), placed(turned(k))) for k in range(3)]
    kept, flat = (scene_of(objects, how, "m") for how in (KEEP, FLATTEN))
    assert np.array_equal(kept.triangles, flat.triangles)
    assert "instances" not in describe_scene(kept)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e101])
@pytest.mark.parametrize("where", ["mesh", "matrix"])
def test_where_triangles_are_dropped_instances_are_flattened_and_that_is_said(bad, where):
    mesh, last = blob(), placed(move=(5, 0, 0))
    if where == "mesh":
        mesh.vertices[mesh.triangles[3, 1]] = bad
    else:
        last[0, 3] = bad
    objects = [PlacedMesh("a", mesh, placed()), PlacedMesh("b", mesh, last)]
    kept, flat = (scene_of(objects, how, "m") for how in (KEEP, FLATTEN))
    assert np.array_equal(kept.triangles, flat.triangles)
    assert kept.dropped == flat.dropped > 0
    assert kept.notes == ("its instances are flattened, for some cannot be computed with in place",)


def test_nothing_to_hit_is_refused_alike():
    mesh = blob()
    for scale in (0.0, 1e-200):
        objects = [PlacedMesh(str(k), mesh, placed(scale * np.eye(3))) for k in range(2)]
        said = []
        for how in (KEEP, FLATTEN):
            with pytest.raises(InputError) as caught:
                scene_of(objects, how, "m")
            said.append(str(caught.value))
        assert said[0] == said[1]


# ------------------------------------------------------------------------------------------ glTF


def gltf(path, meshes, nodes, instancing=None, roots=None):
    """Write a glTF file; `instancing` are translations and scales at the last node."""
    data, views, accessors = b"", [], []

    def accessor(values, kind, component):
        nonlocal data
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes})
        data += values.tobytes()
        accessors.append({"bufferView": len(views) - 1, "componentType": component,
                          "count": len(values), "type": kind})  # fmt: skip
        return len(accessors) - 1

    entries = [
        {"primitives": [
            {"attributes": {"POSITION": accessor(part.vertices.astype("<f4"), "VEC3", 5126)},
             "indices": accessor(part.triangles.astype("<u4").ravel(), "SCALAR", 5125)}
            for part in parts]}
        for parts in meshes
    ]  # fmt: skip
    if instancing is not None:
        moves, scales = (accessor(np.asarray(v, "<f4"), "VEC3", 5126) for v in instancing)
        attributes = {"TRANSLATION": moves, "SCALE": scales}
        nodes[-1]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    roots = list(range(len(nodes))) if roots is None else roots
    root = {"asset": {"version": "2.0"}, "meshes": entries, "accessors": accessors,
            "bufferViews": views, "buffers": [{"uri": uri, "byteLength": len(data)}],
            "nodes": nodes, "scenes": [{"nodes": roots}], "scene": 0}  # fmt: skip
    path.write_text(json.dumps(root))
    return path


@pytest.fixture
def forest(tmp_path):
    """Two meshes, one of two primitives, at nodes within nodes, mirrored, and instanced."""
    nodes = [
        {"mesh": 0, "name": "tree", "scale": [2, 1, -1], "children": [1]},
        {"mesh": 0, "name": "child", "translation": [4, 0, 0], "rotation": [0, 0, 0.6, 0.8]},
        {"mesh": 1, "name": "stone", "translation": [0, 6, 0]},
        {"mesh": 0, "name": "wood", "translation": [0, -9, 0]},
    ]
    moves = [[3 * k, 0, k] for k in range(4)]
    scales = [[1, 1, 1], [0.5, 2, 1], [-1, 1, 1], [0.1, 0.1, 0.1]]
    meshes = [[blob(), blob(30, 1)], [blob(21, 2)]]
    return gltf(tmp_path / "forest.gltf", meshes, nodes, (moves, scales), [0, 2, 3])


def test_nodes_stay_instances(forest):
    kept, flat = load_mesh_file(forest), load_mesh_file(forest, FLATTEN)
    assert_same_hits(kept, flat, worst=20)
    assert kept.object_names == flat.object_names
    assert kept.object_names[:6] == ("tree/0", "tree/1", "child/0", "child/1", "stone", "wood/0/0")
    # Per primitive: that of the tree is at two nodes and four instances.
    assert kept.geometry.which.tolist() == [0, 1, 0, 1, 2, *[0, 1] * 4]
    assert kept.notes == flat.notes == ()


def test_the_command_line_keeps_and_flattens(forest, capsys):
    from accelscope.addon.command.main import main

    def run(*options):
        code = main(["evaluate", str(forest), "--rays", "random_lines:count=200", "--json", "-",
                     "--quiet", *options])  # fmt: skip
        out, err = capsys.readouterr()
        return code, json.loads(out)["records"] if out else [], err

    code, (kept,), _ = run()
    assert (code, kept["scene"]["instances"]["count"]) == (0, 13)
    code, (flat,), _ = run("--structure", "bsp", "--instances", "flatten")
    assert (code, "instances" in flat["scene"]) == (0, False)
    assert kept["scene"]["triangles"] == flat["scene"]["triangles"]
    assert abs(kept["trace"]["hits"] - flat["trace"]["hits"]) <= 1
    code, _, error = run("--structure", "bvh:builder=sbvh")
    assert code == 2
    assert "holds instances; choose --instances flatten" in error
    code, _, error = run("--instances", "melt")
    assert code == 2
    assert "'melt'" in error


# ----------------------------------------------------------------------------------- three levels

THREE_LEVELS = """
import numpy as np
from accelscope.core.geometry.instances import instanced
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh import BVH

random = np.random.default_rng(0)
level = all_triangles(random.random((30, 3, 3)))
for spread in (3.0, 10.0, 40.0):
    matrices = np.tile(np.eye(3, 4), (4, 1, 1))
    matrices[:, :, 3] = spread * random.random((4, 3))
    level = instanced([level], np.zeros(4, int), matrices)
scene = Scene.from_instances(level, "deep")
rays = Rays.from_arrays(np.full((500, 3), -9.0), random.random((500, 3)) + 0.1)
hits, _ = BVH.build(scene, BVH.Settings()).trace(rays)
print(hits.primitive.tolist(), hits.t.tolist())
"""


@pytest.mark.exhaustive  # a process that compiles, and one that finds it done: a minute
def test_three_levels_in_two_processes_over_one_cache(tmp_path):
    """What the first has compiled, the second loads: recursion in Numba has crashed there."""
    said = []
    for _ in range(2):
        environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
        done = subprocess.run(
            [sys.executable, "-c", THREE_LEVELS], capture_output=True, text=True, env=environment,
            check=False,
        )  # fmt: skip
        assert (done.returncode, done.stderr) == (0, "")
        said.append(done.stdout)
    assert said[0] == said[1]
    assert "inf" in said[0]
