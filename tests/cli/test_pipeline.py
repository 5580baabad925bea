"""``accelscope pipeline``: the picture, calls, states, and what is said of a bad program."""

import json

import numpy as np
import pytest
from accelscope.core.pipeline.loading import program_names, source_of

SMALL = "camera:width=24,height=16"


def test_picture_calls_and_record_are_written(run, tmp_path):
    image, calls, record = (tmp_path / name for name in ("a.png", "calls.png", "a.json"))
    outcome = run(
        "pipeline", "sample:tetra:size=3", "--program", "shadows", "--rays", SMALL,
        "--image", image, "--calls", calls, "--json", record, "--pixel", "12,8",
    )  # fmt: skip
    assert outcome.code == 0
    assert "shadow" in outcome.out
    assert "closest hit  instance 0, primitive" in outcome.out
    colours, counts = np.load(image.with_suffix(".npy")), np.load(calls.with_suffix(".npy"))
    assert colours.shape == (16, 24, 4)
    assert counts.shape == (16, 24, 6)
    (made,) = json.loads(record.read_text())["records"]
    launch = made["launch"]
    assert list(launch["calls"].values()) == counts.sum(axis=(0, 1)).tolist()
    assert launch["calls"]["ray_generation"] == 24 * 16
    assert set(launch["by_class"]) == {"primary", "shadow"}
    states = made["pixel"]["states"]
    told = [sum(state["name"] == stage for state in states) for stage in launch["calls"]]
    assert told == counts[8, 12].tolist()


def test_a_program_of_ones_own_is_run_when_it_is_named(run, tmp_path):
    mine = tmp_path / "mine.py"
    mine.write_text(source_of("lecture"))
    images = []
    for program in (mine, "lecture"):
        image = tmp_path / f"{len(images)}.png"
        outcome = run(
            "pipeline", "sample:tetra:size=2", "--program", program, "--rays", SMALL,
            "--image", image,
        )  # fmt: skip
        assert outcome.code == 0
        images.append(np.load(image.with_suffix(".npy")))
    np.testing.assert_array_equal(*images)


def changed(old, new):
    source = source_of("lecture")
    assert old in source
    return source.replace(old, new)


LINE = source_of("lecture").partition("PROGRAM = Program")[0].count("\n") + 1

BAD = {
    "no ray generation": (
        changed("    ray_generation=ray_generation,\n", ""),
        "the program has no ray generation shader",
    ),
    "no program": (changed("PROGRAM = ", "OTHER = "), "has no PROGRAM; end it with PROGRAM ="),
    "no Python": (
        changed("PROGRAM = Program", "PROGRAM = = Program"), f"bad.py, line {LINE}: invalid",
    ),
    "an exception while it is read": (
        changed("PROGRAM = ", "print(unheard_of)\nPROGRAM = "), "NameError",
    ),
    "parameters": (
        changed("attr: Attributes, ray, scene,", "attr: Attributes, ray,"),
        "a shader of this stage is closest_hit(payload, attributes, ray, scene)",
    ),
    "a field": (
        changed("payload.hit_distance = ray.t_current", "payload.hitdistance = ray.t_current"),
        "hitdistance",
    ),
    "an exception": (
        changed("payload.hit_distance = ray.t_current", "raise ValueError('too far')"),
        "ValueError: too far (pixel",
    ),
    "recursion": (
        changed(
            "payload.hit_distance = ray.t_current",
            "again = RayDesc()\n    again.origin = ray.world_origin\n"
            "    again.direction = ray.world_direction\n    again.t_max = 1e9\n"
            "    trace_ray(scene, 0, 255, 0, 1, 0, again, payload)",
        ),
        "rays recurse deeper than the program declares",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD)
def test_a_bad_program_is_one_clear_message(run, tmp_path, what):
    text, words = BAD[what]
    (tmp_path / "bad.py").write_text(text)
    outcome = run(
        "pipeline", "sample:tetra:size=2", "--program", tmp_path / "bad.py", "--rays", SMALL,
        "--quiet",
    )  # fmt: skip
    assert outcome.code == 2
    (line,) = outcome.err.splitlines()
    assert words in line


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--program", "nothing"], f"known are: {', '.join(program_names())}"),
        (["--program", "nothing.py"], "nothing.py"),
        (["--pixel", "24,0"], "is not in the picture, which is 24 by 16"),
        (["--pixel", "here"], "--pixel is X,Y"),
        (["--image", "x.jpg"], "--image writes PNG"),
        (["--structure", "light_buffer"], "does not answer every ray"),
        (["--structure", "grid:lazy=true"], "leave 'lazy' at no"),
    ],
)
def test_what_cannot_be_is_refused(run, arguments, words):
    outcome = run("pipeline", "sample:tetra:size=2", "--rays", SMALL, "--quiet", *arguments)
    assert outcome.code == 2
    assert words in outcome.err


def test_rays_are_those_of_a_camera(run):
    outcome = run("pipeline", "sample:tetra:size=2", "--rays", "random_lines")
    assert outcome.code == 2
    assert "from those of camera, not of random_lines" in outcome.err
