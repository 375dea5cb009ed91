"""The panel *Cagework* in the sidebar of the 3-D view."""

import bpy

from . import binding, operators


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
        layout.operator("cagework.make_cage")
        layout.prop(bound, "cage")
        layout.prop(bound, "grid")
        row = layout.row(align=True)
        row.operator("cagework.bind")
        if not bound.stamp:
            return
        row.operator("cagework.bind", text="Rebind").keep_rest = True
        box = layout.box()
        for line in bound.report.split("\n"):
            box.label(text=line)
        if fault := binding.problem(obj, context.scene):
            wrapped = layout.box()
            wrapped.alert = True
            for k, line in enumerate(fault.split(": ", 1)):
                wrapped.label(text=line, icon="NONE" if k else "ERROR")
        sharing = sum(o.data == obj.data for o in context.scene.objects) - 1
        if sharing:
            layout.label(text=f"{sharing} linked duplicates take the same shape", icon="INFO")
        column = layout.column(align=True)
        for name in ["pull", "reset", "save_key", "bake", "unbind"]:
            column.operator(f"cagework.{name}")
