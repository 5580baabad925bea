"""What an instance says of itself beside its matrix: its descriptor, as DXR has it.

The lecture: "Instance descriptor connects a BLAS to TLAS: transformation matrix, shader table
offset (material...)". Names, sizes and values are those of ``D3D12_RAYTRACING_INSTANCE_DESC``.

Microsoft: DirectX Raytracing (DXR) Functional Spec, 2018.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import InputError
from ..settings import check, setting

MASK_BITS, NUMBER_BITS = 8, 24

CULL_DISABLE, FRONT_CCW, FORCE_OPAQUE, FORCE_NON_OPAQUE = 1, 2, 4, 8
"""Flags of an instance: D3D12_RAYTRACING_INSTANCE_FLAGS."""


@dataclass(frozen=True)
class InstanceSettings:
    """An instance's descriptor without its matrix."""

    mask: int = setting(
        2**MASK_BITS - 1, "Mask",
        "Eight bits: a ray passes by if it has none of them in its own mask; 0 is never hit",
        minimum=0, maximum=2**MASK_BITS - 1,
    )  # fmt: skip
    id: int = setting(
        0, "ID", "A number for shaders to read: InstanceID", minimum=0, maximum=2**NUMBER_BITS - 1
    )
    hit_group: int = setting(
        0, "Hit Group",
        "What is added to the index of the hit group: InstanceContributionToHitGroupIndex",
        minimum=0, maximum=2**NUMBER_BITS - 1,
    )  # fmt: skip
    cull_disable: bool = setting(
        False, "Cull Disable", "Rays that cull front or back faces meet both of this instance"
    )
    front_ccw: bool = setting(
        False, "Front Counterclockwise",
        "Triangles are seen from the front where corners run counterclockwise in DXR's space; that "
        "is left-handed: here, from what is otherwise their back",
    )  # fmt: skip
    force_opaque: bool = setting(
        False, "Force Opaque", "No any hit shader is called, whatever the geometry says"
    )
    force_non_opaque: bool = setting(
        False, "Force Non-Opaque", "Any hit shaders are called, whatever the geometry says"
    )

    @property
    def flags(self) -> int:
        """The flags as the sum of their bits."""
        return (
            CULL_DISABLE * self.cull_disable
            + FRONT_CCW * self.front_ccw
            + FORCE_OPAQUE * self.force_opaque
            + FORCE_NON_OPAQUE * self.force_non_opaque
        )


PLAIN = InstanceSettings()
"""Of an instance of which nothing is said."""


def checked(settings: InstanceSettings, where: str) -> InstanceSettings:
    """Return settings of an instance if they can be.

    Raises
    ------
    InputError
        If a number is too large, or an instance is to be opaque and not opaque.
    """
    check(settings, where)
    if settings.force_opaque and settings.force_non_opaque:
        raise InputError(f"{where} cannot be forced to be opaque and non-opaque; choose one")
    return settings
