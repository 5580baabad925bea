"""What comes from Blender: meshes, cameras, lights, frames, and word of changes."""
