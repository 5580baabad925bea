"""Save a .blend with what extraction has to get right: modifiers, transforms, a turned camera.

python make_blend.py PATH
"""

import sys

import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_monkey_add(location=(0.5, -0.25, 1.0), rotation=(0.1, 0.2, 0.3))
bpy.context.object.modifiers.new("Subdivision", "SUBSURF")
bpy.ops.mesh.primitive_cube_add(location=(-2.0, 0.0, 0.5), scale=(1.0, 0.5, 0.25))
bpy.context.object.modifiers.new("Array", "ARRAY").count = 3
bpy.ops.object.camera_add(location=(6.0, -8.0, 5.0), rotation=(1.1, 0.0, 0.65))
bpy.context.scene.camera = bpy.context.object
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
