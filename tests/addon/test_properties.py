"""The Blender properties are the settings dataclasses, nothing more and nothing less."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays.workloads import workloads
from accelscope.core.settings import setting
from accelscope.core.structures import structures
from accelscope.sample_scenes import samples

GROUPS = [("structures", name, entry.Settings) for name, entry in structures().items()]
GROUPS += [("workloads", name, entry.Settings) for name, entry in workloads().items()]


@dataclasses.dataclass(frozen=True)
class EveryKind:
    """One field of each kind."""

    flag: bool = setting(True, "Flag", "A flag")
    count: int = setting(7, "Count", "A count", unit="things", minimum=1, maximum=10**12)
    ratio: float = setting(0.1, "Ratio", "A ratio", minimum=1e-6, maximum=0.7)
    way: str = setting("left", "Way", "A way", choices={"left": "To the left", "up_on": "Up"})
    text: str = setting("free", "Text", "Any text")
    size: tuple[int, int, int] = setting((1, 2, 3), "Size", "Three numbers", minimum=0)
    place: tuple[float, float, float] = setting((0.1, 0.2, 0.3), "Place", "Three numbers")


@pytest.fixture
def every_kind(bpy: Any) -> Any:
    from accelscope.addon.settings import generated

    group = generated.group_type("every_kind", generated.properties_of(EveryKind))
    bpy.utils.register_class(group)
    bpy.types.WindowManager.every_kind = bpy.props.PointerProperty(type=group)
    yield bpy.context.window_manager.every_kind
    del bpy.types.WindowManager.every_kind
    bpy.utils.unregister_class(group)


@pytest.mark.parametrize(("kind", "name", "settings"), GROUPS, ids=[name for _, name, _ in GROUPS])
def test_defaults_equal_those_of_the_dataclass(
    root: Any, kind: str, name: str, settings: type
) -> None:
    from accelscope.addon.settings import generated

    group = getattr(getattr(root, kind), name)
    # Equal to the last bit, although Blender keeps single precision.
    assert generated.read(group, settings, name) == settings()


@pytest.mark.parametrize(("kind", "name", "settings"), GROUPS, ids=[name for _, name, _ in GROUPS])
def test_names_texts_and_limits_are_those_of_the_dataclass(
    root: Any, kind: str, name: str, settings: type
) -> None:
    group = getattr(getattr(root, kind), name)
    shown = {key: prop for key, prop in group.bl_rna.properties.items()
             if key not in {"rna_type", "name"}}  # fmt: skip
    fields = {field.name: field for field in dataclasses.fields(settings)}
    assert list(shown) == list(fields)
    for key, prop in shown.items():
        meta = fields[key].metadata
        assert prop.name == meta["label"]
        assert prop.description.startswith(meta["description"])
        if meta["minimum"] is not None:
            np.testing.assert_allclose(prop.hard_min, meta["minimum"], rtol=1e-6)
        if meta["maximum"] is not None:
            largest = 2**31 - 1 if prop.type == "INT" else np.inf
            np.testing.assert_allclose(prop.hard_max, min(meta["maximum"], largest), rtol=1e-6)
        if meta["choices"]:
            assert [item.identifier for item in prop.enum_items] == list(meta["choices"])


@pytest.mark.parametrize("name", samples())
def test_sample_settings_are_the_operators(bpy: Any, name: str) -> None:
    operator = bpy.ops.accelscope.add_sample_scene.get_rna_type()
    for field in dataclasses.fields(samples()[name].Settings):
        prop = operator.properties[f"{name}_{field.name}"]
        assert prop.name == field.metadata["label"]
        assert prop.default == pytest.approx(field.default)


def test_choices_are_the_registries(root: Any) -> None:
    items = {key: [item.identifier for item in root.bl_rna.properties[key].enum_items]
             for key in ("structure", "workload")}  # fmt: skip
    assert items["workload"] == list(workloads())
    assert sorted(items["structure"]) == sorted(structures())
    # In the order of the lecture, and before all that is not in it.
    assert items["structure"][:4] == ["naive", "sorted_volumes", "bvh", "grid"]


def test_choices_are_named_as_titles() -> None:
    from accelscope.addon.settings.generated import name_of

    names = {"object_median": "Object Median", "obb_and_kdop14": "OBB and 14-DOP", "fifo": "FIFO",
             "rtree_str": "R-tree STR", "lbvh_parallel": "LBVH Parallel", "N_TS": "N_TS",
             "63": "63"}  # fmt: skip
    assert {key: name_of(key) for key in names} == names
    # Where a structure is a choice, it is called what it is called itself.
    assert {key: name_of(key) for key in structures()} == {
        key: structure.label for key, structure in structures().items()
    }


def test_numbers_of_choices_survive_blenders_buttons(root: Any) -> None:
    # Buttons hold them as single-precision numbers; files hold them for good.
    numbers = {item.identifier: item.value
               for item in root.bl_rna.properties["structure"].enum_items}  # fmt: skip
    assert all(int(np.float32(number)) == number for number in numbers.values())
    assert (numbers["bvh"], numbers["grid"]) == (2027846, 2152759)


def test_every_kind_of_field_comes_back(every_kind: Any) -> None:
    from accelscope.addon.settings import generated

    assert generated.read(every_kind, EveryKind, "x") == EveryKind()
    every_kind.flag = False
    every_kind.count = 10**9
    every_kind.ratio = 0.3
    every_kind.way = "up_on"
    every_kind.text = "other"
    every_kind.size = (4, 5, 6)
    every_kind.place = (1e-7, -2.5, 1e20)
    assert generated.read(every_kind, EveryKind, "x") == EveryKind(
        False, 10**9, 0.3, "up_on", "other", (4, 5, 6), (1e-7, -2.5, 1e20)
    )


def test_limits_hold_in_blender_and_when_reading(every_kind: Any) -> None:
    from accelscope.addon.settings import generated

    every_kind.count, every_kind.ratio, every_kind.size = -5, 99.0, (-1, 0, 1)
    settings = generated.read(every_kind, EveryKind, "x")
    assert (settings.count, settings.ratio, settings.size) == (1, 0.7, (0, 0, 1))


def test_reading_checks(bpy: Any) -> None:
    from accelscope.addon.settings import generated

    values = dataclasses.asdict(EveryKind()) | {"ratio": float("inf")}
    with pytest.raises(InputError, match="x: Ratio must be finite"):
        generated.read(SimpleNamespace(**values), EveryKind, "x")


def test_paths_are_relative_to_the_file(bpy: Any, root: Any, tmp_path: Path) -> None:
    from accelscope.addon.settings import choices

    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "here.blend"))
    root = bpy.context.scene.accelscope
    root.workload = "file"
    root.workloads.file.path = "//rays.npz"
    _, settings = choices.workload_and_settings(root)
    assert Path(settings.path) == tmp_path / "rays.npz"


def test_settings_are_saved_with_the_file(bpy: Any, root: Any, tmp_path: Path) -> None:
    root.structure, root.structures.grid.rule = "grid", "regular"
    root.structures.grid.resolution = (4, 5, 6)
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert bpy.context.scene.accelscope.structure == "bvh"
    bpy.ops.wm.open_mainfile(filepath=path)
    root = bpy.context.scene.accelscope
    assert (root.structure, root.structures.grid.rule) == ("grid", "regular")
    assert tuple(root.structures.grid.resolution) == (4, 5, 6)
