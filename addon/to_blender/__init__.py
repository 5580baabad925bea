"""What goes to Blender: objects."""
