"""What directional techniques share: the directional cube, its cells, and lists of items in them.

A technique of this kind asks where a ray goes before it asks where it is. Directions go through the
faces of a cube around a point (:mod:`.faces`), faces are divided into cells (:mod:`.lists`), and a
cell lists what may be seen through it (:mod:`.insertion`). A sun has one face, across which its
parallel rays go, and so has a picture.
"""
