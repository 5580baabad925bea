"""The subject itself: acceleration structures in pure Python on NumPy and Numba.

Nothing in here imports ``bpy``: the core is used and tested without Blender.

- ``geometry``: triangles, boxes, rays and their intersection tests
- ``structures``: one file per acceleration structure
- ``evaluation``: workloads (named ray sets), experiments, records, pictures
- ``files``: mesh files
- ``reference``: Embree as an independent witness
"""
