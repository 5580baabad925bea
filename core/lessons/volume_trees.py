"""Lesson "volume_trees": trees of spheres, AABBs, OBBs and k-DOPs side by side, level by level.

The slide "Bounding volume hierarchies". The tree is the same in all copies and so are the colours
of its nodes; only the volumes around them differ. Each is fitted to all that is below its node.
"""

from __future__ import annotations

from ..progress import Progress
from .hierarchy import is_tree, tree_of
from .kdop import Settings, VolumesByLevel
from .lesson import Lesson, Play, Subject

KINDS = {
    "aabb": "AABB tree", "smallest_sphere": "Sphere tree", "obb": "OBB tree",
    "kdop18": "18-DOP tree",
}  # fmt: skip

LEVELS = 6


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Fit the volumes of the upper levels."""
    return VolumesByLevel(tree_of(subject), KINDS, LEVELS, progress)


LESSONS = (
    Lesson(
        name="volume_trees",
        label="Trees of Spheres, Boxes and k-DOPs",
        slide="Bounding volume hierarchies",
        begin="Each kind of volume makes a hierarchy: the tree may be the same in all of them",
        look_for="Below the root spheres have most surface and stick out of the object; k-DOPs "
        "follow it on every level, oriented boxes only where the object lies oblique to the axes",
        question="The object is turned by 30 degrees. Which of the trees can be turned with it, "
        "and which have to be fitted anew?",
        answer="Spheres and oriented boxes turn with it: move the centre, or centre and axes. An "
        "AABB or k-DOP has fixed directions, so it has to be found again from the vertices, or "
        "grows if only its corners are turned",
        source="geometry.fit",
        sample="suzanne:subdivisions=1",
        structures=("bvh",),
        suits=is_tree,
        Settings=Settings,
        play=play,
        film="level",
    ),
)
