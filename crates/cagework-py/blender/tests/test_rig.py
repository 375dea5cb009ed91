import bpy
import cagework as cw
import numpy as np
import pytest
from conftest import EXTENSION, ball, bind, local, move, select, world
from mathutils import Euler, Matrix, Vector

binding = EXTENSION.binding
# Tolerance of float32 positions near 10 that are transformed between three spaces.
TOLERANCE = 1e-4
PLACES = {
    "plain": (Matrix(), Matrix()),
    "turned, scaled unevenly": (
        Matrix.LocRotScale(Vector((1, -2, 0.5)), Euler((0.3, 1.0, -0.7)), Vector((1.2, 0.7, 1.5))),
        Matrix.LocRotScale(Vector((-1, 0.5, 1)), Euler((-0.4, 0.6, 1.1)), Vector((0.7, 1.3, 1.0))),
    ),
}
# Heads and tails in the space of the mesh, whose vertices are on a unit sphere. "Root" and "End" are outside every cage.
BONES = {
    "Root": (None, (0, 0, -30), (0, 0, -29)),
    "Lower": ("Root", (0, 0, -0.6), (0, 0.1, 0)),
    "Upper": ("Lower", (0, 0.1, 0), (0, 0, 0.6)),
    "End": ("Upper", (0, 0, 30), (0, 5, 30)),
}


def rigged(body, place=Matrix()):
    """Gives a mesh an armature: "Upper" deforms its vertices above the middle, "Lower" the others."""
    armature = bpy.data.objects.new("Armature", bpy.data.armatures.new("Armature"))
    bpy.context.scene.collection.objects.link(armature)
    armature.matrix_world = place
    select(armature)
    bpy.ops.object.mode_set(mode="EDIT")
    to = place.inverted() @ body.matrix_world
    for name, (parent, head, tail) in BONES.items():
        bone = armature.data.edit_bones.new(name)
        bone.head, bone.tail = to @ Vector(head), to @ Vector(tail)
        bone.parent = armature.data.edit_bones.get(parent) if parent else None
        bone.use_connect = name == "Upper"
    bpy.ops.object.mode_set(mode="OBJECT")
    for name, sign in [("Lower", -1), ("Upper", 1)]:
        group = body.vertex_groups.new(name=name)
        group.add([v.index for v in body.data.vertices if (v.co.z > 0) == (sign > 0)], 1.0, "REPLACE")
    body.modifiers.new("Armature", "ARMATURE").object = armature
    return armature


def ends(armature):
    """World positions of the heads and tails of the bones by name."""
    return {
        bone.name: binding.transform(np.array([bone.head_local, bone.tail_local]), armature.matrix_world)
        for bone in armature.data.bones
    }


def pose(cage, matrix):
    """Moves the vertices of a cage by a matrix in world space."""
    to_world = cage.matrix_world
    moved = binding.transform(local(cage.data), to_world.inverted() @ matrix @ to_world)
    move(cage, moved - local(cage.data))


AFFINE = Matrix.Translation((0.2, 0.1, -0.3)) @ Euler((0.2, 0.1, 0.3)).to_matrix().to_4x4() @ Matrix.Diagonal((1.2, 0.9, 1.7, 1))


@pytest.mark.parametrize(("of_mesh", "of_armature"), PLACES.values(), ids=PLACES.keys())
def test_bones_move_as_the_cage_moves_space_and_those_outside_with_their_parents(of_mesh, of_armature):
    """An affine motion of the cage moves all points inside by this motion."""
    body = ball("Body", of_mesh)
    armature, cage = rigged(body, of_armature), bind(body)
    before, points = ends(armature), world(body)
    pose(cage, AFFINE)
    select(body)
    assert bpy.ops.cagework.apply_to_armature() == {"FINISHED"}
    after = ends(armature)
    for name in ["Lower", "Upper"]:
        assert np.abs(after[name] - binding.transform(before[name], AFFINE)).max() < TOLERANCE, name
    assert np.abs(after["Root"] - before["Root"]).max() < TOLERANCE
    head = before["Upper"][:1]
    assert np.abs(after["End"] - before["End"] - binding.transform(head, AFFINE) + head).max() < TOLERANCE
    assert np.abs(world(body) - binding.transform(points, AFFINE)).max() < TOLERANCE, "the skin stays"
    assert bpy.context.active_object == body and armature.mode == "OBJECT" and armature.data.bones["Upper"].use_connect


