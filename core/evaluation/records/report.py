"""Reports: records as JSON, CSV, a table for the terminal, and rows for the panel."""

from __future__ import annotations

import csv
import io
import json
import re
import unicodedata
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ...contract.counters import (
    MAILBOX_HITS,
    N_EETS,
    OF_HIERARCHY,
    POSTPONED_HITS,
    counters_within,
)
from ...contract.figures import look_up
from ...contract.structure import Structure
from ...geometry.instances import MOST_LEVELS
from ...memory import in_words
from ...printing import printable, show_integer
from ...settings import to_json
from ...structures import structure_named
from ...writing import write_bytes
from ..rays.workloads import WORKLOADS
from .experiment import SCHEMA

Record = dict[str, Any]

OF_LEVELS = tuple(
    {
        each.name: each
        for levels in range(1, MOST_LEVELS + 1)
        for each in counters_within(levels, (*OF_HIERARCHY, N_EETS, MAILBOX_HITS, POSTPONED_HITS))
    }.values()
)
"""What is counted of instances and within them, whatever the meshes' structures are."""


def to_json_text(records: Sequence[Record]) -> str:
    """Return the JSON document of records, in full precision."""
    return json.dumps({"schema": SCHEMA, "records": list(records)}, indent=1, allow_nan=False)


LONE_SURROGATES = re.compile("[\ud800-\udc7f\udd00-\udfff]")
"""Halves of letters that stand for no byte of a file's name: texts of JSON may have them, but not
UTF-8."""


def write_text(path: str | Path, text: str) -> None:
    """Write a text file, making its folder.

    Raises
    ------
    InputError
        If the place cannot be written to.
    """
    text = LONE_SURROGATES.sub("\N{REPLACEMENT CHARACTER}", text)
    # File names of the system may hold bytes that are no text: they are written as they are.
    write_bytes(path, text.encode("utf-8", errors="surrogateescape"))


def write_json(path: str | Path, records: Sequence[Record]) -> None:
    """Write records as JSON."""
    write_text(path, to_json_text(records) + "\n")


def write_csv(path: str | Path, records: Sequence[Record]) -> None:
    """Write records as CSV, one row each: nested names joined by dots, lists by spaces.

    A list of mappings, such as that of the lights, is numbered: ``scene.lights.0.kind``. Texts that
    a spreadsheet would take for a formula get an apostrophe in front, as one would type it there.
    """
    rows = [
        {name: no_formula(value) for name, value in flatten(record).items()} for record in records
    ]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, buffer.getvalue())


NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.ASCII | re.IGNORECASE)
"""A number as a spreadsheet reads it: nothing that Python's ``float`` takes beside it, such as
``-inf`` or ``-1_000``."""


def no_formula(value: Any) -> Any:
    """Return the value of a cell so that no spreadsheet computes it or passes it on.

    Numbers stay as they are, one or several with blanks between them.
    """
    if not isinstance(value, str) or all(map(NUMBER.fullmatch, value.split(" "))):
        return value
    # Some spreadsheets take wide letters, such as a wide equals sign, for plain ones.
    first = unicodedata.normalize("NFKC", value.lstrip(" ")[:1])
    return f"'{value}" if first in tuple("=+-@") or (first and not first.isprintable()) else value


NO_BRACKETS = str.maketrans("[],", "   ")


def flatten(record: Record, prefix: str = "") -> dict[str, Any]:
    """Return nested mappings as one: ``{"trace": {"N_IT": 2}}`` is ``{"trace.N_IT": 2}``.

    Numbers of a list, nested or not, are joined by spaces, sentences by semicolons.
    """
    flat: dict[str, Any] = {}
    for name, value in record.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            value = {str(number): entry for number, entry in enumerate(value)}
        if isinstance(value, dict):
            flat |= flatten(value, f"{prefix}{name}.")
        elif isinstance(value, list) and value and isinstance(value[0], str):
            flat[prefix + name] = "; ".join(value)
        elif isinstance(value, list):
            flat[prefix + name] = " ".join(json.dumps(value).translate(NO_BRACKETS).split())
        else:
            flat[prefix + name] = value
    return flat


# ------------------------------------------------------------------------------- how it is shown


def show_number(value: float) -> str:
    """Return a number to about four figures."""
    return f"{value:.2f}" if 0.01 <= abs(value) < 1e6 or value == 0 else f"{value:.3g}"


