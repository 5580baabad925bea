"""Bad input: one clear line, exit code 2, and nothing that existed is lost."""

import io
import os
import subprocess
import sys
import zipfile

import numpy as np
import pytest

TETRA = "sample:tetra:size=1"
GOOD = ("--structure", "bvh", "--rays", "camera:width=4,height=3")


# ----------------------------------------------------------------------------------- arguments


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "COMMAND"),
        (["frobnicate"], "'frobnicate'"),
        (["list", "extra"], "extra"),
        (["list", "--yaml"], "--yaml"),
        (["evaluate", TETRA, "--structure", "--rays", "camera"], "--structure"),
        (["evaluate", TETRA, *GOOD, "--threads", "many"], "--threads"),
        (["evaluate", TETRA, *GOOD, "--threads", "-1"], "--threads must be 0 to 1024, not -1"),
        (["evaluate", TETRA, *GOOD, "--threads", "100000"], "--threads must be 0 to 1024"),
        (["evaluate", TETRA, *GOOD, "--frobnicate"], "--frobnicate"),
        (["evaluate", *GOOD], "at least one SCENE"),
    ],
)
def test_arguments(refused, arguments, words):
    assert words in refused(*arguments)


@pytest.mark.parametrize(
    ("option", "spec", "words"),
    [
        (
            "--structure",
            "tree",
            "no structure 'tree'; known are: bsp, bvh, grid, image_directory, kdtree, light_buffer",
        ),
        ("--structure", "", "no structure ''; known are: "),
        ("--structure", "all:bins=3", "all"),
        ("--structure", "bvh:leaf=3", "'leaf'; its settings are: builder, axis, bins, duplication"),
        ("--structure", "bvh:bins", "'bins' in 'bvh:bins' is not of the form key=value"),
        ("--structure", "bvh:bins=4,bins=4", "'bins' is given twice"),
        ("--structure", "bvh:bins=1", "bins must be at least 2"),
        ("--structure", "bvh:bins=1000000", "at most 64, not 1000000"),
        ("--structure", "bvh:max_leaf_size=0", "max_leaf_size must be at least 1"),
        ("--structure", "bvh:max_leaf_size=2.5", "takes a whole number, not '2.5'"),
        ("--structure", "bvh:C_trav=-1", "C_trav must be at least 0 and at most 1e+09, not -1"),
        ("--structure", "bvh:C_trav=nan", "C_trav must be finite, not nan"),
        ("--structure", "bvh:builder=magic", "builder is one of "),
        ("--structure", "grid:resolution=-5", "resolution must be at least 0, not -5"),
        ("--structure", "grid:resolution=1x2", "resolution takes three whole numbers"),
        (
            "--structure",
            "grid:resolution=10000",
            "1 000 000 000 000 cells of the grid are more than",
        ),
        ("--structure", "grid:resolution=" + "9" * 18, "cells of the grid are more than"),
        ("--structure", "grid:resolution=" + "9" * 400, "resolution"),
        ("--structure", "grid:density=0", "density must be at least 1e-06"),
        ("--structure", "grid:padding=-0.1", "padding must be at least 0"),
        ("--structure", "grid:mailbox=perhaps", "mailbox takes true or false, not 'perhaps'"),
        (
            "--rays",
            "moon",
            "no rays 'moon'; known are: camera, whitted, ambient, random_lines, file",
        ),
        ("--rays", "camera:focus=3", "'focus'; its settings are: from, at, up, fov, width"),
        ("--rays", "camera:width=0", "width must be at least 1"),
        ("--rays", "camera:width=65536,height=65536", "of memory"),
        ("--rays", "camera:fov=180", "fov must be at least 0 and at most 179"),
        ("--rays", "camera:from=0x0x5,at=0x0x0,up=0x0x1", "up direction"),
        ("--rays", "camera:from=0x0x5,at=0x0x0,up=0x0x0", "up direction"),
        ("--rays", "camera:from=1e300x0x0,at=1x1x1", "camera"),
        ("--rays", "random_lines:count=0", "count must be at least 1"),
        ("--rays", "random_lines:count=-7", "count must be at least 1"),
        ("--rays", "random_lines:count=1000000000000", "472.9 TiB of memory"),
        ("--rays", "random_lines:count=" + "9" * 400, "count"),
        ("--rays", "random_lines:seed=-1", "seed must be at least 0"),
        ("--rays", "file", "need its path, that of an .npz file"),
        ("--rays", "file:path=/nowhere/rays.npz", "no file /nowhere/rays.npz"),
    ],
)
def test_specs(refused, option, spec, words):
    other = {"--structure": ("--rays", "camera:width=4,height=3"), "--rays": ("--structure", "bvh")}
    assert words in refused("evaluate", TETRA, option, spec, *other[option])


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        ("sample:teapots", "no sample scene 'teapots'; known are: suzanne, bunny"),
        ("sample:", "no sample scene ''"),
        ("sample:tetra:size=99", "size must be"),
        ("sample:tetra:width=3", "'width'; its settings are: size"),
        ("sample:soup:count=1000000000", "of memory"),
        ("/nowhere/mesh.obj", "no file /nowhere/mesh.obj"),
        ("/nowhere/file.blend", "no file /nowhere/file.blend"),
        ("picture.jpeg", "scenes are .obj, .ply, .stl, .glb, .gltf, .off, .blend or sample:NAME"),
        ("mesh", "no known kind"),
    ],
)
def test_scenes(refused, scene, words):
    assert words in refused("evaluate", scene, *GOOD)


