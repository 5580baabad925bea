"""Scenes that mean harm: the hits of brute force and a valid structure, or one clear refusal.

One that fails is run again by its seed::

    pytest "tests/core/test_hostile_scenes.py::test_a_hostile_scene[17]"

and any other of the many with ``ACCELSCOPE_HOSTILE_SEED=12345`` and ``-k the_seed``.
"""

import os
import re
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.pages.pictures import Gallery
from accelscope.core.evaluation.rays.workloads import RandomLinesSettings, RandomLinesWorkload
from accelscope.core.evaluation.records.experiment import Built, make_record, trace
from accelscope.core.geometry.rays import ANY, CLOSEST, Rays
from accelscope.core.scene import Scene
from accelscope.core.structures import general_structures, structures

Generator = np.random.Generator


def soup(rng: Generator, n: int, size: float = 0.3) -> np.ndarray:
    """Return n triangles (n, 3, 3) with corners up to `size` from points in the unit cube."""
    return rng.random((n, 1, 3)) + size * (rng.random((n, 3, 3)) - 0.5)


def far_away(rng: Generator, n: int) -> np.ndarray:
    """A scene 10^3 to 10^14 times its size away from the origin."""
    return soup(rng, n) + 10.0 ** rng.uniform(3, 14) * rng.choice([-1.0, 0.0, 1.0], size=3)


def flat(rng: Generator, n: int) -> np.ndarray:
    """All in one plane, parallel to two axes."""
    triangles = soup(rng, n)
    triangles[:, :, rng.integers(3)] = rng.choice([0.0, 1.0, 0.1, -1e9])
    return triangles


def tilted_plane(rng: Generator, n: int) -> np.ndarray:
    """All in one plane but for rounding."""
    u, v = rng.normal(size=(2, 3))
    weights = soup(rng, n)[:, :, :2]
    return weights[..., :1] * u + weights[..., 1:] * v


def subnormal(rng: Generator, n: int) -> np.ndarray:
    """One or two axes so short that numbers there are subnormal, or nearly."""
    triangles = soup(rng, n)
    for axis in rng.choice(3, size=rng.integers(1, 3), replace=False):
        triangles[:, :, axis] *= 10.0 ** rng.uniform(-323, -290)
    return triangles


def thin_axis(rng: Generator, n: int) -> np.ndarray:
    """One axis 10^-8 to 10^-200 of the others."""
    triangles = soup(rng, n)
    triangles[:, :, rng.integers(3)] *= 10.0 ** rng.uniform(-200, -8)
    return triangles


def huge_or_tiny(rng: Generator, n: int) -> np.ndarray:
    """Sizes from 10^-99 to 10^99."""
    return soup(rng, n) * 10.0 ** rng.uniform(-99, 99)


def not_numbers(rng: Generator, n: int) -> np.ndarray:
    """NaN and infinities among the corners."""
    triangles = soup(rng, n)
    bad = rng.random(triangles.shape) < 0.03
    triangles[bad] = rng.choice([np.nan, np.inf, -np.inf, 1e300], size=bad.sum())
    return triangles


