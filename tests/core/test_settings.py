"""Settings: texts, limits, messages and JSON, of everything that has settings."""

import dataclasses
import json
import math
from types import SimpleNamespace

import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays.workloads import workload_named, workloads
from accelscope.core.settings import (
    GIVEN,
    OPEN,
    check,
    describe,
    has_effect,
    key_of,
    kind_in_words,
    parse,
    parse_spec,
    setting,
    to_json,
    without_effect,
)
from accelscope.core.structures import structure_named, structures
from accelscope.sample_scenes import make_sample, samples

EVERYTHING = {
    **{f"structure {name}": entry.Settings for name, entry in structures().items()},
    **{f"rays {name}": entry.Settings for name, entry in workloads().items()},
    **{f"sample {name}": entry.Settings for name, entry in samples().items()},
}


@dataclasses.dataclass(frozen=True)
class Example:
    switch: bool = setting(False, "Switch", "A switch")
    whole: int = setting(3, "Whole", "A whole number", minimum=1, maximum=9)
    real: float = setting(0.5, "Real", "A number", minimum=0.0)
    triple: tuple = setting((0, 0, 0), "Triple", "Three", minimum=0, unset="auto")
    reals: tuple = setting((0.0, 0.0, 1.0), "Reals", "Three")
    word: str = setting("red", "Word", "A word", choices={"red": "Red", "blue": "Blue"})
    text: str = setting("", "Text", "Free")
    from_: float = setting(1.0, "From", "A keyword")


def text_of(value):
    if isinstance(value, tuple):
        return "x".join(map(repr, value))
    return str(value).lower() if isinstance(value, bool) else str(value)


@pytest.mark.parametrize("where", EVERYTHING)
def test_defaults_pass_and_come_back_from_text_and_json(where):
    settings_type = EVERYTHING[where]
    default = settings_type()
    assert check(default, where) == default
    texts = {key_of(f): text_of(getattr(default, f.name)) for f in dataclasses.fields(default)}
    assert parse(settings_type, texts, where) == default
    assert json.loads(json.dumps(to_json(default), allow_nan=False)) == to_json(default)
    assert list(to_json(default)) == list(texts)


@pytest.mark.parametrize("where", EVERYTHING)
def test_every_setting_says_what_it_is(where):
    rows = describe(EVERYTHING[where])
    assert json.loads(json.dumps(rows)) == rows
    for row, field in zip(rows, dataclasses.fields(EVERYTHING[where]), strict=True):
        assert row["key"] == key_of(field)
        assert row["label"]
        assert row["description"]
        assert not row["description"].endswith(".")
        assert row["takes"] == kind_in_words(field)
        meta = field.metadata
        if meta["choices"]:
            assert field.default in meta["choices"]
            assert all(meta["choices"].values())
        for limit in ("minimum", "maximum"):
            if meta[limit] is not None:
                assert row[limit] == meta[limit], "a limit of zero is a limit, too"


@dataclasses.dataclass(frozen=True)
class Conditional:
    way: str = setting("far", "Way", "A way", choices={"far": "Far", "near": "Near", "up": "Up"})
    switch: bool = setting(False, "Switch", "A switch")
    steps: int = setting(3, "Steps", "Steps", only_for={"way": ("near", "up")})
    both: int = setting(3, "Both", "Both", only_for={"way": ("up",), "switch": (True,)})
    budget: int = setting(0, "Budget", "A budget")
    cells: tuple = setting((0, 0, 0), "Cells", "Cells")
    order: int = setting(3, "Order", "Order", only_for={"budget": GIVEN})
    rule: int = setting(3, "Rule", "Rule", only_for={"cells": OPEN, "way": ("far",)})


