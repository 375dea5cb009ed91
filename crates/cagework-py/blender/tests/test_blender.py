import os
import subprocess
import sys
import zipfile
from pathlib import Path

import bmesh
import bpy
import cagework as cw
import numpy as np
import pytest
from conftest import EXTENSION, Modal, attach, ball, bind, delete, local, move, select, world
from mathutils import Euler, Matrix, Vector

binding = EXTENSION.binding
# Tolerance of float32 positions near 3 that are transformed between two spaces.
TOLERANCE = 1e-5
KEY = binding.KEY


def bend(points):
    """Offsets that grow with the square of z above the middle."""
    return np.stack([0.4 * np.maximum(points[:, 2], 0) ** 2, *np.zeros((2, len(points)))], axis=1)


def expected(points, faces, rest, posed, grid=24):
    """Points deformed by the package without the extension, relative to its reconstruction at rest."""
    weights, report = cw.bind(points, cw.Cage(rest, faces), grid=grid)
    return points + cw.deform(weights, posed, report) - cw.deform(weights, rest, report)


def faces_of(mesh):
    return [list(p.vertices) for p in mesh.polygons]


def test_made_cage_encloses_the_mesh_and_is_drawn_as_wire(body):
    select(body)
    bpy.ops.cagework.make_cage(vertices=60)
    cage = body.data.cagework.cage
    assert cage.display_type == "WIRE" and cage.parent == body and 8 <= len(cage.data.vertices) <= 60
    found = cw.check_cage(cw.Cage(local(cage.data), faces_of(cage.data)), local(body.data))
    assert not [problem for problem in found if problem["severity"] == "error"]


def cages():
    return [o for o in bpy.data.objects if o.display_type == "WIRE"]


@pytest.mark.parametrize("active", ["mesh", "cage"])
def test_second_made_cage_replaces_the_first_one(body, active):
    cage = bind(body, vertices=40)
    move(cage, bend(local(cage.data)))
    posed, n_meshes = world(body), len(bpy.data.meshes)
    bpy.ops.ed.undo_push(message="pose")
    select(body if active == "mesh" else cage)
    bpy.ops.cagework.make_cage(vertices=60)
    cage = body.data.cagework.cage
    assert cages() == [cage] and cage.name == "Body Cage" and len(cage.data.vertices) > 40
    assert len(bpy.data.meshes) == n_meshes and bpy.context.active_object == body and body.data.cagework.vertices == 60
    assert np.array_equal(world(body), posed) and "not bound to Body Cage yet" in binding.problem(body, bpy.context.scene)
    bpy.ops.cagework.bind()
    before = world(body)
    cage.location.x += 1
    assert np.abs(world(body) - before - [1, 0, 0]).max() < TOLERANCE
    bpy.ops.ed.undo_push(message="bind")
    bpy.ops.ed.undo()
    body = bpy.data.objects["Body"]
    assert len(body.data.cagework.cage.data.vertices) <= 40 and np.abs(world(body) - posed).max() < TOLERANCE
    body.data.cagework.cage.location.x += 1
    assert np.abs(world(body) - posed - [1, 0, 0]).max() < TOLERANCE


def test_made_cage_replaces_no_cage_of_another_mesh_or_of_the_user(body):
    shirt = ball("Shirt", segments=12)
    shared = bind(body, shirt)
    select(body)
    bpy.ops.cagework.make_cage(vertices=40)
    own = body.data.cagework.cage
    assert set(cages()) == {shared, own} and shirt.data.cagework.cage == shared
    bpy.ops.mesh.primitive_cube_add(size=3)
    cube = bpy.context.active_object
    body.data.cagework.cage = cube
    select(body, shirt)
    bpy.ops.cagework.make_cage(vertices=40)
    both = body.data.cagework.cage
    assert set(cages()) == {own, both} and shirt.data.cagework.cage == both and cube.name in bpy.data.objects


PLACES = {
    "plain": Matrix(),
    "turned, scaled unevenly, far": Matrix.LocRotScale(Vector((5, -3, 2)), Euler((0.3, 1.0, -0.7)), Vector((2.0, 0.5, 1.5))),
    "mirrored": Matrix.Diagonal((-1, 1, 1, 1)),
}


@pytest.mark.parametrize("matrix", PLACES.values(), ids=PLACES.keys())
def test_posed_vertices_move_the_mesh_as_the_package_does(matrix):
    body = ball("Body", matrix)
    cage = bind(body)
    points, rest = world(body), binding.transform(local(cage.data), cage.matrix_world)
    move(cage, bend(local(cage.data)))
    posed = binding.transform(local(cage.data), cage.matrix_world)
    faces = [face[::-1] if matrix.determinant() < 0 else face for face in faces_of(cage.data)]
    assert np.abs(world(body) - points).max() > 0.1
    assert np.abs(world(body) - expected(points, faces, rest, posed)).max() < TOLERANCE * 10


