"""The walk of one recorded ray, or cone, in words: what an event is, and what a picture shows."""

from __future__ import annotations

import numpy as np

from ..contract.events import (
    HIT,
    JUMP,
    KIND_NAMES,
    POSTPONE,
    TEST,
    VISIT_EMPTY,
    VISIT_INNER,
    VISIT_LEAF,
    VOLUME_TEST,
)
from ..contract.steps import Steps
from ..contract.within import chains_of
from .ray_path import MOST_MET, MOST_TESTED, MOST_VISITED, Walk, skipped_regions


def event_text(steps: Steps, event: int, primitive_name: str = "triangle") -> str:
    """Say what happens in an event: ``"visit leaf 203, t = 1.2 to 1.5"``."""
    kind, cell = int(steps.kind[event]), int(steps.cell[event])
    primitive = int(steps.primitive[event])
    enter, leave = float(steps.t_enter[event]), float(steps.t_exit[event])
    levels = max((counter.level for counter in steps.counters), default=0)
    level = int(steps.level[event])
    text = KIND_NAMES[kind]
    if kind == JUMP:
        text += f" over {primitive}"
    elif primitive >= 0:
        text += f" {primitive_name if level == levels else 'instance'} {primitive}"
    elif cell >= 0:
        text += f" {cell}"
    if level:
        chain = chains_of(steps, levels)[event, :level].tolist()
        text += f" in instance {', '.join(map(str, chain))}"
    if kind in (TEST, VOLUME_TEST) and not np.isfinite(enter):
        return f"{text}: missed"
    if kind in (TEST, VOLUME_TEST, HIT, POSTPONE):
        return f"{text}: t = {enter:.4g}"
    return f"{text}: t = {enter:.4g} to {leave:.4g}"


def legend(walk: Walk, event: int | None = None) -> list[tuple[str, str]]:
    """Return what was drawn of a walk: fields of the palette, each with a text that counts it."""
    steps = walk.steps
    events = [steps.events_of(kind, event) for kind in range(len(KIND_NAMES))]
    n = [int((steps.level[each] == 0).sum()) for each in events]
    empty = steps.cell[events[VISIT_EMPTY][steps.level[events[VISIT_EMPTY]] == 0]]
    skipped = np.isin(empty, list(skipped_regions(walk, np.unique(empty))))
    item, primitive = walk.structure.scene.item_name, walk.structure.scene.primitive_name
    several = f"{item}s tested"
    if len(events[TEST]) > MOST_TESTED:
        several += f", drawn: the last {MOST_TESTED}"
    inside = [len(each) - own for each, own in zip(events, n, strict=True)]
    many = f", drawn: the last {MOST_VISITED}"
    inner, leaves, empties = (
        many * (len(events[kind]) > MOST_VISITED) for kind in (VISIT_INNER, VISIT_LEAF, VISIT_EMPTY)
    )
    at_bottom = int((steps.level[events[TEST]] == walk.levels).sum()) if walk.levels else 0
    met = len(walk.met(event)) if walk.half_angle else 0
    first = f", drawn: the first {MOST_MET}" * (met > MOST_MET)
    counts = (
        ("inner", n[VISIT_INNER], "inner node", f"inner nodes{inner}"),
        ("leaf", n[VISIT_LEAF], f"leaf with {item}s", f"leaves with {item}s{leaves}"),
        ("empty", (~skipped).sum(), "empty leaf", f"empty leaves{empties}"),
        ("skipped", skipped.sum(), "skip of an empty region", "skips of empty regions"),
        ("tested", n[TEST], f"{item} tested", several),
        ("inner", inside[VISIT_INNER], "inner node in an instance", "inner nodes in instances"),
        ("leaf", inside[VISIT_LEAF], "leaf in an instance", "leaves in instances"),
        ("tested", at_bottom, f"{primitive} tested", f"{primitive}s tested"),
        *(
            [("found", met, f"{item} met", f"{item}s met{first}")]
            if walk.half_angle
            else [
                ("postponed", n[POSTPONE], "hit postponed", "hits postponed"),
                ("found", n[HIT], "hit accepted", "hits accepted"),
            ]
        ),
    )
    return [
        (name, f"{count} {one if count == 1 else more}")
        for name, count, one, more in counts
        if count
    ]
