"""Each class of rays goes to its own structure, and nothing of the answers is changed by that."""

import dataclasses
import json

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays.workloads import RandomLinesSettings, RandomLinesWorkload
from accelscope.core.evaluation.records.experiment import Built, make_record, trace_rays
from accelscope.core.evaluation.records.report import figures, flatten, spec_of
from accelscope.core.geometry.rays import ANY, CLOSEST, Rays
from accelscope.core.settings import parse, parse_spec
from accelscope.core.structures import structure_named
from accelscope.core.structures.routed import PARTS, ROUTES, Routed, chosen

CLASSES = ("primary", "shadow", "reflected")


@pytest.fixture(scope="module")
def scene(lab):
    return lab.small_scene("suzanne")


@pytest.fixture(scope="module")
def rays(lab, scene):
    """Rays of every awkward kind, their classes in turn; shadow rays ask for any hit."""
    batch, _ = lab.batch_of(lab.ray_families(scene, 12))
    classes = np.arange(len(batch)) % 3
    return Rays.from_arrays(
        batch.origins, batch.directions, classes=classes, class_names=CLASSES,
        queries=np.where(classes == 1, ANY, CLOSEST),
    )  # fmt: skip


def settings_of(text):
    _, texts = parse_spec(f"routed:{text}")
    return parse(Routed.Settings, texts, "routed")


def built(scene, text):
    return Routed.build(scene, settings_of(text))


def alone(scene, name, **changes):
    kind = structure_named(name)
    return kind.build(scene, dataclasses.replace(kind.Settings(), **changes))


MIX = "shadow=grid,primary=kdtree,other=octree"


def test_every_class_is_answered_by_its_structure(scene, rays):
    hits, counts = built(scene, MIX).trace(rays)
    assert {each.name for each in counts.counters} == {
        each.name for name in ("grid", "kdtree", "octree") for each in PARTS[name].COUNTERS
    }
    for number, name in enumerate(("kdtree", "grid", "octree")):
        which = np.flatnonzero(rays.classes == number)
        want, wanted = alone(scene, name).trace(rays.select(which))
        assert hits.t[which].tobytes() == want.t.tobytes()
        assert hits.primitive[which].tobytes() == want.primitive.tobytes()
        counted = wanted.by_name()
        for counter in counts.counters:
            values = counts[counter.name][which]
            assert np.array_equal(values, counted.get(counter.name, np.zeros(len(which))))


@pytest.mark.parametrize("name", [name for name, part in PARTS.items() if part.answers is None])
def test_hits_are_those_of_brute_force(scene, rays, name):
    text = f"primary={name},shadow={name},other=naive"
    hits, _ = built(scene, text).trace(rays, CLOSEST)
    want, _ = alone(scene, "naive").trace(rays, CLOSEST)
    assert hits.t.tobytes() == want.t.tobytes()
    assert hits.primitive.tobytes() == want.primitive.tobytes()


def test_a_structure_for_several_classes_is_built_once(scene):
    routed = built(scene, "primary=bvh,shadow=bvh,other=bvh")
    assert [part.name for part in routed.parts] == ["bvh"]
    assert routed.memory() == routed.parts[0].memory()
    routed = built(scene, 'primary=bvh,shadow=bvh,shadow_settings="builder=lbvh",other=bvh')
    assert [part.settings.builder for part in routed.parts] == ["binned_sah", "lbvh"]
    assert routed.routes == {"primary": 0, "shadow": 1, "other": 0}
    assert routed.memory() == sum(part.memory() for part in routed.parts)


@pytest.mark.parametrize("text", [MIX, "shadow=bsp,primary=grid", "shadow=bvh"])
def test_steps_are_those_of_the_part_and_name_its_cells(scene, rays, text):
    """Also of cells that are no boxes; the last one has the parts of a class alone."""
    routed = built(scene, text)
    cells = routed.cells()
    place = np.empty(len(cells), np.int64)
    place[cells.numbers] = np.arange(len(cells))
    _, counts = routed.trace(rays)
    part_of = routed.parts_of(rays)
    for index in range(0, len(rays), 37):
        steps = routed.record(rays, index)
        part = routed.parts[part_of[index]]
        own, theirs = part.record(rays, index), part.cells()
        tally = steps.tally()
        assert tally == {name: counts[name][index] for name in tally}
        assert np.array_equal(steps.kind, own.kind)
        entered = own.cell >= 0
        assert np.array_equal(steps.cell >= 0, entered)
        places = place[steps.cell[entered]]
        assert (cells.extra["part"][places] == part_of[index]).all()
        order = np.argsort(theirs.numbers)
        wanted = theirs.boxes[order][own.cell[entered]]
        assert np.array_equal(cells.boxes[places], wanted)