def test_moving_the_cage_object_moves_the_mesh_and_moving_the_mesh_moves_both(body):
    cage = bind(body)
    before = world(body)
    cage.location = (0.5, 0.0, 1.0)
    assert np.abs(world(body) - before - [0.5, 0.0, 1.0]).max() < TOLERANCE
    body.matrix_world = PLACES["turned, scaled unevenly, far"]
    both = binding.transform(before + [0.5, 0.0, 1.0], body.matrix_world)
    assert np.abs(world(body) - both).max() < 10 * TOLERANCE


PARENT = PLACES["turned, scaled unevenly, far"]
CHILD = Matrix.LocRotScale(Vector((0.3, -0.2, 0.1)), Euler((-0.4, 0.6, 1.1)), Vector((0.7, 1.3, 1.0)))
OTHER = Matrix.LocRotScale(Vector((-1, 4, -2)), Euler((1.2, 0.1, 0.5)), Vector((0.4, 1.1, 3.0)))


@pytest.mark.parametrize("apart", [False, True], ids=["cage below the mesh", "cage below another empty"])
def test_mesh_below_an_unevenly_scaled_empty_is_its_weights_times_the_cage_in_world_space(body, apart):
    parents = [attach(body, PARENT)]
    body.matrix_basis = CHILD
    select(body)
    bpy.ops.cagework.make_cage(vertices=40)
    cage = body.data.cagework.cage
    if apart:
        cage.parent, in_world = None, binding.transform(local(cage.data), PARENT @ CHILD)
        parents.append(attach(cage, OTHER))
        cage.matrix_basis = CHILD
        move(cage, binding.transform(in_world, (OTHER @ CHILD).inverted()) - local(cage.data))
    body.data.cagework.grid = 24
    bpy.ops.cagework.bind()

    def posed():
        """The cage in world space, from the matrices that were set."""
        return binding.transform(local(cage.data), parents[-1].matrix_basis @ CHILD)

    points, rest = binding.transform(local(body.data), PARENT @ CHILD), posed()
    weights, report = cw.bind(points, cw.Cage(rest, faces_of(cage.data)), grid=24)
    assert report["outside_vertices"] == 0
    at_rest = local(cage.data)
    move(cage, bend(at_rest))
    assert np.abs(world(body) - points).max() > 0.1
    for parent, matrix in [(parents[-1], parents[-1].matrix_basis), (parents[0], OTHER), (parents[-1], PARENT)]:
        parent.matrix_basis = matrix
        assert np.abs(world(body) - weights @ posed()).max() < TOLERANCE * 10, parent.name
    top, before = 5, world(body)
    bpy.ops.cagework.pull(vertex=top, offset=(0.1, 0.2, 0.3))
    assert np.abs((world(body) - before)[top] - [0.1, 0.2, 0.3]).max() < 0.02
    assert np.abs(world(body) - weights @ posed()).max() < TOLERANCE * 10
    bpy.ops.cagework.reset()
    assert np.array_equal(local(cage.data), at_rest)


def apply(**parts):
    bpy.ops.object.transform_apply(**{"location": False, "rotation": False, "scale": False, **parts})


def set_origin():
    bpy.context.scene.cursor.location = (300, -200, 100)
    bpy.ops.object.origin_set(type="ORIGIN_CURSOR")


APPLIED = {
    "scale": lambda: apply(scale=True),
    "location": lambda: apply(location=True),
    "all": lambda: apply(location=True, rotation=True, scale=True),
    "origin": set_origin,
}


@pytest.mark.parametrize("operation", APPLIED.values(), ids=APPLIED.keys())
def test_applied_transforms_and_origins_keep_the_shape(operation):
    body = ball("Body", PLACES["turned, scaled unevenly, far"])
    cage = bind(body)
    move(cage, bend(local(cage.data)))
    bpy.ops.ed.undo_push(message="pose")
    before = world(body)
    # Local coordinates near 400 are rounded to 3e-5.
    tolerance = 1e-4
    select(body)
    operation()
    assert np.abs(world(body) - before).max() < tolerance
    cage.matrix_world = Matrix.Translation((1, 0, 0)) @ cage.matrix_world
    assert np.abs(world(body) - before - [1, 0, 0]).max() < tolerance
    select(body)
    bpy.ops.cagework.bind(keep_rest=True)
    assert np.abs(world(body) - before - [1, 0, 0]).max() < tolerance
    bpy.ops.ed.undo_push(message="apply")
    bpy.ops.ed.undo()
    body = bpy.data.objects["Body"]
    assert np.abs(world(body) - before).max() < tolerance
    body.data.cagework.cage.matrix_world = Matrix.Translation((1, 0, 0)) @ body.data.cagework.cage.matrix_world
    assert np.abs(world(body) - before - [1, 0, 0]).max() < tolerance


