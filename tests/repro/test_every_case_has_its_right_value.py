"""The cases of the folder beside this file, each through the command line.

What is right follows from the formats' specifications, from Blender's own importers or from exact
arithmetic; `cases/README.md` says so for each. Faults of the same kinds have files of their own.
"""

import json

import numpy as np
import pytest
from accelscope.core.files import load_mesh_file
from accelscope.core.settings import parse
from accelscope.core.structures import general_structures, structures
from accelscope.core.structures.octree import DUPLICATION

FAR_CELLS = "bvh:volume=kdop26,arity=4,optimise=reinsert,max_leaf_size=20,C_trav=10"
SUBNORMAL = "macro_grid:rule=regular,density=0.1,regions=octant"


def area_of(triangles):
    """Return the sum of the areas of (n, 3, 3) corners."""
    edges = triangles[:, 1:] - triangles[:, :1]
    return 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum()


# File, number of triangles, lower and upper corner of the box around them.
READ = [
    ("obj_negative_blocks.obj", 6, (0, 0, 0), (3, 2.5, 2)),
    ("polygon_concave.obj", 4, (0, 0, 0), (3, 3, 0)),
    ("obj_quads.obj", 6, (0, 0, 0), (1, 1, 2)),
    ("obj_tab.obj", 2, (0, 0, 0), (1, 1, 5)),
    ("obj_bom.obj", 1, (0, 0, 0), (1, 1, 0)),
    ("obj_mixed_faces.obj", 5, (-2, -2, 0), (2, 2, 0)),
    ("obj_comment.obj", 1, (0, 0, 0), (1, 1, 0)),
    ("gltf_sparse.gltf", None, None, (None, 7, None)),
    ("gltf_fan.gltf", 3, None, None),
    ("gltf_normalized.gltf", None, (0, 0, 0), (1, 1, None)),
    ("gltf_instancing.gltf", 3, None, None),
    ("gltf_percent.gltf", 1, None, None),
    ("gltf_morph.gltf", None, None, (None, 3, None)),
    ("off_joined.off", 2, (0, 0, 0), (1, 1, 5)),
    ("ply_tristrips.ply", 2, (0, 0, 0), (1, 1, 0)),
]


@pytest.mark.parametrize(("file", "count", "lower", "upper"), READ, ids=[row[0] for row in READ])
def test_a_file_is_read(cases, file, count, lower, upper):
    scene = load_mesh_file(cases / file)
    if count is not None:
        assert len(scene) == count
    for right, found in ((lower, scene.lower), (upper, scene.upper)):
        for want, got in zip(right or (), found, strict=False):
            assert want is None or got == want


def test_the_concave_polygon_has_its_area(cases):
    scene = load_mesh_file(cases / "polygon_concave.obj")
    assert area_of(scene.triangles) == pytest.approx(5.0, abs=1e-12)


# File, what its one line has to name.
REFUSED = [
    ("gltf_unknown_required.gltf", "it requires ACME_geometry_made_of_soup, which is not"),
    ("stl_cut.stl", "stl_cut.stl cannot be read: it ends inside the solid that begins in line 10"),
]


@pytest.mark.parametrize(("file", "named"), REFUSED, ids=[row[0] for row in REFUSED])
def test_a_file_is_refused(cases, refused, file, named):
    line = refused(
        "evaluate", cases / file, "--structure", "naive", "--rays", "random_lines:count=10"
    )
    assert named in line


def hits_of(run, folder, scene, structure, rays):
    """Return t and primitive of every ray, as the command line writes them."""
    path = folder / "hits.npz"
    outcome = run(
        "evaluate", scene, "--structure", structure, "--rays", rays, "--hits", path, "--quiet"
    )
    assert (outcome.code, outcome.err) == (0, "")
    with np.load(path) as arrays:
        return arrays["t"], arrays["primitive"]


@pytest.mark.parametrize("structure", general_structures())
def test_rays_of_the_cases(run, cases, tmp_path, structure):
    def hits(name):
        rays = f"file:path={cases / name}_rays.npz"
        return hits_of(run, tmp_path, cases / f"{name}.obj", structure, rays)

    t, _ = hits("obj_negative_blocks")
    assert t.tolist() == [1.0, 1.5, 1.5]
    _, primitive = hits("obj_quads")
    assert primitive.tolist() == [0, 2, 4]
    t, primitive = hits("polygon_concave")
    assert (primitive >= 0).tolist() == [True, True, True, False, False]
    t, primitive = hits_of(
        run, tmp_path, cases / "needle.off", structure, f"file:path={cases / 'needle_ray.npz'}"
    )
    assert primitive.tolist() == [-1]


