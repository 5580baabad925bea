"""The contract of the command line that other programs rely on (issue 2)."""

import csv
import json
import re
import struct
import subprocess
import sys
import zlib

import numpy as np
import pytest
from accelscope.core.contract.counters import counters_within, names_of
from accelscope.core.contract.lazy import MadeByRays
from accelscope.core.evaluation.pages import view
from accelscope.core.evaluation.records.report import figures, said_of_items
from accelscope.core.settings import describe
from accelscope.core.structures import general_structures, structures

TETRA = "sample:tetra:size=3"
CAMERA = "camera:width=20,height=14"


def keys_of(record):
    return {
        f"{part}.{key}" if isinstance(value, dict) else part
        for part, value in record.items()
        for key in (value if isinstance(value, dict) else [""])
    }


# ----------------------------------------------------------------------------------------- list


def test_list(run):
    outcome = run("list")
    assert (outcome.code, outcome.err) == (0, "")
    for word in ("structures", "rays", "samples", "bvh: ", "max_leaf_size=4", "padding=0.001"):
        assert word in outcome.out


def test_list_says_where_a_setting_has_an_effect(run):
    lines = run("list").out.splitlines()
    (line,) = (line for line in lines if line.startswith("      radius=14 "))
    assert line.endswith("; a whole number; only for builder ploc")


def test_settings_that_change_nothing_are_noted(run):
    arguments = ["evaluate", TETRA, "--structure", "bvh:radius=3", "--rays", CAMERA]
    outcome = run(*arguments)
    note = "accelscope: structure bvh: radius changes nothing, it is only for builder ploc"
    assert outcome.code == 0
    assert note in outcome.err.splitlines()
    assert run(*arguments, "--quiet").err == ""


def test_list_as_json(run):
    outcome = run("list", "--json")
    assert (outcome.code, outcome.err) == (0, "")
    listing = json.loads(outcome.out)
    assert listing["schema"] == "accelscope/2"
    assert [entry["name"] for entry in listing["structures"]] == list(structures())
    for entry in listing["structures"]:
        assert entry["settings"] == describe(structures()[entry["name"]].Settings)
    assert {"camera", "random_lines", "file"} <= {entry["name"] for entry in listing["rays"]}
    assert "tetra" in {entry["name"] for entry in listing["samples"]}


def test_whatever_list_shows_as_default_can_be_given(run, evaluate):
    listed = json.loads(run("list", "--json").out)["structures"]
    assert {entry["name"]: entry["answers"] for entry in listed if entry["answers"]} == {
        "light_buffer": ["shadow"],
        "image_directory": ["primary"],
        "ray_coherence": ["shadow", "reflected", "refracted", "ambient"],
    }
    for entry in listed:
        texts = []
        for row in entry["settings"]:
            value = row["default"]
            text = "x".join(map(str, value)) if isinstance(value, list) else json.dumps(value)
            texts.append(f"{row['key']}={text.strip(chr(34))}")
        spec = f"{entry['name']}:{','.join(texts)}"
        if entry["answers"]:
            # As the structure of a route, whose settings stand in quotes.
            route, name = entry["answers"][0], entry["name"]
            rest = spec.partition(":")[2]
            spec = f'routed:{route}={name},{route}_settings="{rest}"'
            (record,) = evaluate(TETRA, "--structure", spec, "--rays", CAMERA)
            (plain,) = evaluate(TETRA, "--structure", f"routed:{route}={name}", "--rays", CAMERA)
            assert record["statistics"] == plain["statistics"]
            continue
        (record,) = evaluate(TETRA, "--structure", spec, "--rays", CAMERA)
        (plain,) = evaluate(TETRA, "--structure", entry["name"], "--rays", CAMERA)
        assert record["structure"] == plain["structure"]


# -------------------------------------------------------------------------------------- records


