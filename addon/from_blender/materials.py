"""The materials of a Blender file, as Whitted's model knows them.

Of a Principled BSDF base colour, metallic, roughness, transmission and index of refraction are
read, as they stand in its sockets: nodes in front of these are not evaluated. Of any other shader,
and without nodes, the colour, metallic and roughness of the viewport's display are taken.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import bpy

from ...core.scene.material import Material, principled

READ = ("Base Color", "Metallic", "Roughness", "Transmission Weight", "IOR")

IGNORED = {
    "Alpha": 1.0, "Subsurface Weight": 0.0, "Coat Weight": 0.0, "Sheen Weight": 0.0,
    "Emission Strength": 0.0, "Thin Film Thickness": 0.0, "Anisotropic": 0.0,
}  # fmt: skip
"""Other sockets that change what is seen, and what they are where they do not."""


class Found(NamedTuple):
    """A material, and what of it is not read, in words; empty if nothing is."""

    material: Material
    unread: str


def materials_of(context: bpy.types.Context) -> dict[str, Found]:
    """Return all materials of the file by their full names."""
    return {each.name_full: _read(each) for each in bpy.data.materials}


def names_of_slots(obj: bpy.types.Object, mesh: bpy.types.Mesh) -> tuple[str, ...]:
    """Return the full names of what an evaluated object is made of by slot, "" for nothing.

    Parameters
    ----------
    mesh : Mesh
        Its evaluated one: geometry nodes may have given it materials.
    """
    names = []
    for number, material in enumerate(mesh.materials):
        if number < len(obj.material_slots) and obj.material_slots[number].link == "OBJECT":
            material = obj.material_slots[number].material
        names.append("" if material is None else material.original.name_full)
    return tuple(names)


def _read(material: bpy.types.Material) -> Found:
    """Return a material of Blender's as one of ours."""
    shader = _shader_of(material)
    if shader is None or shader.type != "BSDF_PRINCIPLED":
        made = principled(
            material.name_full, material.diffuse_color[:3], material.metallic, material.roughness
        )
        if shader is None:
            return Found(made, "")
        return Found(made, f"its {shader.bl_label}, so that its colour in the viewport is taken")
    values = {name: _value(shader, name) for name in READ}
    colour, metallic, roughness, transmission, index = values.values()
    made = principled(
        material.name_full, colour, metallic, roughness, transmission, index
    )  # fmt: skip
    unread = [f"nodes of {name}" for name in READ if shader.inputs[name].is_linked]
    unread += [
        name for name, neutral in IGNORED.items()
        if name in shader.inputs
        and (shader.inputs[name].is_linked or shader.inputs[name].default_value != neutral)
    ]  # fmt: skip
    if "Normal" in shader.inputs and shader.inputs["Normal"].is_linked:
        unread.append("Normal")
    return Found(made, ", ".join(unread))


def _value(shader: bpy.types.Node, name: str) -> Any:
    return shader.inputs[name].default_value


def _shader_of(material: bpy.types.Material) -> bpy.types.Node | None:
    """Return the node that a material shows at its output; None without nodes or such a node."""
    tree = material.node_tree
    if tree is None or (bpy.app.version < (5, 0, 0) and not material.use_nodes):
        return None  # from 5.0 on all use theirs, and the property warns of itself
    output = tree.get_output_node("ALL")
    if output is None or not output.inputs["Surface"].is_linked:
        return None
    node = output.inputs["Surface"].links[0].from_node
    while node.type == "REROUTE" and node.inputs[0].is_linked:
        node = node.inputs[0].links[0].from_node
    return node
