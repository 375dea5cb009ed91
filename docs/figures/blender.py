#!/usr/bin/env python3
"""Draws the picture of docs/blender.md: Blender's monkey in its cage, the posed cage, and the result.

    python docs/figures/blender.py

Needs Blender as the Python package `bpy` (4.2 or newer), the Python package `cagework`, NumPy and Pillow.
"""

import importlib.util
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from PIL import Image

ROOT = Path(__file__).parents[2]
TARGET = ROOT / "docs/pictures/blender.webp"
SIZE = 360, 400


def load_extension():
    place = ROOT / "crates/cagework-py/blender/__init__.py"
    spec = importlib.util.spec_from_file_location("cagework_extension", place)
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.register()
    return module


def material(name, colour, emission=0.0):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    values = made.node_tree.nodes["Principled BSDF"].inputs
    values["Base Color"].default_value = values["Emission Color"].default_value = (*colour, 1)
    values["Emission Strength"].default_value, values["Roughness"].default_value = emission, 0.4
    return made


def monkey():
    bpy.ops.mesh.primitive_monkey_add()
    made = bpy.context.active_object
    bpy.ops.object.modifier_add(type="SUBSURF")
    made.modifiers[0].levels = 2
    bpy.ops.object.modifier_apply(modifier=made.modifiers[0].name)
    bpy.ops.object.shade_smooth()
    made.data.materials.append(material("Clay", (0.5, 0.25, 0.12)))
    return made


def light_and_camera():
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.32, 0.34, 0.38, 1)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 3, (0.7, 0.2, 0.5)
    camera = scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.data.lens = (3.2, -7.4, 1.9), 74
    camera.rotation_euler = (Vector((0, 0, 0.05)) - camera.location).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(sun)
    scene.collection.objects.link(camera)
    scene.render.engine, scene.cycles.samples, scene.cycles.device = "CYCLES", 64, "CPU"
    scene.render.use_lock_interface = True
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.view_settings.view_transform = "Standard"


def draw(cage=None):
    """Renders the scene, with the edges of a cage as thin bars."""
    wire = None
    if cage:
        wire = bpy.data.objects.new("Wire", cage.data.copy())
        wire.matrix_world = cage.matrix_world
        wire.data.materials.append(material("Cage", (0.35, 0.6, 1), 0.7))
        wire.modifiers.new("Wire", "WIREFRAME").thickness = 0.01
        bpy.context.scene.collection.objects.link(wire)
    with tempfile.TemporaryDirectory() as folder:
        bpy.context.scene.render.filepath = str(Path(folder) / "picture.png")
        bpy.ops.render.render(write_still=True)
        picture = Image.open(bpy.context.scene.render.filepath).convert("RGB")
    if wire:
        bpy.data.objects.remove(wire)
    return picture


def pose(cage):
    """Lifts the ears, widens the top of the head and lengthens the chin."""
    rest = np.array([v.co[:] for v in cage.data.vertices])
    x, z = rest[:, 0], rest[:, 2]
    ears, top, chin = np.clip(abs(x) - 0.75, 0, 1), np.clip(z - 0.2, 0, 1), np.clip(-z - 0.35, 0, 1)
    moved = rest + np.stack([0.5 * top * x, 0 * x, 1.1 * ears + 0.35 * top - 0.7 * chin], axis=1)
    cage.data.vertices.foreach_set("co", moved.ravel())
    cage.data.update()


def main():
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    extension = load_extension()
    model = monkey()
    light_and_camera()
    bpy.ops.cagework.make_cage(vertices=80)
    cage = model.data.cagework.cage
    bpy.ops.cagework.bind()
    pictures = [draw(cage)]
    pose(cage)
    bpy.context.view_layer.update()
    pictures += [draw(cage), draw()]
    row = Image.new("RGB", (len(pictures) * SIZE[0], SIZE[1]))
    for k, picture in enumerate(pictures):
        row.paste(picture, (k * SIZE[0], 0))
    row.save(TARGET, quality=80)
    extension.unregister()


if __name__ == "__main__":
    main()
