"""Triangles, boxes, rays and their intersection tests."""
