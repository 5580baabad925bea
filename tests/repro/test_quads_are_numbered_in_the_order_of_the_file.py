"""Quad k gives triangles 2k and 2k + 1 in every format; OBJ gave all first halves first."""

import numpy as np
import pytest
from accelscope.core.files import load_mesh_file
from accelscope.core.geometry.rays import Rays
from accelscope.core.structures import structures


def test_obj(cases):
    scene = load_mesh_file(cases / "obj_quads.obj")
    arrays = np.load(cases / "obj_quads_rays.npz")
    naive = structures()["naive"]
    rays = Rays.from_arrays(arrays["origins"], arrays["directions"])
    hits, _ = naive.build(scene, naive.Settings()).trace(rays)
    assert hits.primitive.tolist() == [0, 2, 4]


@pytest.mark.parametrize("suffix", ["obj", "ply", "off"])
def test_quads_triangles_and_larger_mixed(tmp_path, suffix):
    """A face of n corners has height z; its n - 2 triangles stand where it does."""
    sizes = [4, 3, 6, 4, 4, 5, 3]
    vertices, faces = [], []
    for z, n in enumerate(sizes):
        faces.append(range(len(vertices), len(vertices) + n))
        angle = np.arange(n) * 2 * np.pi / n
        vertices += [(x, y, z) for x, y in zip(np.cos(angle), np.sin(angle))]
    path = tmp_path / f"m.{suffix}"
    numbers = [f"{x!r} {y!r} {z}" for x, y, z in np.array(vertices).tolist()]
    if suffix == "obj":
        lines = [f"v {text}" for text in numbers]
        lines += ["f " + " ".join(str(i + 1) for i in face) for face in faces]
    else:
        lines = ["OFF", f"{len(vertices)} {len(faces)} 0"]
        if suffix == "ply":
            lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
            lines += [f"property double {axis}" for axis in "xyz"]
            lines += [f"element face {len(faces)}", "property list uint8 int32 vertex_indices"]
            lines += ["end_header"]
        lines += numbers + [" ".join(map(str, (len(face), *face))) for face in faces]
    path.write_text("\n".join(lines))
    triangles = load_mesh_file(path).triangles
    wanted = [z for z, n in enumerate(sizes) for _ in range(n - 2)]
    assert triangles[:, 0, 2].tolist() == wanted
    assert (triangles[:, :, 2] == triangles[:, :1, 2]).all()
