"""Shaders of a program: checked, and made what the tables hold.

Compiled, a table holds addresses; in plain Python, functions that bring words into the form of
records and call the shader.
"""

from __future__ import annotations

import inspect
import re
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import kernels
from ..errors import InputError
from .program import HitGroup, Program
from .records import LinkedRow, Row, Struct, declared
from .stage import MOST_ATTRIBUTES, NULL
from .system import (
    ACCEPT_HIT,
    ACCEPT_HIT_AND_END_SEARCH,
    IGNORE_HIT,
    BuiltInTriangleIntersectionAttributes,
    Launch,
    Output,
    Ray,
    Scene,
)  # fmt: skip

PAYLOAD, ATTRIBUTES = "payload", "attributes"

PARAMETERS = {
    "ray_generation": ("scene", "launch", "output"),
    "intersection": ("ray", ATTRIBUTES),
    "any_hit": (PAYLOAD, ATTRIBUTES, "ray"),
    "closest_hit": (PAYLOAD, ATTRIBUTES, "ray", "scene"),
    "miss": (PAYLOAD, "ray", "scene"),
}
"""What shaders take, by their stage."""

GIVEN = {
    "scene": declared(Scene).constant,
    "launch": declared(Launch).constant,
    "output": declared(Output),
    "ray": declared(Ray).constant,
}
"""The records of those parameters that the program does not declare."""

STRUCT_NAME = re.compile(r"(?:const_)?struct_(\w+)_[0-9a-f]+")
"""What Numba calls a struct (:func:`.compiled.short`)."""

PLACE = re.compile(r'File "([^"]+)", line (\d+)')

VERDICTS = ACCEPT_HIT, IGNORE_HIT, ACCEPT_HIT_AND_END_SEARCH


class Shader(NamedTuple):
    """A shader that has been checked.

    Attributes
    ----------
    stage : str
        A key of PARAMETERS.
    function : callable
        Plain Python.
    structs : tuple of Struct
        The records that it takes.
    payload, attributes : Struct or None
    """

    stage: str
    function: Callable
    structs: tuple[Struct, ...]
    payload: Struct | None
    attributes: Struct | None

    @property
    def payload_number(self) -> int:
        """The number of the struct of its payload; 0 for none."""
        return 0 if self.payload is None else self.payload.number


def checked(stage: str, function: Any) -> Shader:
    """Check the parameters of a shader.

    Raises
    ------
    InputError
        If there are others than its stage has, or one that the program declares is no struct.
    """
    function = getattr(function, "py_func", function)
    name = getattr(function, "__name__", "?")
    wanted = PARAMETERS[stage]
    signature = f"{stage}({', '.join(wanted)})"
    try:
        parameters = list(inspect.signature(function).parameters.values())
    except (TypeError, ValueError):
        raise InputError(f"{name} is no function; a shader is one: {signature}") from None
    if len(parameters) != len(wanted) or any(each.default is not each.empty for each in parameters):
        raise InputError(
            f"{name} takes ({', '.join(each.name for each in parameters)}), but a shader of this "
            f"stage is {signature}"
        )
    structs = []
    own: dict[str, Struct] = {}
    for role, parameter in zip(wanted, parameters, strict=True):
        if role in GIVEN:
            structs.append(GIVEN[role])
            continue
        found = parameter.annotation
        if isinstance(found, str):
            found = function.__globals__.get(found, found)
        if found is parameter.empty and role == ATTRIBUTES:
            found = declared(BuiltInTriangleIntersectionAttributes)
        if not isinstance(found, Struct):
            raise InputError(
                f"{name}: say of which struct {parameter.name} is, as in "
                f"'{parameter.name}: {role.capitalize()}', with a class decorated by @struct"
            )
        if role == ATTRIBUTES and found.size > MOST_ATTRIBUTES:
            raise InputError(
                f"{found.name} has {found.size} numbers; attributes hold {MOST_ATTRIBUTES} at most"
            )
        own[role] = found
        structs.append(found)
    return Shader(stage, function, tuple(structs), own.get(PAYLOAD), own.get(ATTRIBUTES))


class Group(NamedTuple):
    """The shaders of a hit group."""

    intersection: Shader | None
    any_hit: Shader | None
    closest_hit: Shader | None


class Shaders(NamedTuple):
    """The shaders of a program."""

    ray_generation: Shader
    triangles: tuple[Group, ...]
    procedurals: tuple[Group, ...]
    misses: tuple[Shader | None, ...]

    def all_of_them(self) -> list[Shader]:
        """Return every shader."""
        groups = [each for group in (*self.triangles, *self.procedurals) for each in group]
        return [each for each in (self.ray_generation, *groups, *self.misses) if each is not None]


