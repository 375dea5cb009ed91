"""The panel *Cagework* in the sidebar of the 3-D view."""

import blf
import bpy

from . import animation, bake, binding, operators, rig

# Width of borders and of an icon, and size of the text, in pixels at a resolution scale of 1. Larger than in Blender's
# theme, because builds of Linux distributions use wider fonts.
BORDERS, ICON, TEXT = 44, 20, 13
# Operators for a bound mesh.
ACTIONS = [
    operators.Pull,
    operators.Reset,
    operators.SaveKey,
    *bake.CLASSES,
    *rig.CLASSES,
    operators.Unbind,
]


def wrapped(text, width, size):
    """Splits a text at spaces into lines up to a width, for a text size. Both in pixels."""
    blf.size(0, size)
    lines = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and blf.dimensions(0, longer)[0] <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


def notice(layout, context, text, icon="NONE"):
    """Shows a text in as many lines as the width of the region needs."""
    scale = context.preferences.system.ui_scale
    width = context.region.width - scale * (BORDERS + (ICON if icon != "NONE" else 0))
    for k, line in enumerate(wrapped(text, width, TEXT * scale)):
        layout.label(text=line, icon="BLANK1" if k and icon != "NONE" else icon)


class Panel(bpy.types.Panel):
    bl_idname = "VIEW3D_PT_cagework"
    bl_label = "Cagework"
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Cagework"

    def draw(self, context):
        layout, chosen = self.layout, operators.meshes(context)
        if not chosen:
            layout.label(text="Select a mesh")
            return
        obj = chosen[0]
        bound = obj.data.cagework
        layout.label(text=obj.name if len(chosen) == 1 else f"{obj.name} and {len(chosen) - 1} more", icon="MESH_DATA")
        layout.prop(bound, "vertices")
        layout.operator("cagework.make_cage").vertices = bound.vertices
        layout.prop(bound, "cage")
        layout.prop(bound, "grid")
        row = layout.row(align=True)
        row.operator("cagework.bind")
        if not bound.stamp:
            return
        row.operator("cagework.bind", text="Rebind").keep_rest = True
        box = layout.box().column(align=True)
        for line in bound.report.split("\n"):
            notice(box, context, line)
        if fault := binding.problem(obj, context.scene) or animation.warning(obj, context.scene):
            box = layout.box().column(align=True)
            box.alert = True
            notice(box, context, fault, "ERROR")
        sharing = sum(o.data == obj.data for o in context.scene.objects) - 1
        if sharing:
            notice(layout, context, f"{sharing} linked duplicates take the same shape", "INFO")
        column = layout.column(align=True)
        for each in ACTIONS:
            column.operator(each.bl_idname)
