"""What work in a thread makes of a scene for the session to keep."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from ...core.errors import InputError
from ...core.progress import SILENT, Progress
from ..drawing.drawable import Drawable, make_drawable
from ..from_blender.snapshot import Snapshot
from ..from_blender.view import View

if TYPE_CHECKING:  # importing them for real would import Numba, and make Blender start slower
    from ...core.contract.structure import Made, Structure
    from ...core.evaluation.records.experiment import Built
    from ...core.lessons.moment import Moment
    from ...core.scene import Scene


class Outcome(NamedTuple):
    """What a build makes: everything that takes long or may fail, done before any of it is kept."""

    snapshot: Snapshot
    built: Built
    drawable: Drawable
    record: dict[str, Any]
    history: Sequence[Moment]

    @classmethod
    def of(
        cls,
        snapshot: Snapshot,
        built: Built,
        progress: Progress = SILENT,
        history: Sequence[Moment] = (),
        **more: Any,
    ) -> Outcome:
        """Compute all of it; runs in any thread.

        Parameters
        ----------
        history : sequence of Moment
            The animation over which the structure was refitted, if it was.
        **more
            What the record has in front.

        Raises
        ------
        Cancelled
            From `progress`.
        """
        from ...core.contract.within import cells_with_instances
        from ...core.evaluation.records.experiment import make_record

        structure = built.structure
        record = more | make_record(built, None, progress)
        drawable = make_drawable(cells_with_instances(structure, progress), progress)
        return cls(snapshot, built, drawable, record, history)


def drawable_since(
    before: Made | None, structure: Structure, progress: Progress = SILENT
) -> Drawable | None:
    """Return the cells anew if rays have made some of them; None if all are as they were.

    Parameters
    ----------
    before : Made or None
        What the structure had made before.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    from ...core.contract.within import cells_with_instances
    from ...core.evaluation.records.experiment import made_since

    made = made_since(before, structure)
    if made is None or not made.cells:
        return None
    return make_drawable(cells_with_instances(structure, progress), progress)


def seen_from(built: Built, shape: Scene, view: View) -> Built:
    """Return a structure with a camera and lights; rays start from them. Runs in any thread.

    Moving them does not make the structure out of date, unless it was built from them.

    Parameters
    ----------
    shape : Scene
        What was built over, with the materials and notes that it had.

    Raises
    ------
    InputError
        If it was built from what is elsewhere now.
    """
    from ...core.contract.needs import moved

    # Its own items: they may be instances of what was built over.
    own = built.structure.scene
    seen = view.onto(dataclasses.replace(own, materials=shape.materials, notes=shape.notes))
    change = moved(built.structure.needs, built.structure.scene, seen)
    if change:
        raise InputError(f"{change}, and {built.structure.label} is built from that; build again")
    structure = copy.copy(built.structure)
    structure.scene = seen
    return dataclasses.replace(built, structure=structure)
