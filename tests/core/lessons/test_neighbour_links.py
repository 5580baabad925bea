"""Lesson "neighbour links": the links of a leaf, and which of them the ray takes."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.lesson import Subject, build
from accelscope.core.lessons.neighbour_links import FACES, Settings
from accelscope.core.progress import SILENT

LESSON = lesson_named("neighbour_links")


@pytest.mark.parametrize("spec", ["octree:max_depth=4,max_leaf_size=4", "kdtree:max_leaf_size=4"])
@pytest.mark.parametrize("name", ["one", "flat", "mess", "suzanne"])
def test_links_lead_to_the_smallest_node_that_covers_a_face(lab, name, spec):
    scene = lab.small_scene(name)
    tree = build(scene, spec)
    play = LESSON.play(Subject(scene, (tree,)), Settings(), SILENT)
    cells = tree.cells()
    box_of = dict(zip(cells.numbers.tolist(), cells.boxes, strict=True))
    parents = dict(zip(cells.numbers.tolist(), cells.parents.tolist(), strict=True))
    last = play.ends["number"]
    for number in sorted({round(i) for i in np.linspace(0, last, 25)}):
        picture = play.picture(Settings("any", number=number))
        assert np.isfinite(picture.points()).all()
        leaf = int(play.leaves[number])
        rows = {row.label: row.text for row in picture.rows}
        linked = []
        for face, called in enumerate(FACES):
            text = rows[f"Face {called}"]
            axis, sign = face % 3, 1 if face > 2 else -1
            if text == "none":
                assert box_of[leaf][face] == box_of[0][face]
                continue
            node = int(text.split(",")[0].split()[-1])
            linked.append(node)
            # Behind the very face, and covering all of it.
            there, box = box_of[node], box_of[leaf]
            assert there[(face + 3) % 6] == box[face]
            others = [a for a in range(3) if a != axis]
            for a in others:
                assert there[a] <= box[a]
                assert there[3 + a] >= box[3 + a]
            assert sign * (there[axis] + there[3 + axis]) >= sign * 2.0 * box[face]
            assert ("inner" in text) == (not cells.is_leaf[cells.numbers == node][0])
            # No child of it covers the face.
            for child in (n for n, above in parents.items() if above == node):
                smaller = box_of[child]
                assert (
                    smaller[(face + 3) % 6] != box[face]
                    or any(smaller[a] > box[a] or smaller[3 + a] < box[3 + a] for a in others)
                    or np.array_equal(smaller, there)
                    or (box[:3] == box[3:]).any()
                )
        assert sorted(linked) == sorted(tree.links(leaf).tolist())
        assert f"{len(linked)} link" in picture.caption


def test_the_link_that_is_taken_is_that_of_the_log(lab):
    scene = lab.small_scene("suzanne")
    tree = build(scene, "octree:max_depth=5,max_leaf_size=4")
    play = LESSON.play(Subject(scene, (tree,)), Settings(), SILENT)
    walked = play.walked
    count = len(walked.visits)
    assert count > 3
    inner = 0
    for entered in range(count):
        picture = play.picture(Settings("ray", entered))
        taken = [row for row in picture.rows if row.text.endswith("taken by the ray")]
        if entered == count - 1:
            assert not taken
            assert "ends" in picture.caption
            continue
        (row,) = taken
        node = int(row.text.split(",")[0].split()[-1])
        # The next leaf lies in the node, and touches the leaf in the face that is named.
        box = walked.cells.boxes[walked.places[entered]]
        following = walked.cells.boxes[walked.places[entered + 1]]
        outer = walked.cells.boxes[walked.cells.places_of(np.array([node]))[0]]
        assert (outer[:3] <= following[:3]).all()
        assert (outer[3:] >= following[3:]).all()
        face = FACES.index(row.label.split()[1])
        assert following[(face + 3) % 6] == box[face]
        inner += "inner" in row.text
    assert inner > 0