def test_mesh_moved_in_edit_mode_moves(body):
    bind(body)
    before = world(body)
    select(body)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.transform.translate(value=(1, 0, 0))
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.abs(world(body) - before - [1, 0, 0]).max() < TOLERANCE


def test_mesh_follows_a_cage_in_edit_mode(body):
    cage = bind(body)
    points, rest = world(body), local(cage.data)
    select(cage)
    bpy.ops.object.mode_set(mode="EDIT")
    edited = bmesh.from_edit_mesh(cage.data)
    for vertex, offset in zip(edited.verts, bend(rest)):
        vertex.co += Vector(offset)
    bmesh.update_edit_mesh(cage.data)
    moved = world(body)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.abs(moved - expected(points, faces_of(cage.data), rest, rest + bend(rest))).max() < TOLERANCE


def test_mesh_follows_shape_keys_and_modifiers_of_the_cage(body):
    cage = bind(body)
    before = world(body)
    cage.shape_key_add(name="Basis")
    wide = cage.shape_key_add(name="Wide")
    wide.points.foreach_set("co", (local(cage.data) * [2, 1, 1]).astype(np.float32).ravel())
    wide.value = 0.5
    cage.data.update_tag()
    assert np.abs(world(body) - before * [1.5, 1, 1]).max() < TOLERANCE
    bpy.ops.object.armature_add()
    armature = bpy.context.active_object
    group = cage.vertex_groups.new(name=armature.data.bones[0].name)
    group.add(range(len(cage.data.vertices)), 1.0, "REPLACE")
    cage.modifiers.new("Armature", "ARMATURE").object = armature
    armature.pose.bones[0].location = (0, 0, 0.7)
    bone = armature.data.bones[0].matrix_local.to_3x3() @ Vector((0, 0, 0.7))
    assert np.abs(world(body) - before * [1.5, 1, 1] - np.array(bone)).max() < TOLERANCE


def widen(cage):
    """Adds a shape key to a cage that moves it by 1 along x."""
    cage.shape_key_add(name="Basis")
    key = cage.shape_key_add(name="Moved")
    key.points.foreach_set("co", (local(cage.data) + [1, 0, 0]).astype(np.float32).ravel())
    key.value = 0
    return key


@pytest.mark.parametrize("how", ["object", "viewport", "collection"])
def test_mesh_follows_a_hidden_cage(body, how):
    cage, scene = bind(body), bpy.context.scene
    before, key = world(body), widen(cage)
    if how == "object":
        cage.hide_set(True)
    elif how == "viewport":
        cage.hide_viewport = True
    else:
        collection = bpy.data.collections.new("Hidden")
        scene.collection.children.link(collection)
        collection.objects.link(cage)
        scene.collection.objects.unlink(cage)
        bpy.context.view_layer.layer_collection.children["Hidden"].exclude = True
    cage.location.y = 2
    key.value = 0.5
    assert np.abs(world(body) - before - [0.5, 2, 0]).max() < TOLERANCE
    assert binding.problem(body, scene) is None


@pytest.mark.parametrize("keyed", ["location", "shape key"])
def test_renders_show_the_pose_of_a_cage_that_is_hidden_in_renders(body, keyed, tmp_path):
    cage, scene = bind(body), bpy.context.scene
    assert cage.hide_render
    target, path = (cage, "location") if keyed == "location" else (widen(cage), "value")
    target.keyframe_insert(path, frame=1)
    setattr(target, path, (1, 0, 0) if keyed == "location" else 1)
    target.keyframe_insert(path, frame=3)
    for curve in EXTENSION.animation.curves(target.id_data):
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    material = bpy.data.materials.new("Glow")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    surface = nodes.new("ShaderNodeOutputMaterial").inputs["Surface"]
    material.node_tree.links.new(nodes.new("ShaderNodeEmission").outputs[0], surface)
    body.data.materials.append(material)
    # Along z, 4 pixels per unit.
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    scene.camera.location.z, scene.camera.data.type, scene.camera.data.ortho_scale = 5, "ORTHO", 8
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.render.threads_mode, scene.render.threads, scene.render.use_lock_interface = "FIXED", 1, True
    scene.frame_start, scene.frame_end, scene.render.filepath = 1, 3, str(tmp_path / "frame")
    scene.frame_set(2)
    bpy.ops.render.render(animation=True)
    for frame, x in [(1, 0.0), (2, 0.5), (3, 1.0)]:
        image = bpy.data.images.load(str(tmp_path / f"frame{frame:04}.png"))
        lit = np.array(image.pixels).reshape(32, 32, 4)[..., 0] > 0.5
        assert abs(np.nonzero(lit)[1].mean() - (15.5 + 4 * x)) < 0.25, "the disc is centred on the body"


