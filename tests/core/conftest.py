"""Scenes, rays of every awkward kind, and the comparison with brute force, bit for bit."""

import dataclasses
import functools
import itertools
import sys

import numpy as np
import pytest
from accelscope.core.evaluation.rays.workloads import CameraSettings, camera_of, random_lines
from accelscope.core.geometry.rays import CLOSEST, Rays
from accelscope.core.scene import Scene
from accelscope.core.scene.camera_rays import camera_rays
from accelscope.core.settings import key_of, parse
from accelscope.core.structures import general_structures, structures
from accelscope.sample_scenes import make_sample, samples
from accelscope.sample_scenes.mount import grow_mountain

# Samples scaled down, so that brute force is quick; one that is added later comes as it is.
SMALL = {
    "suzanne": "suzanne:subdivisions=0",
    "teapot_in_stadium": "teapot_in_stadium:teapot_resolution=2",
    "crowd": "crowd:figures=3,triangles=1000",
    "forest": "forest:trees=4,forks=1",
    "overlapping": "overlapping:spheres=12,segments=8",
    "balls": "balls:size=1",
    "gears": "gears:size=1",
    "jacks": "jacks:size=2",
    "lattice": "lattice:size=2",
    "mount": "mount:size=3",
    "rings": "rings:size=1",
    "shells": "shells:size=1",
    "sombrero": "sombrero:size=1",
    "teapot": "teapot:size=2",
    "tetra": "tetra:size=4",
    "tree": "tree:size=4",
    "soup": "soup:count=500,edge=0.2",
    "csg_plate": "csg_plate:holes=3",
    "csg_chain": "csg_chain:size=12",
    "facade": "facade:floors=2,bays=2",
}

# Beside the settings that are found by themselves: one more per boolean and per choice.
VARIANTS = {
    "grid": [
        "resolution=1x1x1",
        "resolution=7x3x5",
        "resolution=1x1x40",
        "resolution=7x3x5,mailbox=true",
        "resolution=7x3x5,padding=0",
        "resolution=8x8x8,padding=0,assignment=exact",
        "resolution=16x16x16,padding=0",
        "resolution=16x16x16,padding=0,mailbox=true",
        "padding=0",
        "padding=10",
        "density=50,mailbox=true,assignment=exact",
    ],
    "bvh": ["max_leaf_size=1", "max_leaf_size=32", "bins=2", "max_leaf_size=1,C_trav=0", "bins=64"],
}

GENERIC = ("random lines", "camera", "inside", "short", "long", "shifted")
"""Rays that touch nothing exactly: all that an open grid promises to get right."""

DIRECTIONS_26 = np.array([d for d in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(d)])


DIRECTIONAL = set(structures()) - set(general_structures())
"""For some classes of rays only; routed leads there, too: test_directional.py goes that way."""


def choices_of(field):
    """The choices of a setting that serve rays of any class, over any scene."""
    return [choice for choice in field.metadata["choices"] or () if choice not in DIRECTIONAL]


def settings_variants(structure):
    """Texts of --structure after the name: defaults, each choice and switch, and the extras."""
    texts = [""]
    for field in dataclasses.fields(structure.Settings):
        if isinstance(field.default, bool):
            texts.append(f"{key_of(field)}={str(not field.default).lower()}")
        texts += [f"{key_of(field)}={c}" for c in choices_of(field) if c != field.default]
    return texts + VARIANTS.get(structure.name, [])


def settings_of(structure, text):
    texts = dict(part.split("=") for part in text.split(",") if part)
    return parse(structure.Settings, texts, structure.name)


ALL_VARIANTS = [
    (name, text)
    for name, structure in general_structures().items()
    for text in settings_variants(structure)
]


@functools.cache
def small_scene(name):
    if name in HAND_MADE:
        return Scene.from_triangles(HAND_MADE[name](), name)
    return make_sample(SMALL.get(name, name))


def _flat():
    """A square of 8 x 8 quads in the plane z = 0."""
    x, y = np.meshgrid(np.arange(8.0), np.arange(8.0), indexing="ij")
    p = np.stack([x.ravel(), y.ravel(), np.zeros(64)], axis=1)[:, None]
    lower = p + np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0]])
    upper = p + np.array([[0, 0, 0], [1, 1, 0], [0, 1, 0]])
    return np.concatenate([lower, upper])


