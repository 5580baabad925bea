"""Builders that cut triangles, too."""