def test_modifiers_of_the_mesh_act_on_the_posed_shape(body):
    cage = bind(body)
    body.modifiers.new("Subdivision", "SUBSURF").levels = 1
    before = world(body)
    cage.location.x += 1
    moved = world(body)
    assert len(moved) > len(body.data.vertices) and np.abs(moved - before - [1, 0, 0]).max() < TOLERANCE


def test_saved_file_opens_bound(body, tmp_path):
    cage = bind(body)
    move(cage, bend(local(cage.data)))
    before = world(body)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    binding.WEIGHTS_CACHE.clear()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    body = bpy.data.objects["Body"]
    assert np.array_equal(world(body), before) and binding.problem(body, bpy.context.scene) is None
    body.data.cagework.cage.location.x += 1
    assert np.abs(world(body) - before - [1, 0, 0]).max() < TOLERANCE


def test_undo_restores_the_pose_and_the_bind(body):
    select(body)
    bpy.ops.ed.undo_push(message="start")
    before = world(body)
    cage = bind(body)
    bpy.ops.ed.undo_push(message="bind")
    cage.location.x += 1
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="move")
    bpy.ops.ed.undo()
    body = bpy.data.objects["Body"]
    assert np.abs(world(body) - before).max() < TOLERANCE and body.data.cagework.stamp
    body.data.cagework.cage.location.x += 2
    assert np.abs(world(body) - before - [2, 0, 0]).max() < TOLERANCE
    bpy.ops.ed.undo()
    assert not bpy.data.objects["Body"].data.cagework.stamp


def test_undo_brings_a_deleted_cage_back_and_redo_its_pose(body):
    cage = bind(body)
    before = world(body)
    bpy.ops.ed.undo_push(message="bind")
    cage.location.x += 1
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="move")
    delete(cage)
    bpy.ops.ed.undo_push(message="delete")
    bpy.ops.ed.undo()
    bpy.ops.ed.undo()
    assert np.abs(world(bpy.data.objects["Body"]) - before).max() < TOLERANCE
    bpy.ops.ed.redo()
    body = bpy.data.objects["Body"]
    assert np.abs(world(body) - before - [1, 0, 0]).max() < TOLERANCE
    body.data.cagework.cage.location.x += 1
    assert np.abs(world(body) - before - [2, 0, 0]).max() < TOLERANCE


def test_edited_mesh_is_bound_again_and_keeps_the_pose(body):
    cage = bind(body)
    rest = local(cage.data)
    move(cage, bend(rest))
    select(body)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    bpy.ops.object.mode_set(mode="OBJECT")
    moved = world(body)
    points = binding.basis(body.data)
    assert len(points) == len(moved) and len(binding.loaded(body.data).rows) == len(points)
    assert np.abs(moved - expected(points, faces_of(cage.data), rest, rest + bend(rest))).max() < TOLERANCE


def test_rebind_keeps_the_pose_and_bind_makes_it_the_rest_shape(body):
    cage = bind(body)
    before = world(body)
    move(cage, bend(local(cage.data)))
    posed = world(body)
    select(body)
    bpy.ops.cagework.bind(keep_rest=True)
    assert np.abs(world(body) - posed).max() < TOLERANCE
    bpy.ops.cagework.bind()
    assert np.abs(world(body) - before).max() < TOLERANCE


def test_reset_gives_the_cage_its_rest_shape(body):
    cage = bind(body)
    rest, before = local(cage.data), world(body)
    move(cage, bend(rest))
    bpy.ops.cagework.reset()
    assert np.array_equal(local(cage.data), rest) and np.abs(world(body) - before).max() < TOLERANCE


def test_reset_gives_a_cage_with_mixed_shape_keys_its_rest_shape(body):
    select(body)
    bpy.ops.cagework.make_cage(vertices=40)
    cage = body.data.cagework.cage
    cage.shape_key_add(name="Basis")
    rest, keys = local(cage.data), []
    for factors in [[1.5, 1, 1], [1, 1, 2]]:
        key = cage.shape_key_add(name="Key", from_mix=False)
        key.points.foreach_set("co", (rest * factors).astype(np.float32).ravel())
        keys.append(key)
    group = cage.vertex_groups.new(name="Mask")
    group.add(range(len(rest)), 0.5, "REPLACE")
    keys[1].vertex_group, keys[0].value, keys[1].value = "Mask", 1, 0.4
    cage.active_shape_key_index = 1
    bpy.context.view_layer.update()
    bpy.ops.cagework.bind()
    before = world(body)
    with pytest.raises(RuntimeError, match="mixes shape keys"):
        bpy.ops.cagework.reset()
    keys[1].value = 0
    assert np.abs(world(body) - before).max() > 0.1
    bpy.ops.cagework.reset()
    # The rest shape: 1.5 x, y and z + 0.4 * 0.5 * z.
    assert np.abs(binding.coordinates(keys[0].points) - rest * [1.5, 1, 1.2]).max() < TOLERANCE
    assert np.abs(world(body) - before).max() < TOLERANCE


