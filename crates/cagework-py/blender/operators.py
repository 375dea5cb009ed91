"""Operators: make a cage, bind, pull, reset, save as shape key, unbind."""

import threading

import bpy
import cagework as cw
import numpy as np
from bpy_extras import view3d_utils
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from . import binding

# Seconds between two updates of the progress of a bind.
INTERVAL = 0.05


def meshes(context):
    """Selected meshes, the active one first. If a cage is active, the meshes that are bound to it."""
    active = context.active_object
    bound = [o for o in binding.owners(context.scene) if o.data.cagework.cage == active]
    if active and bound:
        return bound
    chosen = [o for o in context.selected_objects if o.type == "MESH"]
    if active and active.type == "MESH":
        chosen = [active, *(o for o in chosen if o != active)]
    cage = chosen[0].data.cagework.cage if chosen else None
    return [o for o in chosen if o != cage]


def bound_mesh(context):
    """The active bound mesh, or the first one of the active cage."""
    return next((o for o in meshes(context) if o.data.cagework.stamp), None)


class BoundObjectOperator:
    """Base class of operators for a bound mesh."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT" and bound_mesh(context) is not None

    def refuse(self, sentence):
        self.report({"ERROR"}, sentence)
        return {"CANCELLED"}


class MakeCage(BoundObjectOperator, bpy.types.Operator):
    bl_idname = "cagework.make_cage"
    bl_label = "Make Cage"
    bl_description = (
        "Make a cage around the selected meshes, without their modifiers and shape keys. Replaces the cage that was made "
        "for them before"
    )

    vertices: bpy.props.IntProperty(**binding.VERTICES)
    kind: bpy.props.EnumProperty(
        name="Kind",
        items=[
            ("auto", "Auto", "Rings along the limbs if they fit well, otherwise a shell"),
            ("skeleton", "Skeleton", "Rings of quads along the limbs"),
            ("shell", "Shell", "Follows the surface"),
            ("hull", "Hull", "The convex hull"),
        ],
    )
    clearance: bpy.props.FloatProperty(
        name="Clearance", description="Distance from the mesh, as a fraction of its diagonal", default=0.0, min=0.0, max=0.25
    )

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT" and bool(meshes(context))

    def execute(self, context):
        objects = meshes(context)
        points, triangles, n = [], [], 0
        for obj in objects:
            if fault := binding.fixed(obj):
                return self.refuse(fault)
            obj.data.calc_loop_triangles()
            corners = np.empty(3 * len(obj.data.loop_triangles), np.int32)
            obj.data.loop_triangles.foreach_get("vertices", corners)
            points.append(binding.transform(binding.basis(obj.data), obj.matrix_world))
            triangles.append(corners.reshape(-1, 3) + n)
            n += len(points[-1])
        options = {"target": self.vertices, "kind": self.kind, "clearance": self.clearance}
        try:
            made = cw.generate_cage(np.concatenate(points), np.concatenate(triangles), **options)
        except cw.Error as error:
            return self.refuse(f"No cage was made: {error}")
        first = objects[0]
        for old in made_cages(objects):
            remove_cage(old)
        local = binding.transform(made.vertices, first.matrix_world.inverted())
        mesh = bpy.data.meshes.new(f"{first.name} Cage")
        mesh.from_pydata(local.tolist(), [], [face.tolist() for face in made.faces])
        cage = bpy.data.objects.new(mesh.name, mesh)
        (first.users_collection[0] if first.users_collection else context.collection).objects.link(cage)
        # As a child, the cage moves with the mesh. Moving the cage alone moves the mesh's vertices,
        # not its object.
        cage.parent = first
        cage.display_type, cage.show_in_front, cage.hide_render = "WIRE", True, True
        setattr(cage, binding.MADE, True)
        for obj in objects:
            obj.data.cagework.cage, obj.data.cagework.vertices = cage, self.vertices
        if context.active_object is None:  # The replaced cage was active.
            context.view_layer.objects.active = first
            first.select_set(True)
        return {"FINISHED"}


def made_cages(objects):
    """The cages of objects that *Make Cage* made and that no other mesh uses."""
    chosen = {o.data for o in objects}
    found = {mesh.cagework.cage for mesh in chosen}
    others = [mesh.cagework for mesh in bpy.data.meshes if mesh not in chosen]
    found -= {each for bound in others for each in (bound.cage, bound.bound_cage)}
    return [cage for cage in found if cage and getattr(cage, binding.MADE) and not cage.library]


def remove_cage(cage):
    """Deletes a cage and what refers to it."""
    for mesh in bpy.data.meshes:
        if mesh.cagework.bound_cage == cage:
            mesh.cagework.bound_cage = None
            binding.release(mesh)
        if mesh.cagework.cage == cage:
            mesh.cagework.cage = None
    data = cage.data
    bpy.data.objects.remove(cage)
    if not data.users:
        bpy.data.meshes.remove(data)


class Bind(BoundObjectOperator, bpy.types.Operator):
    bl_idname = "cagework.bind"
    bl_label = "Bind"
    bl_description = "Compute the weights. The current shape of the cage becomes its rest shape"

    keep_rest: bpy.props.BoolProperty(
        name="Keep Rest Shape", description="Bind to the rest shape of the last bind and keep the pose", options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT" and any(o.data.cagework.cage for o in meshes(context))

    def prepare(self, context):
        objects = meshes(context)
        cage = next(o.data.cagework.cage for o in objects if o.data.cagework.cage)
        for obj in objects:
            obj.data.cagework.cage = cage
            if fault := binding.fixed(obj) or binding.cage_fault(obj.data, context.scene):
                raise cw.Error(fault)
            if not cage.visible_get():
                raise cw.Error(f"The cage {cage.name} is hidden: show it to bind, then hide it again")
            sharing = [o.name for o in context.scene.objects if o.data == obj.data and o != obj and o in objects]
            if sharing:
                raise cw.Error(f"{obj.name} and {sharing[0]} share their mesh: select one, or make them single users")
        grid = objects[0].data.cagework.grid
        depsgraph = context.evaluated_depsgraph_get()
        if self.keep_rest and len(objects) > 1:
            return [binding.Job([o], cage, depsgraph, grid, True) for o in objects]
        return [binding.Job(objects, cage, depsgraph, grid, self.keep_rest)]

    def execute(self, context):
        try:
            jobs = self.prepare(context)
            for job in jobs:
                job.solve()
        except cw.Error as error:
            return self.refuse(str(error))
        return self.finish(context, jobs)

    def finish(self, context, jobs):
        for job in jobs:
            job.store(context.evaluated_depsgraph_get())
        self.report({"INFO"}, meshes(context)[0].data.cagework.report.replace("\n", ". "))
        return {"FINISHED"}

    def invoke(self, context, _event):
        try:
            self.jobs = self.prepare(context)
        except cw.Error as error:
            return self.refuse(str(error))
        self.fraction, self.cancelled, self.error = 0.0, False, None
        self.thread = threading.Thread(target=self.work)
        self.thread.start()
        self.timer = context.window_manager.event_timer_add(INTERVAL, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def work(self):
        try:
            for job in self.jobs:
                job.solve(self.progress)
        except Exception as error:  # Shown by `modal`, which runs in the main thread.
            self.error = error

    def progress(self, fraction):
        self.fraction = fraction
        if self.cancelled:
            raise cw.Error("The bind was cancelled")

    def modal(self, context, event):
        self.cancelled |= event.type == "ESC"
        if event.type != "TIMER" or self.thread.is_alive():
            context.workspace.status_text_set(f"Cagework: binding, {self.fraction:.0%} (Esc: cancel)")
            return {"RUNNING_MODAL"}
        context.window_manager.event_timer_remove(self.timer)
        context.workspace.status_text_set(None)
        if self.error or self.cancelled:
            return self.refuse(str(self.error or "The bind was cancelled"))
        return self.finish(context, self.jobs)


class Reset(BoundObjectOperator, bpy.types.Operator):
    bl_idname = "cagework.reset"
    bl_label = "Reset Cage"
    bl_description = "Give the cage's vertices the shape that it had when the mesh was bound"

    def execute(self, context):
        obj = bound_mesh(context)
        cage, local = obj.data.cagework.cage, binding.loaded(obj.data).cage_local
        if fault := binding.cage_fault(obj.data, context.scene) or binding.other_cage(obj) or mixes(cage):
            return self.refuse(fault)
        if len(local) != len(cage.data.vertices):
            return self.refuse(f"The cage has {len(cage.data.vertices)} vertices and had {len(local)} when bound")
        write_cage(cage, local)
        return {"FINISHED"}


def posed_points(cage):
    """The vertices of a cage, or the points of its active shape key if the cage has shape keys."""
    return cage.active_shape_key.points if cage.data.shape_keys else cage.data.vertices


def mixes(cage):
    """Says that the shape of a cage differs from its `posed_points`, or returns None."""
    points = binding.coordinates(posed_points(cage))
    if np.abs(binding.mixed(cage) - points).max() <= binding.SHAPE_TOLERANCE * np.ptp(points, axis=0).max():
        return None
    return f"{cage.name} mixes shape keys: set the active key to 1 and the others to 0"


def write_cage(cage, local):
    """Sets the local positions of a cage's `posed_points`."""
    posed_points(cage).foreach_set("co", np.asarray(local, np.float32).ravel())
    cage.data.update()
    if cage.data.shape_keys:
        cage.data.update_tag()


