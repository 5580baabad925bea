"""What has come of a picture's rays: the picture, and what was saved, at which price."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...contract.figures import Figure
from ...scene.whitted.film import error_of
from ...scene.whitted.trees import CLASS_NAMES

SECTION = "Fewer rays"

FIGURES = (
    Figure("samples", "primary rays: samples of all pixels", "Samples", "count", SECTION),
    Figure("samples_per_pixel", "primary rays over pixels", "Samples per pixel", "", SECTION),
    Figure(
        "not_sent",
        "rays left out since they could add too little; what would come of them is not counted",
        "Rays not sent", "count", SECTION,
    ),
    Figure("generations", "rays of each depth by class, and how many were not sent"),
    Figure(
        "saved.rays", "rays that all samples and contributions would take beside these",
        "Rays saved", "count", SECTION,
    ),
    Figure("saved.share", "the same over all rays that would take", "Share of all", "", SECTION),
    Figure("saved.by_depth", "rays saved at each depth"),
    Figure(
        "saved.rms_error",
        "root of the mean square of what the picture is off in a colour of a pixel, from 0 to 1",
        "Error of picture, RMS", "error", SECTION,
    ),
    Figure(
        "saved.maximum_error", "the most that a colour of a pixel is off", "Error, maximum",
        "error", SECTION,
    ),
)  # fmt: skip


@dataclass(frozen=True)
class Saved:
    """What a picture has saved against the same with all samples and contributions.

    Attributes
    ----------
    by_depth : (depth,) int64
        Rays saved.
    whole : int
        Rays that there would have been.
    rms_error, maximum_error : float
        How far the picture is off, in colours as they are shown, from 0 to 1.
    """

    by_depth: np.ndarray
    whole: int
    rms_error: float
    maximum_error: float

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON takes it."""
        rays = int(self.by_depth.sum())
        return {
            "rays": rays,
            "share": rays / self.whole,
            "by_depth": self.by_depth.tolist(),
            "rms_error": self.rms_error,
            "maximum_error": self.maximum_error,
        }


@dataclass(frozen=True)
class Pictured:
    """The outcome of ``whitted``.

    Attributes
    ----------
    picture : (height, width, 3) float64
        Red, green and blue; white is 1, and more is shown as white.
    samples : (height, width) int64
        Of each pixel.
    sent, spared : (depth, 4) int64
        Rays by depth and class, and those not sent for adding too little.
    saved : Saved or None
        None if nothing was, or it was not compared.
    """

    picture: np.ndarray
    samples: np.ndarray
    sent: np.ndarray
    spared: np.ndarray
    saved: Saved | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the figures by their keys."""
        generations = [
            {
                "depth": number + 1,
                **dict(zip(CLASS_NAMES, sent.tolist(), strict=True)),
                "not_sent": int(spared.sum()),
            }
            for number, (sent, spared) in enumerate(zip(self.sent, self.spared, strict=True))
            if sent.any() or spared.any()
        ]
        return {
            "samples": int(self.samples.sum()),
            "samples_per_pixel": float(self.samples.mean()),
            "not_sent": int(self.spared.sum()),
            "generations": generations,
            **({} if self.saved is None else {"saved": self.saved.to_json()}),
        }

    def against(self, whole: Pictured) -> Pictured:
        """Return this with what it has saved against a picture of all samples and contributions."""
        rms, maximum = error_of(self.picture, whole.picture)
        by_depth = whole.sent.sum(axis=1) - self.sent.sum(axis=1)
        return dataclasses.replace(
            self, saved=Saved(by_depth, int(whole.sent.sum()), rms, maximum)
        )  # fmt: skip
