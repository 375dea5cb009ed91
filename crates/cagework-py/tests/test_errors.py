import ast
import inspect
import subprocess
from pathlib import Path

import cagework as cw
import numpy as np
import pytest
from support import COMMAND, box

CUBE = cw.Cage(*box())
POINT = np.zeros((1, 3))


def pulled(triangles):
    weights, _ = cw.bind(POINT, CUBE, grid=8)
    return cw.pull(POINT, triangles, CUBE, weights, [0], POINT, grid=8)


def test_a_mesh_that_is_no_cage_is_refused_with_the_commands_sentence(tmp_path):
    vertices, faces = box()
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {a + 1} {b + 1} {c + 1} {d + 1}" for a, b, c, d in faces[1:]]
    (tmp_path / "open.obj").write_text("\n".join(lines))
    said = subprocess.run([COMMAND, "bind", "open.obj", "--cage", "open.obj"], cwd=tmp_path, capture_output=True, text=True)
    for call in [lambda: cw.Cage(vertices, faces[1:]), lambda: cw.Cage.load(tmp_path / "open.obj")]:
        with pytest.raises(cw.CageError) as error:
            call()
        assert "cage is not closed" in str(error.value) and str(error.value) in said.stderr


@pytest.mark.parametrize(
    ("call", "kind", "sentence"),
    [
        (lambda: cw.bind(POINT, CUBE, grid=7), cw.OptionError, "grid is 7; it must be a whole number from 8 to 512"),
        (lambda: cw.bind(POINT, CUBE, grid=64.5), cw.OptionError, "grid: .*64.5"),
        (lambda: cw.bind(POINT, CUBE, solver="gauss"), cw.OptionError, "solver: .*gauss.*jacobi"),
        (lambda: cw.bind(POINT, CUBE, tau=[1]), cw.OptionError, "tau is of type .*list"),
        (lambda: cw.generate_cage(POINT, [[0, 0, 0]], target=7), cw.OptionError, "target is 7; it must be"),
        (lambda: cw.Cage(*box(), smooth=-1), cw.OptionError, "smooth is -1; it must be a whole number from 0 to 3"),
        (lambda: cw.check_cage(CUBE, grid=1.5), cw.OptionError, "grid is 1.5; it must be"),
        (lambda: cw.bind(POINT, CUBE, gird=7), TypeError, 'no option "gird"; there are .*grid'),
        (lambda: cw.bind(POINT + 9, CUBE, grid=8), cw.BindError, "none of the model's 1 vertices is inside"),
        (lambda: cw.bind(POINT * np.nan, CUBE, grid=8), cw.BindError, "mesh vertex 0 is not a finite number"),
        (lambda: cw.bind(POINT, CUBE, grid=512, memory_limit=1 << 20), cw.BindError, "more than the limit of 1 MiB"),
        (lambda: cw.generate_cage(np.zeros((0, 3)), [[0, 0, 0]]), cw.CageError, "model has no vertices"),
        (lambda: pulled([[0, 1, 2]]), cw.PullError, "there is no vertex 1: indices run from 0 to 0"),
        (lambda: cw.reshape(b"no model", CUBE, CUBE.vertices), cw.ModelError, "model"),
        (lambda: cw.reshape("missing.glb", CUBE, CUBE.vertices), FileNotFoundError, "missing.glb"),
        (lambda: cw.reshape(b"", CUBE, CUBE.vertices, joints="run"), cw.OptionError, "joints is .run"),
    ],
)
def test_errors_are_of_their_class_with_the_cores_sentence(call, kind, sentence):
    with pytest.raises(kind, match=sentence):
        call()


def test_errors_that_are_our_own_are_caught_by_one_name():
    for kind in [cw.ArrayError, cw.BindError, cw.CageError, cw.ModelError, cw.OptionError, cw.PullError]:
        assert issubclass(kind, cw.Error)


def test_the_stubs_say_what_is_there():
    package = Path(cw.__file__).parent
    assert (package / "py.typed").exists()
    body = ast.parse((package / "_native.pyi").read_text()).body
    functions = {node.name: node for node in body if isinstance(node, ast.FunctionDef)}
    native = {name: f for name, f in vars(cw._native).items() if inspect.isbuiltin(f)}
    assert set(functions) == set(native) and set(native) < set(cw.__all__)
    for name, node in functions.items():
        there = inspect.signature(native[name]).parameters
        named = [a.arg for a in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
        if node.args.kwarg:
            named.append(node.args.kwarg.arg)
        assert list(there) == named, name
        assert native[name].__doc__ and "Raises" in native[name].__doc__
    (cage,) = (node for node in body if isinstance(node, ast.ClassDef) and node.name == "Cage")
    stubbed = {node.name for node in cage.body} - {"__new__"}
    assert stubbed == {name for name in vars(cw.Cage) if not name.startswith("_")}
    # Options are the core's: names that are not are refused above, and these are taken.
    defaults = {"BindOptions": lambda **o: cw.bind(POINT, CUBE, **o), "CageOptions": lambda **o: cw.generate_cage(*box_triangles(), **o)}
    for node in body:
        if isinstance(node, ast.ClassDef) and node.name in defaults:
            defaults[node.name](**dict.fromkeys((field.target.id for field in node.body), None))


def box_triangles():
    vertices, faces = box()
    return vertices, np.concatenate([faces[:, :3], faces[:, [0, 2, 3]]])
