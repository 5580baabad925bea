"""Programs: which shader is called when."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..errors import InputError
from .system import MOST_RECURSION


@dataclass(frozen=True)
class HitGroup:
    """What is called for geometries of one kind; what is left out is not called.

    With an intersection shader it is for procedural primitives, without for triangles.

    Attributes
    ----------
    closest_hit : callable
        ``(payload, attributes, ray, scene)``
    any_hit : callable
        ``(payload, attributes, ray)``, returning ACCEPT_HIT, IGNORE_HIT or
        ACCEPT_HIT_AND_END_SEARCH.
    intersection : callable
        ``(ray, attributes)``, calling ``report_hit``.
    """

    closest_hit: Callable | None = None
    any_hit: Callable | None = None
    intersection: Callable | None = None


@dataclass(frozen=True)
class Program:
    """A program: DXR's pipeline state object and shader tables.

    Attributes
    ----------
    ray_generation : callable
        ``(scene, launch, output)``
    hit_groups : sequence of HitGroup
        Those for triangles make one table, those for procedural primitives another. Record i of a
        table is its group i modulo the number of its groups: a table is as long as a scene with
        many geometries needs it.
    miss : sequence of callable
        ``(payload, ray, scene)``; None in the place of one calls nothing.
    max_recursion_depth : int
        How many rays may be under way at once: 1 if only ray generation traces rays, 31 at most.
    ray_types : sequence of str
        Names of the classes of rays, by their contribution to the hit group index.
    label : str
        One sentence about it, without a full stop.
    """

    ray_generation: Callable | None = None
    hit_groups: Sequence[HitGroup] = ()
    miss: Sequence[Callable | None] = ()
    max_recursion_depth: int = 1
    ray_types: Sequence[str] = ("primary",)
    label: str = ""

    def __post_init__(self) -> None:
        """Refuse what is no program.

        Raises
        ------
        InputError
            Naming what is wrong.
        """
        if not callable(self.ray_generation):
            raise InputError("the program has no ray generation shader; give it ray_generation=")
        if not all(isinstance(group, HitGroup) for group in self.hit_groups):
            raise InputError("hit_groups of the program must be a list of HitGroup(...)")
        if isinstance(self.miss, Callable) or not all(  # type: ignore[arg-type]
            shader is None or callable(shader) for shader in self.miss
        ):
            raise InputError("miss of the program must be a list of shaders: miss=[miss]")
        if not 1 <= self.max_recursion_depth <= MOST_RECURSION:
            raise InputError(
                f"max_recursion_depth of the program is {self.max_recursion_depth}; it must be "
                f"from 1 to {MOST_RECURSION}"
            )