def test_faults_are_sentences(body, tmp_path):
    scene, cage = bpy.context.scene, bind(body)
    cage.hide_set(True)
    with pytest.raises(RuntimeError, match="is hidden"):
        bpy.ops.cagework.bind()
    cage.hide_set(False)
    before = world(body)
    delete(cage)
    assert "was deleted" in binding.problem(body, scene) and np.array_equal(world(body), before)
    select(body)
    with pytest.raises(RuntimeError, match="was deleted"):
        bpy.ops.cagework.reset()
    body.scale.x = 0
    bpy.context.view_layer.update()
    assert "a scale of zero" in binding.problem(body, scene)
    with pytest.raises(RuntimeError, match="a scale of zero"):
        bpy.ops.cagework.make_cage()
    body.scale.x = 1
    bpy.context.view_layer.update()
    open_mesh = bpy.data.meshes.new("Open")
    open_mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    body.data.cagework.cage = bpy.data.objects.new("Open", open_mesh)
    scene.collection.objects.link(body.data.cagework.cage)
    with pytest.raises(RuntimeError, match="not closed"):
        bpy.ops.cagework.bind()


def test_another_cage_is_used_only_after_a_bind(body):
    scene, first = bpy.context.scene, bind(body, vertices=40)
    before = world(body)
    second = first.copy()
    second.data = first.data.copy()
    scene.collection.objects.link(second)
    body.data.cagework.cage = second
    select(body)
    assert np.abs(world(body) - before).max() < TOLERANCE
    assert first.name in binding.problem(body, scene)
    with pytest.raises(RuntimeError, match="not bound to"):
        bpy.ops.cagework.reset()
    body.data.cagework.cage = first
    assert binding.problem(body, scene) is None
    body.data.cagework.cage = second
    bpy.ops.cagework.bind(keep_rest=True)
    assert binding.problem(body, scene) is None and np.abs(world(body) - before).max() < TOLERANCE
    second.location.x += 1
    assert np.abs(world(body) - before - [1, 0, 0]).max() < TOLERANCE


def test_modifier_that_changes_the_number_of_cage_vertices_is_a_fault(body):
    scene, cage = bpy.context.scene, bind(body)
    before = world(body)
    cage.modifiers.new("Subdivision", "SUBSURF")
    assert np.array_equal(world(body), before) and f"vertices and had {len(cage.data.vertices)} when bound" in binding.problem(body, scene)
    cage.modifiers.clear()
    cage.location.x += 1
    assert np.abs(world(body) - before - [1, 0, 0]).max() < TOLERANCE and binding.problem(body, scene) is None


def test_failed_new_bind_says_why_and_keeps_the_weights(body, monkeypatch):
    """The bind of an edited mesh fails once, and is not tried again for each update."""
    scene, cage, tries = bpy.context.scene, bind(body), []
    before = world(body)
    bpy.ops.ed.undo_push(message="bind")

    def fail(*_, **__):
        tries.append(1)
        raise cw.Error("out of memory")

    monkeypatch.setattr(cw, "bind", fail)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide()
    bpy.ops.object.mode_set(mode="OBJECT")
    for _ in range(3):
        cage.location.x += 1
        bpy.context.view_layer.update()
    assert len(tries) == 1 and "was not bound again: out of memory" in binding.problem(body, scene)
    assert body.data.cagework.stamp
    monkeypatch.undo()
    bpy.ops.cagework.bind(keep_rest=True)
    assert binding.problem(body, scene) is None
    assert np.abs(world(body)[: len(before)] - before - [3, 0, 0]).max() < TOLERANCE


def test_pull_refuses_a_cage_with_a_scale_of_zero(body):
    cage = bind(body)
    cage.scale.x = 0
    bpy.context.view_layer.update()
    select(body)
    with pytest.raises(RuntimeError, match=f"{cage.name} has a scale of zero"):
        bpy.ops.cagework.pull(vertex=3, offset=(0.1, 0, 0))


def test_without_an_active_object_no_mesh_is_chosen(body):
    bind(body)
    body.data.cagework.cage = None
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = None
    assert EXTENSION.operators.meshes(bpy.context) == []


def test_largest_clearance_makes_a_cage(body):
    select(body)
    largest = bpy.ops.cagework.make_cage.get_rna_type().properties["clearance"].hard_max
    assert bpy.ops.cagework.make_cage(vertices=40, clearance=largest) == {"FINISHED"}


