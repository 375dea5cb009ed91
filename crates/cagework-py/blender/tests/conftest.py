"""Loads the extension's sources into Blender as a Python module (package `bpy`)."""

import importlib.util
import inspect
import sys
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix, Vector

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


@pytest.fixture
def gltf():
    """Blender's glTF add-on, which calls the extension like an installed one."""
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    bpy.context.preferences.addons.new().module = EXTENSION.__name__
    yield
    bpy.context.preferences.addons.remove(bpy.context.preferences.addons[EXTENSION.__name__])


class Modal:
    """Runs the methods of a modal operator on a plain object, because Blender sends no events in the background.

    Window, workspace and 3-D view are plain objects too. Scene, selection and dependency graph are Blender's.
    """

    def __init__(self, operator, perspective=True):
        methods = {**vars(EXTENSION.operators.BoundObjectOperator), **vars(operator)}
        functions = {name: each for name, each in methods.items() if inspect.isfunction(each)}
        self.reports, self.handlers, self.timers, self.status = [], [], [], None
        self.operator = type(operator.__name__, (), functions)()
        self.operator.keep_rest, self.operator.report = False, lambda kind, text: self.reports.append((kind, text))
        self.region = SimpleNamespace(type="WINDOW", x=50, y=100, width=800, height=600)
        view = Matrix.Translation((0, 0, -6)) @ Euler((-1.1, 0, 0.6)).to_matrix().to_4x4()
        scale = 2 if perspective else 0.5
        lens = Matrix.Diagonal((scale, scale * 800 / 600, -0.02, 1))
        if perspective:
            lens[2][3], lens[3][2], lens[3][3] = -0.2, -1, 0
        self.view = SimpleNamespace(
            view_matrix=view,
            perspective_matrix=lens @ view,
            is_perspective=perspective,
            view_perspective="PERSP" if perspective else "ORTHO",
        )

    def context(self):
        def status(text):
            self.status = text

        now = bpy.context
        manager = SimpleNamespace(
            event_timer_add=lambda *_, **__: self.timers.append("timer") or "timer",
            event_timer_remove=self.timers.remove,
            modal_handler_add=self.handlers.append,
        )
        return SimpleNamespace(
            scene=now.scene,
            active_object=now.active_object,
            selected_objects=now.selected_objects,
            evaluated_depsgraph_get=now.evaluated_depsgraph_get,
            window=now.window,
            window_manager=manager,
            workspace=SimpleNamespace(status_text_set=status),
            area=SimpleNamespace(type="VIEW_3D", regions=[self.region]),
            space_data=SimpleNamespace(region_3d=self.view),
        )

    def invoke(self):
        result = self.operator.invoke(self.context(), None)
        assert (result == {"RUNNING_MODAL"}) == (self.handlers == [self.operator])
        return result

    def send(self, kind, value="NOTHING", at=(0, 0)):
        """Sends an event; `at` is relative to the region, in pixels."""
        x, y = at[0] + self.region.x, at[1] + self.region.y
        return self.operator.modal(self.context(), SimpleNamespace(type=kind, value=value, mouse_x=x, mouse_y=y))

    def pixel(self, point):
        """The pixel at which the view shows a point, relative to the region."""
        x, y, _, w = self.view.perspective_matrix @ Vector((*point, 1.0))
        return (x / w + 1) / 2 * self.region.width, (y / w + 1) / 2 * self.region.height
