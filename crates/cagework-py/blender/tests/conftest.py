"""Loads the extension's sources into Blender as a Python module (package `bpy`)."""

import importlib.util
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Matrix

FOLDER = Path(__file__).parents[1]


def load():
    """Registers the extension as the package `cagework_extension`."""
    spec = importlib.util.spec_from_file_location("cagework_extension", FOLDER / "__init__.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    module.register()
    return module


EXTENSION = load()


@pytest.fixture(scope="session", autouse=True)
def registered():
    yield
    EXTENSION.unregister()


@pytest.fixture(autouse=True)
def empty():
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


@pytest.fixture
def body():
    return ball("Body")


def ball(name, matrix=Matrix(), segments=16):
    """A sphere of radius 1 in its own space, selected and active."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=segments, ring_count=segments // 2)
    obj = bpy.context.active_object
    obj.name, obj.matrix_world = name, matrix
    bpy.context.view_layer.update()
    return obj


def select(*objects):
    """Selects objects; the first one becomes active."""
    bpy.ops.object.select_all(action="DESELECT")
    for obj in objects:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]


def delete(obj):
    """Deletes an object as users do. It stays in the file while a mesh refers to it."""
    select(obj)
    bpy.ops.object.delete()


def bind(*objects, vertices=40, grid=24):
    """Makes a cage around objects and binds them; returns the cage."""
    select(*objects)
    assert bpy.ops.cagework.make_cage(vertices=vertices) == {"FINISHED"}
    for obj in objects:
        obj.data.cagework.grid = grid
    assert bpy.ops.cagework.bind() == {"FINISHED"}
    return objects[0].data.cagework.cage


def world(obj):
    """World positions of an object with modifiers and shape keys."""
    bpy.context.view_layer.update()
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    points = EXTENSION.binding.coordinates(evaluated.data.vertices)
    return EXTENSION.binding.transform(points, evaluated.matrix_world)


def local(mesh):
    return EXTENSION.binding.coordinates(mesh.vertices)


def move(cage, offsets):
    """Moves the vertices of a cage, local space."""
    cage.data.vertices.foreach_set("co", (local(cage.data) + offsets).astype(np.float32).ravel())
    cage.data.update()
    bpy.context.view_layer.update()


def attach(obj, matrix):
    """Makes an object the child of a new empty, which it returns."""
    empty = bpy.data.objects.new(f"{obj.name} Parent", None)
    bpy.context.scene.collection.objects.link(empty)
    empty.matrix_world, obj.parent = matrix, empty
    bpy.context.view_layer.update()
    return empty
