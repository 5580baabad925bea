"""Constructive solid geometry (CSG): trees of set operations over solids, and how they are cut.

- :mod:`.description`: the words for trees;
- :mod:`.trees`, :mod:`.making`: trees in arrays, and how they come from descriptions;
- :mod:`.closed`: which meshes have an inside;
- :mod:`.volumes`, :mod:`.cutting`: bounds from the leaves up, and back down;
- :mod:`.intervals`: where a ray is inside, from the intervals of two operands.

How a ray meets a tree takes a walk, and is told in :mod:`...contract.csg`.
"""
