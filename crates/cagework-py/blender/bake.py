"""Bakes the deformation of a range of frames."""

import struct

import bpy
import cagework as cw
import numpy as np

from . import animation, binding, operators


class Baking(operators.BoundObjectOperator):
    """Base class of operators that bake."""

    form, step, filepath = "KEYS", 1, ""

    def bake(self, context, objects):
        scene = context.scene
        if self.form == "KEYS":
            objects = list({o.data: o for o in objects}.values())
        frames, current = list(range(self.first, self.last + 1, self.step)), scene.frame_current
        if not frames:
            return self.refuse(f"There are no frames from {self.first} to {self.last}")
        for obj in objects:
            if fault := binding.problem(obj, scene):
                return self.refuse(fault)
        for obj in objects:
            remove_bake(obj)
        context.window_manager.progress_begin(0, len(frames))
        try:
            poses = [self.poses(context, objects, frame) for frame in frames]
        except cw.Error as error:
            return self.refuse(str(error))
        finally:
            context.window_manager.progress_end()
            scene.frame_set(current)
        for obj, own in zip(objects, zip(*poses)):
            shapes, cages = zip(*own)
            name = self.filepath if len(objects) == 1 else f"{self.filepath} {bpy.path.clean_name(obj.name)}"
            try:
                if self.form == "KEYS":
                    self.to_keys(obj, frames, shapes)
                else:
                    self.to_file(obj, name, frames, shapes, scene.render.fps / scene.render.fps_base)
            except OSError as error:
                return self.refuse(f"The file was not written: {error}")
            bound = obj.data.cagework
            bound.bake_first, bound.bake_step, bound.bake_count = self.first, self.step, len(frames)
            bound.bake_poses, bound.bake_stamp = np.array(cages, np.float32).tobytes(), bound.stamp
            bound.bake_curves = animation.digest(animation.sources(obj))
            binding.seen(obj.data).outdated.clear()
        return {"FINISHED"}

    def poses(self, context, objects, frame):
        """For each object, what a frame stores, and the pose of its cage.

        As keys, it stores shape and value of the key that follows the cage; as a file, the mix of all shape keys.
        """
        context.scene.frame_set(frame)
        context.window_manager.progress_update((frame - self.first) // self.step)
        found = []
        for obj in objects:
            if fault := binding.follow(obj, context.evaluated_depsgraph_get()):
                raise cw.Error(fault)
            live = obj.data.shape_keys.key_blocks[binding.KEY]
            shape = (binding.coordinates(live.points), live.value) if self.form == "KEYS" else binding.mixed(obj)
            found.append((shape, binding.seen(obj.data).posed))
        return found

    def to_keys(self, obj, frames, poses):
        live, names = obj.data.shape_keys.key_blocks[binding.KEY], []
        for frame, (shape, strength) in zip(frames, poses):
            key = operators.copy_key(obj, f"Cage {frame}")
            key.slider_min, key.slider_max = live.slider_min, live.slider_max
            key.points.foreach_set("co", shape.astype(np.float32).ravel())
            near = [(frame - self.step, 0.0), (frame, strength), (frame + self.step, 0.0)]
            for at, value in near[(frame == frames[0]) : 3 - (frame == frames[-1])]:
                key.value = value
                key.keyframe_insert("value", frame=at)
            names.append(key.name)
            for point in next(c for c in animation.curves(obj.data.shape_keys) if c.data_path == value_path(key)).keyframe_points:
                point.interpolation = "LINEAR"
        live.mute, obj.data.cagework.baked = True, "\n".join(names)

    def to_file(self, obj, name, frames, shapes, fps):
        path = f"{bpy.path.abspath(name)}.{self.form.lower()}"
        with open(path, "wb") as file:
            if self.form == "MDD":
                file.write(struct.pack(">2i", len(shapes), len(shapes[0])))
                file.write((np.array(frames) / fps).astype(">f4").tobytes())
                file.writelines(shape.astype(">f4").tobytes() for shape in shapes)
            else:
                header = (b"POINTCACHE2\0", 1, len(shapes[0]), frames[0], self.step, len(shapes))
                file.write(struct.pack("<12siiffi", *header))
                file.writelines(shape.astype("<f4").tobytes() for shape in shapes)
        cache = obj.modifiers.new(f"Cagework {self.form}", "MESH_CACHE")
        cache.cache_format, cache.filepath, cache.frame_start = self.form, self.filepath_of(path), frames[0] / self.step
        cache.frame_scale = 1 / self.step  # Blender subtracts `frame_start` from the scaled frame.
        obj.modifiers.move(len(obj.modifiers) - 1, 0)

    def filepath_of(self, path):
        return bpy.path.relpath(path) if self.filepath.startswith("//") else path


class Bake(Baking, bpy.types.Operator):
    bl_idname = "cagework.bake"
    bl_label = "Bake"
    bl_description = "Write the deformation in a range of frames, so that it plays without this extension"

    form: bpy.props.EnumProperty(
        name="Format",
        items=[
            ("KEYS", "Shape Keys", "A key per frame, with animated values"),
            ("MDD", "MDD", "A file for the Mesh Cache modifier"),
            ("PC2", "PC2", "A file for the Mesh Cache modifier"),
        ],
    )
    first: bpy.props.IntProperty(name="First Frame", default=1)
    last: bpy.props.IntProperty(name="Last Frame", default=250)
    step: bpy.props.IntProperty(name="Step", default=1, min=1)
    filepath: bpy.props.StringProperty(name="File", subtype="FILE_PATH", description="Without its extension")

    def invoke(self, context, _event):
        self.first, self.last = context.scene.frame_start, context.scene.frame_end
        self.filepath = self.filepath or f"//{operators.bound_mesh(context).name}"
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        return self.bake(context, [o for o in operators.meshes(context) if o.data.cagework.stamp])


class BakeForExport(Baking, bpy.types.Operator):
    bl_idname = "cagework.bake_for_export"
    bl_label = "Bake for Export"
    bl_description = (
        "Write the deformation of all meshes of the scene with an animated cage as shape keys, in the scene's frame range. "
        "Bakes that are up to date are kept"
    )

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT" and bool(binding.owners(context.scene))

    def execute(self, context):
        self.first, self.last = context.scene.frame_start, context.scene.frame_end
        objects = list(animation.warnings(context.scene, exported=True))
        if not objects:
            self.report({"INFO"}, "Nothing to bake: no cage is animated, or the bakes are up to date")
            return {"CANCELLED"}
        return self.bake(context, objects)


def value_path(key):
    """Path from the shape keys to the value of one of them."""
    return f'key_blocks["{bpy.utils.escape_identifier(key.name)}"].value'


def remove_bake(obj):
    """Removes what the last bake of a mesh made, so that the live shape key deforms it again."""
    for form in ["MDD", "PC2"]:
        if cache := obj.modifiers.get(f"Cagework {form}"):
            obj.modifiers.remove(cache)
    keys, names = obj.data.shape_keys, obj.data.cagework.baked
    action = keys.animation_data.action if keys.animation_data else None
    obj.data.cagework.bake_count, obj.data.cagework.bake_poses = 0, b""
    for key in [keys.key_blocks[name] for name in names.split("\n") if name in keys.key_blocks]:
        for group in animation.curve_groups(action) if action else []:
            for curve in [c for c in group if c.data_path == value_path(key)]:
                group.remove(curve)
        obj.shape_key_remove(key)
    if names:
        keys.key_blocks[binding.KEY].mute, obj.data.cagework.baked = False, ""


class RemoveBake(operators.BoundObjectOperator, bpy.types.Operator):
    bl_idname = "cagework.remove_bake"
    bl_label = "Remove Bake"
    bl_description = "Remove the baked keys or the Mesh Cache modifier, so that the mesh follows the cage again"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and any(animation.form_of_bake(o) for o in operators.meshes(context))

    def execute(self, context):
        for obj in operators.meshes(context):
            if obj.data.cagework.stamp:
                remove_bake(obj)
        return {"FINISHED"}


CLASSES = [Bake, BakeForExport, RemoveBake]
