"""Builders that join clusters, from single triangles on."""