def test_the_rotated_cone_is_an_ordinary_octree(run, cases):
    outcome = run(
        "evaluate", cases / "cone_rotated.obj", "--structure", "all",
        "--rays", "random_lines:count=200", "--json", "-", "--quiet",
    )  # fmt: skip
    assert (outcome.code, outcome.err) == (0, "")
    records = {record["structure"]["name"]: record for record in outcome.records}
    assert set(records) == set(general_structures())
    assert records["octree"]["statistics"]["duplication"] <= DUPLICATION


def test_pictures_of_far_cells(run, cases, tmp_path):
    outcome = run(
        "evaluate", cases / "far_cells.off", "--structure", FAR_CELLS,
        "--rays", "random_lines:count=100", "--pictures", tmp_path, "--quiet",
    )  # fmt: skip
    assert (outcome.code, outcome.err) == (0, "")
    assert list(tmp_path.glob("*.png"))


def test_hits_with_a_subnormal_axis_are_those_of_naive(run, cases, tmp_path):
    scene = cases / "subnormal_axis.off"
    rays = f"file:path={cases / 'subnormal_axis_rays.npz'}"
    found = {}
    for structure in (*general_structures(), SUBNORMAL, "macro_grid:resolution=16x16x16"):
        path = tmp_path / "hits.npz"
        outcome = run(
            "evaluate", scene, "--structure", structure, "--rays", rays, "--hits", path, "--quiet"
        )
        assert (outcome.code, outcome.err) == (0, "")
        with np.load(path) as arrays:
            found[structure] = arrays["t"].tobytes(), arrays["primitive"].tobytes()
            assert (arrays["primitive"] >= 0).any()
    assert set(found.values()) == {found["naive"]}


# Every structure, and the hierarchy with every volume.
LARGE = [
    *general_structures(),
    *(
        f"bvh:volume={volume}"
        for volume in parse(structures()["bvh"].Settings, {}, "bvh")
        .__dataclass_fields__["volume"]
        .metadata["choices"]
    ),
]


@pytest.mark.parametrize("structure", LARGE)
def test_figures_of_a_scene_of_1e90(run, cases, structure):
    outcome = run(
        "evaluate", cases / "big_1e90.off", "--structure", structure,
        "--rays", "random_lines:count=100", "--json", "-", "--quiet",
    )  # fmt: skip
    assert (outcome.code, outcome.err) == (0, "")
    (record,) = json.loads(outcome.out)["records"]
    figures = record["statistics"]
    figure = "sah" if "sah" in figures else "mean_list"  # what has no cells in space has no areas
    assert 0.0 < figures[figure] < np.inf


# ------------------------------------------------------------------------------------ Blender's own


def test_an_invalid_mesh_is_named(addon, cases, run):
    outcome = run(
        "evaluate", cases / "invalid_mesh.blend", "--structure", "bvh",
        "--rays", "random_lines:count=10",
    )  # fmt: skip
    assert (outcome.code, outcome.out) == (2, "")
    # Blender 4.5 adds a line of its own: the file is of a newer Blender.
    (line,) = [line for line in outcome.err.splitlines() if not line.startswith("Warning: File ")]
    assert line.startswith(
        "accelscope: error: the mesh of bad is invalid: a face names vertex 7 of 3; repair it"
    )


def test_a_missing_library_is_said(addon, cases, run):
    outcome = run(
        "evaluate", cases / "missing_library.blend", "--structure", "bvh",
        "--rays", "random_lines:count=10", "--json", "-",
    )  # fmt: skip
    assert outcome.code == 0
    (record,) = outcome.records
    said = (
        "the linked library //lib.blend cannot be read, so that these are left out: Object libtri"
    )
    assert record["scene"]["triangles"] == 1
    assert record["scene"]["notes"] == [said]
    assert f"accelscope: missing_library: {said}\n" in outcome.err