def duplicates(rng: Generator, n: int) -> np.ndarray:
    """A few triangles many times, in shuffled order and with their corners turned."""
    few = soup(rng, max(n // 8, 1), 0.8)
    triangles = few[rng.integers(len(few), size=n)]
    turn = rng.integers(3, size=n)
    return np.stack([np.roll(each, k, axis=0) for each, k in zip(triangles, turn, strict=True)])


def slivers(rng: Generator, n: int) -> np.ndarray:
    """Needles 10^-3 to 10^-17 of their length wide."""
    ends = rng.random((n, 2, 3))
    between = ends[:, 0] + rng.random((n, 1)) * (ends[:, 1] - ends[:, 0])
    between += 10.0 ** rng.uniform(-17, -3, size=(n, 1)) * rng.normal(size=(n, 3))
    return np.concatenate([ends, between[:, None]], axis=1)


def collinear(rng: Generator, n: int) -> np.ndarray:
    """Corners on one line but for rounding, among ordinary triangles."""
    a, b = rng.normal(size=(2, n, 1, 3))
    needles = a + rng.uniform(-2, 2, size=(n, 3, 1)) * b
    return np.concatenate([needles, soup(rng, n)])[:n]


def lattice(rng: Generator, n: int) -> np.ndarray:
    """Corners on a lattice of whole numbers: everything lies in cell walls."""
    return rng.integers(0, rng.integers(2, 9), size=(n, 3, 3)).astype(float)


def two_clusters(rng: Generator, n: int) -> np.ndarray:
    """Two dense heaps 10^3 to 10^12 of their sizes apart."""
    triangles = soup(rng, n)
    triangles[n // 2 :] += 10.0 ** rng.uniform(3, 12) * rng.normal(size=3)
    return triangles


def mixed_scales(rng: Generator, n: int) -> np.ndarray:
    """Triangles whose sizes span twelve orders of magnitude, round one point."""
    return soup(rng, n, 1.0) * 10.0 ** rng.uniform(-6, 6, size=(n, 1, 1))


def no_area(rng: Generator, n: int) -> np.ndarray:
    """Points and lines among triangles."""
    triangles = soup(rng, n)
    kind = rng.random(n)
    points, lines = kind < 0.4, kind > 0.7
    triangles[points] = triangles[points][:, :1]
    triangles[lines, 2] = triangles[lines, 1]
    triangles[0] = rng.random((3, 3))
    return triangles


def hub(rng: Generator, n: int) -> np.ndarray:
    """A disc of triangles round one corner, turned anyhow."""
    angle = np.linspace(0.0, 2.0 * np.pi, n + 1)
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros(n + 1)], axis=1)
    turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    disc = np.stack([np.zeros((n, 3)), rim[:-1], rim[1:]], axis=1)
    return disc @ turned.T + rng.normal(size=3)


def concentric(rng: Generator, n: int) -> np.ndarray:
    """Triangles of one shape and centre, each a little larger than the one before."""
    shape = rng.normal(size=(3, 3))
    shape -= shape.mean(axis=0)
    return shape * (1.0 + np.arange(n)[:, None, None] / n) + rng.normal(size=3)


def through_one_point(rng: Generator, n: int) -> np.ndarray:
    """Large triangles that all contain one point."""
    triangles = rng.normal(size=(n, 3, 3))
    return triangles - triangles.mean(axis=1, keepdims=True) + rng.normal(size=3)


def long_diagonals(rng: Generator, n: int) -> np.ndarray:
    """Thin triangles from one end of the scene to the other, parallel to each other."""
    start = 0.3 * rng.random((n, 1, 3))
    along = rng.choice([-1.0, 1.0], size=3)
    return start + np.stack([np.zeros((n, 3)), np.tile(along, (n, 1)), along + 0.01 * rng.normal(
        size=(n, 3))], axis=1)  # fmt: skip


def few(rng: Generator, n: int) -> np.ndarray:
    """One to three triangles."""
    return soup(rng, int(rng.integers(1, 4)), 2.0)


KINDS: dict[str, Callable[[Generator, int], np.ndarray]] = {
    make.__name__: make
    for make in (
        far_away, flat, tilted_plane, subnormal, thin_axis, huge_or_tiny, not_numbers, duplicates,
        slivers, collinear, lattice, two_clusters, mixed_scales, no_area, hub, concentric,
        through_one_point, long_diagonals, few,
    )
}  # fmt: skip


def make_hostile(seed: int) -> tuple[str, np.ndarray]:
    """Return the name of its kind and the triangles, (n, 3, 3) float64, of one scene."""
    rng = np.random.default_rng(seed)
    name = list(KINDS)[seed % len(KINDS)]
    count = int(rng.choice([8, 24, 60, 150]))
    with np.errstate(under="ignore"):
        triangles = KINDS[name](rng, count)
        if rng.random() < 0.15:
            triangles = triangles * 10.0 ** rng.uniform(-30, 30)
    return name, triangles


# ----------------------------------------------------------------------------------- the comparison

MANY, ALL_OF_THEM = 200, 10_000


def rays_over(lab, scene, rng):
    """Return rays of every family, and (n,) the family of each."""
    with np.errstate(all="ignore"):
        families = lab.ray_families(scene, 6, int(rng.integers(1 << 30)))
    # What overflows on the way is no ray.
    kept = {}
    for name, (origins, directions) in families.items():
        fine = np.isfinite(origins).all(1) & np.isfinite(directions).all(1) & directions.any(1)
        if fine.any():
            kept[name] = origins[fine], directions[fine]
    names = np.concatenate([np.full(len(o), name) for name, (o, _) in kept.items()])
    origins, directions = (np.concatenate([each[k] for each in kept.values()]) for k in (0, 1))
    return Rays.from_arrays(origins, directions), names


def built_with(lab, name, scene, rng):
    """Build a structure with one of its variants; return it and how it is called."""
    variants = [text for owner, text in lab.ALL_VARIANTS if owner == name]
    text = variants[int(rng.integers(len(variants)))]
    # The settings that may lose rays, or hits from behind.
    text = "" if "overlap=open" in text or "cull=true" in text else text
    kind = structures()[name]
    return kind.build(scene, lab.settings_of(kind, text)), f"{name}:{text}"


def check(lab, seed):
    """Build every structure, each with one of its variants, and compare with brute force.

    Returns
    -------
    Outcome
    """
    kind, triangles = make_hostile(seed)
    rng = np.random.default_rng([seed, 1])
    refused, wrong = [], {}
    try:
        scene = Scene.from_triangles(triangles, f"{kind} {seed}")
    except InputError as error:
        return Outcome(kind, [("scene", str(error))], 0, 0, 0)
    rays, names = rays_over(lab, scene, rng)
    naive = structures()["naive"]
    want, _ = naive.build(scene, naive.Settings()).trace(rays)
    for name in general_structures():
        try:
            structure, where = built_with(lab, name, scene, rng)
        except InputError as error:
            refused.append((name, str(error)))
            continue
        faults = structure.validate()
        closest, _ = structure.trace(rays, CLOSEST)
        some, _ = structure.trace(rays, ANY)
        found = {
            "validate": faults,
            "closest": lab.differences(names, want, closest),
            "any": lab.any_differences(names, want, some),
        }
        found = {what: each for what, each in found.items() if each}
        if found:
            wrong[where] = found
        structure.cells()
        structure.statistics()
    assert wrong == {}, f"seed {seed}, {kind}, {len(scene)} triangles"
    hits = int((want.primitive >= 0).sum())
    return Outcome(kind, refused, len(general_structures()) - len(refused), len(rays), hits)


class Outcome(NamedTuple):
    """What has become of a scene.

    Attributes
    ----------
    kind : str
    refused : list of (str, str)
        What was refused ("scene" or a structure with its settings), and why.
    built, rays, hits : int
        How many structures were built, how many rays were traced, and how many hit by brute force.
    """

    kind: str
    refused: list[tuple[str, str]]
    built: int
    rays: int
    hits: int


def judge(outcome):
    """Check that a scene is refused for one reason, a structure for none, and that rays hit."""
    if outcome.refused:
        assert outcome.kind in MAY_BE_REFUSED, outcome
        ((what, why),) = outcome.refused
        assert what == "scene", outcome
        assert re.search(MAY_BE_REFUSED[outcome.kind], why), outcome
        return
    assert outcome.built == len(general_structures())
    assert outcome.hits > outcome.rays / 50, outcome


MAY_BE_REFUSED = {
    "subnormal": r"all \d+ triangles have zero area, so no ray can hit",
    "huge_or_tiny": "every vertex of .* is NaN or infinite|units large, too small to compute with",
}
"""Kinds of scenes that may be no scene, and why; the other kinds always are one."""


@pytest.mark.parametrize("seed", range(MANY))
def test_a_hostile_scene(lab, seed):
    judge(check(lab, seed))


def test_every_kind_is_among_them():
    assert {make_hostile(seed)[0] for seed in range(MANY)} == set(KINDS)


def test_a_scene_is_refused_only_where_two_axes_are_too_thin():
    """One that is too thin is taken as flat; two leave no triangle."""
    made = 0
    seeds = [seed for seed in range(ALL_OF_THEM) if list(KINDS)[seed % len(KINDS)] == "subnormal"]
    for seed in seeds:
        _, triangles = make_hostile(seed)
        thin = (np.ptp(triangles, axis=(0, 1)) < 1e-200).sum()
        try:
            Scene.from_triangles(triangles, "subnormal")
        except InputError:
            assert thin == 2
        else:
            made += 1
    assert made > len(seeds) / 3


@pytest.mark.exhaustive
@pytest.mark.parametrize("first", range(MANY, ALL_OF_THEM, 200))
def test_many_hostile_scenes(lab, first):
    for seed in range(first, first + 200):
        judge(check(lab, seed))


@pytest.mark.exhaustive
@pytest.mark.parametrize("seed", range(2 * len(KINDS)))
def test_pictures_of_a_hostile_scene(lab, seed, tmp_path):
    """Cells of every shape are drawn wherever they are, and lessons can be played."""
    kind, triangles = make_hostile(seed)
    try:
        scene = Scene.from_triangles(triangles, kind)
    except InputError:
        pytest.skip("that it is refused is looked at above")
    rng = np.random.default_rng([seed, 2])
    gallery = Gallery(tmp_path)
    for name in general_structures():
        structure, where = built_with(lab, name, scene, rng)
        before = len(list(tmp_path.glob("*.png")))
        built = Built(structure, 0.0)
        traced = trace(built, RandomLinesWorkload, RandomLinesSettings(count=20))
        gallery.add(built, [make_record(built, traced)])
        assert len(list(tmp_path.glob("*.png"))) > before, where
    gallery.write_page()


@pytest.mark.skipif("ACCELSCOPE_HOSTILE_SEED" not in os.environ, reason="no seed is named")
def test_the_seed_that_is_named(lab):
    outcome = check(lab, int(os.environ["ACCELSCOPE_HOSTILE_SEED"]))
    print(outcome)
    judge(outcome)