def test_costs_too_large_for_a_float_are_refused_and_large_ones_written(refused, evaluate):
    """JSON knows no infinity."""
    for setting in ("C_trav", "C_isect"):
        arguments = ("sample:tetra:size=1", "--rays", "random_lines:count=3", "--structure")
        assert "at most 1e+09" in refused("evaluate", *arguments, f"bvh:{setting}=1e308")
        (record,) = evaluate(*arguments, f"bvh:{setting}=1e9")
        assert 0.0 < record["statistics"]["sah"] < 1e12


# ---------------------------------------------------------------------------------- mesh files

SUFFIXES = ("obj", "ply", "stl", "glb", "gltf", "off")
BROKEN = {
    "empty": b"",
    "noise": bytes(range(256)) * 20,
    "words": b"This is not a mesh.\n" * 30,
    "zeros": bytes(3000),
    "cut off": {
        "obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
        "ply": b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n",
        "stl": bytes(80) + b"\x05\0\0\0" + bytes(60),
        "glb": b"glTF\x02\0\0\0\xff\xff\0\0\x10\0\0\0JSON{}",
        "gltf": b'{"asset": {"version": "2.0"}, "meshes": [',
        "off": b"OFF\n3 1 0\n0 0 0\n1 0 0\n",
    },
    "no faces": {
        "obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\n",
        "ply": b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
        b"property float z\nend_header\n0 0 0\n",
        "stl": bytes(84),
        "glb": b"glTF\x02\0\0\0\x30\0\0\0\x1c\0\0\0JSON" + b'{"asset":{"version":"2.0"}}'.ljust(28),
        "gltf": b'{"asset": {"version": "2.0"}}',
        "off": b"OFF\n1 0 0\n0 0 0\n",
    },
}


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("how", BROKEN)
def test_broken_files(refused, tmp_path, suffix, how):
    path = tmp_path / f"broken.{suffix}"
    data = BROKEN[how] if isinstance(BROKEN[how], bytes) else BROKEN[how][suffix]
    path.write_bytes(data)
    assert str(path) in refused("evaluate", path, *GOOD)
    assert path.read_bytes() == data


def test_a_folder_is_no_file(refused, tmp_path):
    (tmp_path / "mesh.obj").mkdir()
    assert "mesh.obj" in refused("evaluate", tmp_path / "mesh.obj", *GOOD)