def test_settings_without_effect():
    steps, both, _, _, order, rule = dataclasses.fields(Conditional)[2:]
    for way, switch, some, all_ in (
        ("far", True, False, False),
        ("near", True, True, False),
        ("up", False, True, False),
        ("up", True, True, True),
    ):
        settings = Conditional(way, switch)
        assert (has_effect(steps, settings), has_effect(both, settings)) == (some, all_)
    assert without_effect(Conditional(steps=4), "structure x") == [
        "structure x: steps changes nothing, it is only for way near, up"
    ]
    assert without_effect(Conditional("up", both=4), "structure x") == [
        "structure x: both changes nothing, it is only for way up and switch True"
    ]
    assert without_effect(Conditional("up", True, 4, 4), "structure x") == []
    assert without_effect(Conditional(), "structure x") == []
    assert without_effect(Conditional(order=4), "structure x") == [
        "structure x: order changes nothing, it is only for budget given"
    ]
    assert without_effect(Conditional(cells=(1, 2, 3), rule=4), "structure x") == [
        "structure x: rule changes nothing, it is only for cells open and way far"
    ]
    assert has_effect(order, Conditional(budget=1))
    for cells, expected in (((0, 0, 0), True), ((1, 0, 2), True), ((1, 2, 3), False)):
        assert has_effect(rule, Conditional(cells=cells)) is expected
        # Blender hands out arrays of its own kind.
        assert has_effect(rule, SimpleNamespace(cells=list(cells), way="far")) is expected


@pytest.mark.parametrize("where", EVERYTHING)
def test_conditions_name_other_settings(where):
    fields = {field.name: field for field in dataclasses.fields(EVERYTHING[where])}
    for field in fields.values():
        for name, condition in (field.metadata["only_for"] or {}).items():
            assert name != field.name
            assert fields[name].metadata["choices"] or condition in (GIVEN, OPEN)


@pytest.mark.parametrize("where", EVERYTHING)
def test_every_limit_is_kept(where):
    settings_type = EVERYTHING[where]
    for field in dataclasses.fields(settings_type):
        meta, default = field.metadata, field.default
        if isinstance(default, (bool, str)):
            if meta["choices"]:
                with pytest.raises(InputError, match=f"^{where}: {key_of(field)}.*'nonsense'"):
                    parse(settings_type, {key_of(field): "nonsense"}, where)
            continue
        first = default[0] if isinstance(default, tuple) else default
        if isinstance(first, float):
            for word in ("nan", "inf", "-inf"):
                with pytest.raises(InputError, match=key_of(field)):
                    parse(settings_type, {key_of(field): word}, where)
        for limit, step in (("minimum", -1), ("maximum", 1)):
            if meta[limit] is None:
                continue
            outside = type(first)(meta[limit] + step)
            with pytest.raises(InputError, match=f"^{where}: {key_of(field)} must be .*{outside}"):
                parse(settings_type, {key_of(field): str(outside)}, where)
        for word in ("", "x", "1x2", "1x2x3x4", "1;2", "0x1y2", "1e5x", "--1"):
            with pytest.raises(InputError, match=f"{key_of(field)} takes "):
                parse(settings_type, {key_of(field): word}, where)


def test_parsing():
    got = parse(
        Example,
        {"switch": "YES", "whole": " 9 ", "real": "1e-3", "triple": "4x5x6", "reals": "-1x2.5x1e3",
         "word": "blue", "text": "a=b c", "from": "2"},
        "example",
    )  # fmt: skip
    assert got == Example(True, 9, 1e-3, (4, 5, 6), (-1.0, 2.5, 1e3), "blue", "a=b c", 2.0)
    assert to_json(got) == {
        "switch": True, "whole": 9, "real": 1e-3, "triple": [4, 5, 6],
        "reals": [-1.0, 2.5, 1e3], "word": "blue", "text": "a=b c", "from": 2.0,
    }  # fmt: skip
    assert parse(Example, {"triple": "7"}, "example").triple == (7, 7, 7)
    assert parse(Example, {"triple": "auto"}, "example").triple == (0, 0, 0)
    for text, value in (("true", True), ("on", True), ("1", True), ("no", False), ("0", False)):
        assert parse(Example, {"switch": text}, "example").switch is value
    for text in ("0.1", "1e-300", "123456.789012345678"):
        assert parse(Example, {"real": text}, "example").real == float(text)


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        ({"colour": "1"}, "example has no setting 'colour'; its settings are: switch, whole, real, "
         "triple, reals, word, text, from"),
        ({"from_": "1"}, "example has no setting 'from_'; its settings are: switch, whole, real, "
         "triple, reals, word, text, from"),
        ({"switch": "maybe"}, "example: switch takes true or false, not 'maybe'"),
        ({"whole": "2.5"}, "example: whole takes a whole number, not '2.5'"),
        ({"whole": "10"}, "example: whole must be at least 1 and at most 9, not 10"),
        ({"triple": "1x2x" + "9" * 19}, "example: triple is a number of more than 64 bits"),
        ({"real": "-1"}, "example: real must be at least 0, not -1.0"),
        ({"real": "nan"}, "example: real must be finite, not nan"),
        ({"real": "x"}, "example: real takes a number, not 'x'"),
        ({"triple": "1x2"}, "example: triple takes three whole numbers such as 1x2x3 or auto, "
         "not '1x2'"),
        ({"triple": "1x-2x3"}, "example: triple must be at least 0, not -2"),
        ({"reals": "1xinfx3"}, "example: reals must be finite, not inf"),
        ({"word": "green"}, "example: word is one of red, blue, not 'green'"),
        ({"from": ""}, "example: from takes a number, not ''"),
    ],
)  # fmt: skip
def test_messages(texts, message):
    with pytest.raises(InputError) as caught:
        parse(Example, texts, "example")
    assert str(caught.value) == message


