"""What the user can set: Blender's properties, made from the core's settings."""