def show_seconds(value: float) -> str:
    """Return ``"83 ms"`` or ``"2.41 s"``."""
    if value >= 1:
        return f"{value:.2f} s"
    return f"{value * 1e3:.0f} ms" if value >= 0.01 else f"{value * 1e3:.2f} ms"


UNITS: dict[str, Callable[[Any], str]] = {
    "": show_number,
    "count": show_integer,
    "seconds": show_seconds,
    "bytes": in_words,
    "error": lambda value: f"{value:.2g}",
}
"""How values are shown, by their unit."""


class Row(NamedTuple):
    """Where a value stands in a record, how it is shown, and what it means in one sentence."""

    section: str
    label: str
    path: tuple[str, ...]
    unit: str
    column: str = ""
    meaning: str = ""


def _row(section: str, label: str, path: str, unit: str, meaning: str, column: str = "") -> Row:
    return Row(section, label, tuple(path.split(".")), unit, column, meaning)


SCENE_AND_BUILD = (
    _row("Scene", "Triangles", "scene.triangles", "count",
         "what is built over, those of instances each time", "triangles"),
    _row("Scene", "Instances", "scene.instances.count", "count", "places in which meshes are"),
    _row("Scene", "Triangles of meshes", "scene.instances.triangles", "count",
         "triangles of the meshes that are in those places, each mesh counted once"),
    _row("Scene", "Dropped triangles", "scene.dropped_triangles", "count",
         "triangles left out, since a corner is not finite"),
    _row("Build", "Build time", "build.seconds", "seconds",
         "time of the building alone, in which nothing was compiled", "build"),
    _row("Build", "Memory", "build.bytes", "bytes", "what the finished structure takes", "memory"),
)  # fmt: skip

RAYS = (
    _row("Rays", "Rays", "rays.count", "count", "rays that were traced"),
    _row("Rays", "Hits", "trace.hits", "count", "rays that hit something", "hits"),
    _row("Rays", "Trace time", "trace.seconds", "seconds", "time of the tracing alone"),
    _row("Rays", "Rays per second", "trace.rays_per_second", "count", "rays over that time"),
    _row("Rays", "Cells made", "trace.lazy.cells", "count",
         "cells that were made when a ray entered them first"),
    _row("Rays", "of the time, making them", "trace.lazy.seconds", "seconds",
         "share of the trace time in which cells were made"),
    _row("Rays", "in passes", "trace.lazy.passes", "count",
         "how many times rays waited for cells to be made"),
)  # fmt: skip


def rows_of(structure: type[Structure]) -> list[Row]:
    """Return what a person sees of a structure, in reading order: its own figures and counters."""
    return [
        *SCENE_AND_BUILD,
        *(
            Row(
                each.section,
                each.label,
                ("statistics", *each.path),
                each.unit,
                each.column,
                each.meaning,
            )
            for each in structure.FIGURES
            if each.label
        ),
        *RAYS,
        *(
            Row("Per ray", each.label, ("trace", each.name), "", each.column, each.meaning)
            for each in structure.COUNTERS
        ),
        *(  # of records over instances
            Row("Per ray", each.label, ("trace", each.name), "", "", each.meaning)
            for each in OF_LEVELS
        ),
    ]


def rows_of_outcome(record: Record) -> list[Row]:
    """Return what a person sees of what has come of a record's rays."""
    workload = WORKLOADS.get(record.get("rays", {}).get("name", ""))
    return [
        Row(each.section, each.label, ("outcome", *each.path), each.unit, "", each.meaning)
        for each in (workload.FIGURES if workload else ())
        if each.label
    ]


def generations_in_words(record: Record) -> list[tuple[str, str, str, str]]:
    """Return a row for each depth of a picture's rays: how many of which class."""
    rows = []
    for generation in record.get("outcome", {}).get("generations", ()):
        numbers = {name.replace("_", " "): n for name, n in generation.items() if name != "depth"}
        text = ", ".join(f"{show_integer(n)} {name}" for name, n in numbers.items() if n)
        meaning = "rays of this depth by class, and those left out since they could add too little"
        rows.append(("Fewer rays", f"Depth {generation['depth']}", text, meaning))
    return rows


def figures(record: Record) -> list[tuple[str, str, str]]:
    """Return (section, label, text) of what the record has, for a person."""
    return [row[:3] for row in explained_figures(record)]


