"""Lesson "adaptive traversal": what a walk remembers is what its stack or heap held."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.contract.events import SKIP, VISIT_INNER
from accelscope.core.errors import InputError
from accelscope.core.geometry.rays import Rays
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.adaptive_traversal import WALKS, Settings
from accelscope.core.lessons.lesson import Subject, build
from accelscope.core.progress import SILENT

LESSON = lesson_named("adaptive_traversal")
SPECS = "octree:max_depth=4,max_leaf_size=4", "kdtree:planes=sah,max_leaf_size=3"


def rays_through(scene, count=12, seed=7):
    rng = np.random.default_rng(seed)
    ways = rng.normal(size=(count, 3))
    inside = scene.lower + rng.random((count, 3)) * (scene.upper - scene.lower)
    return Rays.from_arrays(inside - 3.0 * scene.diagonal * ways, ways)


def met_by(boxes, rays):
    """Whether a ray meets boxes: slabs, without any margin."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a = (boxes[:, :3] - rays.origins[0]) / rays.directions[0]
        b = (boxes[:, 3:] - rays.origins[0]) / rays.directions[0]
    return np.minimum(a, b).max(axis=1) <= np.maximum(a, b).min(axis=1)


@pytest.mark.parametrize("spec", SPECS)
@pytest.mark.parametrize("name", ["one", "flat", "mess", "suzanne"])
def test_what_is_remembered_is_what_was_put_aside(lab, name, spec):
    scene = lab.small_scene(name)
    tree = build(scene, spec)
    rays = rays_through(scene)
    # Others than these meet several planes at once: the marching walks leave them to the stack.
    for ray in range(len(rays)):
        try:
            play = LESSON.play(Subject(scene, (tree,), rays, ray), Settings(), SILENT)
        except InputError:
            continue
        leaves = [
            each.walked.steps.cell[each.walked.visits].tolist() for each in play.walks.values()
        ]
        assert all(each == leaves[0] for each in leaves)
        for walk, each in play.walks.items():
            assert each.walked.counts == tree.walked_by(*WALKS[walk][:2]).record(rays, ray).tally()
            assert len(each.nodes) == each.walked.counts["N_TS"] + int((each.kinds == SKIP).sum())
        cells = tree.cells()
        met = set(cells.numbers[met_by(cells.boxes, play.walks["heap"].walked.rays)].tolist())
        for walk in ("recursive", "heap"):
            check_discipline(play.walks[walk], cells, met)


def check_discipline(each, cells, met):
    """Assert last in, first out, or the nearest first; and that nothing else was put aside."""
    parents = dict(zip(cells.numbers.tolist(), cells.parents.tolist(), strict=True))
    pushed = dict(zip(each.held[:, 0].tolist(), each.held[:, 1].tolist(), strict=True))
    enter = dict(
        zip(each.nodes.tolist(), each.walked.steps.t_enter[each.events].tolist(), strict=True)
    )
    seen = set()
    for event, node in enumerate(each.nodes.tolist()):
        before = each.remembered(event - 1) if event else []
        if node in pushed:
            assert node in before
            if each.name == "recursive":
                assert pushed[node] == max(pushed[other] for other in before)
            else:
                assert enter[node] <= min(enter[other] for other in before) + 1e-9
        seen.add(node)
        # Children that the ray meets, of what it has entered: all of them, and no others.
        inner = {n for n, k in zip(each.nodes[: event + 1].tolist(), each.kinds, strict=False)
                 if k == VISIT_INNER}  # fmt: skip
        want = {n for n in met if parents[n] in inner and n not in seen}
        now = set(each.remembered(event))
        in_hand = set()
        if each.name == "recursive" and event + 1 < len(each.nodes):
            following = int(each.nodes[event + 1])
            in_hand = {following} if parents[following] == node else set()
        assert now == want - in_hand


def test_rows_and_the_nodes_above(lab):
    scene = lab.small_scene("suzanne")
    tree = build(scene, SPECS[0])
    play = LESSON.play(Subject(scene, (tree,)), Settings(), SILENT)
    picture = play.picture(Settings("all", play.ends["event"]))
    rows = {row.label: row.text for row in picture.rows}
    for each in play.walks.values():
        counts = each.walked.counts
        assert rows[each.label].startswith(f"N_TS {counts['N_TS']}, leaves {counts['N_ETS']}")
    assert rows["Stored Links"] == str(int((tree.ropes >= 0).sum()))
    root = play.walks["march"]
    # Every leaf from the root: the levels above each leaf, and the leaf.
    depth = root.walked.cells.depth[root.walked.places]
    assert root.walked.counts["N_TS"] == int((depth + 1).sum())
    above = play.walks["neighbours"]
    for event in range(len(above.nodes)):
        boxes = above.walked.cells.boxes[above.walked.cells.places_of(above.nodes[[event]])]
        chain = above.remembered(event)
        assert (
            len(chain)
            == above.walked.cells.depth[above.walked.cells.places_of(above.nodes[[event]])][0]
        )
        if chain:
            outer = above.walked.cells.boxes[above.walked.cells.places_of(np.array(chain))]
            assert (outer[:, :3] <= boxes[:, :3]).all()
            assert (outer[:, 3:] >= boxes[:, 3:]).all()
    for walk in WALKS:
        for event in (0, 5, play.ends["event"]):
            picture = play.picture(Settings(walk, event))
            assert np.isfinite(picture.points()).all()
            assert len(picture.marks) <= 15


def test_what_has_no_neighbours_is_refused(lab):
    scene = lab.small_scene("one")
    assert "no octree or kd-tree" in LESSON.suits(build(scene, "bvh"))
    assert "lazy" in LESSON.suits(build(scene, "octree:lazy=true"))
    assert not LESSON.suits(build(scene, "kdtree"))
    tree = build(scene, "octree")
    past = Rays.from_arrays([[0.0, 0.0, 99.0]], [[1.0, 0.0, 0.0]])
    with pytest.raises(InputError, match="misses the tree"):
        LESSON.play(Subject(scene, (tree,), past), Settings(), SILENT)