def test_a_file_name_that_is_no_text(tmp_path, obj):
    """Linux allows any bytes in a name."""
    path = os.fsencode(tmp_path) + b"/\xff\xfe.obj"
    os.link(obj(), path)
    done = subprocess.run(
        [sys.executable, "-m", "accelscope", "evaluate", path, *GOOD, "--csv", tmp_path / "a.csv"],
        capture_output=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert b"Traceback" not in done.stderr
    assert b"\xff\xfe.obj" in (tmp_path / "a.csv").read_bytes()
    assert rb"\udcff\udcfe" in done.stdout


# -------------------------------------------------------------------------------------- meshes


@pytest.mark.parametrize(
    ("triangles", "words"),
    [
        ([[[0, 0, 0], [1, 1, 1], [2, 2, 2]]], "its only triangle has zero area"),
        ([[[0, 0, 0]] * 3] * 4, "all 4 triangles have zero area"),
        ([[[np.nan, 0, 0], [1, 0, 0], [0, 1, 0]]] * 3, "NaN or infinite"),
        ([[[0, 0, 0], [np.inf, 0, 0], [0, 1, 0]]], "NaN or infinite"),
    ],
)
def test_meshes_without_a_triangle_to_hit(refused, obj, triangles, words):
    line = refused("evaluate", obj(triangles), *GOOD)
    assert words in line
    assert "mesh" in line


@pytest.mark.parametrize(
    "triangles",
    [
        [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]],
        [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]] * 10_000,
        [[[x, 0, z], [x + 1, 0, z], [x, 0, z + 1]] for x in range(9) for z in range(9)],
    ],
    ids=["one", "identical", "flat"],
)
def test_odd_meshes_work(evaluate, obj, triangles):
    records = evaluate(
        obj(triangles), "--structure", "all", "--rays", "camera:width=8,height=8",
        "random_lines:count=200",
    )  # fmt: skip
    for n in range(2):
        assert len({record["trace"]["hits"] for record in records[n::2]}) == 1
        assert records[n]["trace"]["hits"] > 0


@pytest.mark.parametrize("exponent", [-20, 20])
def test_tiny_and_huge_meshes_are_scaled_copies(evaluate, obj, exponent, tmp_path):
    rng = np.random.default_rng(4)
    triangles = rng.random((60, 3, 3))
    found = []
    for scale in (1.0, 10.0**exponent):
        path, hits = obj(triangles * scale), tmp_path / "hits.npz"
        for structure in ("bvh", "grid", "naive"):
            (record,) = evaluate(
                path, "--structure", structure, "--rays", "random_lines:count=500", "--hits", hits
            )
            arrays = np.load(hits)
            found.append((arrays["t"] / scale, arrays["primitive"], record["statistics"]["sah"]))
    for plain, scaled in zip(found[:3], found[3:], strict=True):
        assert np.array_equal(plain[1], scaled[1])
        assert np.allclose(plain[0], scaled[0], rtol=1e-9)
        assert plain[2] == pytest.approx(scaled[2], rel=1e-9)
        assert (plain[1] >= 0).sum() > 100


def test_a_mesh_too_small_for_its_areas(refused, obj):
    """At 1e-170 products of two coordinates are zero."""
    mesh = obj([[[0, 0, 0], [1e-170, 0, 0], [0, 1e-170, 1e-170]]])
    assert "too small to compute with" in refused("evaluate", mesh, "--structure", "all")


# ---------------------------------------------------------------------------------- rays (.npz)


def npz(**arrays):
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def npy(array):
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=True)
    return buffer.getvalue()


def zipped(compression=zipfile.ZIP_DEFLATED, **members):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as archive:
        for name, data in members.items():
            archive.writestr(f"{name}.npy", data)
    return buffer.getvalue()


def flipped(data, where):
    out = bytearray(data)
    for i in range(where, where + 40):
        out[i] ^= 0xFF
    return bytes(out)


