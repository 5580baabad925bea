"""Adaptive subdivisions of space by planes: what octree, kd-tree and BSP tree share.

Three choices are independent, as the lecture presents them: who decides the planes (the builder of
the structure), what stores the tree (a record, see :mod:`.tree`), who walks it (:mod:`.walks`).

- :mod:`.tree`: the four kernels by which a walk sees a tree, and the arithmetic of intervals.
- :mod:`.walks`: five ways from leaf to leaf along a ray, in :mod:`.march`, :mod:`.segments`,
  :mod:`.recursive` and :mod:`.heap`.
- :mod:`.ropes`: neighbour links of leaves.
- :mod:`.frontier`: which node is split next, and when building stops.
- :mod:`.settings`: the settings that all of them have.
- :mod:`.selection`: the median of a list.
- :mod:`.structure`: cells, figures and checks of any such tree.
"""
