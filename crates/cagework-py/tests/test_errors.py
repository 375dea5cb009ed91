import ast
import errno
import inspect
import json
import os
import subprocess
from pathlib import Path

import cagework as cw
import numpy as np
import pytest
from support import COMMAND, box

CUBE = cw.Cage(*box())
POINT = np.zeros((1, 3))


def pull(triangles):
    weights, _ = cw.bind(POINT, CUBE, grid=8)
    return cw.pull(POINT, triangles, CUBE, weights, [0], POINT, grid=8)


def test_invalid_cage_gives_the_error_message_of_the_command(tmp_path):
    vertices, faces = box()
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {a + 1} {b + 1} {c + 1} {d + 1}" for a, b, c, d in faces[1:]]
    (tmp_path / "open.obj").write_text("\n".join(lines))
    result = subprocess.run([COMMAND, "bind", "open.obj", "--cage", "open.obj"], cwd=tmp_path, capture_output=True, text=True)
    for call in [lambda: cw.Cage(vertices, faces[1:]), lambda: cw.Cage.load(tmp_path / "open.obj")]:
        with pytest.raises(cw.CageError) as error:
            call()
        assert "cage is not closed" in str(error.value) and str(error.value) in result.stderr


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (lambda: cw.bind(POINT, CUBE, grid=7), cw.OptionError, "grid is 7; it must be auto .0. or a whole number from 8 to 512"),
        (lambda: cw.bind(POINT, CUBE, grid=64.5), cw.OptionError, "grid: .*64.5"),
        (lambda: cw.bind(POINT, CUBE, solver="gauss"), cw.OptionError, "solver: .*gauss.*jacobi"),
        (lambda: cw.bind(POINT, CUBE, tau=[1]), cw.OptionError, "tau is of type .*list"),
        (lambda: cw.generate_cage(POINT, [[0, 0, 0]], target=7), cw.OptionError, "target is 7; it must be"),
        (lambda: cw.Cage(*box(), smooth=-1), cw.OptionError, "smooth is -1; it must be a whole number from 0 to 3"),
        (lambda: cw.check_cage(CUBE, grid=1.5), cw.OptionError, "grid is 1.5; it must be"),
        (lambda: cw.bind(POINT, CUBE, gird=7), TypeError, 'no option "gird"; there are .*grid'),
        (lambda: cw.bind(POINT + 9, CUBE, grid=8), cw.BindError, "none of the model's 1 vertices is inside"),
        (lambda: cw.deform(cw.bind(POINT, CUBE, grid=8)[0], np.full((8, 3), 1e308)), cw.ArrayError, "moves point 0 to .* end at"),
        (lambda: cw.bind(POINT * np.nan, CUBE, grid=8), cw.BindError, "mesh vertex 0 is not a finite number"),
        (lambda: cw.bind(POINT, CUBE, grid=512, memory_limit=1 << 20), cw.BindError, "more than the limit of 1 MiB"),
        (lambda: cw.generate_cage(np.zeros((0, 3)), [[0, 0, 0]]), cw.CageError, "model has no vertices"),
        (lambda: pull([[0, 1, 2]]), cw.PullError, "there is no vertex 1: indices run from 0 to 0"),
        (lambda: cw.reshape(b"no model", CUBE, CUBE.vertices), cw.ModelError, "model"),
        (lambda: cw.reshape("missing.glb", CUBE, CUBE.vertices), FileNotFoundError, "missing.glb"),
        (lambda: cw.reshape(7, CUBE, CUBE.vertices), TypeError, "model: expected a path, bytes, .* got int"),
        (lambda: cw.read_model([b"", None]), TypeError, "model: expected a path, bytes, .* got NoneType"),
        (lambda: cw.transfer(b"", 1.5), TypeError, "clothes: expected a path, bytes, .* got float"),
        (lambda: cw.reshape(b"", CUBE, CUBE.vertices, joints="run"), cw.OptionError, "joints: .run"),
    ],
)
def test_errors_have_their_class_and_the_message_of_the_core(call, kind, message):
    with pytest.raises(kind, match=message):
        call()


