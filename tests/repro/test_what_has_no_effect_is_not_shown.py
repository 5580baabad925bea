"""The panel shows no setting that changes nothing beside the other choices, no field of nothing.

The panels draw into a layout that notes what is put into it, and whether it is active.
"""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import pytest


class Layout:
    """Takes what a panel draws, as Blender's layout does."""

    def __init__(self, above: Layout | None = None) -> None:
        self.above = above
        self.active = True
        self.drawn: list[tuple[str, Any, Layout]] = above.drawn if above else []

    def part(self, *_: Any, **__: Any) -> Layout:
        return Layout(self)

    row = column = box = split = part

    @property
    def is_active(self) -> bool:
        return self.active and (self.above is None or self.above.is_active)

    def prop(self, group: Any, name: str, **_: Any) -> None:
        getattr(group, name)  # it exists
        self.drawn.append(("prop", name, self))

    def operator(self, name: str, **_: Any) -> Any:
        self.drawn.append(("operator", name, self))
        return SimpleNamespace()

    def operator_menu_enum(self, name: str, key: str, **_: Any) -> None:
        self.drawn.append(("operator", name, self))

    def label(self, text: str = "", **_: Any) -> None:
        self.drawn.append(("label", text, self))

    def active_of(self, kind: str = "prop") -> dict[str, bool]:
        """Return what was drawn by its name, and whether it is active."""
        return {name: part.is_active for each, name, part in self.drawn if each == kind}

    @property
    def text(self) -> str:
        return " ".join(name for kind, name, _ in self.drawn if kind == "label")


@pytest.fixture
def draw(bpy: Any, root: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Draw a panel and return what it has drawn."""
    # Without a window Blender has no size of characters.
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    told = SimpleNamespace(types=bpy.types, context=SimpleNamespace(preferences=preferences))
    monkeypatch.setattr("accelscope.panels.base.bpy", told)

    class Context:
        region = SimpleNamespace(width=400)

        def __getattr__(self, name: str) -> Any:
            return getattr(bpy.context, name)

    def of(name: str) -> Layout:
        panel = getattr(bpy.types, f"VIEW3D_PT_accelscope_{name}")
        own = {key: value for cls in panel.__mro__[::-1] for key, value in vars(cls).items()}
        pretended = type("Pretended", (), {key: own[key] for key in ("draw_loaded", "draw_walk")
                                           if key in own})  # fmt: skip
        layout = Layout()
        pretended().draw_loaded(Context(), layout, root)
        return layout

    return of


def built(bpy: Any, root: Any, structure: str) -> None:
    bpy.ops.mesh.primitive_monkey_add()
    root.structure = structure
    assert bpy.ops.accelscope.build() == {"FINISHED"}


DEPTHS = ["depth_min", "depth_min_share", "depth_max", "depth_max_share"]


def test_before_a_build_there_is_no_depth_and_no_ray(draw: Any) -> None:
    layout = draw("display")
    assert not set(DEPTHS) & set(layout.active_of())
    assert "Nothing has been built yet" in layout.text
    active = layout.active_of()
    assert not active["planes"]
    assert active["opacity"]


CUT = "bvh", "kdtree", "octree", "bsp"


@pytest.mark.parametrize("structure", [*CUT, "bvh:ploc", "grid"])
def test_display(bpy: Any, root: Any, draw: Any, structure: str) -> None:
    structure, _, builder = structure.partition(":")
    if builder:
        root.structures.bvh.builder = builder
    built(bpy, root, structure)
    is_cut, has_steps = structure in CUT and not builder, structure in CUT
    layout = draw("display")
    active = layout.active_of()
    assert all(active[name] for name in (*DEPTHS, "leaves_only", "hide_empty", "colour_by"))
    assert active["planes"] == is_cut
    assert ("Planes: not of cells" in layout.text) == (not has_steps)
    assert ("Planes: these cells are joined" in layout.text) == (has_steps and not is_cut)
    root.display.show = False
    assert not any(draw("display").active_of().values())


def test_settings_of_structures_and_rays(bpy: Any, root: Any, draw: Any) -> None:
    """Each setting is there under every choice it is for, and is not under all others."""
    from accelscope.core.evaluation.rays.workloads import workloads
    from accelscope.core.structures import structures

    count = 0
    for panel, groups, chosen, entries in (
        ("build", root.structures, "structure", structures()),
        ("rays", root.workloads, "workload", workloads()),
    ):
        for name, entry in entries.items():
            setattr(root, chosen, name)
            group = getattr(groups, name)
            fields = {field.name: field for field in dataclasses.fields(entry.Settings)}
            for field in fields.values():
                conditions = field.metadata["only_for"] or {}
                if len(conditions) != 1:
                    continue
                ((other, choices),) = conditions.items()
                if isinstance(choices, str) or not fields[other].metadata["choices"]:
                    continue
                if fields[other].metadata["only_for"]:
                    continue
                for choice in fields[other].metadata["choices"]:
                    setattr(group, other, choice)
                    assert (field.name in draw(panel).active_of()) == (choice in choices), (
                        name, field.name, choice,
                    )  # fmt: skip
                    count += 1
                group.property_unset(other)
    assert count > 50


def test_a_value_that_leaves_a_setting_open_is_a_word(root: Any) -> None:
    from accelscope.core.structures import structure_named
    from accelscope.panels.base import label_beside

    for structure, name, given in (("octree", "max_depth", 4), ("grid", "resolution", (4, 4, 4))):
        group = getattr(root.structures, structure)
        settings = structure_named(structure).Settings
        (field,) = (each for each in dataclasses.fields(settings) if each.name == name)
        label = field.metadata["label"]
        assert label_beside(field, getattr(group, name)) == f"{label} (Auto)"
        setattr(group, name, given)
        assert label_beside(field, getattr(group, name)) == label


def test_only_what_can_follow_is_refitted(bpy: Any, root: Any, draw: Any) -> None:
    from accelscope.core.contract.protocols import Refittable
    from accelscope.core.structures import structures

    for name, entry in structures().items():
        root.structure = name
        operators = draw("build").active_of("operator")
        assert ("accelscope.refit" in operators) == issubclass(entry, Refittable)
        assert issubclass(entry, Refittable) == (name in ("bvh", "two_level"))
