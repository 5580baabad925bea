"""Materials of samples as Blender's: Principled BSDFs that mirror and transmit as much.

Whitted's model and physically based shading do not mean the same: highlights, and what is mirrored
in white beside a coloured surface, are not taken over. What sends rays on sends them on.
"""

from __future__ import annotations

import bpy

from ...core.scene.material import Material


def linear_of(shown: float) -> float:
    """Return a colour's share as shaders have it, of the one as it is shown (sRGB)."""
    return shown / 12.92 if shown <= 0.04045 else ((shown + 0.055) / 1.055) ** 2.4


def blender_material(material: Material) -> bpy.types.Material:
    """Return a new material of Blender's that is like one of ours.

    In solid view it stays grey, so that cells are seen on it as on any mesh.
    """
    made = bpy.data.materials.new(material.name)
    if made.node_tree is None:  # up to 4.5
        made.use_nodes = True
    shader = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    mirrors = material.specular > 0.0 or material.transmission > 0.0
    # Of glass the index of refraction says how much it mirrors.
    metallic = 0.0 if material.transmission > 0.0 else material.specular
    shader.inputs["Base Color"].default_value = (*map(linear_of, material.colour), 1.0)
    shader.inputs["Metallic"].default_value = metallic
    shader.inputs["Roughness"].default_value = 0.0 if mirrors else 1.0
    shader.inputs["Transmission Weight"].default_value = material.transmission
    shader.inputs["IOR"].default_value = material.index_of_refraction
    return made