def _cubes():
    """Unit cubes side by side on a dyadic lattice: every face exists twice, all in cell walls."""
    corners = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    cube = np.array([[corners[q[i]] for i in ids] for q in quads for ids in ((0, 1, 2), (0, 2, 3))])
    return np.concatenate([cube + p for p in itertools.product((0.0, 1.0, 3.0), repeat=3)])


def _mess():
    """Duplicates, degenerate triangles, needles, and one giant among dwarfs."""
    rng = np.random.default_rng(5)
    few = rng.random((20, 3, 3))
    line = np.repeat(rng.random((10, 1, 3)), 3, axis=1)
    line[:, 1] += 0.5
    line[:, 2] += 0.25
    point = np.repeat(rng.random((10, 1, 3)), 3, axis=1)
    needle = rng.random((20, 3, 3))
    needle[:, 2] = needle[:, 1] + 1e-13
    dwarfs = rng.random((40, 1, 3)) + 1e-6 * rng.random((40, 3, 3))
    giant = 1e4 * (rng.random((1, 3, 3)) - 0.5)
    return np.concatenate([few, line, few, point, needle, dwarfs, giant, few[::-1]])


HAND_MADE = {
    "one": lambda: np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]]),
    "flat": _flat,
    "cubes": _cubes,
    "mess": _mess,
    "mountain": lambda: grow_mountain(3),
}

SOLIDS = ["balls", "gears", "jacks", "lattice", "mount", "rings", "shells", "teapot", "tree"]
SOLIDS += ["room", "facade", "csg_classic", "csg_rook", "csg_plate", "csg_chain"]
"""Samples of other items than triangles: test_structures_over_samples.py traces those."""

INSTANCES = ["crowd", "forest", "overlapping"]
"""Samples of instances: test_instances.py, test_two_level.py and test_rebraid.py trace such."""

TRIANGLES = [name for name in samples() if name not in (*INSTANCES, *SOLIDS)]
SCENES = [*TRIANGLES, *HAND_MADE]


