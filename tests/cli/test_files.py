"""Mesh files: every kind gives its triangles in the order of the file, in world space."""

import base64
import json
import struct

import numpy as np
import pytest
from accelscope.core.files import load_mesh_file


def write_off(path, vertices, faces):
    lines = ["OFF", f"{len(vertices)} {len(faces)} 0"]
    lines += [" ".join(map(repr, map(float, v))) for v in vertices]
    lines += [" ".join(map(str, (len(f), *f))) for f in faces]
    path.write_text("\n".join(lines) + "\n")


def write_ply(path, vertices, faces):
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(map(repr, map(float, v))) for v in vertices]
    lines += [" ".join(map(str, (len(f), *f))) for f in faces]
    path.write_text("\n".join(lines) + "\n")


def write_ply_binary(path, vertices, faces):
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz")
    header += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    body = np.asarray(vertices, "<f8").tobytes()
    body += b"".join(struct.pack(f"<B{len(f)}i", len(f), *f) for f in faces)
    path.write_bytes(header.encode() + body)


def write_obj(path, vertices, faces):
    lines = ["v " + " ".join(map(repr, map(float, v))) for v in vertices]
    lines += ["f " + " ".join(str(i + 1) for i in f) for f in faces]
    path.write_text("\n".join(lines) + "\n")


def write_stl(path, vertices, faces):
    triangles = np.asarray(vertices)[np.array(faces)]
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *map(float, t.ravel()), 0) for t in triangles)
    path.write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + body)


def write_stl_ascii(path, vertices, faces):
    lines = ["solid s"]
    for face in faces:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(map(repr, map(float, vertices[i]))) for i in face]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid s"]) + "\n")


def gltf(meshes, nodes, *, embed):
    """Return a glTF document and its buffer for meshes of (vertices, faces)."""
    buffer, views, accessors, entries = b"", [], [], []
    for vertices, faces in meshes:
        v, f = np.asarray(vertices, "<f4"), np.asarray(faces, "<u4")
        for data, kind, component, count in (
            (v.tobytes(), "VEC3", 5126, len(v)), (f.tobytes(), "SCALAR", 5125, f.size),
        ):  # fmt: skip
            views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(data)})
            accessor = {"bufferView": len(views) - 1, "componentType": component, "count": count,
                        "type": kind}  # fmt: skip
            if kind == "VEC3":
                accessor |= {"min": v.min(0).tolist(), "max": v.max(0).tolist()}
            accessors.append(accessor)
            buffer += data
        entries.append(
            {"primitives": [{"attributes": {"POSITION": len(accessors) - 2},
                             "indices": len(accessors) - 1}]}
        )  # fmt: skip
    uri = "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "meshes": entries, "nodes": nodes,
        "scenes": [{"nodes": [i for i in range(len(nodes)) if not any(
            i in node.get("children", ()) for node in nodes)]}],
        "bufferViews": views, "accessors": accessors,
        "buffers": [{"byteLength": len(buffer)} | ({"uri": uri} if embed else {})],
    }  # fmt: skip
    return document, buffer


def write_glb(path, meshes, nodes):
    document, buffer = gltf(meshes, nodes, embed=False)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    buffer += bytes(-len(buffer) % 4)
    path.write_bytes(
        struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(buffer))
        + struct.pack("<I4s", len(text), b"JSON") + text
        + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    )  # fmt: skip


def write_simple_glb(path, vertices, faces):
    write_glb(path, [(vertices, faces)], [{"mesh": 0}])


def write_gltf(path, vertices, faces):
    document, _ = gltf([(vertices, faces)], [{"mesh": 0}], embed=True)
    path.write_text(json.dumps(document))


WRITERS = {
    "mesh.obj": write_obj,
    "mesh.OBJ": write_obj,
    "mesh.off": write_off,
    "mesh.ply": write_ply,
    "binary.ply": write_ply_binary,
    "mesh.stl": write_stl,
    "ascii.stl": write_stl_ascii,
    "mesh.glb": write_simple_glb,
    "mesh.gltf": write_gltf,
}


def shuffled_mesh(n=200):
    """Shared vertices, duplicate vertices, a duplicate face and unused vertices, in any order."""
    rng = np.random.default_rng(2)
    vertices = rng.integers(-512, 512, (90, 3)) / 64.0
    vertices[50:60] = vertices[20:30]
    faces = np.stack([rng.choice(80, 3, replace=False) for _ in range(n)])
    faces[77] = faces[12]
    return vertices, faces


@pytest.mark.parametrize("name", WRITERS)
def test_triangles_come_in_the_order_of_the_file(tmp_path, name):
    vertices, faces = shuffled_mesh()
    WRITERS[name](tmp_path / name, vertices, faces)
    scene = load_mesh_file(tmp_path / name)
    assert np.array_equal(scene.triangles, vertices[faces])
    assert scene.dropped == 0
    assert scene.source == str(tmp_path / name)


@pytest.mark.parametrize("name", ["mesh.obj", "mesh.off", "mesh.ply", "binary.ply"])
def test_polygons_are_cut_where_they_stand(tmp_path, name):
    """Quads and triangles mixed: face n's triangles come before those of face n + 1."""
    vertices = np.array(
        [[x, y, z] for z in range(4) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], float
    )
    faces = [(0, 1, 2, 3), (4, 5, 6), (8, 9, 10, 11), (12, 13, 14)]
    WRITERS[name](tmp_path / name, vertices, faces)
    scene = load_mesh_file(tmp_path / name)
    assert len(scene) == 6
    assert scene.triangles[:, 0, 2].tolist() == [0, 0, 1, 2, 2, 3]


