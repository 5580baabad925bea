"""Records: payloads, attributes, and what else shaders are given and give on.

A record is declared as HLSL declares a struct, and used like one::

    @struct
    class Payload:
        color: float4
        hit_distance: float

    payload = Payload()
    payload.color = (0.0, 0.5, 1.0, 1.0)

Fields are numbers of eight bytes, one after the other; vectors and matrices (row by row) are read
and written as tuples. So a record is a row of words: compiled, a shader is given its address, and
a new one lies on the stack (:mod:`.compiled`); in plain Python it is a row of an array.
"""

from __future__ import annotations

import inspect
import re
import zlib
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ..errors import InputError

float2: TypeAlias = tuple[float, float]
float3: TypeAlias = tuple[float, float, float]
float4: TypeAlias = tuple[float, float, float, float]
float2x3: TypeAlias = tuple[float3, float3]
float3x3: TypeAlias = tuple[float3, float3, float3]
float3x4: TypeAlias = tuple[float4, float4, float4]
int2: TypeAlias = tuple[int, int]
uint: TypeAlias = int

ALIASES: dict[Any, str] = {
    float: "float", int: "int", float2: "float2", float3: "float3", float4: "float4",
    float2x3: "float2x3", float3x3: "float3x3", float3x4: "float3x4", int2: "int2",
}  # fmt: skip

KINDS = re.compile(r"(float|int|uint)(?:(\d)(?:x(\d))?)?")

WORD = 8
"""Bytes."""


class Field(NamedTuple):
    """A field of a record.

    Attributes
    ----------
    is_whole : bool
        Whether it holds whole numbers, not float64.
    first, n_words : int
        Its words; one word is a number, more are a tuple.
    """

    is_whole: bool
    first: int
    n_words: int


class Struct:
    """The declaration of a record; called, it makes one of zeros.

    Attributes
    ----------
    name : str
    fields : dict of str to Field
    size : int
        In words.
    """

    def __init__(self, name: str, fields: dict[str, Field], is_constant: bool = False) -> None:
        self.name = name
        self.fields = fields
        self.size = sum(field.n_words for field in fields.values())
        self.is_constant = is_constant

    def __call__(self) -> Row:
        """Make a record of zeros."""
        return Row(self, np.zeros(self.size))

    def __repr__(self) -> str:
        return f"struct {self.name}"

    @property
    def key(self) -> tuple[Any, ...]:
        """What is equal for equal declarations."""
        fields = tuple((name, *field) for name, field in self.fields.items())
        return self.name, fields, self.is_constant

    @property
    def number(self) -> int:
        """A number that differs for different declarations."""
        return zlib.crc32(repr(self.key[:2]).encode())

    @property
    def constant(self) -> Struct:
        """The same for those who may only read."""
        return Struct(self.name, self.fields, is_constant=True)


class Row:
    """A record in plain Python: words of an array, read and written by name."""

    __slots__ = ("_floats", "_struct", "_wholes")

    def __init__(self, declared: Struct, words: np.ndarray) -> None:
        """Wrap the words of a record, (size,) float64 or more."""
        object.__setattr__(self, "_struct", declared)
        object.__setattr__(self, "_floats", words)
        object.__setattr__(self, "_wholes", words.view(np.int64))

    def __getattr__(self, name: str) -> Any:
        field = self._field(name)
        words = self._wholes if field.is_whole else self._floats
        if field.n_words == 1:
            return words[field.first]
        return tuple(words[field.first : field.first + field.n_words])

    def __setattr__(self, name: str, value: Any) -> None:
        field = self._field(name)
        if self._struct.is_constant:
            raise AttributeError(f"{self._struct.name}.{name} can only be read")
        words = self._wholes if field.is_whole else self._floats
        if field.n_words == 1:
            words[field.first] = value
            return
        if len(value) != field.n_words:
            raise ValueError(
                f"{self._struct.name}.{name} has {field.n_words} components, not {len(value)}"
            )
        words[field.first : field.first + field.n_words] = value

    def _field(self, name: str) -> Field:
        try:
            return self._struct.fields[name]
        except KeyError:
            raise AttributeError(
                f"{self._struct.name} has no field {name}; it has {', '.join(self._struct.fields)}"
            ) from None

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={getattr(self, name)}" for name in self._struct.fields)
        return f"{self._struct.name}({values})"


class LinkedRow(Row):
    """A record of which some fields, compiled addresses, are objects in plain Python."""

    __slots__ = ("bundle", "light_rows", "stage", "trace")

    def __init__(self, declared: Struct, words: np.ndarray, **links: Any) -> None:
        """Wrap words, and set what is linked."""
        super().__init__(declared, words)
        for name, value in links.items():
            object.__setattr__(self, name, value)


def struct(declaration: type) -> Struct:
    """Return the record that a class declares: its annotations are the fields.

    Raises
    ------
    InputError
        If it has no fields, or one is of another type than these.
    """
    fields: dict[str, Field] = {}
    first = 0
    for name, annotation in inspect.get_annotations(declaration).items():
        kind = annotation if isinstance(annotation, str) else ALIASES.get(annotation, "")
        found = KINDS.fullmatch(kind)
        if found is None:
            raise InputError(
                f"field {name} of {declaration.__name__} must be float, float2, float3, float4, "
                "float3x4, int, int2 or uint"
            )
        count = int(found[2] or 1) * int(found[3] or 1)
        fields[name] = Field(found[1] != "float", first, count)
        first += count
    if not fields:
        raise InputError(
            f"struct {declaration.__name__} declares no fields; write some, such as 'color: float4'"
        )
    return Struct(declaration.__name__, fields)


def declared(struct: Any) -> Struct:
    """Return a struct as what it is: to a type checker, its name is still that of a class."""
    return struct


# ------------------------------------------- what kernels do with records, and compiled otherwise


def record_at(struct: Any, words: Any) -> Any:
    """Return the record of a kind that lies at an address; in plain Python, in words."""
    return Row(struct, words)


def words_of(record: Any) -> Any:
    """Return the address of a record; in plain Python, its words."""
    return record._floats


def words_at(rows: Any, index: Any) -> Any:
    """Return the address of a row of an array, (n, size) float64; in plain Python, the row."""
    return rows[index]


def words_from(address: Any, index: Any, size: Any) -> Any:
    """Return the address of a row, of so many words, of those at an address; plainly, the row."""
    return address[index]


def copy_record(record: Any, words: Any) -> None:
    """Copy a record to an address; in plain Python, into words."""
    size = record._struct.size
    words[:size] = record._floats[:size]


def number_of(record: Any) -> int:
    """Return the number of the declaration of a record."""
    return record._struct.number


def call_at(address: Any, arguments: tuple[Any, ...]) -> Any:
    """Call a shader: compiled, what lies at an address; in plain Python, a function."""
    return address(*arguments)
