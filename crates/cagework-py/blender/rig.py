"""Fits the armature of a bound mesh to the shape that the cage gives the mesh.

The rule for joints is that of `cagework deform` (docs/rigs.md), for heads of bones; tails follow too.
"""

import hashlib
import json

import bpy
import cagework as cw
import numpy as np
from mathutils import Vector

from . import binding, operators

# A property of armatures: the bones before they were fitted, as JSON.
RIG = "cagework_bones"
# Distance by which a bone may differ from the fitted one to count as unchanged, relative to the largest coordinate: a few
# roundings of float32.
TOLERANCE = 1e-5


def armature_of(obj):
    """The armature that deforms a bound mesh or, otherwise, its cage; or None."""
    cage = obj.data.cagework.cage
    return obj.find_armature() or (cage.find_armature() if cage else None)


def bones_at_rest(data, rest):
    """Head, tail and z axis of each bone that belong to the cage at rest, [n_bones, 3, 3], armature space.

    After a fit to a pose of the same cage at rest, they are those before that fit, unless the bone was edited since.
    """
    stored = json.loads(getattr(data, RIG) or "{}")
    before = stored.get("bones", {}) if stored.get("cage") == digest(rest) else {}
    found = []
    for bone in data.bones:
        now = [list(bone.head_local), list(bone.tail_local), list(bone.matrix_local.col[2][:3])]
        old = before.get(bone.name)
        same = old and np.abs(np.subtract(old["fitted"], now[:2])).max() <= TOLERANCE * np.abs(now[:2]).max()
        found.append(old["rest"] if same else now)
    return np.array(found)


def digest(rest):
    return hashlib.sha256(rest.tobytes()).hexdigest()


def weighted(scene, armature):
    """Names of the bones that deform vertices of the meshes of an armature."""
    names = set()
    for obj in scene.objects:
        if obj.type == "MESH" and obj.find_armature() == armature:
            used = {part.group for vertex in obj.data.vertices for part in vertex.groups if part.weight > 0}
            names |= {group.name for group in obj.vertex_groups if group.index in used}
    return names


def moves(obj, armature, points, posed, depsgraph, scene):
    """Displacements of the heads and tails of bones in a pose of the cage, [n_bones, 2, 3], armature space.

    points: their positions for the cage at rest; posed: [n_cage, 3], bind space. A head outside the cage without
    vertices moves with the head of the parent. A tail outside moves with its head. Connected points move together.
    """
    bound, weights, n = obj.data.cagework, binding.loaded(obj.data), len(points)
    to_bind = binding.to_bind(obj.data) @ np.array(obj.matrix_world.inverted() @ armature.matrix_world)
    cage = cw.Cage(weights.rest, binding.cage_faces(bound.cage, depsgraph))
    flat = binding.transform(points.reshape(-1, 3), to_bind)
    rows, report = cw.bind(flat, cage, grid=bound.grid)
    by = cw.deform(rows, posed, report) - cw.deform(rows, weights.rest, report)
    by = (by @ np.linalg.inv(to_bind[:3, :3]).T).reshape(n, 2, 3)
    is_outside = np.isin(np.arange(2 * n), report["outside"]["vertex"]).reshape(n, 2)
    bones, holds = list(armature.data.bones), weighted(scene, armature)
    number = {bone.name: k for k, bone in enumerate(bones)}
    # The bones of an armature are listed with parents first.
    for k, bone in enumerate(bones):
        if is_outside[k, 0] and bone.name not in holds:
            by[k, 0] = by[number[bone.parent.name], 0] if bone.parent else 0
        if is_outside[k, 1]:
            by[k, 1] = by[k, 0]
    for k, bone in enumerate(bones):
        if bone.use_connect:
            by[number[bone.parent.name], 1] = by[k, 0]
    return by


def fit(armature, rest, by):
    """Moves the bones, and turns their z axes as little as their directions allow. Returns the heads and tails."""
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        edited = armature.data.edit_bones
        for bone, (head, tail, z), (by_head, by_tail) in zip(armature.data.bones, rest, by):
            each = edited[bone.name]
            each.head, each.tail = head + by_head, tail + by_tail
            turn = Vector(tail - head).rotation_difference(each.tail - each.head)
            each.align_roll(turn @ Vector(z))
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
    return [[list(bone.head_local), list(bone.tail_local)] for bone in armature.data.bones]


class ApplyToArmature(operators.BoundObjectOperator, bpy.types.Operator):
    bl_idname = "cagework.apply_to_armature"
    bl_label = "Apply to Armature"
    bl_description = (
        "Move the bones of the mesh's armature, in their rest position, to where the cage moves their places in the mesh. "
        "After Reset Cage, move them back"
    )

    @classmethod
    def poll(cls, context):
        return super().poll(context) and armature_of(operators.bound_mesh(context)) is not None

    def execute(self, context):
        obj, layer = operators.bound_mesh(context), context.view_layer
        armature, active = armature_of(obj), context.active_object
        if fault := binding.problem(obj, context.scene):
            return self.refuse(fault)
        data = armature.data
        if armature.library or data.library or data.override_library:
            return self.refuse(f"The armature {armature.name} is linked from another file: make it local")
        if not armature.visible_get():
            return self.refuse(f"The armature {armature.name} is hidden: show it to move its bones")
        if binding.singular(armature.matrix_world):
            return self.refuse(f"{armature.name} has a scale of zero: set another scale")
        position, data.pose_position = data.pose_position, "REST"
        try:
            layer.update()
            depsgraph = context.evaluated_depsgraph_get()
            posed, at_rest = binding.posed_cage(obj, depsgraph), binding.loaded(obj.data).rest
            rest = bones_at_rest(data, at_rest)
            by = moves(obj, armature, rest[:, :2], posed, depsgraph, context.scene)
            layer.objects.active = armature
            fitted = fit(armature, rest, by)
        except cw.Error as error:
            return self.refuse(f"The bones were not bound: {error}")
        finally:
            layer.objects.active, data.pose_position = active, position
        names = [bone.name for bone in data.bones]
        bones = {name: {"rest": each.tolist(), "fitted": new} for name, each, new in zip(names, rest, fitted)}
        setattr(data, RIG, json.dumps({"cage": digest(at_rest), "bones": bones}))
        return {"FINISHED"}


CLASSES = [ApplyToArmature]
