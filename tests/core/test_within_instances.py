"""What is drawn of instances: their boxes, the trees of their meshes, and walks through both."""

import numpy as np
import pytest
from accelscope.addon.interface import OwnRays, OwnRaysSettings
from accelscope.core.contract.events import HIT, TEST, VISIT_INNER, VISIT_LEAF
from accelscope.core.contract.outlines import DASHES, faces_of, wires_of
from accelscope.core.contract.within import (
    MOST_BOXES,
    MOST_NODES,
    cells_with_instances,
    chains_of,
    space_of,
    within_of,
)
from accelscope.core.evaluation.records.experiment import Built, make_record, trace_rays
from accelscope.core.evaluation.records.report import counters_in_words, figures
from accelscope.core.geometry.box_shape import corners_of
from accelscope.core.geometry.geometry import boxes_around
from accelscope.core.geometry.instances import flattened, instanced, moved_points
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.lessons import ray_path, walk_in_words
from accelscope.core.scene import Scene
from accelscope.core.structures import structure_named

AFFINE = np.array([[1.0, 0.4, 0.0], [-0.3, 1.2, 0.5], [0.2, 0.0, 0.8]])


def muddle(levels, count=5, seed=0, triangles=40):
    """Return a scene of instances within instances."""
    random = np.random.default_rng(seed)
    level = all_triangles(random.random((triangles, 1, 3)) + 0.2 * random.random((triangles, 3, 3)))
    for depth in range(levels):
        matrices = np.zeros((count, 3, 4))
        matrices[:, :, :3] = AFFINE
        matrices[0, :, :3] = np.eye(3)
        matrices[:, :, 3] = 3.0 ** (depth + 1) * random.random((count, 3))
        level = instanced([level], np.zeros(count, int), matrices)
    return Scene.from_instances(level, "muddle")


def built(scene, name="bvh", log=False):
    kind = structure_named(name)
    return kind.build(scene, kind.Settings(), log=log)


@pytest.mark.parametrize("name", ["bvh", "grid", "naive", "octree"])
@pytest.mark.parametrize("levels", [1, 2])
def test_rows(name, levels):
    """The structure's own first; then every box contains what is in it."""
    scene = muddle(levels)
    structure = built(scene, name)
    own, cells = structure.cells(), cells_with_instances(structure)
    assert cells.n_own is not None
    assert cells.is_dashed is not None
    assert np.array_equal(cells.boxes[: cells.n_own], own.boxes)
    assert len(cells.own()) == len(own) == cells.n_own
    assert cells.own().faces is None
    assert (np.diff(cells.depth) >= 0).all()
    assert len(np.unique(cells.numbers)) == len(cells)
    assert cells.left_out == ()
    level, instance = cells.extra["level"], cells.extra["instance"]
    assert level[cells.is_dashed].tolist() == sorted(5 * list(range(levels)))
    assert (instance[: cells.n_own] == -1).all()
    # Each mesh once: one tree over all items of a mesh on each level.
    for k in range(1, levels + 1):
        here = (level == k) & ~cells.is_dashed
        assert cells.count[here].sum() == (5 if k < levels else 40)
        assert (cells.parents[here] >= 0).all()
    place = np.full(cells.numbers.max() + 1, -1)
    place[cells.numbers] = np.arange(len(cells))
    children = np.flatnonzero((cells.parents >= 0) & (np.arange(len(cells)) >= cells.n_own))
    parents = place[cells.parents[children]]
    assert (cells.depth[children] > cells.depth[parents]).all()
    slack = 1e-12 * scene.diagonal
    # Boxes are around boxes that stand aslant: they may reach out of that above, not of an
    # instance's in world space.
    top = cells.is_dashed[parents] & (level[parents] == 0)
    lower, upper = cells.boxes[parents[top], :3], cells.boxes[parents[top], 3:]
    assert (cells.boxes[children[top], :3] >= lower - slack).all()
    assert (cells.boxes[children[top], 3:] <= upper + slack).all()
    assert np.isfinite(cells.areas).all()
    assert set(cells.attributes()) >= {"level", "instance", "parent"}