def shaders_of(program: Program) -> Shaders:
    """Check the shaders of a program.

    Raises
    ------
    InputError
        If one does not fit its stage, or those of a hit group do not fit each other.
    """
    groups = [_group(group) for group in program.hit_groups]
    return Shaders(
        checked("ray_generation", program.ray_generation),
        tuple(group for group in groups if group.intersection is None),
        tuple(group for group in groups if group.intersection is not None),
        tuple(None if each is None else checked("miss", each) for each in program.miss),
    )


def _group(group: HitGroup) -> Group:
    made = Group(
        *(
            None if function is None else checked(stage, function)
            for stage, function in (
                ("intersection", group.intersection), ("any_hit", group.any_hit),
                ("closest_hit", group.closest_hit),
            )
        )
    )  # fmt: skip
    kinds = {each.attributes.key: each.attributes.name for each in made if each and each.attributes}
    if made.intersection is not None and len(kinds) > 1:
        raise InputError(
            f"the shaders of a hit group take attributes of different structs: "
            f"{', '.join(sorted(kinds.values()))}"
        )
    return made


# ------------------------------------------------------------------------------- plain Python


def plain(shader: Shader | None, links: dict[str, Any]) -> Any:
    """Return what calls a shader in plain Python: words in, a whole number out.

    Parameters
    ----------
    links : dict
        The stage, for ``ray``; filled in before the first call.
    """
    if shader is None:
        return NULL
    roles = PARAMETERS[shader.stage]

    def called(*given: Any) -> int:
        records: list[Row] = []
        for role, struct, value in zip(roles, shader.structs, given, strict=True):
            if role == "ray":
                records.append(LinkedRow(struct, value, stage=links["stage"]))
            else:
                records.append(value if isinstance(value, Row) else Row(struct, value))
        verdict = shader.function(*records)
        if shader.stage == "any_hit":
            if verdict not in VERDICTS or verdict is None:
                raise InputError(_verdict_wanted(shader))
            return int(verdict)
        return 0

    return called


def _verdict_wanted(shader: Shader) -> str:
    return (
        f"{shader.function.__name__} must return ACCEPT_HIT, IGNORE_HIT or "
        "ACCEPT_HIT_AND_END_SEARCH, whichever way it ends"
    )


# ---------------------------------------------------------------------------------- compiled


class Compiler:
    """Shaders compiled, each once; what an address leads to is kept alive here."""

    def __init__(self) -> None:
        self._made: dict[Shader, tuple[int, Any]] = {}
        self._lock = threading.Lock()

    def address(self, shader: Shader | None) -> int:
        """Return the address of a shader, compiled.

        Raises
        ------
        InputError
            If Numba cannot compile it, with what it says in one line.
        """
        if shader is None:
            return NULL
        with self._lock:
            if shader not in self._made:
                self._made[shader] = compiled(shader)
            return self._made[shader][0]


def compiled(shader: Shader) -> tuple[int, Any]:
    """Return the address of a shader, compiled, and what keeps that alive."""
    from numba.core import errors, types

    from .compiled import StructType

    wrapped: Any = kernels.shader(shader.function)
    kinds = tuple(StructType(each.key) for each in shader.structs)
    try:
        address, returned = wrapped.compiled_at(kinds)
    except errors.NumbaError as error:
        raise InputError(reason_told(shader, str(error))) from error
    if shader.stage == "any_hit" and returned != types.int64:
        raise InputError(_verdict_wanted(shader))
    return address, wrapped


def reason_told(shader: Shader, message: str) -> str:
    """Return what Numba says of a shader that it cannot compile, on one line."""
    code = shader.function.__code__
    lines = [line.strip() for line in message.splitlines()]
    told = [
        line for line in lines
        if line and not line.startswith(("Failed in", "During", "File", "- ", "def ", "<source"))
    ]  # fmt: skip
    reason = STRUCT_NAME.sub(r"\1", told[0]) if told else "Numba gives no reason"
    places = [
        int(found[2]) for found in PLACE.finditer(message)
        if Path(found[1]).name == Path(code.co_filename).name
    ]  # fmt: skip
    line = places[-1] if places else code.co_firstlineno
    name = f"{Path(code.co_filename).name}, line {line}, {shader.function.__name__}"
    return f"{name} cannot be compiled: {reason}"


def table(rows: list[list[Any]]) -> np.ndarray:
    """Return a table of addresses, or in plain Python of functions."""
    is_plain = any(callable(value) for row in rows for value in row)
    made = np.empty((len(rows), len(rows[0])), dtype=object if is_plain else np.int64)
    for r, row in enumerate(rows):
        for c, value in enumerate(row):
            made[r, c] = value
    return made