def test_heads_of_bones_are_the_joints_that_the_package_writes_for_the_exported_model(body, gltf, tmp_path):
    armature, path = rigged(body), tmp_path / "a.glb"
    select(body, armature)
    bpy.ops.export_scene.gltf(filepath=str(path), use_selection=True)
    cage = bind(body)
    rest = local(cage.data)
    move(cage, np.stack([0.4 * np.maximum(rest[:, 2], 0) ** 2, 0.2 * rest[:, 2], 0.3 * rest[:, 0]], axis=1))
    posed = local(cage.data)
    select(body)
    bpy.ops.cagework.apply_to_armature()
    found = ends(armature)
    to_gltf = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]).T  # y up
    faces = [list(face.vertices) for face in cage.data.polygons]
    path.write_bytes(cw.reshape(path, cw.Cage(rest @ to_gltf, faces), posed @ to_gltf, grid=24))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.import_scene.gltf(filepath=str(path))
    expected = ends(next(o for o in bpy.data.objects if o.type == "ARMATURE"))
    assert np.abs(expected["Upper"][0] - [0, 0.1, 0]).max() > 0.01
    for name in BONES:
        assert np.abs(found[name][0] - expected[name][0]).max() < TOLERANCE, name


def test_posed_bone_turns_the_deformed_vertices_about_its_new_head(body):
    armature, cage = rigged(body), bind(body)
    pose(cage, Matrix.Diagonal((1, 1, 2, 1)))
    select(body)
    bpy.ops.cagework.apply_to_armature()
    deformed, upper = world(body), np.array([v.co.z > 0 for v in body.data.vertices])
    turn = Euler((0, 0, 0.8)).to_matrix()
    posed = armature.pose.bones["Upper"]
    posed.matrix = Matrix.Translation(posed.bone.head_local) @ turn.to_4x4() @ posed.bone.matrix_local.to_3x3().to_4x4()
    head = np.array([0, 0.1, 0])
    expected = np.where(upper[:, None], head + (deformed - head) @ np.array(turn).T, deformed)
    assert np.abs(expected - deformed).max() > 0.5
    assert np.abs(world(body) - expected).max() < TOLERANCE


def test_bones_are_fitted_to_each_pose_from_the_rest_shape_and_reset_with_the_cage(body):
    armature, cage = rigged(body), bind(body)
    before, axes = ends(armature), [np.array(bone.matrix_local) for bone in armature.data.bones]
    for matrix in [Matrix.Diagonal((1, 1, 2, 1)), AFFINE]:
        bpy.ops.cagework.reset()
        pose(cage, matrix)
        # The pose of the armature does not matter.
        armature.pose.bones["Upper"].location.x += 1
        select(body)
        bpy.ops.cagework.apply_to_armature()
        assert np.abs(ends(armature)["Upper"] - binding.transform(before["Upper"], matrix)).max() < TOLERANCE
    bpy.ops.cagework.reset()
    bpy.ops.cagework.apply_to_armature()
    assert max(np.abs(ends(armature)[name] - before[name]).max() for name in BONES) < TOLERANCE
    assert max(np.abs(np.array(b.matrix_local) - a).max() for b, a in zip(armature.data.bones, axes)) < TOLERANCE


def test_undo_restores_the_bones(body):
    armature, cage = rigged(body), bind(body)
    before = ends(armature)
    pose(cage, AFFINE)
    bpy.ops.ed.undo_push(message="pose")
    posed = world(body)
    select(body)
    bpy.ops.cagework.apply_to_armature()
    bpy.ops.ed.undo_push(message="apply")
    bpy.ops.ed.undo()
    body, armature = bpy.data.objects["Body"], bpy.data.objects["Armature"]
    assert all(np.array_equal(ends(armature)[name], before[name]) for name in BONES)
    assert np.abs(world(body) - posed).max() < TOLERANCE
    select(body)
    bpy.ops.cagework.apply_to_armature()
    assert np.abs(ends(armature)["Upper"] - binding.transform(before["Upper"], AFFINE)).max() < TOLERANCE


def test_cage_that_the_armature_deforms_counts_in_its_rest_position(body):
    armature, cage = rigged(body), bind(body)
    cage.vertex_groups.new(name="Lower").add(range(len(cage.data.vertices)), 1.0, "REPLACE")
    cage.modifiers.new("Armature", "ARMATURE").object = armature
    body.modifiers.clear()
    before = ends(armature)
    pose(cage, Matrix.Translation((0.1, 0.2, 0.3)))
    armature.pose.bones["Lower"].location.x = 1
    select(body)
    bpy.ops.cagework.apply_to_armature()
    assert np.abs(ends(armature)["Lower"] - before["Lower"] - [0.1, 0.2, 0.3]).max() < TOLERANCE
    assert armature.data.pose_position == "POSE"


def test_hidden_armature_is_refused(body):
    armature, _ = rigged(body), bind(body)
    armature.hide_set(True)
    select(body)
    with pytest.raises(RuntimeError, match="Armature is hidden"):
        bpy.ops.cagework.apply_to_armature()
