"""Line charts as SVG: a few lines of text, crisp at any size, and no plotting library needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...printing import in_html

WIDTH, HEIGHT = 720, 420
LEFT, RIGHT, TOP, BOTTOM = 74, 24, 52, 52
"""Margins around the plot, in the chart's units."""

PALETTE = ("#e0662f", "#1483c4", "#2a9d5c", "#b2418f", "#8a7a10", "#5b5bd6")


@dataclass(frozen=True)
class Curve:
    """A curve with its name.

    Attributes
    ----------
    name : str
    x, y : (n,) float64
    """

    name: str
    x: np.ndarray
    y: np.ndarray


def nice_ticks(low: float, high: float, wanted: int = 6) -> np.ndarray:
    """Return round numbers, evenly spaced, that lie between two limits."""
    if not high > low:
        return np.array([low])
    rough = (high - low) / wanted
    magnitude = 10.0 ** np.floor(np.log10(rough))
    step = magnitude * min((1, 2, 5, 10), key=lambda each: abs(np.log(each * magnitude / rough)))
    return step * np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1) + 0.0


def line_chart(title: str, x_label: str, curves: Sequence[Curve]) -> str:
    """Return curves as an SVG document; y starts at 0, for they are compared by their heights.

    A curve of one point is a dot.
    """
    x = np.concatenate([curve.x for curve in curves])
    y = np.concatenate([curve.y for curve in curves])
    low, high, top = float(x.min()), float(x.max()), float(y.max()) * 1.05 or 1.0

    def column(value: float) -> float:
        share = (value - low) / (high - low) if high > low else 0.5
        return LEFT + share * (WIDTH - LEFT - RIGHT)

    def row(value: float) -> float:
        return HEIGHT - BOTTOM - value / top * (HEIGHT - TOP - BOTTOM)

    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT
    parts = [f'<text x="{LEFT}" y="22" class="title">{in_html(title)}</text>']
    for value in nice_ticks(0.0, top):
        parts.append(f'<path class="grid" d="M{LEFT} {row(value):.1f}H{right}"/>')
        parts.append(
            f'<text x="{LEFT - 8}" y="{row(value) + 4:.1f}" class="end">{value:.6g}</text>'
        )
    for value in nice_ticks(low, high):
        parts.append(f'<path class="axis" d="M{column(value):.1f} {bottom}v5"/>')
        parts.append(
            f'<text x="{column(value):.1f}" y="{bottom + 20}" class="middle">{value:.6g}</text>'
        )
    parts.append(f'<path class="axis" d="M{LEFT} {TOP}V{bottom}H{right}"/>')
    parts.append(
        f'<text x="{(LEFT + right) / 2}" y="{HEIGHT - 12}" class="middle">{in_html(x_label)}</text>'
    )
    for number, curve in enumerate(curves):
        colour = PALETTE[number % len(PALETTE)]
        points = " ".join(
            f"{column(a):.2f},{row(b):.2f}" for a, b in zip(curve.x, curve.y, strict=True)
        )
        parts.append(f'<polyline points="{points}" stroke="{colour}"/>')
        if len(curve.x) <= 60:
            parts += [
                f'<circle cx="{column(a):.2f}" cy="{row(b):.2f}" r="2.6" fill="{colour}"/>'
                for a, b in zip(curve.x, curve.y, strict=True)
            ]
        at = LEFT + 130 * number
        parts.append(f'<path d="M{at} 36h22" stroke="{colour}" stroke-width="2"/>')
        parts.append(f'<text x="{at + 28}" y="40">{in_html(curve.name)}</text>')
    return DOCUMENT.format(width=WIDTH, height=HEIGHT, parts="\n".join(parts))


DOCUMENT = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" \
width="{width}" height="{height}">
<style>
text {{ font: 12px system-ui, sans-serif; fill: #333; }}
.title {{ font-size: 15px; font-weight: 600; }}
.end {{ text-anchor: end; }} .middle {{ text-anchor: middle; }}
.grid {{ stroke: #e2e2de; }} .axis {{ stroke: #888; fill: none; }}
polyline {{ fill: none; stroke-width: 2; stroke-linejoin: round; }}
</style>
<rect width="100%" height="100%" fill="white"/>
{parts}
</svg>
"""
