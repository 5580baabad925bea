"""``--image``: the picture that rays have made, as an image and as numbers."""

import struct

import numpy as np
import pytest

ADAPTIVE = "whitted:width=20,height=14,samples=2,adaptive=true,compare=false"


def size_of(path):
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    return struct.unpack(">II", data[16:24])


def test_a_picture_is_written_as_image_and_as_numbers(run, tmp_path):
    image = tmp_path / "made" / "tetra.png"
    outcome = run(
        "evaluate", "sample:tetra:size=3", "--rays", "whitted:width=20,height=14", "--image", image
    )
    assert (outcome.code, outcome.err) == (0, "")
    assert size_of(image) == (20, 14)
    picture = np.load(image.with_suffix(".npy"))
    assert (picture.shape, picture.dtype) == ((14, 20, 3), np.float64)
    assert (picture[0, 0] == (0.078, 0.361, 0.753)).all()  # the sky
    assert sorted(path.name for path in image.parent.iterdir()) == ["tetra.npy", "tetra.png"]


def test_where_samples_differ_they_are_written_too(run, tmp_path):
    image = tmp_path / "tetra.png"
    assert run("evaluate", "sample:tetra:size=3", "--rays", ADAPTIVE, "--image", image).code == 0
    samples = np.load(tmp_path / "tetra_samples.npy")
    assert (samples.shape, samples.min(), samples.max()) == ((14, 20), 1, 4)
    assert size_of(tmp_path / "tetra_samples.png") == (20, 14)


@pytest.mark.parametrize(
    ("rays", "name", "words"),
    [
        (["camera"], "x.png", "rays camera make no picture; --image takes --rays whitted"),
        (["whitted"], "x.jpg", "--image writes PNG; call it something.png"),
        (["whitted", "camera"], "x.png", "--image takes one scene, structure and set of rays"),
    ],
)
def test_what_makes_no_image_is_refused_beforehand(run, tmp_path, rays, name, words):
    outcome = run("evaluate", "sample:tetra", "--rays", *rays, "--image", tmp_path / name)
    assert outcome.code == 2
    assert words in outcome.err
    assert not list(tmp_path.iterdir())
