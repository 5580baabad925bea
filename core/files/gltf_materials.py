"""Materials of glTF: what Whitted's model knows of them.

Read are base colour, metallic, roughness, transmission (KHR_materials_transmission) and index of
refraction (KHR_materials_ior); textures and all else are not.
"""

from __future__ import annotations

from typing import Any

from ..scene.material import Material, principled
from .gltf_accessors import Document, real

TRANSMISSION, INDEX = "KHR_materials_transmission", "KHR_materials_ior"

READ = {TRANSMISSION, INDEX}


class Materials:
    """The materials of a file; each is read when it is asked for.

    Attributes
    ----------
    notes : list of str
        What of them is not read.
    """

    def __init__(self, document: Document) -> None:
        self._document = document
        self._found: dict[int, Material] = {}
        self.notes: list[str] = []

    def of(self, primitive: dict) -> tuple[Material, ...]:
        """Return what a primitive is made of; nothing where the file does not say it."""
        if "material" not in primitive:
            return ()
        index = int(primitive["material"])
        if index not in self._found:
            self._found[index] = self._read(index)
        return (self._found[index],)

    def _read(self, index: int) -> Material:
        entry = self._document.entry("materials", index)
        name = str(entry.get("name") or f"number {index}")
        surface = entry.get("pbrMetallicRoughness", {})
        extensions = entry.get("extensions", {})
        clear = extensions.get(TRANSMISSION, {})
        unread = [key for key in ("emissiveTexture", "normalTexture") if key in entry]
        unread += [key for part in (surface, clear) for key in part if key.endswith("Texture")]
        unread += sorted(set(extensions) - READ)
        if any(entry.get("emissiveFactor", ())):
            unread.append("emissiveFactor")
        if entry.get("alphaMode", "OPAQUE") != "OPAQUE":
            unread.append("alphaMode")
        if unread:
            self.notes.append(f"not read of the material {name}: {', '.join(unread)}")

        def number(part: dict[str, Any], key: str, default: float) -> float:
            return real(part.get(key, default), f"{key} of material {index}")

        colour = surface.get("baseColorFactor", [1.0, 1.0, 1.0])
        return principled(
            name, [real(each, f"a colour of material {index}") for each in colour[:3]],
            number(surface, "metallicFactor", 1.0), number(surface, "roughnessFactor", 1.0),
            number(clear, "transmissionFactor", 0.0),
            number(extensions.get(INDEX, {}), "ior", 1.5),
        )  # fmt: skip
