import bpy
import numpy as np
import pytest
from conftest import EXTENSION, ball, bind, local, move, select, world

animation, binding = EXTENSION.animation, EXTENSION.binding
# Tolerance of float32 positions near 3 in a file.
TOLERANCE = 1e-5


def key(data, path, values, index=-1):
    """Keys a property at the frames of a dict, with linear interpolation."""
    for frame, value in values.items():
        setattr(data, path, value)
        data.keyframe_insert(path, index=index, frame=frame)
    for curve in animation.curves(data.id_data):
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"


def free(cage):
    """Removes the parent of a cage."""
    cage.parent = None


def by_object(_body, cage):
    key(cage, "location", {1: (0, 0, 0), 9: (1, 0, 0)})


def by_shape_key(_body, cage):
    cage.shape_key_add(name="Basis")
    key(cage.shape_key_add(name="Wide"), "value", {1: 0, 9: 1})


def armature_on(cage):
    bpy.ops.object.armature_add()
    armature = bpy.context.active_object
    cage.vertex_groups.new(name=armature.data.bones[0].name).add(range(len(cage.data.vertices)), 1.0, "REPLACE")
    cage.modifiers.new("Armature", "ARMATURE").object = armature
    return armature


def by_armature(_body, cage):
    key(armature_on(cage).pose.bones[0], "location", {1: (0, 0, 0), 9: (0, 0, 1)})


def by_armature_of_both(body, cage):
    armature = armature_on(cage)
    body.parent = armature
    key(armature.pose.bones[0], "location", {1: (0, 0, 0), 9: (0, 0, 1)})


def by_lattice_through_a_parent(_body, cage):
    lattice = bpy.data.objects.new("Lattice", bpy.data.lattices.new("Lattice"))
    bpy.context.scene.collection.objects.link(lattice)
    lattice.parent = bpy.data.objects.new("Empty", None)
    bpy.context.scene.collection.objects.link(lattice.parent)
    cage.modifiers.new("Lattice", "LATTICE").object = lattice
    key(lattice.parent, "scale", {1: (1, 1, 1), 9: (2, 1, 1)})


def by_driver(_body, cage):
    cage.driver_add("location", 0).driver.expression = "frame / 10"


def by_modifier(_body, cage):
    cage.modifiers.new("Wave", "WAVE")


def by_strip(_body, cage):
    by_object(_body, cage)
    data = cage.animation_data
    data.nla_tracks.new().strips.new("Strip", 1, data.action)
    data.action = None


def by_mesh_alone(body, cage):
    free(cage)
    key(body, "location", {1: (0, 0, 0), 9: (1, 0, 0)})


MOVES = [
    by_object,
    by_shape_key,
    by_armature,
    by_armature_of_both,
    by_lattice_through_a_parent,
    by_driver,
    by_modifier,
    by_strip,
    by_mesh_alone,
]


@pytest.mark.parametrize("animate", MOVES)
def test_animated_cage_without_a_bake_is_a_warning(body, animate):
    cage, scene = bind(body), bpy.context.scene
    assert animation.warning(body, scene) is None
    animate(body, cage)
    assert "Body Cage is animated, and Body has no bake" in animation.warning(body, scene)


def with_the_mesh(body, _cage):
    key(body, "location", {1: (0, 0, 0), 9: (1, 0, 0)})


def by_constant_keys(_body, cage):
    key(cage, "location", {1: (1, 0, 0), 9: (1, 0, 0)})


def by_color(_body, cage):
    material = bpy.data.materials.new("Material")
    cage.data.materials.append(material)
    key(material, "diffuse_color", {1: (0, 0, 0, 1), 9: (1, 1, 1, 1)})


def by_common_parent(body, cage):
    free(cage)
    cage.parent = body.parent = bpy.data.objects.new("Empty", None)
    bpy.context.scene.collection.objects.link(body.parent)
    key(body.parent, "location", {1: (0, 0, 0), 9: (1, 0, 0)})


def by_no_keys(_body, cage):
    by_object(_body, cage)
    for curve in animation.curves(cage):
        curve.keyframe_points.clear()


@pytest.mark.parametrize("animate", [with_the_mesh, by_constant_keys, by_no_keys, by_color, by_common_parent])
def test_animation_that_does_not_deform_the_mesh_is_no_warning(body, animate):
    cage, scene = bind(body), bpy.context.scene
    animate(body, cage)
    before = world(body) - np.array(body.matrix_world.translation)
    scene.frame_set(5)
    assert np.abs(world(body) - np.array(body.matrix_world.translation) - before).max() < TOLERANCE
    assert animation.warning(body, scene) is None


@pytest.fixture
def baked(body):
    """A mesh with a bake for export of the frames 1 to 9, in which its cage moves by 1 along x."""
    cage, scene = bind(body), bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 9
    by_object(body, cage)
    scene.frame_set(1)
    assert bpy.ops.cagework.bake_for_export() == {"FINISHED"}
    assert animation.warning(body, scene) is None
    return body


