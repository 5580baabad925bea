"""Generalized rays: probes that carry more than a point.

A ray says what lies at one point of a picture. A *beam* says it of a whole region at once, exactly,
where the scene is made of flat polygons: which part of its cross section sees which polygon. The
files here are in reading order:

- :mod:`.polygonal`: the scene as convex polygons in a BSP tree, cut by its planes;
- :mod:`.beam`: what a beam is; one from a camera, mirrored ones, refracted ones;
- :mod:`.clipping`: convex regions of a cross section, and how one is taken out of another;
- :mod:`.visible`: front to back through the tree: the pieces of the cross section;
- :mod:`.beam_tree`: what goes on from mirrors and glass;
- :mod:`.beam_picture`: pictures of it, at the centres of pixels and by exact areas.

Cones, which ask what lies in a direction give or take an angle, go through structures as rays do
(:mod:`..geometry.cones`). What becomes of that:

- :mod:`.coverage`: how much of a cone each item covers, :mod:`.lens` for spheres;
- :mod:`.soft_shadow`: how much of a light of some size is seen from a point;
- :mod:`.flat_shading`: one colour for each polygon.

J. Amanatides: Ray Tracing with Cones, SIGGRAPH 1984. P. Heckbert, P. Hanrahan: Beam Tracing
Polygonal Objects, SIGGRAPH 1984.
"""
