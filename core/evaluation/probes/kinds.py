"""All kinds of probes by name."""

from __future__ import annotations

from ...errors import InputError
from .beam import BeamProbe
from .cone import ConeProbe, PyramidProbe
from .probe import Probe

PROBES: dict[str, type[Probe]] = {
    probe.name: probe for probe in (ConeProbe, PyramidProbe, BeamProbe)
}


def probe_named(name: str) -> type[Probe]:
    """Return the kind of probe called `name`.

    Raises
    ------
    InputError
        Listing the known names.
    """
    if name not in PROBES:
        raise InputError(f"there is no probe '{name}'; known are: {', '.join(PROBES)}")
    return PROBES[name]
