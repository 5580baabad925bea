"""How much of a round cone a sphere covers: the lens of two conics.

Across its axis, one unit before the apex, a round cone is a circle. Of a sphere the apex sees all
directions within some angle of that to its centre, and what is a circle around that direction is a
conic in the cone's cross section: an ellipse, or a branch of a hyperbola where the sphere reaches
beside the apex. Both are mirrored at the line to the centre, and cross at two points at most: at
right angles to that line, the chord between these divides what they have in common, the *lens*,
into a segment of the circle and one of the conic. Both have closed forms. Where angles are small it
is the lens of two circles.

J. Amanatides: Ray Tracing with Cones, SIGGRAPH 1984.
"""

from __future__ import annotations

import math

import numpy as np

NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
"""Of a quadrature for what has no closed form that does not cancel."""


def share_of_sphere(along: float, across: float, radius: float, slope: float) -> float:
    """Return the share of a round cone's cross section that a sphere covers by itself.

    Parameters
    ----------
    along, across : float
        Of the sphere's centre: from the apex along the axis, and from the axis.
    radius : float
    slope : float
        Tangent of the angle between the cone's axis and its side.
    """
    distance = math.hypot(along, across)
    if distance <= radius:
        return 1.0
    half, half_cone = math.asin(radius / distance), math.atan(slope)
    to_centre = math.atan2(across, along)
    if to_centre - half >= half_cone:
        return 0.0
    if to_centre + half_cone <= half:
        return 1.0
    # In the cross section, x runs to the centre. The conic is where its square of y is above 0,
    # y^2 = (x - nearest) (rise + bend (x - nearest)).
    nearest = math.tan(to_centre - half)
    bend = (math.sin(to_centre) / math.cos(half)) ** 2 - 1.0
    rise = 2.0 * math.tan(half)
    if to_centre + half <= half_cone:
        whole = math.tan(to_centre + half) - nearest
        return segment_of_conic(whole, rise, bend) / (math.pi * slope * slope)
    # Where the circle's points are in the sphere's angle.
    # (cosines of small angles are subtracted as squares of sines of their halves)
    a, b, c = (math.sin(0.5 * angle) ** 2 for angle in (half, to_centre, half_cone))
    to_chord = (2.0 * (b + c - a) - 4.0 * b * c) / math.cos(half_cone)
    cosine = min(max(to_chord / (slope * math.sin(to_centre)), -1.0), 1.0)
    turn = math.acos(cosine)
    of_circle = slope * slope * (turn - math.sin(turn) * cosine)
    of_conic = segment_of_conic(max(slope * cosine - nearest, 0.0), rise, bend)
    return (of_circle + of_conic) / (math.pi * slope * slope)


def segment_of_conic(width: float, rise: float, bend: float) -> float:
    """Return the area between a conic's vertex and a chord at right angles to its axis.

    With ``y^2 = x (rise + bend x)`` twice the integral of y from 0 to `width`. Over u, whose square
    is the share of the width, that is one of ``u^2 sqrt(rise + bend width u^2)``.

    Parameters
    ----------
    width : float
        From the vertex to the chord, at most that of an ellipse.
    rise : float
        Above 0.
    bend : float
        Below 0 an ellipse, 0 a parabola, above 0 a hyperbola.
    """
    curve = bend * width
    if abs(curve) < 0.5 * rise:
        # Closed forms cancel; and the root is smooth.
        squares = (0.5 * (NODES + 1.0)) ** 2
        integral = 0.5 * float(WEIGHTS @ (squares * np.sqrt(rise + curve * squares)))
    else:
        end, root = max(rise + curve, 0.0), math.sqrt(abs(curve))
        if curve > 0.0:
            angle = math.asinh(math.sqrt(curve / rise))
        else:
            angle = math.atan2(root, math.sqrt(end))
        integral = math.sqrt(end) * (2.0 * end - rise) / (8.0 * curve)
        integral -= rise * rise * angle / (8.0 * curve * root)
    return 4.0 * width**1.5 * integral