def test_linked_mesh_is_refused_and_its_override_does_not_fail(body, tmp_path):
    bind(body)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, into):
        into.objects = ["Body", "Body Cage"]
    for obj in into.objects:
        bpy.context.scene.collection.objects.link(obj)
    linked = bpy.data.objects["Body"].override_create(remap_local_usages=True)
    assert "make it local" in binding.problem(linked, bpy.context.scene)
    select(linked)
    with pytest.raises(RuntimeError, match="make it local"):
        bpy.ops.cagework.make_cage()
    before = world(linked)
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.make_local(type="SELECT_OBDATA")
    own = bpy.context.active_object
    assert binding.problem(own, bpy.context.scene) is None
    own.data.cagework.cage.location.x += 1
    assert np.abs(world(own) - before - [1, 0, 0]).max() < TOLERANCE


def test_linked_duplicates_take_the_same_shape_and_are_bound_once(body):
    cage = bind(body)
    twin = body.copy()
    twin.location = (4, 0, 0)
    bpy.context.scene.collection.objects.link(twin)
    before = world(body)
    cage.location.x += 1
    assert np.abs(world(body) - before - [1, 0, 0]).max() < TOLERANCE
    assert np.abs(world(twin) - before - [5, 0, 0]).max() < TOLERANCE
    select(body, twin)
    with pytest.raises(RuntimeError, match="share their mesh"):
        bpy.ops.cagework.bind()


def test_duplicate_with_its_own_mesh_follows_from_the_same_place(body):
    cage = bind(body)
    before = world(body)
    select(body)
    bpy.ops.object.duplicate()
    twin = bpy.context.active_object
    assert twin.data != body.data
    for x in [0.5, 1.0]:
        cage.location.x = x
        assert np.abs(world(body) - before - [x, 0, 0]).max() < TOLERANCE
        assert np.abs(world(twin) - before - [x, 0, 0]).max() < TOLERANCE


def test_several_meshes_follow_one_cage():
    body = ball("Body")
    shirt = ball("Shirt", Matrix.Translation((0.2, 0, 0)) @ Matrix.Scale(0.9, 4), segments=12)
    cage = bind(body, shirt)
    assert shirt.data.cagework.cage == cage
    points, rest = [world(body), world(shirt)], binding.transform(local(cage.data), cage.matrix_world)
    move(cage, bend(local(cage.data)))
    posed = binding.transform(local(cage.data), cage.matrix_world)
    for obj, before in zip([body, shirt], points):
        assert np.abs(world(obj) - expected(before, faces_of(cage.data), rest, posed)).max() < TOLERANCE
    select(body, shirt)
    assert bpy.ops.cagework.bind(keep_rest=True) == {"FINISHED"}
    assert np.abs(world(shirt) - expected(points[1], faces_of(cage.data), rest, posed)).max() < TOLERANCE


def test_points_outside_the_cage_follow_as_in_the_package(body):
    bpy.ops.mesh.primitive_cube_add(size=1.8)
    cage = bpy.context.active_object
    body.data.cagework.cage, body.data.cagework.grid = cage, 24
    select(body)
    bpy.ops.cagework.bind()
    points, rest = world(body), local(cage.data)
    assert "outside the cage" in body.data.cagework.report
    move(cage, bend(rest))
    assert np.abs(world(body) - expected(points, faces_of(cage.data), rest, rest + bend(rest))).max() < TOLERANCE


def test_pulled_vertex_reaches_its_target():
    body = ball("Body", PLACES["turned, scaled unevenly, far"])
    bind(body, grid=32)
    before = world(body)
    top = int(before[:, 2].argmax())
    for offset in [(0.2, 0.0, 0.3), (0.0, 0.1, 0.0)]:
        assert bpy.ops.cagework.pull(vertex=top, offset=offset) == {"FINISHED"}
    assert np.abs((world(body) - before)[top] - [0.2, 0.1, 0.3]).max() < 0.02


def test_pull_is_prepared_once_per_bind_and_shape_of_the_mesh(body, monkeypatch):
    bind(body)
    prepared, Puller = [], cw.Puller
    monkeypatch.setattr(cw, "Puller", lambda *given, **options: prepared.append(given[0]) or Puller(*given, **options))

    def pull(offset):
        assert bpy.ops.cagework.pull(vertex=3, offset=offset) == {"FINISHED"}
        return len(prepared)

    assert [pull((0.1, 0, 0)), pull((0, 0.1, 0))] == [1, 1]
    body.data.shape_keys.reference_key.points.foreach_set("co", (1.1 * binding.basis(body.data)).astype(np.float32).ravel())
    assert pull((0.1, 0, 0)) == 2 and np.array_equal(prepared[1], binding.basis(body.data))
    bpy.ops.cagework.bind()
    assert pull((0.1, 0, 0)) == 3