def test_a_record_has_the_keys_of_the_contract(evaluate):
    (record,) = evaluate(TETRA, "--structure", "bvh:bins=8", "--rays", "random_lines:count=500")
    promised = {
        "scene.name", "scene.source", "scene.triangles", "scene.dropped_triangles", "scene.bounds",
        "structure.name", "structure.settings", "rays.name", "rays.settings", "rays.count",
        "build.seconds", "build.bytes", "statistics.N_IN", "statistics.N_V", "statistics.N_EV",
        "statistics.N_OIV", "statistics.max_depth", "statistics.mean_leaf_size", "statistics.sah",
        "statistics.sah_constants", "trace.seconds", "trace.rays_per_second", "trace.hits",
        "trace.N_TS", "trace.N_ETS", "trace.N_IT", "trace.volume_tests",
    }  # fmt: skip
    assert promised <= keys_of(record)
    parts = {"scene", "structure", "rays", "build", "statistics", "environment", "trace"}
    assert set(record) == parts
    assert record["scene"]["name"] == "tetra"
    assert record["scene"]["triangles"] == 64
    assert record["scene"]["dropped_triangles"] == 0
    assert np.array(record["scene"]["bounds"]).shape == (2, 3)
    assert record["structure"]["name"] == "bvh"
    assert record["structure"]["settings"] == {
        "builder": "binned_sah", "axis": "best", "volume": "aabb", "arity": "2", "optimise": "none",
        "max_leaf_size": 4, "bins": 8, "radius": 14, "morton_bits": "63",
        "morton_codes": "standard", "size_bits": 6, "cut_alpha": 0.5, "cut_delta": 6.0,
        "rtree_split": "quadratic", "duplication": 2.0, "batch": 0.05, "rounds": 3,
        "C_trav": 1.2, "C_isect": 1.0,
    }  # fmt: skip
    assert record["statistics"]["sah_constants"] == {"C_trav": 1.2, "C_isect": 1.0}
    assert record["rays"]["name"] == "random_lines"
    assert record["rays"]["settings"] == {"count": 500, "seed": 1, "order": "automatic"}
    assert record["rays"]["count"] == 500
    assert record["build"]["seconds"] > 0
    assert record["trace"]["rays_per_second"] == 500 / record["trace"]["seconds"]


@pytest.mark.parametrize("name", general_structures())
def test_a_record_has_what_its_structure_declares_and_nothing_else(evaluate, name):
    (record,) = evaluate(TETRA, "--structure", name, "--rays", CAMERA)
    structure = structures()[name]
    timing = {"seconds", "rays_per_second", "hits", "hits_by_class", "by_class"}
    counted = set(record["trace"]) - timing
    assert ("lazy" in counted) == issubclass(structure, MadeByRays)
    counted -= {"lazy"}
    if "routes" in counted:  # by which of its parts count what
        assert counted - {"routes"} < set(names_of(structure.COUNTERS))
    else:
        # Of two levels the lower one is counted, too, whatever the scene holds.
        below = counters_within(1) if name == "two_level" else ()
        assert counted == set(names_of((*structure.COUNTERS, *below)))
    declared = {figure.key.split(".")[0] for figure in structure.FIGURES}
    assert set(record["statistics"]) <= declared
    shown = {label for _, label, _ in figures(record)}
    labels = {
        said_of_items(record, each.label, each.name)
        for each in structure.COUNTERS
        if each.name in counted
    }
    assert labels <= shown


def test_the_document(run):
    outcome = run("evaluate", TETRA, "--structure", "bvh", "--rays", CAMERA, "--json", "-")
    document = json.loads(outcome.out)
    assert document["schema"] == "accelscope/2"
    assert set(document) == {"schema", "records"}


def test_every_combination_once(evaluate):
    records = evaluate(
        TETRA, "sample:soup:count=50", "--structure", "bvh", "--structure", "grid", "naive",
        "--rays", CAMERA, "random_lines:count=20", "random_lines:count=30",
    )  # fmt: skip
    seen = [(r["scene"]["name"], r["structure"]["name"], r["rays"]["count"]) for r in records]
    assert seen == [
        (scene, structure, count)
        for scene in ("tetra", "soup")
        for structure in ("bvh", "grid", "naive")
        for count in (280, 20, 30)
    ]