def explained_figures(record: Record) -> list[tuple[str, str, str, str]]:
    """Return the same, and with each what it means: for whom there is a place to say it."""
    rows = []
    for row in (*rows_of(structure_named(record["structure"]["name"])), *rows_of_outcome(record)):
        value = look_up(record, row.path)
        if value is not None:
            show = UNITS[row.unit]
            text = " x ".join(map(show, value)) if isinstance(value, list) else show(value)
            label = said_of_items(record, row.label, row.path[-1])
            rows.append((row.section, label, text, row.meaning))
    rows += generations_in_words(record)
    for name, route in record.get("trace", {}).get("routes", {}).items():
        text = f"{show_integer(route['rays'])}, by {route['structure']}"
        meaning = "rays of this class, and the structure that they were sent to"
        rows.append(("Rays", f"{name.capitalize()} rays", text, meaning))
    return rows


def counters_in_words(record: Record) -> str:
    """Return the counters that tables show: ``"15.78 N_TS steps, 2.82 N_ETS leaves, ..."``."""
    structure = structure_named(record["structure"]["name"])
    return ", ".join(
        f"{show_number(record['trace'][each.name])} {said_of_items(record, each.label, each.name)}"
        for each in (*structure.COUNTERS, *OF_LEVELS)
        if each.column and each.name in record["trace"]
    )


def said_of_items(record: Record, label: str, counter: str) -> str:
    """Return what a counter is called in a record: what is tested may be instances."""
    trace = record.get("trace", {})
    name, _, level = counter.rpartition("_") if counter[-1:].isdigit() else (counter, "", "0")
    has_more_within = f"{name}_{int(level) + 1}" in trace
    return label.replace("triangle", "instance") if has_more_within else label


def spec_of(structure: Record) -> str:
    """Return ``NAME[:key=value,...]`` of a record's structure, default settings left out."""
    defaults = to_json(structure_named(structure["name"]).Settings())
    changed = []
    for key, value in structure["settings"].items():
        if value != defaults[key]:
            text = "x".join(map(str, value)) if isinstance(value, list) else str(value)
            if isinstance(value, str) and "=" in value:
                text = f'"{text}"'
            changed.append(f"{key}={text.lower() if isinstance(value, bool) else text}")
    return ":".join([structure["name"]] + ([",".join(changed)] if changed else []))


TEXT_COLUMNS: tuple[tuple[str, tuple[str, ...], Callable[[Any], str]], ...] = (
    ("scene", ("scene", "name"), str),
    ("structure", ("structure",), spec_of),
    ("rays", ("rays", "name"), str),
)


PARTS = "scene", "build", "statistics", "rays", "trace"
"""Parts of a record in the order of the table's columns."""


def table(records: Sequence[Record]) -> str:
    """Return the records as an aligned table, one line each; failed ones with their reason.

    Figures and counters of the structures that are in it have a column, if they want one.
    """
    kinds = {record["structure"]["name"]: None for record in records}
    # Each once, in the order in which the first structure has them.
    columns = {
        row.column: row for name in kinds for row in rows_of(structure_named(name)) if row.column
    }
    ordered = sorted(columns.values(), key=lambda row: PARTS.index(row.path[0]))
    rows = [[title for title, _, _ in TEXT_COLUMNS] + [row.column for row in ordered] + ["Mrays/s"]]
    for record in records:
        texts = [show(look_up(record, path)) for _, path, show in TEXT_COLUMNS]
        if "error" in record:
            rows.append([*texts, failure(record)])
            continue
        for row in ordered:
            value = look_up(record, row.path)
            texts.append("-" if value is None else UNITS[row.unit](value))
        rows.append([*texts, f"{record['trace']['rays_per_second'] / 1e6:.3f}"])
    return aligned(rows, len(TEXT_COLUMNS))


def failure(record: Record) -> str:
    """Return what stands in a table instead of the figures of a failed record."""
    return f"failed: {record['error']}"


def aligned(rows: Sequence[Sequence[str]], text_columns: int = 1) -> str:
    """Return rows, the first of them titles, as text in columns; text left, figures right.

    In a row of fewer cells, the last one reaches to the end.
    """
    rows = [[printable(text) for text in row] for row in rows]
    titles = rows[0]
    widths = [
        max(len(row[n]) for row in rows if len(row) == len(titles) or n < len(row) - 1)
        for n in range(len(titles))
    ]
    lines = []
    for row in rows:
        cells = [
            text.ljust(width) if n < text_columns else text.rjust(width)
            for n, (text, width) in enumerate(zip(row, widths))
        ]
        if len(row) < len(titles):
            cells[-1] = row[-1]
        lines.append("  ".join(cells).rstrip())
    lines.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join(lines)