def unit(rng, n):
    d = rng.normal(size=(n, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def ray_families(scene, n, seed=1):
    """Return {family: (origins, directions)}; directions of zero are left out later."""
    rng = np.random.default_rng(seed)
    lower, upper, tri = scene.lower, scene.upper, scene.triangles
    size = float((upper - lower).max())
    centre = 0.5 * (lower + upper)

    def pick():
        return tri[rng.integers(len(tri), size=n)]

    def vertices():
        return pick()[np.arange(n), rng.integers(3, size=n)]

    def on_edges():
        t, s = pick(), rng.choice([0.5, 0.25, rng.random()], size=n)[:, None]
        return t[:, 0] + s * (t[:, 1] - t[:, 0])

    def on_faces():
        w = rng.dirichlet([1, 1, 1], size=n)
        return (pick() * w[:, :, None]).sum(axis=1)

    def inside():
        return lower + rng.random((n, 3)) * (upper - lower)

    def outside(distance=1.5):
        return centre + distance * size * unit(rng, n)

    families = {}
    families["random lines"] = random_lines(lower, upper, n, seed)
    camera = camera_rays(camera_of(scene, CameraSettings()), 16, 16)
    families["camera"] = camera.origins, camera.directions
    families["inside"] = inside(), unit(rng, n)
    families["short"] = outside(), 1e-12 * unit(rng, n)
    families["long"] = inside(), 1e12 * unit(rng, n)
    o = outside()
    families["shifted"] = o, inside() + 1e-3 * size * unit(rng, n) - o
    for name, d in (("tiny", 1e-150), ("huge", 1e150)):
        o = outside()
        families[name] = o, d / size * (on_faces() - o)
    axis = np.eye(3)[rng.integers(3, size=n)] * rng.choice([-1.0, 1.0], size=(n, 1))
    families["axis-parallel"] = inside() - rng.choice([0, 2 * size], size=(n, 1)) * axis, axis
    families["axis-parallel to vertices"] = vertices() - 4 * size * axis, axis
    families["axis-parallel to edges"] = on_edges() - 4 * size * axis, axis
    families["axis-parallel from vertices"] = vertices(), axis
    zeros = DIRECTIONS_26[rng.integers(26, size=n)] * rng.random((n, 3))
    families["zero components"] = inside() - rng.choice([0, 2]) * size * zeros, zeros
    families["minus zero"] = inside(), np.where(zeros == 0.0, -0.0, zeros)
    families["zero components to vertices"] = vertices() - 2 * size * zeros, zeros
    diagonal = DIRECTIONS_26[rng.integers(26, size=n)]
    families["26 directions"] = vertices() - rng.choice([0.0, 1.0, 2.0]) * size * diagonal, diagonal
    for name, points in (("vertices", vertices), ("edges", on_edges), ("faces", on_faces)):
        o = outside()
        families[f"to {name}"] = o, points() - o
        families[f"from {name}"] = points(), unit(rng, n)
        o = inside()
        families[f"inside to {name}"] = o, points() - o
        for far in (1e3, 1e6):
            o = outside(far)
            families[f"{far:g} sizes away, to {name}"] = o, points() - o
            o = points() - far * size * axis
            families[f"{far:g} sizes away, axis-parallel to {name}"] = o, axis
    o = vertices()
    families["vertex to vertex"] = o, vertices() - o
    t = pick()
    families["along edges"] = t[:, 0], t[:, 1] - t[:, 0]
    families["into edges"] = 2 * t[:, 0] - t[:, 1], t[:, 1] - t[:, 0]
    t, w, v = pick(), 3 * rng.normal(size=(2, n, 1)), rng.normal(size=(2, n, 1))
    e, f = t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]
    families["in planes of faces"] = t[:, 0] + w[0] * e + w[1] * f, v[0] * e + v[1] * f
    corners = np.array(list(itertools.product(*zip(lower, upper, strict=True))))
    corners = corners[rng.integers(8, size=n)]
    families["along the box"] = corners - rng.choice([0.0, 1.0], size=(n, 1)) * size * axis, axis
    families["from box corners"] = corners, DIRECTIONS_26[rng.integers(26, size=n)] * 1.0
    return families


def wall_rays(structure, n, seed=2):
    """Rays that start on cell walls, run in them, along their edges and through their corners."""
    rng = np.random.default_rng(seed)
    boxes = structure.cells().boxes
    corners = boxes.reshape(-1, 2, 3)
    if hasattr(structure.arrays, "walls"):  # where the grid's kernels see them
        shift = structure.arrays.walls[:, 0] - boxes[:, :3].min(axis=0)
        corners = np.concatenate([corners, corners + shift])

    def points():
        which, low_or_high = rng.integers(len(corners), size=n), rng.integers(2, size=(n, 3))
        return corners[which[:, None], low_or_high, np.arange(3)]

    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    d = DIRECTIONS_26[rng.integers(26, size=n)]
    families = {
        "in walls": (points() - rng.choice([0.0, 0.5, 3.0], size=(n, 1)) * size * d, d),
        "from cell corners": (points(), unit(rng, n)),
    }
    o = points()
    families["cell corner to cell corner"] = o, points() - o
    o = points()
    on_wall = np.where(rng.random((n, 3)) < 0.4, o, o + 0.1 * size * rng.normal(size=(n, 3)))
    families["from walls"] = on_wall, unit(rng, n)
    axis = np.eye(3)[rng.integers(3, size=n)]
    families["from walls, axis-parallel"] = on_wall, axis * rng.choice([-1.0, 1.0], size=(n, 1))
    o = size * 2 * unit(rng, n)
    families["to cell corners"] = o, points() - o
    return families


def batch_of(families, t_max=None):
    """Return (rays, names): all families as one batch, and the family of every ray."""
    names = np.concatenate([np.full(len(o), name) for name, (o, _) in families.items()])
    origins = np.concatenate([o for o, _ in families.values()])
    directions = np.concatenate([d for _, d in families.values()])
    usable = directions.any(axis=1)
    rays = Rays.from_arrays(origins[usable], directions[usable])
    return rays, names[usable]


@functools.cache
def truth(name, n=150):
    """Return (rays, names, hits) of brute force, with rays that end at and before their hit."""
    scene = small_scene(name)
    rays, names = batch_of(ray_families(scene, n))
    kind = structures()["naive"]
    naive = kind.build(scene, kind.Settings())
    t = naive.trace(rays)[0].t
    hit = np.flatnonzero(np.isfinite(t))[::3]
    ends = [t[hit], np.nextafter(t[hit], 0.0), t[hit] * 0.5]
    rays = Rays.from_arrays(
        np.concatenate([rays.origins] + [rays.origins[hit]] * 3),
        np.concatenate([rays.directions] + [rays.directions[hit]] * 3),
        np.concatenate([np.full(len(t), np.inf), *ends]),
    )
    names = np.concatenate([names, *(names[hit] + " " + end for end in ("t", "t-", "t/2"))])
    return rays, names, naive.trace(rays, CLOSEST)[0], len(hit)


def differences(names, want, got):
    """Return {family: number of rays} where t or primitive differ in any bit."""
    wrong = (want.t.view(np.int64) != got.t.view(np.int64)) | (want.primitive != got.primitive)
    return {
        str(k): int(v) for k, v in zip(*np.unique(names[wrong], return_counts=True), strict=True)
    }


def any_differences(names, want, got):
    """Return {family: rays} where any-hit answers otherwise than brute force, or nonsense."""
    hit = got.primitive >= 0
    wrong = (hit != (want.primitive >= 0)) | (hit != np.isfinite(got.t)) | (got.t < want.t)
    return {
        str(k): int(v) for k, v in zip(*np.unique(names[wrong], return_counts=True), strict=True)
    }


SHARE = 4
"""In a normal run a test of settings and something else takes every so many combinations."""


def takes_part(variant, partner, partners):
    """Say whether settings go with something else in a normal run.

    Parameters
    ----------
    variant, partner : int
        Which settings, and which of those that they could go with.
    partners : int
        How many those are; of fewer than SHARE, every variant has one nevertheless.
    """
    return (variant + partner) % min(SHARE, partners) == 0


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark most of the combinations of settings with scenes, samples or queries as exhaustive.

    The defaults of every structure go with everything; all other settings take turns, each with a
    fourth of what there is, and another fourth than their neighbours.
    """
    tests = {}
    for item in items:
        indices = item.callspec.indices if hasattr(item, "callspec") else {}
        if len(indices) < 2 or "variant" not in indices:
            continue
        partner = tuple(index for name, index in indices.items() if name != "variant")
        tests.setdefault(item.nodeid.partition("[")[0], []).append((item, partner))
    for combinations in tests.values():
        partners = sorted({partner for _, partner in combinations})
        number = {partner: place for place, partner in enumerate(partners)}
        for item, partner in combinations:
            variant = item.callspec.indices["variant"]
            _, text = item.callspec.params["variant"]
            if text and not takes_part(variant, number[partner], len(partners)):
                item.add_marker(pytest.mark.exhaustive)


def pytest_generate_tests(metafunc):
    """Give every test that asks for them all scenes and all structures with all settings."""
    if "scene_name" in metafunc.fixturenames:
        metafunc.parametrize("scene_name", SCENES)
    if "sample_of_triangles" in metafunc.fixturenames:
        metafunc.parametrize("sample_of_triangles", TRIANGLES)
    if "sample_of_solids" in metafunc.fixturenames:
        metafunc.parametrize("sample_of_solids", SOLIDS)
    if "variant" in metafunc.fixturenames:
        ids = [f"{name}:{text}" if text else name for name, text in ALL_VARIANTS]
        metafunc.parametrize("variant", ALL_VARIANTS, ids=ids)
    if "structure_name" in metafunc.fixturenames:
        metafunc.parametrize("structure_name", list(general_structures()))


@pytest.fixture(scope="session")
def lab():
    """This module: tests are imported one by one and cannot import it themselves."""
    return sys.modules[__name__]


@pytest.fixture
def build():
    """Build a structure by name and settings text over a scene."""

    def build_one(name, scene, text="", **more):
        structure = structures()[name]
        return structure.build(scene, settings_of(structure, text), **more)

    return build_one