def test_bind_in_a_window_reports_progress_and_stores_the_weights_at_the_end(body):
    cage = bind(body)
    points, rest = world(body), local(cage.data)
    bpy.ops.cagework.unbind()
    modal = Modal(EXTENSION.operators.Bind)
    assert modal.invoke() == {"RUNNING_MODAL"} and modal.timers and not body.data.cagework.stamp
    assert modal.send("MOUSEMOVE") == {"RUNNING_MODAL"} and "Esc" in modal.status
    modal.operator.thread.join()
    assert modal.send("TIMER") == {"FINISHED"} and not modal.timers and modal.status is None
    assert [kind for kind, _ in modal.reports] == [{"INFO"}]
    move(cage, bend(rest))
    assert np.abs(world(body) - expected(points, faces_of(cage.data), rest, rest + bend(rest))).max() < TOLERANCE


def test_escape_stops_a_bind_and_keeps_the_previous_one(body):
    cage = bind(body)
    move(cage, bend(local(cage.data)))
    posed, stamp = world(body), body.data.cagework.stamp
    body.data.cagework.grid = 160
    modal = Modal(EXTENSION.operators.Bind)
    modal.invoke()
    assert modal.send("ESC", "PRESS") == {"RUNNING_MODAL"}
    modal.operator.thread.join()
    assert modal.operator.jobs[0].results is None, "the thread stopped before the end"
    assert modal.send("TIMER") == {"CANCELLED"} and not modal.timers and modal.status is None
    assert modal.reports == [({"ERROR"}, "The bind was cancelled")]
    assert body.data.cagework.stamp == stamp and np.array_equal(world(body), posed)
    cage.location.x += 1
    assert np.abs(world(body) - posed - [1, 0, 0]).max() < TOLERANCE


@pytest.mark.parametrize("keys", [False, True], ids=["vertices", "shape keys"])
@pytest.mark.parametrize("perspective", [True, False], ids=["perspective", "orthographic"])
def test_dragged_vertex_follows_the_mouse_until_it_is_released_or_escape_restores_the_cage(body, perspective, keys):
    cage = bind(body, grid=32)
    if keys:
        cage.shape_key_add(name="Basis")
        cage.shape_key_add(name="Pose").value = 1
        cage.active_shape_key_index = 1
    points = EXTENSION.operators.posed_points(cage)
    rest, before = binding.coordinates(points), world(body)

    def drag():
        select(body)
        modal = Modal(EXTENSION.operators.Pull, perspective)
        assert modal.invoke() == {"RUNNING_MODAL"} and "Esc" in modal.status
        front = np.argmin([(modal.view.view_matrix @ Vector(point)).length for point in before])
        assert modal.send("MIDDLEMOUSE", "PRESS") == {"PASS_THROUGH"}
        start = np.array(modal.pixel(before[front]))
        modal.send("LEFTMOUSE", "PRESS", start)
        assert modal.operator.vertex == front
        for step in [(10, 5), (40, 25)]:
            assert modal.send("MOUSEMOVE", at=start + step) == {"RUNNING_MODAL"}
            assert np.abs(modal.pixel(world(body)[front]) - start - step).max() < 2
            assert np.abs(world(body)[front] - before[front] - modal.operator.offset).max() < 0.02
        return modal

    modal = drag()
    assert modal.send("ESC", "PRESS") == {"CANCELLED"} and modal.status is None
    assert np.array_equal(binding.coordinates(points), rest) and np.abs(world(body) - before).max() < TOLERANCE
    modal = drag()
    assert modal.send("LEFTMOUSE", "RELEASE") == {"FINISHED"} and modal.status is None
    assert np.abs(binding.coordinates(points) - rest).max() > 0.01
    pulled = binding.coordinates(points)
    modal = Modal(EXTENSION.operators.Pull)
    modal.invoke()
    assert modal.send("LEFTMOUSE", "PRESS", (1, 1)) == {"CANCELLED"}, "no point of the mesh is in the corner"
    assert np.array_equal(binding.coordinates(points), pulled)


def test_pull_refuses_a_cage_that_mixes_shape_keys_and_restores_it_after_a_fault(body):
    cage = bind(body)
    cage.shape_key_add(name="Basis")
    wide = cage.shape_key_add(name="Wide")
    wide.points.foreach_set("co", (local(cage.data) * [2, 1, 1]).astype(np.float32).ravel())
    wide.value, cage.active_shape_key_index = 0.5, 1
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match="mixes shape keys"):
        bpy.ops.cagework.pull(vertex=0, offset=(0.1, 0, 0))
    wide.value = 1
    bpy.context.view_layer.update()
    before = binding.coordinates(wide.points)
    select(body)
    modal = Modal(EXTENSION.operators.Pull)
    modal.invoke()
    modal.send("LEFTMOUSE", "PRESS", (modal.region.width / 2, modal.region.height / 2))
    modal.send("MOUSEMOVE", at=(modal.region.width / 2 + 30, modal.region.height / 2))
    assert not np.array_equal(binding.coordinates(wide.points), before)
    modal.operator.to_world = modal.operator.to_world * np.nan
    assert modal.send("MOUSEMOVE", at=(0, 0)) == {"CANCELLED"} and modal.reports[0][0] == {"ERROR"}
    assert np.array_equal(binding.coordinates(wide.points), before)


