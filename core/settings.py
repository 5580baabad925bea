"""Settings: one frozen dataclass per structure, workload or sample scene.

The dataclass is the only source of a setting. The Blender properties, the ``name:key=value``
of the command line, the JSON and the reference table of the documentation are all derived from
the fields declared here.

A field is declared with :func:`setting`::

    @dataclass(frozen=True)
    class Settings:
        bins: int = setting(16, "Bins", "Candidate planes per axis", minimum=2, maximum=256)

The type of a setting is the type of its default: ``bool``, ``int``, ``float``, ``str`` or a tuple
of three ints or floats. A ``str`` with ``choices`` is one of them, any other is free text.
A trailing underscore keeps a name out of Python's keywords: field ``from_`` is the key ``from``.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from .errors import InputError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

T = TypeVar("T", bound="DataclassInstance")

BOOLEANS = {"true": True, "yes": True, "on": True, "1": True,
            "false": False, "no": False, "off": False, "0": False}  # fmt: skip


GIVEN, OPEN = "given", "open"
"""Conditions on a setting whose 0, in one component at least, leaves it open: such as a budget."""


def setting(
    default: Any,
    label: str,
    description: str,
    *,
    unit: str = "",
    minimum: float | None = None,
    maximum: float | None = None,
    choices: Mapping[str, str] | None = None,
    unset: str = "",
    only_for: Mapping[str, Sequence[str] | str] | None = None,
) -> Any:
    """Declare one field of a settings dataclass.

    Parameters
    ----------
    default : bool, int, float, str or tuple of three ints or floats
        The default value; its type is the type of the setting.
    label, description : str
        Name in the panel and one sentence about it, without a full stop.
    unit : str, optional
        Unit shown behind the label, for example ``"cells"`` or ``"degrees"``.
    minimum, maximum : float, optional
        Inclusive limits; of every component of a tuple.
    choices : mapping of str to str, optional
        The admitted texts, each with one sentence about it.
    unset : str, optional
        A word such as ``"auto"`` that the command line accepts for the default.
    only_for : mapping of str to sequence of str, or to GIVEN or OPEN, optional
        Where this setting has an effect: the choices of other settings, or whether they are GIVEN
        or left OPEN, by their names. Elsewhere it changes nothing: the panel greys it out, the
        command line says so and goes on.

    Returns
    -------
    dataclasses.Field
    """
    metadata = {
        "label": label,
        "description": description,
        "unit": unit,
        "minimum": minimum,
        "maximum": maximum,
        "choices": dict(choices) if choices else None,
        "unset": unset,
        "only_for": {
            name: condition if condition in (GIVEN, OPEN) else list(condition)
            for name, condition in (only_for or {}).items()
        }
        or None,
    }
    return dataclasses.field(default=default, metadata=metadata)


def key_of(field: dataclasses.Field) -> str:
    """Return the public name of a field: ``from_`` is ``from``."""
    return field.name.rstrip("_")


def has_effect(field: dataclasses.Field, settings: Any) -> bool:
    """Say whether a setting has an effect beside the others.

    Parameters
    ----------
    settings : object
        What has the settings as attributes: the dataclass, or Blender's properties made of it.
    """
    only_for = field.metadata["only_for"] or {}
    return all(_meets(getattr(settings, name), condition) for name, condition in only_for.items())


def _meets(value: Any, condition: Sequence[str] | str) -> bool:
    """Say whether the value of a setting meets a condition of another's `only_for`."""
    if condition not in (GIVEN, OPEN):
        return value in condition
    # Blender's properties of three numbers are no tuples, but have as many components.
    is_open = 0 in (value if hasattr(value, "__len__") else (value,))
    return is_open == (condition == OPEN)


def only_for_in_words(only_for: Mapping[str, Sequence[str] | str]) -> str:
    """Say where a setting has an effect: ``"only for builder lbvh, ploc and budget given"``."""
    return "only for " + " and ".join(
        f"{name} {condition if condition in (GIVEN, OPEN) else ', '.join(map(str, condition))}"
        for name, condition in only_for.items()
    )


def without_effect(settings: Any, where: str) -> list[str]:
    """Return one sentence for each setting that was changed, but has no effect beside the others.

    Parameters
    ----------
    where : str
        What is being set, for the sentences (``"structure grid"``).
    """
    return [
        f"{where}: {key_of(field)} changes nothing, it is "
        f"{only_for_in_words(field.metadata['only_for'])}"
        for field in dataclasses.fields(settings)
        if getattr(settings, field.name) != field.default and not has_effect(field, settings)
    ]