def test_objects_of_one_obj_stay_in_order(tmp_path):
    lines, wanted = [], []
    for n, name in enumerate(["zebra", "ant", "monkey"]):
        lines.append(f"o {name}")
        for k in range(2):
            base = 10 * n + k
            corners = [[base, 0, 0], [base + 1, 0, 0], [base, 1, 0]]
            wanted.append(corners)
            lines += [f"v {x} {y} {z}" for x, y, z in corners]
        first = 6 * n + 1
        lines += [f"f {first} {first + 1} {first + 2}", f"f {first + 3} {first + 4} {first + 5}"]
    path = tmp_path / "many.obj"
    path.write_text("\n".join(lines))
    assert np.array_equal(load_mesh_file(path).triangles, np.array(wanted, float))


def test_materials_of_one_obj_do_not_change_the_order(tmp_path):
    lines = ["mtllib m.mtl"]
    for n in range(6):
        lines += [f"v {n} 0 0", f"v {n + 1} 0 0", f"v {n} 1 0"]
    for n in range(6):
        lines += [f"usemtl {'red' if n % 2 else 'blue'}", f"f {3 * n + 1} {3 * n + 2} {3 * n + 3}"]
    (tmp_path / "m.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n")
    path = tmp_path / "coloured.obj"
    path.write_text("\n".join(lines))
    assert load_mesh_file(path).triangles[:, 0, 0].tolist() == [0, 1, 2, 3, 4, 5]


def test_relative_indices_and_texture_coordinates_of_an_obj(tmp_path):
    path = tmp_path / "relative.obj"
    path.write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/1/1\n"
        "v 0 0 5\nv 1 0 5\nv 0 1 5\nf -3 -2 -1\n"
    )
    assert load_mesh_file(path).triangles[:, 0].tolist() == [[0, 0, 0], [0, 0, 5]]


def test_transforms_of_a_glb(tmp_path):
    """Nodes in order, nested, with translation, scale, rotation, a matrix; one mesh twice."""
    mesh = ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    other = ([[0, 0, 0], [0, 2, 0], [0, 0, 2]], [[0, 1, 2]])
    half = np.sqrt(0.5)
    nodes = [
        {"mesh": 0, "translation": [10, 0, 0]},
        {"mesh": 1, "scale": [2, 3, -4]},
        {"children": [3], "rotation": [0, 0, half, half]},
        {"mesh": 0, "translation": [1, 0, 0]},
        {"mesh": 0, "matrix": [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]},
    ]
    write_glb(tmp_path / "nodes.glb", [mesh, other], nodes)
    scene = load_mesh_file(tmp_path / "nodes.glb", "flatten")
    wanted = [
        [[10, 0, 0], [11, 0, 0], [10, 1, 0]],
        [[0, 0, 0], [0, 6, 0], [0, 0, -8]],
        [[0, 1, 0], [0, 2, 0], [-1, 1, 0]],
        [[5, 6, 7], [5, 7, 7], [4, 6, 7]],
    ]
    got = sorted(sorted(map(tuple, np.round(t, 5).tolist())) for t in scene.triangles)
    assert np.allclose(got, sorted(sorted(map(tuple, t)) for t in wanted), atol=1e-5)
    # Each corner keeps its place within the triangle, mirrored or not.
    order = [np.abs(scene.triangles - np.array(t, float)).sum(axis=(1, 2)).argmin() for t in wanted]
    assert order == [0, 1, 2, 3]


def test_hits_name_triangles_as_the_file_does(run, tmp_path):
    """With a triangle dropped, and another of no area, numbers stay those of the file."""
    path = tmp_path / "gap.obj"
    lines = []
    for n in range(5):
        z = "nan" if n == 1 else str(n)
        lines += [f"v {3 * n} 0 {z}", f"v {3 * n + 1} 0 {n}", f"v {3 * n} {0 if n == 3 else 1} {n}"]
        lines.append(f"f {3 * n + 1} {3 * n + 2} {3 * n + 3}")
    path.write_text("\n".join(lines) + "\n")
    rays = tmp_path / "rays.npz"
    origins = np.array([[3 * n + 0.25, 0.25, -1.0] for n in range(5)])
    np.savez(rays, origins=origins, directions=np.tile([0.0, 0, 1], (5, 1)))
    for structure in ("bvh", "grid", "naive"):
        hits = tmp_path / "hits.npz"
        outcome = run(
            "evaluate", path, "--structure", structure, "--rays", f"file:path={rays}",
            "--hits", hits, "--json", "-",
        )  # fmt: skip
        assert outcome.code == 0
        assert outcome.err == (
            "accelscope: gap: 1 triangles with NaN or infinite vertices are left out\n"
        )
        assert outcome.records[0]["scene"]["dropped_triangles"] == 1
        found = np.load(hits)
        assert found["primitive"].tolist() == [0, -1, 2, -1, 4]
        assert found["t"].tolist() == [1.0, np.inf, 3.0, np.inf, 5.0]


def test_rays_from_a_file(run, tmp_path, obj):
    rays, hits = tmp_path / "r.npz", tmp_path / "h.npz"
    np.savez(
        rays, origins=np.array([[0, 0, -1], [0, 0, -1], [0, 0, 9], [0, 0, -1]], np.float32),
        directions=[[0, 0, 2], [0, 0, 2], [0, 0, -1], [0, 0, 1]], t_max=[np.inf, 0.25, 8.5, 1.0],
        note="ignored",
    )  # fmt: skip
    outcome = run(
        "evaluate", obj(), "--structure", "bvh", "--rays", f"file:path={rays}", "--hits", hits,
        "--quiet",
    )  # fmt: skip
    assert (outcome.code, outcome.err) == (0, "")
    found = np.load(hits)
    assert found["t"].tolist() == [0.5, np.inf, 8.0, 1.0]
    assert found["primitive"].tolist() == [0, -1, 1, 0]
