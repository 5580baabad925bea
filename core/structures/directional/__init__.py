"""What directional techniques share: the directional cube, its cells, and lists of items in them.

A technique of this kind asks where a ray goes before it asks where it is. Directions go through the
faces of a cube around a point (:mod:`.faces`). A face is divided into cells, each with a list of
what may be seen through it (:mod:`.lists`): items are projected into the face (:mod:`.projection`),
and cells ask whether they see them (:mod:`.insertion`, :mod:`.filling`). A sun has one face, across
which its parallel rays go, and so has a picture.
"""