@pytest.mark.skipif(os.name != "posix", reason="pipes and devices")
def test_pipes_and_devices_are_refused_as_models_buffers_and_bodies(tmp_path):
    # Opening a pipe without a writer waits forever, and /dev/zero has no end.
    pipe = tmp_path / "pipe.glb"
    os.mkfifo(pipe)
    refused = "is a pipe or a device, not a regular file"
    for call in [
        lambda: cw.read_model(pipe),
        lambda: cw.read_model("/dev/zero"),
        lambda: cw.reshape(pipe, CUBE, CUBE.vertices),
        lambda: cw.transfer(pipe, pipe),
        lambda: cw.generate_cage(*box_triangles(), rig=pipe),
    ]:
        with pytest.raises(OSError, match=refused):
            call()
    with pytest.raises(IsADirectoryError, match="is a folder"):
        cw.read_model(tmp_path)
    (tmp_path / "secret.bin").write_bytes(bytes(36))
    (tmp_path / "models").mkdir()
    os.mkfifo(tmp_path / "models" / "pipe.bin")
    os.symlink("../secret.bin", tmp_path / "models" / "link.bin")
    for uri, message in [("pipe.bin", refused), ("link.bin", "out of the model's folder"), ("../secret.bin", "out of the model's folder")]:
        model = {"asset": {"version": "2.0"}, "buffers": [{"byteLength": 36, "uri": uri}]}
        (tmp_path / "models" / "model.gltf").write_text(json.dumps(model))
        with pytest.raises(cw.ModelError, match=message):
            cw.read_model(tmp_path / "models" / "model.gltf")


def test_whole_floats_and_scalars_of_numpy_are_options():
    expected = cw.bind(POINT, CUBE, grid=8, tau=1.0)[0]
    for grid, tau in [(8.0, np.float32(1)), (np.float64(8), 1), (np.int32(8), np.int64(1))]:
        assert abs(cw.bind(POINT, CUBE, grid=grid, tau=tau)[0] - expected).max() == 0
    vertices, triangles = box_triangles()
    for quads in [True, False]:
        options = {"target": 20, "quads": np.bool_(quads)}
        made = cw.generate_cage(vertices, triangles, **options)
        assert np.array_equal(made.vertices, cw.generate_cage(vertices, triangles, target=20, quads=quads).vertices)


def test_all_errors_have_a_common_base_class():
    for kind in [cw.ArrayError, cw.BindError, cw.CageError, cw.ModelError, cw.OptionError, cw.PullError]:
        assert issubclass(kind, cw.Error)


def test_stubs_match_the_module():
    package = Path(cw.__file__).parent
    assert (package / "py.typed").exists()
    body = ast.parse((package / "_native.pyi").read_text()).body
    functions = {node.name: node for node in body if isinstance(node, ast.FunctionDef)}
    private = {"to_glb", "defaults", "restored_cage", "restored_splats"}
    native = {name: f for name, f in vars(cw._native).items() if inspect.isbuiltin(f)}
    assert set(functions) == set(native) and set(native) - private < set(cw.__all__)
    defaults = dict(zip(("BindOptions", "CageOptions"), cw._native.defaults(), strict=True))
    options = {node.name: [field.target.id for field in node.body] for node in body if isinstance(node, ast.ClassDef) and node.name in defaults}
    assert options == {name: list(values) for name, values in defaults.items()}
    # The signatures show names in place of numbers and of what depends on other options.
    defaults["BindOptions"] |= {"grid": "auto", "solver": None}
    for name, node in functions.items():
        actual = inspect.signature(native[name]).parameters
        named = [a.arg for a in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
        if node.args.kwarg:
            of_stub = defaults[node.args.kwarg.annotation.slice.id]
            assert {option: actual[option].default for option in of_stub} == of_stub, name
            named += of_stub
        assert list(actual) == named, name
        assert native[name].__doc__ and "Raises" in native[name].__doc__
    (cage,) = (node for node in body if isinstance(node, ast.ClassDef) and node.name == "Cage")
    stubbed = {node.name for node in cage.body} - {"__new__"}
    assert stubbed == {name for name in vars(cw.Cage) if not name.startswith("_")}
    field = inspect.signature(cw.Field).parameters
    assert {option: field[option].default for option in defaults["BindOptions"]} == defaults["BindOptions"]


def box_triangles():
    vertices, faces = box()
    return vertices, np.concatenate([faces[:, :3], faces[:, [0, 2, 3]]])


def test_errors_of_the_system_have_their_number_and_the_file():
    with pytest.raises(FileNotFoundError) as error:
        cw.read_model("missing.glb")
    assert (error.value.errno, error.value.filename) == (errno.ENOENT, "missing.glb")