def test_all_is_every_structure_with_its_defaults(evaluate):
    records = evaluate(TETRA, "--structure", "all", "--rays", CAMERA)
    assert [record["structure"]["name"] for record in records] == list(general_structures())
    assert len({record["trace"]["hits"] for record in records}) == 1


def test_figures_are_means_over_all_rays(evaluate, tmp_path):
    path = tmp_path / "hits.npz"
    (record,) = evaluate(
        TETRA, "--structure", "grid:resolution=5x6x7,mailbox=true",
        "--rays", "random_lines:count=999", "--hits", path,
    )  # fmt: skip
    hits, names = np.load(path), names_of(structures()["grid"].COUNTERS)
    assert set(hits.files) == {
        "t", "primitive", "instance", "origins", "directions", "t_min", "t_max", "query",
        "ray_class", "class_names", "source", "target", "time", "mask", "pixel", *names,
    }  # fmt: skip
    assert hits["t"].dtype == np.float64
    assert hits["primitive"].dtype.kind == "i"
    assert {len(hits[name]) for name in hits.files if name != "class_names"} == {999}
    assert (hits["instance"] == -1).all()
    missed = hits["primitive"] == -1
    assert (np.isinf(hits["t"]) == missed).all()
    assert missed.any()
    assert not missed.all()
    assert record["trace"]["hits"] == (~missed).sum()
    for name in names:
        assert record["trace"][name] == hits[name].sum() / 999
        assert hits[name].sum() > 0