@pytest.mark.parametrize("digits", [20, 30, 400, 5000])
@pytest.mark.parametrize("key", ["whole", "real", "triple"])
def test_numbers_of_any_length_give_a_message(key, digits):
    if key == "real" and digits < 300:
        assert math.isclose(parse(Example, {key: "9" * digits}, "example").real, 10.0**digits)
        return
    with pytest.raises(InputError, match=key):
        parse(Example, {key: "9" * digits}, "example")


@pytest.mark.parametrize(
    "wrong",
    [{"whole": 2.5}, {"whole": "4"}, {"real": "x"}, {"switch": 3}, {"triple": (1, 2)},
     {"triple": 5}, {"word": 3}, {"reals": ("a", "b", "c")}],
)  # fmt: skip
def test_values_of_another_type_are_refused(wrong):
    """check() is what values of Python code and JSON go through."""
    with pytest.raises(InputError):
        check(Example(**wrong), "example")


@pytest.mark.parametrize(
    ("spec", "name", "texts"),
    [
        ("grid", "grid", {}),
        ("grid:", "grid", {}),
        (" grid : resolution=3x3x3 , padding=0", "grid", {"resolution": "3x3x3 ", "padding": "0"}),
        ("file:path=a=b.npz", "file", {"path": "a=b.npz"}),
        ("file:path=C:/rays.npz", "file", {"path": "C:/rays.npz"}),
    ],
)
def test_specs(spec, name, texts):
    assert parse_spec(spec) == (name, texts)


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("grid:resolution", "'resolution' in 'grid:resolution' is not of the form key=value"),
        ("grid:=3", "'=3' in 'grid:=3' is not of the form key=value"),
        ("grid:a=1,a=2", "'a' is given twice in 'grid:a=1,a=2'"),
    ],
)
def test_broken_specs(spec, message):
    with pytest.raises(InputError) as caught:
        parse_spec(spec)
    assert str(caught.value) == message


def test_unknown_names_list_the_known_ones():
    for find, known in (
        (structure_named, structures()),
        (workload_named, workloads()),
        (make_sample, samples()),
    ):
        with pytest.raises(InputError) as caught:
            find("nonsense")
        assert "'nonsense'" in str(caught.value)
        assert str(caught.value).endswith("known are: " + ", ".join(known))


def test_names_that_stay():
    """The command line's contract with other programs."""
    assert {"naive", "grid", "bvh"} <= set(structures())
    assert {"camera", "random_lines", "file"} <= set(workloads())
    keys = {where: {row["key"] for row in describe(kind)} for where, kind in EVERYTHING.items()}
    assert {"resolution", "padding", "overlap", "assignment", "mailbox"} <= keys["structure grid"]
    assert {"builder", "max_leaf_size", "bins", "C_trav", "C_isect"} <= keys["structure bvh"]
    assert {"from", "at", "up", "fov", "width", "height"} <= keys["rays camera"]
    assert "count" in keys["rays random_lines"]
    assert "path" in keys["rays file"]
    assert {"tetra", "mount", "sombrero", "suzanne", "bunny", "soup"} <= set(samples())
