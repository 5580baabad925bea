"""Whitted's illumination model: what a surface adds to what is seen.

    I = I_a K_d C + sum over lights of I_l (K_d C (N . L) + K_s (R . L)^shine) + K_s S + T P

S is what comes from the direction of reflection R, P from that of refraction; a light that is
hidden adds nothing. The databases leave intensities open, and recommend sqrt(n) / (2 n) for each of
n lights and for I_a; neither falls off with distance.

T. Whitted: An improved illumination model for shaded display, CACM 23(6), 1980. E. Haines: Readme
of the Standard Procedural Databases 3.14, 2005.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .. import Scene
from ..material import MATT
from .optics import whole_power

SHARPEST = 1_000_000
"""Exponent of the smallest highlight."""


class Surfacing(NamedTuple):
    """Materials as arrays, one row each; shares are multiplied into the colours they go with.

    Attributes
    ----------
    matt, specular, transmission : (m, 3) float64
        K_d C, K_s and T, of red, green and blue.
    shine : (m,) int64
    index_of_refraction : (m,) float64
    """

    matt: np.ndarray
    specular: np.ndarray
    transmission: np.ndarray
    shine: np.ndarray
    index_of_refraction: np.ndarray

    @classmethod
    def of(cls, scene: Scene) -> Surfacing:
        """Return the materials of a scene, or the one that stands in for them."""
        materials = scene.materials or (MATT,)
        return cls(
            np.array([np.multiply(each.diffuse, each.colour) for each in materials]),
            np.array([np.multiply(each.specular, each.specular_colour) for each in materials]),
            np.array(
                [np.multiply(each.transmission, each.transmission_colour) for each in materials]
            ),
            np.array([min(round(each.shine), SHARPEST) for each in materials], dtype=np.int64),
            np.array([each.index_of_refraction for each in materials]),
        )

    def at(self, numbers: np.ndarray) -> Surfacing:
        """Return the rows of materials by number, (n,), of a surface each."""
        return Surfacing(*(column[numbers] for column in self))


def intensity(n_lights: int) -> float:
    """Return that of each light and of the ambient light."""
    return float(np.sqrt(n_lights)) / (2.0 * n_lights)


def lit(
    surfacing: Surfacing, normals: np.ndarray, mirrored: np.ndarray, to_light: np.ndarray
) -> np.ndarray:
    """Return what light of intensity one adds where it arrives, (n, 3).

    Parameters
    ----------
    surfacing : Surfacing
        Of each surface.
    normals, mirrored, to_light : (n, 3) float64
        Unit vectors: N, R and L.
    """
    cosines = np.maximum((normals * to_light).sum(axis=1), 0.0)
    along = np.maximum((mirrored * to_light).sum(axis=1), 0.0)
    highlights = whole_power(np.minimum(along, 1.0), surfacing.shine)
    return surfacing.matt * cosines[:, None] + surfacing.specular * highlights[:, None]
