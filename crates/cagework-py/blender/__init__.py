"""Cagework in Blender: a mesh follows its cage through a shape key. Panel *Cagework* in the sidebar of the 3-D view."""

import bpy

from . import animation, bake, binding, operators, panel, rig

CLASSES = [binding.Binding, *operators.CLASSES, *bake.CLASSES, *rig.CLASSES, panel.Panel]
HANDLERS = ["depsgraph_update_post", "frame_change_post"]
RESET_EVENTS = ["undo_post", "redo_post", "load_post"]


def glTF2_pre_export_callback(export_settings):
    """Blender's glTF exporter calls this function by its name before an export, and shows the warnings."""
    for text in animation.warnings(bpy.context.scene, exported=True).values():
        export_settings["log"].warning(f"Cagework: {text}", popup=True)


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Mesh.cagework = bpy.props.PointerProperty(type=binding.Binding)
    setattr(bpy.types.Object, binding.POSE, bpy.props.FloatProperty())
    setattr(bpy.types.Object, binding.MADE, bpy.props.BoolProperty())
    setattr(bpy.types.Armature, rig.RIG, bpy.props.StringProperty())
    for name in HANDLERS:
        getattr(bpy.app.handlers, name).append(binding.on_update)
    for name in RESET_EVENTS:
        getattr(bpy.app.handlers, name).append(binding.forget)


def unregister():
    for name in HANDLERS:
        getattr(bpy.app.handlers, name).remove(binding.on_update)
    for name in RESET_EVENTS:
        getattr(bpy.app.handlers, name).remove(binding.forget)
    del bpy.types.Mesh.cagework
    delattr(bpy.types.Object, binding.POSE)
    delattr(bpy.types.Object, binding.MADE)
    delattr(bpy.types.Armature, rig.RIG)
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