def test_boxes_stand_as_their_matrix_says():
    """Drawn are the corners of the object's box, moved, and twelve edges of it."""
    scene = muddle(1)
    cells = cells_with_instances(built(scene))
    places = np.arange(cells.n_own, len(cells))
    wires = wires_of(cells, places)
    owners = wires.edge_owners()
    assert (np.diff(owners) >= 0).all()
    counts = np.bincount(owners, minlength=len(cells))[places]
    assert np.array_equal(counts, np.where(cells.is_dashed[places], 12 * DASHES, 12))
    mesh = scene.geometry.meshes[0]
    own = boxes_around(mesh)
    own = np.concatenate([own[:, :3].min(axis=0), own[:, 3:].max(axis=0)])
    root = places[~cells.is_dashed[places]][0]
    number = int(cells.extra["instance"][root])
    wanted = moved_points(corners_of(own[None])[0], scene.geometry.matrices[number])
    got = np.unique(wires.segments()[owners == root].reshape(-1, 3).round(9), axis=0)
    assert np.allclose(got, np.unique(wanted.round(9), axis=0), atol=1e-8)
    # Dashes are of the edges, and begin and end with them.
    first = places[cells.is_dashed[places]][0]
    dashes = wires.segments()[owners == first].reshape(-1, 3)
    box = cells.boxes[first]
    assert np.allclose((dashes.min(axis=0), dashes.max(axis=0)), box.reshape(2, 3), rtol=1e-15)
    triangles, whose = faces_of(cells, places)
    assert (np.diff(whose) >= 0).all()
    assert len(triangles) == 12 * (~cells.is_dashed[places]).sum() + 12 * cells.is_dashed.sum()


def test_what_is_drawn_is_bounded_and_that_is_said():
    random = np.random.default_rng(0)
    triangles = random.random((MOST_NODES, 1, 3)) + 1e-3 * random.random((MOST_NODES, 3, 3))
    matrices = np.tile(np.eye(3, 4), (MOST_BOXES + 500, 1, 1))
    matrices[:, :, 3] = 100 * random.random((len(matrices), 3))
    many = instanced([all_triangles(triangles)], np.zeros(len(matrices), int), matrices)
    cells = cells_with_instances(built(Scene.from_instances(many, "many")))
    assert cells.n_own is not None
    assert cells.is_dashed is not None
    assert cells.is_dashed.sum() == MOST_BOXES
    assert len(cells) == cells.n_own + MOST_BOXES + MOST_NODES
    boxes, nodes = cells.left_out
    assert boxes == "boxes of 2 000 of 2 500 instances, the largest"
    assert nodes.startswith("20 000 of ")
    assert nodes.endswith(" nodes within instances, those nearest to their roots")


def test_a_log_has_no_steps_for_what_it_does_not_know():
    """They are there when all is built."""
    cells = cells_with_instances(built(muddle(1), log=True))
    order = cells.extra["order"]
    assert (order[cells.n_own :] == order.max()).all()
    assert (cells.replaced[cells.n_own :] > order.max()).all()