def test_saved_key_has_the_pose_and_stays_after_unbinding(body):
    cage = bind(body)
    before = world(body)
    move(cage, bend(local(cage.data)))
    posed = world(body)
    bpy.ops.cagework.save_key()
    bpy.ops.cagework.unbind()
    assert np.abs(world(body) - before).max() < TOLERANCE
    body.data.shape_keys.key_blocks["Cage Pose"].value = 1
    assert np.abs(world(body) - posed).max() < TOLERANCE and KEY not in body.data.shape_keys.key_blocks
    body.data.shape_keys.key_blocks["Cage Pose"].value = 0
    bpy.ops.cagework.bind()
    assert binding.problem(body, bpy.context.scene) is None


@pytest.mark.parametrize("form", ["KEYS", "MDD", "PC2"])
def test_baked_frames_play_without_the_cage(body, form, tmp_path):
    cage = bind(body)
    for frame, x in [(1, 0.0), (5, 1.0), (9, -0.5)]:
        cage.location.x = x
        cage.keyframe_insert("location", index=0, frame=frame)
    scene, live = bpy.context.scene, []
    for frame in range(1, 10):
        scene.frame_set(frame)
        live.append(world(body))
    assert np.ptp([points[0, 0] for points in live]) > 1
    bpy.ops.cagework.bake(form=form, first=1, last=9, step=2, filepath=str(tmp_path / "baked"))
    delete(cage)
    for frame in range(1, 10, 2):
        scene.frame_set(frame)
        assert np.abs(world(body) - live[frame - 1]).max() < TOLERANCE, frame


def masked_and_mixed(*objects, last=3):
    """Binds objects, keys a move of their cage by 1 along x, and sets value, mask and a further key.

    Returns for each object a function that gives its expected points for a move of the cage.
    """
    cage, formulas = bind(*objects), []
    for frame, x in [(1, 0.0), (last, 1.0)]:
        cage.location.x = x
        cage.keyframe_insert("location", index=0, frame=frame)
    for obj in objects:
        before, live = world(obj) - [cage.location.x, 0, 0], obj.data.shape_keys.key_blocks[KEY]
        weights = np.linspace(0, 1, len(before))
        group = obj.vertex_groups.new(name="Mask")
        for v, weight in enumerate(weights):
            group.add([v], weight, "REPLACE")
        live.value, live.vertex_group = 0.5, "Mask"
        wide = obj.shape_key_add(name="Wide", from_mix=False)
        wide.points.foreach_set("co", (binding.basis(obj.data) + [0, 2, 0]).astype(np.float32).ravel())
        wide.value = 0.25
        formulas.append(lambda x, b=before, w=weights: b + [0, 0.5, 0] + 0.5 * x * w[:, None] * [1, 0, 0])
    return cage, formulas


@pytest.mark.parametrize("form", ["KEYS", "MDD", "PC2"])
def test_bake_keeps_value_mask_and_other_keys_and_replaces_the_last_bake(form, tmp_path):
    body, shirt = ball("Body"), ball("Shirt", segments=12)
    cage, formulas = masked_and_mixed(body, shirt)
    scene, path = bpy.context.scene, str(tmp_path / "baked")
    for step in [1, 2]:
        select(body, shirt)
        bpy.ops.cagework.bake(form=form, first=1, last=3, step=step, filepath=path)
    assert scene.frame_current == 1
    delete(cage)
    for frame, x in [(1, 0.0), (3, 1.0)]:
        scene.frame_set(frame)
        for obj, formula in zip([body, shirt], formulas):
            assert np.abs(world(obj) - formula(x)).max() < TOLERANCE, (frame, obj.name)


def test_bake_stops_with_a_sentence_where_a_cage_changes_its_count_and_restores_the_frame(body):
    cage, scene = bind(body), bpy.context.scene
    split = cage.modifiers.new("Subdivision", "SUBSURF")
    for frame, shown in [(1, False), (2, True)]:
        split.show_viewport = shown
        split.keyframe_insert("show_viewport", frame=frame)
    scene.frame_set(1)
    with pytest.raises(RuntimeError, match="vertices and had"):
        bpy.ops.cagework.bake(form="KEYS", first=1, last=3)
    assert scene.frame_current == 1


def test_archive_of_the_extension_is_valid():
    """Blender's own checker reads the manifest of the archive that users install."""
    checker = Path(bpy.utils.resource_path("LOCAL")) / "scripts/addons_core/bl_pkg/cli/blender_ext.py"
    command = [sys.executable, checker, "validate", os.environ["CAGEWORK_EXTENSION"]]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    with zipfile.ZipFile(os.environ["CAGEWORK_EXTENSION"]) as archive:
        assert {"LICENSE-MIT", "LICENSE-APACHE"} <= set(archive.namelist())
