"""Builders that divide the triangles of a node in two, from the root on."""