def test_bake_for_export_bakes_each_mesh_with_an_animated_cage_once():
    scene = bpy.context.scene
    first, second, still = ball("First"), ball("Second"), ball("Still")
    for obj in [first, second, still]:
        cage = bind(obj)
        if obj != still:
            by_object(obj, cage)
    scene.frame_start, scene.frame_end = 3, 5
    select(still)
    assert bpy.ops.cagework.bake_for_export() == {"FINISHED"}
    assert [o.data.cagework.baked.split("\n") for o in [first, second]] == [["Cage 3", "Cage 4", "Cage 5"]] * 2
    assert still.data.cagework.baked == "" and animation.warnings(scene, exported=True) == {}
    assert bpy.ops.cagework.bake_for_export() == {"CANCELLED"}


def later_curve(body, cage):
    animation.curves(cage)[0].keyframe_points[1].co.y = 2


def pose(body, cage):
    move(cage, [0.1, 0, 0])


def longer_scene(body, cage):
    bpy.context.scene.frame_end = 10


def rebind(body, cage):
    select(body)
    bpy.ops.cagework.bind()


@pytest.mark.parametrize("change", [later_curve, pose, longer_scene, rebind])
def test_change_after_a_bake_is_a_warning_until_it_is_baked_again(baked, change):
    scene = bpy.context.scene
    change(baked, baked.data.cagework.cage)
    bpy.context.view_layer.update()
    assert "bake again" in animation.warning(baked, scene)
    assert bpy.ops.cagework.bake_for_export() == {"FINISHED"}
    assert animation.warning(baked, scene) is None


def test_undone_change_is_no_warning(baked):
    cage, scene = baked.data.cagework.cage, bpy.context.scene
    for frame in range(1, 10):
        scene.frame_set(frame)
        assert animation.warning(baked, scene) is None
    move(cage, [0.1, 0, 0])
    assert "was changed after the bake" in animation.warning(baked, scene)
    move(cage, [-0.1, 0, 0])
    assert animation.warning(baked, scene) is None


@pytest.mark.parametrize("form", ["KEYS", "PC2"])
def test_mesh_follows_the_cage_again_without_its_bake(body, form, tmp_path):
    cage, scene = bind(body), bpy.context.scene
    before = world(body)
    by_object(body, cage)
    select(body)
    bpy.ops.cagework.bake(form=form, first=1, last=9, filepath=str(tmp_path / "baked"))
    assert bpy.ops.cagework.remove_bake() == {"FINISHED"} and not bpy.ops.cagework.remove_bake.poll()
    scene.frame_set(9)
    cage.location.y = 2
    assert np.abs(world(body) - before - [1, 2, 0]).max() < TOLERANCE
    assert "has no bake" in animation.warning(body, scene)


def test_deleted_keys_of_a_bake_are_a_warning(baked):
    baked.shape_key_remove(baked.data.shape_keys.key_blocks["Cage 4"])
    assert "has no bake" in animation.warning(baked, bpy.context.scene)


def test_file_for_the_mesh_cache_modifier_is_no_bake_for_exporters_of_shape_keys(body, tmp_path):
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 9
    by_object(body, bind(body))
    select(body)
    bpy.ops.cagework.bake(form="PC2", first=1, last=9, filepath=str(tmp_path / "baked"))
    assert animation.warning(body, scene) is None
    assert "no baked shape keys" in animation.warning(body, scene, exported=True)


def test_exported_gltf_warns_without_a_bake_and_plays_with_it(body, gltf, tmp_path, capfd):
    cage, scene, path = bind(body), bpy.context.scene, str(tmp_path / "a.glb")
    scene.frame_start, scene.frame_end = 1, 9
    by_object(body, cage)
    key(cage, "scale", {1: (1, 1, 1), 9: (1, 2, 1)})
    live = []
    for frame in range(1, 10):
        scene.frame_set(frame)
        live.append(world(body))
    options = {"filepath": path, "export_normals": False, "export_texcoords": False, "use_selection": True}
    select(body)
    capfd.readouterr()
    bpy.ops.export_scene.gltf(**options)
    assert "Body Cage is animated, and Body has no baked shape keys" in capfd.readouterr().out
    bpy.ops.cagework.bake_for_export()
    capfd.readouterr()
    bpy.ops.export_scene.gltf(**options)
    assert "is animated" not in capfd.readouterr().out
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    scene = bpy.context.scene
    bpy.ops.import_scene.gltf(filepath=path)
    imported = next(o for o in bpy.data.objects if o.type == "MESH" and o.data.shape_keys)
    for frame, points in enumerate(live, 1):
        scene.frame_set(frame)
        found = world(imported)
        nearest = np.linalg.norm(points[:, None] - found[None], axis=2).min(axis=1)
        assert nearest.max() < 10 * TOLERANCE, frame
