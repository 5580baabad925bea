"""Materials: what becomes of a ray where it hits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import InputError

WHITE = 1.0, 1.0, 1.0

SHARP = 100_000.0
"""Exponent of a highlight that is too small to be seen."""


@dataclass(frozen=True)
class Material:
    """A surface as Whitted's illumination model knows it (CACM 23(6), 1980).

    The fields are those of the line ``f`` of the Neutral File Format, in which the scenes of the
    Standard Procedural Databases are published. A hit sends a reflected ray on where `specular` is
    above 0, and a refracted one where `transmission` is.

    Attributes
    ----------
    name : str
    colour : (float, float, float)
        Red, green and blue, 0 to 1, as they are shown.
    diffuse : float
        Kd: share of the light of the sources that is scattered in all directions.
    specular : float
        Ks: share of what is seen in the direction of reflection.
    shine : float
        Exponent of the cosine in Phong's highlight; 100,000 is one too small to be seen.
    transmission : float
        T: share of what is seen in the direction of refraction.
    index_of_refraction : float
        Of the inside, the outside being 1; without a meaning where `transmission` is 0.
    specular_colour, transmission_colour : (float, float, float)
        What is reflected and refracted, white light being seen: the colour of a metal, of tinted
        glass. The format knows white alone.
    """

    name: str
    colour: tuple[float, float, float]
    diffuse: float = 1.0
    specular: float = 0.0
    shine: float = SHARP
    transmission: float = 0.0
    index_of_refraction: float = 1.0
    specular_colour: tuple[float, float, float] = WHITE
    transmission_colour: tuple[float, float, float] = WHITE

    def __post_init__(self) -> None:
        """Refuse what would make more light than there is, or numbers that are none."""
        shares = (self.diffuse, self.specular, self.transmission)
        colours = (*self.colour, *self.specular_colour, *self.transmission_colour)
        if not all(0.0 <= value <= 1.0 for value in (*shares, *colours)):
            raise InputError(
                f"material {self.name}: colours, diffuse, specular and transmission must be from "
                "0 to 1"
            )
        if not (0.0 <= self.shine < math.inf and 0.0 < self.index_of_refraction < math.inf):
            raise InputError(
                f"material {self.name}: shine must be at least 0, index_of_refraction above 0"
            )

    def to_json(self) -> dict[str, Any]:
        """Return all of it, as JSON takes it."""
        return {
            "name": self.name,
            "colour": list(self.colour),
            "diffuse": self.diffuse,
            "specular": self.specular,
            "shine": self.shine,
            "transmission": self.transmission,
            "index_of_refraction": self.index_of_refraction,
            "specular_colour": list(self.specular_colour),
            "transmission_colour": list(self.transmission_colour),
        }


def shine_of(half_angle: float) -> float:
    """Return the exponent of a highlight that has half of its strength at an angle.

    Parameters
    ----------
    half_angle : float
        In degrees from the direction of reflection, above 0 and below 90.
    """
    return math.log(0.5) / math.log(math.cos(math.radians(half_angle)))


def display_of(linear: float) -> float:
    """Return a linear share of red, green or blue, from 0 to 1, as it is shown (sRGB).

    To six digits, on which all mathematical libraries agree.
    """
    if linear <= 0.0031308:
        return round(12.92 * linear, 6)
    return round(1.055 * linear ** (1.0 / 2.4) - 0.055, 6)


def principled(
    name: str,
    base_colour: Sequence[float],
    metallic: float = 0.0,
    roughness: float = 0.5,
    transmission: float = 0.0,
    index_of_refraction: float = 1.5,
) -> Material:
    """Return a material of physically based shading as Whitted's model knows it.

    A metal mirrors what is not scattered by its roughness, in its colour. Glass mirrors as much as
    at normal incidence, ((n - 1) / (n + 1))^2, and transmits the rest in its colour, as if it were
    smooth. What is neither is matt.

    Parameters
    ----------
    base_colour : (3,) float
        Linear, not as it is shown.
    metallic, roughness, transmission : float
        From 0 to 1; what is beyond is limited.
    index_of_refraction : float
        What is none is 1.
    """
    metal, rough, clear = (_share(each) for each in (metallic, roughness, transmission))
    index = index_of_refraction if 0.0 < index_of_refraction < math.inf else 1.0
    base: Any = tuple(display_of(_share(each)) for each in base_colour[:3])
    of_metal = metal * (1.0 - rough)
    glass = (1.0 - metal) * clear
    of_glass = glass * ((index - 1.0) / (index + 1.0)) ** 2
    specular = of_metal + of_glass
    part = of_metal / specular if specular else 0.0
    return Material(
        name, base,
        diffuse=max(1.0 - of_metal - glass, 0.0), specular=min(specular, 1.0),
        shine=min(max(2.0 / rough**4 - 2.0, 1.0), SHARP) if rough > 0.05 else SHARP,
        transmission=max(glass - of_glass, 0.0), index_of_refraction=index,
        specular_colour=tuple(1.0 - part * (1.0 - each) for each in base),
        transmission_colour=base,
    )  # fmt: skip


def _share(value: float) -> float:
    """Return a number limited to 0 to 1; 0 for what is none."""
    return min(max(float(value), 0.0), 1.0) if value == value else 0.0


MATT = Material("matt", (0.8, 0.8, 0.8))
"""What everything is made of in a scene without materials."""