def composed(
    name: str, doc: str, own: type, parts: Mapping[str, Mapping[str, type[Any]]]
) -> type[Any]:
    """Return the settings of a family: its own, and those of the parts that can be chosen in it.

    A setting of a part that is none of the family's own stands behind the choice of that part, and
    is `only_for` the choices that have it.

    Parameters
    ----------
    name, doc : str
        Of the new settings dataclass.
    own : type
        The family's own settings dataclass; what a class declares stands before what it inherits.
    parts : mapping
        By the name of one of the family's own settings and by its choices: the settings dataclass
        of the part that is chosen.
    """
    own_fields = {field.name: field for field in dataclasses.fields(own)}
    declared = [name for each in own.__mro__ for name in getattr(each, "__annotations__", ())]
    rows: list[tuple[str, Any, Any]] = []
    for field in sorted(own_fields.values(), key=lambda field: declared.index(field.name)):
        rows.append((field.name, field.type, _copy_of(field, None)))
        of_parts: dict[str, tuple[dataclasses.Field, list[str]]] = {}
        for choice, settings in parts.get(field.name, {}).items():
            for each in dataclasses.fields(settings):
                if each.name not in own_fields:
                    of_parts.setdefault(each.name, (each, []))[1].append(choice)
        for each, choices in of_parts.values():
            rows.append((each.name, each.type, _copy_of(each, {field.name: choices})))
    return dataclasses.make_dataclass(
        name, rows, frozen=True, namespace={"__doc__": doc, "__module__": own.__module__}
    )


def _copy_of(field: dataclasses.Field, only_for: Mapping[str, list[str]] | None) -> Any:
    """Return a field like another, with one more condition."""
    conditions = {**(field.metadata["only_for"] or {}), **(only_for or {})}
    metadata = {**field.metadata, "only_for": conditions or None}
    return dataclasses.field(default=field.default, metadata=metadata)


def part_of(settings: Any, settings_type: type[T]) -> T:
    """Return the settings of one part out of those of its family."""
    return settings_type(
        **{field.name: getattr(settings, field.name) for field in dataclasses.fields(settings_type)}
    )


def parse(settings_type: type[T], texts: Mapping[str, str], where: str) -> T:
    """Make settings from texts such as ``{"resolution": "35x35x35"}``.

    Parameters
    ----------
    settings_type : type
        The settings dataclass.
    texts : mapping of str to str
        Values by key, as the command line gives them.
    where : str
        What is being set, for the messages (``"structure grid"``).

    Raises
    ------
    InputError
        For an unknown key or a value that does not fit, naming what is known.
    """
    fields = {key_of(field): field for field in dataclasses.fields(settings_type)}
    values = {}
    for key, text in texts.items():
        if key not in fields:
            known = ", ".join(fields) or "none"
            raise InputError(f"{where} has no setting '{key}'; its settings are: {known}")
        values[fields[key].name] = _parse_value(fields[key], text, where)
    return check(settings_type(**values), where)


def check(settings: T, where: str, called: Callable[[dataclasses.Field], str] = key_of) -> T:
    """Return `settings` if every value is of its type and within its limits.

    Parameters
    ----------
    where : str
        What is being set, for the messages.
    called : callable
        Returns what a setting is called where it is set; on the command line by its key.

    Raises
    ------
    InputError
        Naming the setting, the value and the limits.
    """
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        if not _is_of_kind(value, field.default):
            raise InputError(
                f"{where}: {called(field)} takes {kind_in_words(field)}, not {value!r}"
            )
        if value == field.default:
            continue
        meta = field.metadata
        if meta["choices"] and value not in meta["choices"]:
            known = ", ".join(meta["choices"])
            raise InputError(f"{where}: {called(field)} is one of {known}, not '{value}'", value)
        if isinstance(value, (str, bool)):
            continue
        for component in value if isinstance(value, tuple) else (value,):
            if isinstance(component, int) and abs(component) >= 2**63:
                raise InputError(f"{where}: {called(field)} is a number of more than 64 bits")
            if not math.isfinite(component):
                raise InputError(f"{where}: {called(field)} must be finite, not {component}")
            low, high = meta["minimum"], meta["maximum"]
            if (low is not None and component < low) or (high is not None and component > high):
                limits = " and ".join(
                    f"at {word} {limit:g}"
                    for word, limit in (("least", low), ("most", high))
                    if limit is not None
                )
                raise InputError(f"{where}: {called(field)} must be {limits}, not {component}")
    return settings


def _is_of_kind(value: Any, default: Any) -> bool:
    """Say whether a value can stand where `default` stands; a whole number can for any number."""
    if isinstance(default, tuple):
        return (
            isinstance(value, tuple)
            and len(value) == len(default)
            and all(map(_is_of_kind, value, default))
        )
    if isinstance(value, bool) or isinstance(default, bool):
        return isinstance(value, bool) and isinstance(default, bool)
    return isinstance(value, (int, float) if isinstance(default, float) else type(default))