@pytest.mark.parametrize(
    ("name", "levels"),
    [
        ("bvh", 1), ("grid", 1), ("bvh", 2),
        *(pytest.param(*each, marks=pytest.mark.exhaustive)
          for each in (("bvh", 3), ("naive", 2), ("grid", 2), ("octree", 1))),
    ],
)  # fmt: skip
def test_a_walk_is_drawn_where_it_went(name, levels):
    """Every node that was entered within an instance has the ray's point of entry on it."""
    scene = muddle(levels, count=4, seed=levels)
    structure = built(scene, name)
    random = np.random.default_rng(5)
    corners, _ = flattened(scene.geometry)
    targets = corners[random.integers(len(corners), size=30)].mean(axis=1)
    origins = targets + scene.diagonal * random.normal(size=(30, 3))
    rays = Rays.from_arrays(origins, targets - origins)
    hits, counts = structure.trace(rays)
    assert (hits.primitive >= 0).all()
    by_name = counts.by_name()
    cells = cells_with_instances(structure)
    for ray in range(0, len(rays), 3):
        steps = structure.record(rays, ray)
        assert steps.tally() == {name: values[ray] for name, values in by_name.items()}
        walk = ray_path.Walk(structure, cells, rays, ray, float(hits.t[ray]), steps)
        chains = chains_of(steps, levels)
        assert np.array_equal((chains >= 0).sum(axis=1), steps.level)
        inside = np.flatnonzero((steps.level > 0) & np.isin(steps.kind, (VISIT_INNER, VISIT_LEAF)))
        for event in inside[:: max(len(inside) // 20, 1)]:
            space = space_of(structure, chains[event])
            inverse = np.linalg.inv(space.matrix[:, :3])
            entry = walk.at(steps.t_enter[event : event + 1])[0]
            local = inverse @ (entry - space.matrix[:, 3])
            box = space.boxes[steps.cell[event]]
            slack = 1e-9 * scene.diagonal
            assert (local >= box[:3] - slack).all()
            assert (local <= box[3:] + slack).all()
        # What is found at last is the triangle that the hit is numbered by.
        last = np.flatnonzero((steps.level == 0) & np.isin(steps.kind, (HIT, 7)))[-1:]
        (bottom,) = within_of(steps, last, levels)
        if name != "grid":
            space = space_of(structure, chains[bottom])
            found = moved_points(space.geometry.corners[steps.primitive[bottom]], space.matrix)
            assert np.allclose(found, corners[hits.primitive[ray]], atol=1e-9 * scene.diagonal)
        segments, colours = ray_path.segments_of(walk)
        assert np.isfinite(segments).all()
        assert len(segments) == len(colours)
        for event in range(0, len(steps), max(len(steps) // 10, 1)):
            ray_path.segments_of(walk, event)
            assert walk_in_words.event_text(steps, event)
            assert walk_in_words.legend(walk, event) is not None


def test_a_walk_in_words():
    scene = muddle(2)
    structure = built(scene)
    corners, _ = flattened(scene.geometry)
    rays = Rays.from_arrays(corners[:1].mean(axis=1) - (0, 0, 50), [[0, 0, 1.0]])
    steps = structure.record(rays, 0)
    texts = [walk_in_words.event_text(steps, event) for event in range(len(steps))]
    assert any(text.startswith("test instance ") and " in " not in text for text in texts)
    assert any(text.startswith("test instance ") and " in instance " in text for text in texts)
    assert any(text.startswith("test triangle ") and " in instance " in text for text in texts)
    hits, _ = structure.trace(rays)
    walk = ray_path.Walk(structure, structure.cells(), rays, 0, float(hits.t[0]), steps)
    legend = [text for _, text in walk_in_words.legend(walk)]
    assert any("instance" in text and "tested" in text for text in legend)
    assert any(text.endswith("in instances") for text in legend)
    tested = int(((steps.kind == TEST) & (steps.level == 2)).sum())
    assert f"{tested} triangles tested" in legend


def test_figures_say_what_is_tested_on_which_level():
    scene = muddle(2)
    structure = Built(built(scene), 0.0)
    rays = Rays.from_arrays(np.zeros((3, 3)), np.ones((3, 3)))
    record = make_record(structure, trace_rays(structure, OwnRays, OwnRaysSettings(), rays))
    labels = {label for section, label, _ in figures(record) if section == "Per ray"}
    tests = {label for label in labels if label.startswith("N_IT")}
    first, second = "N_IT instance tests", "N_IT triangle tests"
    assert tests == {first, f"{first}, level 1", f"{second}, level 2"}
    said = counters_in_words(record)
    assert said.count("instance tests") == 2
    assert said.count("triangle tests") == 1
    assert ("Scene", "Instances", "5") in figures(record)
    flat = Built(built(scene.flat()), 0.0)
    record = make_record(flat, trace_rays(flat, OwnRays, OwnRaysSettings(), rays))
    assert "instance" not in counters_in_words(record)
    assert not any("nstance" in label for _, label, _ in figures(record))