O3, D3 = np.zeros((4, 3)), np.ones((4, 3))
NOISE = np.random.default_rng(1).random((500, 3))
RAYS = {
    "empty": b"",
    "text": b"not an archive\n" * 9,
    "noise": bytes(range(256)) * 9,
    "a bare array": npy(O3),
    "a bare object": npy(np.array([{"a": 1}], dtype=object)),
    "cut off": npz(origins=O3, directions=D3)[:-40],
    "no arrays": npz(),
    "no directions": npz(origins=O3),
    "other names": npz(o=O3, d=D3),
    "two columns": npz(origins=np.zeros((4, 2)), directions=np.ones((4, 2))),
    "one dimension": npz(origins=np.zeros(3), directions=np.ones(3)),
    "a number": npz(origins=np.float64(1), directions=np.float64(1)),
    "other lengths": npz(origins=O3, directions=np.ones((5, 3))),
    "no rays": npz(origins=np.zeros((0, 3)), directions=np.zeros((0, 3))),
    "nan": npz(origins=O3 + np.nan, directions=D3),
    "zero direction": npz(origins=O3, directions=O3),
    "text arrays": npz(origins=np.full((4, 3), "a"), directions=D3),
    "complex": npz(origins=O3 + 1j, directions=D3),
    "objects": zipped(origins=npy(O3.astype(object)), directions=npy(D3)),
    "t_max too long": npz(origins=O3, directions=D3, t_max=np.ones(7)),
    "t_max negative": npz(origins=O3, directions=D3, t_max=-np.ones(4)),
    "t_max text": npz(origins=O3, directions=D3, t_max=np.full(4, "a")),
    "no array in it": zipped(origins=b"hello", directions=b""),
    "short array": zipped(origins=npy(NOISE)[:-100], directions=npy(NOISE)),
    "bad header": zipped(origins=npy(O3).replace(b"(4, 3)", b"(4, x)"), directions=npy(D3)),
    "header cut off": zipped(origins=npy(O3).replace(b", }", b",  "), directions=npy(D3)),
    "absurd size": zipped(
        origins=npy(O3).replace(b"(4, 3), }           ", b"(999999999999, 3), }"),
        directions=npy(D3),
    ),
    "flipped bits": flipped(zipped(origins=npy(NOISE), directions=npy(NOISE)), 2000),
    "broken stream": flipped(zipped(origins=npy(NOISE), directions=npy(NOISE)), 50),
    "flipped plain bits": flipped(npz(origins=NOISE, directions=NOISE), 2000),
    "encrypted": zipped(origins=npy(O3), directions=npy(D3)).replace(
        b"PK\x03\x04\x14\x00\x00", b"PK\x03\x04\x14\x00\x01"
    ).replace(b"PK\x01\x02\x14\x03\x14\x00\x00", b"PK\x01\x02\x14\x03\x14\x00\x01"),
    "unknown compression": zipped(origins=npy(O3), directions=npy(D3)).replace(
        b"\x14\x00\x00\x00\x08\x00", b"\x14\x00\x00\x00\x63\x00"
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", RAYS)
def test_rays_that_cannot_be_read(refused, tmp_path, kind):
    path = tmp_path / "rays.npz"
    path.write_bytes(RAYS[kind])
    line = refused("evaluate", TETRA, "--structure", "bvh", "--rays", f"file:path={path}")
    assert "rays.npz" in line


# ------------------------------------------------------------------------------ places to write

OUTPUTS = [("--json", "out.json"), ("--csv", "out.csv"), ("--hits", "out.npz")]


@pytest.mark.parametrize(("option", "name"), OUTPUTS)
def test_impossible_places(refused, tmp_path, option, name):
    """Root may write anywhere, so files stand where folders should be, and folders for files."""
    obstacle = tmp_path / "file"
    obstacle.write_text("keep me")
    line = refused("evaluate", TETRA, *GOOD, option, obstacle / name)
    assert "cannot write" in line
    assert obstacle.read_text() == "keep me"
    assert "folder" in refused("evaluate", TETRA, *GOOD, option, tmp_path)
    assert "/dev/full" in refused("evaluate", TETRA, *GOOD, option, "/dev/full", "--quiet")
    assert "cannot write" in refused("evaluate", TETRA, *GOOD, option, tmp_path / ("x" * 300))


def test_impossible_places_for_pictures(refused, tmp_path):
    obstacle = tmp_path / "file"
    obstacle.write_text("keep me")
    for place in (obstacle, obstacle / "below"):
        assert "cannot write" in refused("evaluate", TETRA, *GOOD, "--pictures", place)
    assert obstacle.read_text() == "keep me"


@pytest.mark.parametrize(("option", "name"), OUTPUTS)
@pytest.mark.parametrize(
    "reason",
    [
        ["sample:nothing", *GOOD],
        [TETRA, "--structure", "nothing", "--rays", "camera"],
        [TETRA, "--structure", "grid:resolution=99999", "--rays", "camera"],
        [TETRA, "--structure", "bvh", "--rays", "random_lines:count=99999999999999"],
        ["/nowhere.obj", *GOOD],
    ],
)
def test_what_existed_is_kept_when_refused(refused, tmp_path, option, name, reason):
    old, new = tmp_path / name, tmp_path / f"new-{name}"
    old.write_text("yesterday's results")
    refused("evaluate", *reason, option, old)
    assert old.read_text() == "yesterday's results"
    refused("evaluate", *reason, option, new)
    assert not new.exists()


@pytest.mark.parametrize(("option", "name"), OUTPUTS)
def test_the_scene_is_never_overwritten(refused, obj, option, name):
    path = obj()
    before = path.read_bytes()
    refused("evaluate", path, *GOOD, option, path)
    assert path.read_bytes() == before


def test_the_rays_are_never_overwritten(refused, tmp_path):
    path = tmp_path / "rays.npz"
    path.write_bytes(npz(origins=O3, directions=D3))
    before = path.read_bytes()
    refused("evaluate", TETRA, "--structure", "bvh", "--rays", f"file:path={path}", "--hits", path)
    assert path.read_bytes() == before


def test_two_results_do_not_share_a_file(refused, tmp_path):
    path = tmp_path / "both"
    line = refused("evaluate", TETRA, *GOOD, "--json", path, "--csv", path)
    assert "both" in line


@pytest.mark.parametrize(
    "extra",
    [
        [TETRA, TETRA, *GOOD],
        [TETRA, "--structure", "all", "--rays", "camera"],
        [TETRA, *GOOD, "random_lines"],
    ],
)
def test_hits_take_one_combination(refused, tmp_path, extra):
    path = tmp_path / "hits.npz"
    line = refused("evaluate", *extra, "--hits", path)
    assert "--hits takes one scene, structure and set of rays, not " in line
    assert not path.exists()


# --------------------------------------------------------------------------- the process itself


def command(*arguments, **options):
    return subprocess.run(
        [sys.executable, "-m", "accelscope", *arguments],
        timeout=120, check=False, text=True, stderr=subprocess.PIPE, **options,
    )  # fmt: skip


def test_the_process_exits_with_2_and_one_line():
    done = command("evaluate", "/nowhere.obj", *GOOD, stdout=subprocess.PIPE)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == "accelscope: error: there is no file /nowhere.obj\n"


def test_warnings_of_libraries_do_not_reach_the_terminal(tmp_path):
    """One clear line: NumPy's warnings about overflow go to stderr, too."""
    done = command(
        "evaluate", TETRA, "--structure", "bvh", "--rays", "camera:from=1e300x0x0,at=1x1x1",
        stdout=subprocess.PIPE,
    )  # fmt: skip
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1


def test_a_reader_that_goes_away_is_no_error():
    read, write = os.pipe()
    os.close(read)
    done = command("list", stdout=write)
    os.close(write)
    assert done.returncode == 0
    assert done.stderr == ""


def test_a_full_disk_is_an_error_of_one_line():
    with open("/dev/full", "w") as full:
        done = command("list", stdout=full)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
