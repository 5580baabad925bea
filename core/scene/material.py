"""Materials: what becomes of a ray where it hits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ..errors import InputError

WHITE = 1.0, 1.0, 1.0


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
    shine: float = 100_000.0
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


MATT = Material("matt", (0.8, 0.8, 0.8))
"""What everything is made of in a scene without materials."""