def test_boxes_are_given_sides_beside_cells_that_are_none(scene):
    routed = built(scene, "shadow=bsp,primary=grid")
    cells, (bsp, grid) = routed.cells(), (alone(scene, "bsp").cells(), alone(scene, "grid").cells())
    sides = np.bincount(cells.faces.owners, minlength=len(cells))
    is_grid = cells.extra["part"] == routed.routes["primary"]
    assert (sides[is_grid] == 6).all()
    assert is_grid.sum() == len(grid)
    order = np.argsort(bsp.numbers)
    of_bsp = np.flatnonzero(cells.extra["part"] == routed.routes["shadow"])
    by_number = of_bsp[np.argsort(cells.numbers[of_bsp])]
    assert np.array_equal(
        sides[by_number], np.bincount(bsp.faces.owners, minlength=len(bsp))[order]
    )
    assert np.array_equal(cells.attributes()["area"][by_number], bsp.attributes()["area"][order])


def test_a_record_names_every_structure_and_its_share(scene, rays):
    routed = built(scene, MIX)
    lines = RandomLinesSettings(count=10)
    traced = trace_rays(Built(routed, 0.0), RandomLinesWorkload, lines, rays)
    record = make_record(Built(routed, 0.0), traced)
    assert json.loads(json.dumps(record, allow_nan=False)) == record
    routes = record["trace"]["routes"]
    assert {n: route["structure"] for n, route in routes.items()} == {
        "primary": "kdtree", "shadow": "grid", "reflected": "octree",
    }  # fmt: skip
    assert sum(route["share"] for route in routes.values()) == pytest.approx(1.0)
    for number, name in enumerate(CLASSES):
        assert routes[name]["rays"] == (rays.classes == number).sum()
        assert routes[name]["share"] == routes[name]["rays"] / len(rays)
    assert flatten(record)["trace.routes.shadow.structure"] == "grid"
    for name, part in (("primary", "kdtree"), ("shadow", "grid"), ("other", "octree")):
        own = alone(scene, part).statistics()
        assert record["statistics"][name]["N_OIV"] == own.N_OIV
        assert record["statistics"][name]["sah"] == own.sah
        section = f"{name.capitalize()} rays: structure"
        assert ("SAH cost", f"{own.sah:.2f}") in {
            row[1:] for row in figures(record) if row[0] == section
        }
    assert any(row[:2] == ("Rays", "Reflected rays") for row in figures(record))
    # A structure that answers alone names none.
    plain = alone(scene, "grid")
    traced = trace_rays(Built(plain, 0.0), RandomLinesWorkload, lines, rays)
    assert "routes" not in make_record(Built(plain, 0.0), traced)["trace"]


def test_a_part_that_does_not_answer_a_class_refuses_it_by_name(scene, rays, monkeypatch):
    routed = built(scene, "shadow=grid,primary=bvh")
    monkeypatch.setattr(PARTS["grid"], "answers", ("primary",))
    with pytest.raises(InputError, match="routed: grid answers primary rays only, not shadow ones"):
        routed.trace(rays)
    routed.trace(rays.select(rays.classes == 0))


def test_settings_of_parts(scene):
    text = 'shadow=grid,shadow_settings="resolution=3x4x5,mailbox=true",primary=bvh'
    settings = settings_of(text)
    _, grid = chosen(settings)["shadow"]
    assert (grid.resolution, grid.mailbox) == ((3, 4, 5), True)
    assert built(scene, text).statistics().extra["shadow"]["resolution"] == [3, 4, 5]
    record = {"name": "routed", "settings": dataclasses.asdict(settings)}
    assert settings_of(spec_of(record).partition(":")[2]) == settings
    for wrong, words in (
        ("shadow_settings=densty=3", "structure routed, shadow: grid has no setting 'densty'"),
        ("shadow_settings=x", "structure routed, shadow: grid: 'x' in 'grid:x' is not of the form"),
        ("other_settings=max_leaf_size=-1", "routed, other: bvh: max_leaf_size must be at least 1"),
    ):
        with pytest.raises(InputError, match=words):
            Routed.refuse_too_large(scene, settings_of(wrong))
    for route in ROUTES:
        with pytest.raises(InputError, match=f"{route} is one of .*, not 'routed'"):
            settings_of(f"{route}=routed")


def test_a_part_may_be_lazy(scene, rays):
    text = 'shadow=grid,shadow_settings="lazy=true",primary=naive,other=naive'
    routed = built(scene, text)
    before = routed.cells()
    hits, counts = routed.trace(rays)
    want, wanted = built(scene, "shadow=grid,primary=naive,other=naive").trace(rays)
    assert hits.t.tobytes() == want.t.tobytes()
    assert np.array_equal(counts.values, wanted.values)
    made = routed.made()
    assert made.cells == routed.cells().extra["is_made"].sum() > 0
    assert np.array_equal(np.sort(before.numbers), np.sort(routed.cells().numbers))
    assert routed.validate() == []
    for index in range(1, len(rays), 300):  # a shadow ray
        assert set(routed.record(rays, index).cell) <= {-1, *routed.cells().numbers.tolist()}
    assert routed.made() == made


def test_damage_in_a_part_is_found(scene):
    routed = built(scene, "shadow=grid")
    (grid,) = (part for part in routed.parts if part.name == "grid")
    grid.arrays = grid.arrays._replace(offsets=grid.arrays.offsets + 1)
    assert routed.validate() == ["grid: cell offsets do not partition the references"]
