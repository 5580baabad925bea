"""Trees of solids to try, and whether points are inside of them, by closed forms."""

import numpy as np
from accelscope.core.geometry.csg.description import (
    Difference,
    HalfSpace,
    Intersection,
    Union,
    mesh_of_triangles,
)
from accelscope.core.geometry.icosphere import icosphere
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.solids.description import Box, Cone, Placed, Sphere
from accelscope.core.geometry.solids.tessellation import cube


def box_mesh(lower, upper):
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    return mesh_of_triangles(lower + (0.5 + 0.5 * cube()) * (upper - lower))


def some_leaf(rng, spread=1.0):
    at, size = spread * rng.uniform(-1, 1, 3), rng.uniform(0.3, 1.2)
    kind = rng.integers(7)
    if kind == 0:
        return Sphere(at, size)
    if kind == 1:
        return Box(at - size * rng.uniform(0.2, 1, 3), at + size * rng.uniform(0.2, 1, 3))
    if kind == 2:
        return Cone(
            at - size * rng.normal(size=3), at + size * rng.normal(size=3), size, 0.4 * size
        )
    if kind == 3:
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.5, 1.5, 3)
        return Placed(Box((-size, -size, -size), (size, size, size)), np.column_stack([turn, at]))
    if kind == 4:
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        return mesh_of_triangles(at + size * icosphere(1) @ turn)
    if kind == 5:
        return HalfSpace(
            at, rng.normal(size=3) if rng.random() < 0.5 else np.eye(3)[rng.integers(3)]
        )
    return Cone(at, at + np.eye(3)[rng.integers(3)] * size, 0.5 * size, 0.5 * size)


def some_tree(rng, depth, is_bounded=True, spread=1.0):
    """A tree of so many levels; if it is to be bounded, half-spaces are cut off by others."""
    if depth == 0:
        while True:
            leaf = some_leaf(rng, spread)
            if not (is_bounded and isinstance(leaf, HalfSpace)):
                return leaf
    kind = rng.integers(3)
    first = some_tree(rng, depth - 1 if rng.random() < 0.8 else 0, is_bounded, spread)
    free = kind > 0  # what is taken away, or shared, may go on for ever
    others = [
        some_tree(rng, rng.integers(depth), is_bounded and not free, spread)
        for _ in range(rng.integers(1, 4))
    ]
    return (Union, Intersection, Difference)[kind]([first, *others])


def is_inside(node, points):
    """Say of points, (n, 3), whether they are inside of a tree."""
    if isinstance(node, (Union, Intersection, Difference)):
        inside = np.array([is_inside(operand, points) for operand in node.operands])
        if isinstance(node, Union):
            return inside.any(axis=0)
        if isinstance(node, Intersection):
            return inside.all(axis=0)
        return inside[0] & ~inside[1:].any(axis=0)
    if isinstance(node, Placed):
        matrix = np.asarray(node.matrix, float)
        return is_inside(node.solid, (points - matrix[:, 3]) @ np.linalg.inv(matrix[:, :3]).T)
    if isinstance(node, Sphere):
        return ((points - node.centre) ** 2).sum(axis=1) <= node.radius**2
    if isinstance(node, Box):
        return ((points >= node.lower) & (points <= node.upper)).all(axis=1)
    if isinstance(node, HalfSpace):
        return (points - np.asarray(node.point)) @ np.asarray(node.normal, float) <= 0.0
    if isinstance(node, Cone):
        axis = np.subtract(node.apex, node.base)
        share = (points - node.base) @ axis / (axis @ axis)
        away = np.linalg.norm(points - node.base - share[:, None] * axis, axis=1)
        radius = node.base_radius + share * (node.apex_radius - node.base_radius)
        return (share >= 0) & (share <= 1) & (away <= radius)
    return _is_in_mesh(node, points)


def _is_in_mesh(mesh, points):
    """By the solid angle that the surface takes, seen from each point."""
    corners = np.asarray(mesh.vertices)[mesh.triangles]
    inside = np.empty(len(points), bool)
    for i, point in enumerate(points):
        a, b, c = (corners - point).transpose(1, 0, 2)
        la, lb, lc = (np.linalg.norm(each, axis=1) for each in (a, b, c))
        volume = (a * np.cross(b, c)).sum(axis=1)
        below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
        inside[i] = abs(np.arctan2(volume, below).sum()) > np.pi
    return inside


def awkward_rays(scene, count, seed=0):
    """Random lines, rays from inside, along the axes, from afar, and with a t_min."""
    rng = np.random.default_rng(seed)
    size, middle = scene.diagonal, 0.5 * (scene.lower + scene.upper)
    at = scene.lower + rng.random((count, 3)) * (scene.upper - scene.lower)
    unit = rng.normal(size=(count, 3))
    unit /= np.linalg.norm(unit, axis=1)[:, None]
    axis = np.eye(3)[rng.integers(3, size=count)] * rng.choice([-1.0, 1.0], (count, 1))
    snapped = np.round(2 * at) / 2  # in the planes of boxes with round numbers
    families = [
        (at - size * unit, unit), (at, unit), (at - size * axis, axis),
        (snapped - size * axis, axis),
        (snapped, np.round(2 * unit) + axis), (at - 1e3 * size * unit, unit),
        (at - 1e6 * size * unit, unit), (at - 1e5 * size * axis, axis),
        (middle + 2 * size * unit, 1e-9 * (at - middle - 2 * size * unit)),
    ]  # fmt: skip
    origins = np.concatenate([o for o, _ in families])
    directions = np.concatenate([d for _, d in families])
    usable = directions.any(axis=1)
    t_min = np.where(rng.random(len(origins)) < 0.2, 0.3, 0.0)
    return Rays.from_arrays(origins[usable], directions[usable], t_min=t_min[usable])
