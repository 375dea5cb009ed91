from types import SimpleNamespace

import blf
import bpy
import pytest
from conftest import EXTENSION, bind, select

# Resolution scale of the interface. Without a window, Blender's own is 0.
SCALE = 1.5


class Layout:
    """Records what a panel draws, because Blender has no panels without a window."""

    def __init__(self, drawn=None):
        self.drawn = [] if drawn is None else drawn

    def label(self, text="", icon="NONE"):
        self.drawn.append(("label", text))

    def prop(self, data, name):
        assert name in data.bl_rna.properties, name
        self.drawn.append(("prop", name))

    def operator(self, name, text=""):
        assert getattr(bpy.ops.cagework, name.split(".")[1]).get_rna_type()
        properties = SimpleNamespace()
        self.drawn.append(("operator", name, properties))
        return properties

    def box(self):
        return Layout(self.drawn)

    def row(self, align=False):
        return Layout(self.drawn)

    column = row


def draw(width=300):
    """What the panel draws in a region of a width, in pixels."""
    context = SimpleNamespace(
        scene=bpy.context.scene,
        active_object=bpy.context.active_object,
        selected_objects=bpy.context.selected_objects,
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=SCALE)),
        region=SimpleNamespace(width=width),
    )
    layout = Layout()
    EXTENSION.panel.Panel.draw(SimpleNamespace(layout=layout), context)
    return layout.drawn


def labels(drawn):
    return [text for kind, text, *_ in drawn if kind == "label"]


@pytest.mark.parametrize("width", [240, 400, 1200])
def test_warning_about_an_animated_cage_is_wrapped_to_the_width_of_the_panel(body, width):
    cage = bind(body)
    select(body)
    for frame in [1, 9]:
        cage.location.x = frame
        cage.keyframe_insert("location", frame=frame)
    text = EXTENSION.animation.warning(body, bpy.context.scene)
    lines = labels(draw(width))
    assert text in " ".join(lines)
    blf.size(0, EXTENSION.panel.TEXT * SCALE)
    assert all(blf.dimensions(0, line)[0] <= width - SCALE * EXTENSION.panel.BORDERS for line in lines)
    assert len(lines) < len(labels(draw(240))) or width == 240


def test_word_wider_than_the_panel_has_a_line_of_its_own():
    assert EXTENSION.panel.wrapped("a very_long_name_of_a_mesh b", 20, 11) == ["a", "very_long_name_of_a_mesh", "b"]


def test_bound_mesh_has_all_operators(body):
    select(body)
    assert [name for kind, name, *_ in draw() if kind == "operator"] == ["cagework.make_cage", "cagework.bind"]
    bind(body)
    drawn = {name for kind, name, *_ in draw() if kind == "operator"}
    assert drawn == {each.bl_idname for module in [EXTENSION.operators, EXTENSION.bake, EXTENSION.rig] for each in module.CLASSES}


def test_number_of_vertices_in_the_panel_is_that_of_the_next_cage(body):
    select(body)
    body.data.cagework.vertices = 30
    assert ("prop", "vertices") in draw()
    made = next(properties for _, name, *properties in draw() if name == "cagework.make_cage")[0]
    assert bpy.ops.cagework.make_cage(**vars(made)) == {"FINISHED"}
    assert 8 <= len(body.data.cagework.cage.data.vertices) <= 30
