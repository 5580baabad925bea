"""The command line; it needs no Blender."""