class Pull(BoundObjectOperator, bpy.types.Operator):
    bl_idname = "cagework.pull"
    bl_label = "Pull"
    bl_description = "Drag a point of the mesh; the cage follows with little bending"

    vertex: bpy.props.IntProperty(name="Vertex", min=0)
    offset: bpy.props.FloatVectorProperty(name="Offset", subtype="TRANSLATION", description="In world space")

    def start(self, context):
        """Reads mesh, cage and weights. Returns a sentence if they cannot be pulled."""
        self.obj = bound_mesh(context)
        mesh, cage = self.obj.data, self.obj.data.cagework.cage
        if fault := binding.problem(self.obj, context.scene):
            return fault
        depsgraph = context.evaluated_depsgraph_get()
        if cage.modifiers:
            return f"{cage.name} has modifiers: apply them, or pose it by hand"
        if binding.singular(cage.matrix_world):
            return f"{cage.name} has a scale of zero: set another scale"
        if fault := mixes(cage):
            return fault
        self.weights, self.cage = binding.loaded(mesh), cage
        mesh.calc_loop_triangles()
        corners = np.empty(3 * len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("vertices", corners)
        self.triangles = corners.reshape(-1, 3)
        to_bind = binding.to_bind(mesh)
        self.rest = binding.transform(binding.basis(mesh), to_bind)
        try:
            self.puller = self.weights.pull_of(self.rest, self.triangles, cage, depsgraph, mesh.cagework.grid)
        except cw.Error as error:
            return str(error)
        self.posed = binding.posed_cage(self.obj, depsgraph)
        self.moved = self.rest + self.weights.displacements(self.posed, np.eye(3))
        self.to_world = np.array(self.obj.matrix_world) @ np.linalg.inv(to_bind)
        self.world_to_cage = np.linalg.inv(np.array(cage.matrix_world))
        self.before = binding.coordinates(posed_points(cage))
        return None

    def pull(self, solve, world_target):
        """Sets the pose of the cage that a function returns for the targets of the grabs."""
        posed = solve(binding.transform(np.array([world_target]), np.linalg.inv(self.to_world)))
        write_cage(self.cage, binding.transform(binding.transform(posed, self.to_world), self.world_to_cage))

    def execute(self, context):
        if fault := self.start(context):
            return self.refuse(fault)
        if self.vertex >= len(self.rest):
            return self.refuse(f"There is no vertex {self.vertex}; {self.obj.name} has {len(self.rest)}")
        at = binding.transform(self.moved[[self.vertex]], self.to_world)[0]
        try:
            self.pull(lambda to: self.puller.pull([self.vertex], to, start=self.posed), at + np.array(self.offset))
        except cw.Error as error:
            return self.refuse(str(error))
        return {"FINISHED"}

    def invoke(self, context, _event):
        if context.area is None or context.area.type != "VIEW_3D":
            return self.execute(context)
        if fault := self.start(context):
            return self.refuse(fault)
        self.tree = BVHTree.FromPolygons(
            binding.transform(self.moved, self.to_world).tolist(), self.triangles.tolist()
        )
        self.drag = None
        context.workspace.status_text_set("Cagework: drag a point of the mesh (Esc: cancel)")
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        region = next((r for r in context.area.regions if r.type == "WINDOW"), None)
        view = context.space_data.region_3d
        mouse = Vector((event.mouse_x - region.x, event.mouse_y - region.y))
        try:
            if event.type in {"ESC", "RIGHTMOUSE"}:
                write_cage(self.cage, self.before)
                return self.end(context, {"CANCELLED"})
            if event.type == "LEFTMOUSE" and event.value == "PRESS":
                origin = view3d_utils.region_2d_to_origin_3d(region, view, mouse)
                hit, _, face, _ = self.tree.ray_cast(origin, view3d_utils.region_2d_to_vector_3d(region, view, mouse))
                if hit is None:
                    return self.end(context, {"CANCELLED"})
                world = binding.transform(self.moved[self.triangles[face]], self.to_world)
                nearest = int(np.linalg.norm(world - np.array(hit), axis=1).argmin())
                self.vertex, self.at = int(self.triangles[face][nearest]), Vector(world[nearest])
                self.drag = self.puller.drag([self.vertex], start=self.posed)
            elif event.type == "MOUSEMOVE" and self.drag:
                target = view3d_utils.region_2d_to_location_3d(region, view, mouse, self.at)
                self.offset = target - self.at
                self.pull(self.drag.to, np.array(target))
            elif event.type == "LEFTMOUSE" and event.value == "RELEASE" and self.drag:
                return self.end(context, {"FINISHED"})
            elif not self.drag and event.type not in {"MOUSEMOVE", "INBETWEEN_MOUSEMOVE", "TIMER"}:
                return {"PASS_THROUGH"}
        except cw.Error as error:
            write_cage(self.cage, self.before)
            self.end(context, {"CANCELLED"})
            return self.refuse(str(error))
        return {"RUNNING_MODAL"}

    def end(self, context, result):
        context.workspace.status_text_set(None)
        return result


def copy_key(obj, name):
    """Adds a shape key with the current shape of the key that follows the cage."""
    active = obj.active_shape_key_index
    key = obj.shape_key_add(name=name, from_mix=False)
    key.value = 0.0  # Blender 5.0 adds keys with the value 1.
    flat = binding.coordinates(obj.data.shape_keys.key_blocks[binding.KEY].points).astype(np.float32)
    key.points.foreach_set("co", flat.ravel())
    key.vertex_group = obj.data.shape_keys.key_blocks[binding.KEY].vertex_group
    obj.active_shape_key_index = active
    return key


class SaveKey(BoundObjectOperator, bpy.types.Operator):
    bl_idname = "cagework.save_key"
    bl_label = "Save as Shape Key"
    bl_description = "Keep the current deformation as a shape key with the value 0"

    def execute(self, context):
        for obj in meshes(context):
            if obj.data.cagework.stamp and obj.data.shape_keys:
                copy_key(obj, "Cage Pose")
        return {"FINISHED"}


class Unbind(BoundObjectOperator, bpy.types.Operator):
    bl_idname = "cagework.unbind"
    bl_label = "Unbind"
    bl_description = "Remove the weights and the live shape key. Saved shape keys stay"

    def execute(self, context):
        for obj in meshes(context):
            keys = obj.data.shape_keys
            if keys and binding.KEY in keys.key_blocks:
                obj.shape_key_remove(keys.key_blocks[binding.KEY])
            if obj.data.shape_keys and len(obj.data.shape_keys.key_blocks) == 1:
                obj.shape_key_clear()
            binding.release(obj.data)
            obj.data.cagework.stamp, obj.data.cagework.weights, obj.data.cagework.report = "", b"", ""
        return {"FINISHED"}


CLASSES = [MakeCage, Bind, Reset, Pull, SaveKey, Unbind]