def _parse_value(field: dataclasses.Field, text: str, where: str) -> Any:
    """Return the value that `text` means for `field`."""
    default, text = field.default, text.strip()
    if field.metadata["unset"] and text == field.metadata["unset"]:
        return default
    try:
        if isinstance(default, bool):
            return BOOLEANS[text.lower()]
        if isinstance(default, int):
            return int(text)
        if isinstance(default, float):
            return float(text)
        if isinstance(default, tuple):
            return _parse_triple(text, type(default[0]))
    except (ValueError, KeyError, OverflowError):
        raise InputError(
            f"{where}: {key_of(field)} takes {kind_in_words(field)}, not '{text}'", text
        ) from None
    return text


def _parse_triple(text: str, number: type) -> tuple:
    """Return the three numbers of ``1x2x3``; a single one stands for all three."""
    parts = [number(part) for part in text.split("x")]
    if len(parts) == 1:
        parts = parts * 3
    if len(parts) != 3:
        raise ValueError(text)
    return tuple(parts)


def kind_in_words(field: dataclasses.Field) -> str:
    """Say what a field accepts: ``"a whole number"``, ``"true or false"``, ..."""
    default = field.default
    if isinstance(default, bool):
        words = "true or false"
    elif isinstance(default, int):
        words = "a whole number"
    elif isinstance(default, float):
        words = "a number"
    elif isinstance(default, tuple):
        kind = "whole numbers" if isinstance(default[0], int) else "numbers"
        words = f"three {kind} such as 1x2x3"
    elif field.metadata["choices"]:
        words = "one of " + ", ".join(field.metadata["choices"])
    else:
        words = "text"
    return f"{words} or {field.metadata['unset']}" if field.metadata["unset"] else words


def to_json(settings: Any) -> dict[str, Any]:
    """Return the settings as a JSON-ready mapping of key to value."""
    values = {}
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        values[key_of(field)] = list(value) if isinstance(value, tuple) else value
    return values


def to_text(settings: Any) -> str:
    """Return the settings in the words of the command line: ``resolution=auto,mailbox=true``.

    Free text stands as it is, without the quotes that it may need there.
    """
    parts = []
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        parts.append(f"{key_of(field)}={value_to_text(field, value)}")
    return ",".join(parts)


def value_to_text(field: dataclasses.Field, value: Any) -> str:
    """Return a text that means `value`."""
    if field.metadata["unset"] and value == field.default:
        return field.metadata["unset"]
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return "x".join(str(component) for component in value)
    return str(value)


def describe(settings_type: type) -> list[dict[str, Any]]:
    """Return one JSON-ready mapping per setting: key, label, default, limits, choices, ..."""
    rows = []
    for field in dataclasses.fields(settings_type):
        default = list(field.default) if isinstance(field.default, tuple) else field.default
        row = {
            "key": key_of(field),
            "takes": kind_in_words(field),
            "default": default,
            "default_text": value_to_text(field, field.default),
        }
        rows.append(
            row | {name: value for name, value in field.metadata.items() if value or value == 0}
        )
    return rows


PAIR = re.compile(
    r"""\s*(?P<key>[^=,]*?)\s*=
    (?:\s*"(?P<double>[^"]*)"\s*|\s*'(?P<single>[^']*)'\s*|(?P<plain>.*?),*)
    (?:,(?=\s*[a-z_]\w*\s*=)|\Z)""",
    re.VERBOSE | re.IGNORECASE | re.DOTALL,
)
"""``key=value`` up to the comma before the next key; a value in quotes may hold anything else."""


def parse_spec(spec: str) -> tuple[str, dict[str, str]]:
    """Split ``name:key=value,key=value`` into its name and its texts by key.

    A comma that no ``key=`` follows belongs to the value: ``file:path=a,b.npz`` has one key. A
    value in quotes, ``path="a,b=c.npz"``, ends where they do.

    Raises
    ------
    InputError
        For a part without an equals sign or a key given twice.
    """
    name, _, rest = spec.partition(":")
    texts: dict[str, str] = {}
    rest = rest.strip(",")
    while rest:
        pair = PAIR.match(rest)
        if pair is None or not pair["key"]:
            part = rest.partition(",")[0]
            raise InputError(f"'{part}' in '{spec}' is not of the form key=value")
        key = pair["key"]
        if key in texts:
            raise InputError(f"'{key}' is given twice in '{spec}'")
        values = (pair[kind] for kind in ("double", "single", "plain"))
        texts[key] = next(value for value in values if value is not None)
        rest = rest[pair.end() :]
    return name.strip(), texts


def parse_inner(settings_type: type[T], name: str, text: str, where: str) -> T:
    """Make the settings of a part from one text, such as ``"builder=ploc,max_leaf_size=2"``.

    Parameters
    ----------
    name : str
        Of the part.
    where : str
        Whose part it is, for the messages (``"structure two_level, tlas_settings"``).

    Raises
    ------
    InputError
        For what is not of the form key=value, or settings that the part does not have.
    """
    where = f"{where}: {name}"
    try:
        _, texts = parse_spec(f"{name}:{text}")
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return parse(settings_type, texts, where)