def test_csv_is_json_flattened_in_full_precision(run, tmp_path):
    outcome = run(
        "evaluate", TETRA, "sample:soup:count=70", "--structure", "all", "--rays", CAMERA,
        "random_lines:count=77", "--quiet", "--json", tmp_path / "a.json",
        "--csv", tmp_path / "a.csv",
    )  # fmt: skip
    assert (outcome.code, outcome.out, outcome.err) == (0, "", "")
    records = json.loads((tmp_path / "a.json").read_text())["records"]
    with (tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(records) == 4 * len(general_structures())

    def flatten(value, prefix=""):
        if isinstance(value, list) and value and isinstance(value[0], dict):
            value = dict(enumerate(value))
        if not isinstance(value, dict):
            return {prefix: value}
        out = {}
        for key, inner in value.items():
            out |= flatten(inner, f"{prefix}.{key}" if prefix else key)
        return out

    for row, record in zip(rows, records, strict=True):
        flat = flatten(record)
        assert {key for key, text in row.items() if text != ""} <= set(flat)
        assert set(flat) <= set(row)
        for key, value in flat.items():
            if value is None:
                assert row[key] == ""
            elif isinstance(value, (bool, str)):
                assert row[key].lower() == str(value).lower()
            elif isinstance(value, int):
                assert int(row[key]) == value
            elif isinstance(value, float):
                assert float(row[key]) == value  # to the last bit
            else:
                numbers = np.array(value, dtype=float).ravel()
                assert [float(x) for x in row[key].split()] == numbers.tolist(), key


def test_json_has_full_precision(evaluate, obj):
    corner = 0.1 + 0.2
    path = obj([[[0, 0, 0], [corner, 0, 0], [0, 1 / 3, 1e-5]]])
    (record,) = evaluate(path, "--structure", "bvh", "--rays", CAMERA)
    assert record["scene"]["bounds"] == [[0, 0, 0], [corner, 1 / 3, 1e-5]]


def without_times(record):
    record["build"].pop("seconds")
    record["trace"].pop("seconds")
    record["trace"].pop("rays_per_second")
    record["trace"].get("lazy", {}).pop("seconds", None)
    record["environment"].pop("date")
    record["environment"].pop("threads")
    return record


def test_results_do_not_depend_on_threads(evaluate, tmp_path):
    seen = []
    for threads in (0, 1, 2, 5):
        path = tmp_path / f"{threads}.npz"
        (record,) = evaluate(
            "sample:suzanne", "--structure", "bvh", "--rays", "random_lines:count=30000",
            "--threads", threads, "--hits", path,
        )  # fmt: skip
        arrays = np.load(path)
        seen.append((without_times(record), {name: arrays[name] for name in arrays.files}))
    for record, arrays in seen[1:]:
        assert record == seen[0][0]
        for name, values in arrays.items():
            assert np.array_equal(values, seen[0][1][name])


def test_results_repeat(evaluate):
    arguments = ("sample:soup:count=300", "--structure", "all", "--rays", "random_lines:count=300")
    assert [without_times(r) for r in evaluate(*arguments)] == [
        without_times(r) for r in evaluate(*arguments)
    ]


# ------------------------------------------------------------------------------- what is printed


def test_a_table_for_people(run):
    outcome = run("evaluate", TETRA, "--structure", "bvh", "grid", "--rays", CAMERA)
    assert outcome.code == 0
    lines = outcome.out.splitlines()
    assert lines[0].split()[:4] == ["scene", "structure", "rays", "triangles"]
    assert set(lines[1]) <= {"-", " "}
    assert [line.split()[:3] for line in lines[2:]] == [
        ["tetra", "bvh", "camera"], ["tetra", "grid", "camera"],
    ]  # fmt: skip


def test_quiet_is_silent(run, tmp_path):
    outcome = run(
        "evaluate", TETRA, "--structure", "bvh", "--rays", CAMERA, "--quiet",
        "--json", tmp_path / "a.json",
    )  # fmt: skip
    assert (outcome.code, outcome.out, outcome.err) == (0, "", "")
    assert json.loads((tmp_path / "a.json").read_text())["records"]


def test_the_installed_command_is_the_same():
    done = subprocess.run(
        [sys.executable, "-m", "accelscope", "evaluate", TETRA, "--structure", "bvh", "--rays",
         CAMERA, "--json", "-", "--quiet"],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert len(json.loads(done.stdout)["records"]) == 1


def test_help_is_no_error(run):
    for arguments in (["--help"], ["evaluate", "-h"], ["list", "-h"]):
        outcome = run(*arguments)
        assert outcome.code == 0
        assert "usage: accelscope" in outcome.out


# ------------------------------------------------------------------------------------- pictures


def read_png(path):
    """Return the pixels of an 8-bit RGB PNG, checking every part of the file."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    place, chunks = 8, []
    while place < len(data):
        length, name = struct.unpack(">I4s", data[place : place + 8])
        body = data[place + 8 : place + 8 + length]
        (crc,) = struct.unpack(">I", data[place + 8 + length : place + 12 + length])
        assert crc == zlib.crc32(name + body)
        chunks.append((name, body))
        place += 12 + length
    assert next(name for name, _ in chunks) == b"IHDR"
    assert chunks[-1] == (b"IEND", b"")
    width, height, *rest = struct.unpack(">IIBBBBB", chunks[0][1])
    assert rest == [8, 2, 0, 0, 0]
    raw = zlib.decompress(b"".join(body for name, body in chunks if name == b"IDAT"))
    rows = np.frombuffer(raw, np.uint8).reshape(height, 1 + 3 * width)
    assert (rows[:, 0] == 0).all()
    return rows[:, 1:].reshape(height, width, 3)


def test_pictures(run, tmp_path):
    folder = tmp_path / "deep" / "pictures"
    outcome = run(
        "evaluate", TETRA, "--structure", "bvh", "grid", "bvh:max_leaf_size=1",
        "--rays", CAMERA, "random_lines:count=9", "--pictures", folder, "--quiet",
    )  # fmt: skip
    assert (outcome.code, outcome.err) == (0, "")
    page = (folder / "index.html").read_text()
    files = sorted(path.name for path in folder.iterdir() if path.name != "index.html")
    framed = [name for name in files if re.search(r"-[a-z_]+-\d+\.png$", name)]
    assert len(files) - len(framed) == 4 + 3 + 4
    assert sum("-levels-" in name for name in framed) >= 2 * 2
    for name in files:
        assert page.count(f'src="{name}"') == 1
        pixels = read_png(folder / name).astype(int)
        if name in framed:
            continue  # a picture may be nearly empty: tests/core/lessons looks at them
        assert pixels.shape[0] > view.HEIGHT / 2
        # There is something to see: background, mesh and coloured lines.
        assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 20
        saturated = pixels.max(axis=2) - pixels.min(axis=2) > 60
        assert saturated.mean() > 0.003
    assert page.count("random_lines") == 3
    assert "max_leaf_size=1" in page


def test_a_picture_of_links_where_there_are_some(run, tmp_path):
    outcome = run(
        "evaluate", TETRA, "--structure", "octree", "bsp", "--rays", CAMERA,
        "--pictures", tmp_path / "p", "--quiet",
    )  # fmt: skip
    assert (outcome.code, outcome.err) == (0, "")
    assert [path.name for path in (tmp_path / "p").glob("*-links.png")] == [
        "tetra-octree-links.png"
    ]


def test_pictures_of_difficult_scenes(run, obj, tmp_path):
    for name, triangles in (
        ("small", [[[0, 0, 0], [1e-20, 0, 0], [0, 1e-20, 0]]]),
        ("large", [[[0, 0, 0], [1e20, 0, 0], [0, 1e20, 1e20]]]),
        ("needle", [[[0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0]], [[0, 0, 0], [0, 0, 0], [0, 0, 0]]]),
    ):
        folder = tmp_path / name
        outcome = run(
            "evaluate", obj(triangles, f"{name}.obj"), "--structure", "all", "--rays", CAMERA,
            "--pictures", folder, "--quiet",
        )  # fmt: skip
        assert (outcome.code, outcome.err) == (0, "")
        files = list(folder.glob("*.png"))
        assert {path.name.split("-")[1] for path in files} == set(general_structures())
        for path in files:
            read_png(path)


def test_names_of_files_are_safe_on_the_page(run, obj, tmp_path):
    path = obj(name="a <b>&'\".obj")
    outcome = run(
        "evaluate", path, "--structure", "bvh", "--rays", CAMERA, "--pictures", tmp_path / "p",
        "--quiet",
    )  # fmt: skip
    assert (outcome.code, outcome.err) == (0, "")
    page = (tmp_path / "p" / "index.html").read_text()
    assert "<b>" not in page
    assert "a &lt;b&gt;&amp;" in page


# ------------------------------------------------------------------------- Blender's own command


def test_without_a_scene_the_open_file_is_taken(capsys):
    from accelscope.addon.command.main import main
    from accelscope.sample_scenes import make_sample

    code = main(
        ["evaluate", "--structure", "bvh", "--rays", CAMERA, "--json", "-", "--quiet"],
        open_file=lambda instances: make_sample("tetra:size=1"),
    )
    captured = capsys.readouterr()
    assert (code, captured.err) == (0, "")
    assert json.loads(captured.out)["records"][0]["scene"]["triangles"] == 4


@pytest.mark.parametrize("spec", ["camera:from=0x-9x0,at=0x0x0,fov=30,width=9,height=5"])
def test_rays_of_a_camera(run, obj, tmp_path, spec):
    """Five rows from the top, nine columns from the left, at the middle of pixels."""
    wall = [[[-99, 0, -99], [99, 0, -99], [0, 0, 199]]]
    hits = tmp_path / "h.npz"
    run("evaluate", obj(wall), "--structure", "naive", "--rays", spec, "--hits", hits, "--quiet")
    assert np.load(hits)["t"].tolist() == pytest.approx([9.0] * 45)
