"""Partial re-braiding: what is opened, where it stops, and that it saves steps where it should."""

import numpy as np
from accelscope.core.geometry.instances import instanced
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.lessons.figures import lines_through
from accelscope.core.scene import Scene
from accelscope.sample_scenes import make_sample
from test_two_level import built, same_hits

PARTIAL = "two_level:rebraid=partial"


def strip(count):
    """Triangles in a row along x, each 1 long, with gaps."""
    one = np.array([[0.0, 0, 0], [0.9, 0, 0], [0.4, 0.5, 0.3]])
    return one + 1.0 * np.arange(count)[:, None, None] * np.array([1.0, 0.0, 0.0])


def scene(shifts, count=16):
    """Strips that begin at some places, (n, 3)."""
    places = np.tile(np.eye(3, 4), (len(shifts), 1, 1))
    places[:, :, 3] = shifts
    mesh = all_triangles(strip(count))
    return Scene.from_instances(instanced([mesh], np.zeros(len(shifts), int), places), "strips")


def opened_in(shifts, spec=PARTIAL, **changed):
    settings = ",".join(f"{key}={value}" for key, value in changed.items())
    structure = built(spec + ("," + settings if settings else ""), scene(shifts))
    assert structure.validate() == []
    return len(structure.braid.opened), len(structure.braid.references.owner), structure


def test_one_instance_is_never_opened():
    """All references are of one: its own tree has divided it."""
    assert opened_in([[0.0, 0, 0]])[:2] == (0, 1)


def test_few_that_do_not_overlap_are_not_opened():
    apart = [[0.0, 3.0 * k, 0] for k in range(4)]
    assert opened_in(apart)[:2] == (0, 4)
    # One more is not looked at pair by pair.
    assert opened_in([*apart, [0.0, 12.0, 0]])[0] > 0


def test_what_overlaps_is_opened_as_far_as_the_budget_goes():
    two = [[0.0, 0, 0], [0.5, 0.1, 0]]
    for budget, references in ((1, 2), (2, 4), (5, 10)):
        opened, found, _ = opened_in(two, budget=budget, room=0)
        assert found == references
        assert opened == references - 2
    # Nothing but leaves of the strips' trees is left, or parts that few of do not overlap.
    found = opened_in(two, budget=1000, room=0)[1]
    assert found < 2 * 16 + 1
    assert opened_in(two, budget=1, room=7)[1] == 7


def test_only_what_is_long_is_opened():
    """With a share of 1 nothing is longer than the node, and of two, moved, each is shorter."""
    two = [[0.0, 0, 0], [0.5, 0.1, 0]]
    assert opened_in(two, extent=1.0)[0] == 0
    # Both are 16 of 16.5 long, a share of 0.97; their halves are 8.
    assert opened_in(two, extent=0.98)[0] == 0
    assert opened_in(two, extent=0.96)[0] > 0


def test_a_singular_instance_is_not_opened_and_never_hit():
    shifts = [[0.0, 0, 0], [0.5, 0.1, 0], [0.2, 0.2, 0]]
    flat = scene(shifts)
    places = flat.geometry.matrices.copy()
    places[1, :, 2] = 0.0
    geometry = instanced(flat.geometry.meshes, flat.geometry.which, places)
    one_flat = Scene.from_instances(geometry, "one flat")
    structure = built(PARTIAL, one_flat)
    assert structure.validate() == []
    assert 1 not in structure.braid.opened[:, 0]
    same_hits(structure, built("naive", one_flat), lines_through(one_flat))


def test_leaves_hold_one_reference_each_and_boxes_what_is_in_them():
    _, _, structure = opened_in([[0.0, 0, 0], [0.5, 0.1, 0], [0.9, -0.1, 0.2]])
    tree, references = structure.braid.tree, structure.braid.references
    assert set(tree.size.tolist()) == {0, 1}
    forest, geometry = structure.instances.forest, structure.scene.geometry
    for box, owner, node in zip(*references, strict=True):
        inside = forest.volumes.boxes()[node].reshape(2, 3) + geometry.matrices[owner, :, 3]
        assert (box[:3] < inside[0]).all()
        assert (box[3:] > inside[1]).all()
        assert np.abs(box.reshape(2, 3) - inside).max() < 1e-4


def test_overlapping_instances_cost_fewer_steps_and_the_flattened_tree_fewer_still():
    """Measured with the default settings; a pin of our own beside it."""
    overlapping = make_sample("overlapping")
    rays = lines_through(overlapping)
    naive = built("naive", overlapping)
    steps = {}
    for spec in ("two_level", PARTIAL):
        _, counts = same_hits(built(spec, overlapping), naive, rays)
        steps[spec] = counts["N_TS"].mean() + counts["N_TS_1"].mean()
    _, counts = built("bvh", overlapping.flat()).trace(rays)
    assert counts["N_TS"].mean() < steps[PARTIAL] < 0.75 * steps["two_level"]


def test_instances_apart_are_opened_in_vain():
    """As the rules are: where there are many, what is long is opened, overlapping or not."""
    crowd = make_sample("crowd:figures=9,triangles=1000")
    before, after = built("two_level", crowd), built(PARTIAL, crowd)
    extra = after.statistics().extra
    assert extra["references_per_instance"] > 2.0
    assert extra["sah_rebraided"] > 0.9 * extra["sah_two_levels"]
    same_hits(after, before, lines_through(crowd))
