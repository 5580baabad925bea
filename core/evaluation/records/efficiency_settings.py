"""Settings of the efficiency of volumes: apart from it, so that the command line starts quickly."""

from __future__ import annotations

from dataclasses import dataclass

from ...settings import setting


@dataclass(frozen=True)
class EfficiencySettings:
    """What efficiency is measured with."""

    lines: int = setting(
        100_000, "Lines", "Lines of each sample", unit="lines", minimum=100, maximum=10_000_000
    )
    seed: int = setting(1, "Seed", "Start of the random numbers", minimum=0)
    spread: float = setting(
        2.0,
        "Spread",
        "Size of the ball that lines are drawn through; 1 is the one around the object's box",
        minimum=1.0,
        maximum=1000.0,
    )
