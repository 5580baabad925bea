"""Lesson "extended_codes": groups share their leading bits, and orange ones are the larger ones."""

import numpy as np
import pytest
from accelscope.core.lessons.extended_codes import MOST_BITS, Settings, has_extended_codes
from accelscope.core.lessons.morton_codes import takes_bits_in_turn
from accelscope.core.parallel import Team
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh.builders.morton.codes import MortonSettings, codes_of


def around(boxes):
    return np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])


def area(box):
    x, y, z = box[3:] - box[:3]
    return 2.0 * (x * y + y * z + z * x)


@pytest.mark.parametrize("name", ["mess", "flat", "one"])
def test_groups_are_the_triangles_whose_codes_begin_alike(lab, play_lesson, name):
    scene = lab.small_scene(name)
    played, boxes = play_lesson("extended_codes", scene), scene.boxes()
    diagonal = np.linalg.norm(boxes[:, 3:] - boxes[:, :3], axis=1)
    for kind, coded in (("standard", "Standard"), ("extended", "Extended")):
        play = played.play.coded[coded]
        with Team(SILENT, "testing") as team:
            codes = codes_of(boxes, MortonSettings(morton_codes=kind), team)
        for bits in range(MOST_BITS + 1):
            leading = codes >> 63 - bits
            groups = [boxes[leading == each] for each in np.unique(leading)]
            starts, drawn = play.groups[bits]
            assert np.array_equal(np.diff(starts, append=len(boxes)), [len(g) for g in groups])
            assert np.array_equal(drawn, [around(group) for group in groups])
            tests = sum(area(around(g)) * len(g) for g in groups) / area(around(boxes))
            assert play.tests[bits] == pytest.approx(tests, rel=1e-12)
            assert played.row(coded, bits=bits).startswith(str(len(groups)))
            # A bit of the size is set from some share of the scene's diagonal on.
            is_large = play.is_large(bits)
            assert not is_large.any() or kind == "extended"
            share = 0.5 ** int((play.kinds[:bits] == 3).sum())
            limit = np.linalg.norm(around(boxes)[3:] - around(boxes)[:3]) * share
            of_triangle = np.isin(leading, np.unique(leading)[is_large])
            assert (diagonal[of_triangle] >= limit * (1 - 1e-12)).all()
            assert (diagonal[~of_triangle] <= limit * (1 + 1e-12)).all() or share == 1.0
        letters = play.letters(14)
        assert (letters[12], letters[26]) == (("x", "y") if kind == "standard" else ("S", "S"))


def test_they_pay_in_the_sample(play_lesson):
    """As many bits, and fewer tests; the first ones are all of the long side."""
    played = play_lesson("extended_codes")
    six, seven = (float(played.row("Tests, Extended", bits=bits)) for bits in (6, 7))
    assert 10 * seven < six
    assert 2 * seven < float(played.row("Tests, Standard", bits=7))
    assert played.play.coded["Extended"].letters(6) == "x y x y x y"
    assert "orange" in played.picture(bits=7).caption
    assert "orange" not in played.picture(bits=6).caption
    assert [each.bits for each in played.play.on_page(played.lesson, Settings())] == [3, 6, 7, 14]


def test_who_has_such_codes(lab, build):
    scene = lab.small_scene("soup")
    extended = build("bvh", scene, "builder=lbvh,morton_codes=extended", log=True)
    standard = build("bvh", scene, "builder=lbvh", log=True)
    assert has_extended_codes(extended) == takes_bits_in_turn(standard) == ""
    assert "extended" in has_extended_codes(standard)
    assert "standard" in takes_bits_in_turn(extended)
    assert "Morton" in has_extended_codes(build("bvh", scene, log=True))
