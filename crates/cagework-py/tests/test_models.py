"""What all functions accept as a model."""

import io
import json
from types import SimpleNamespace

import cagework as cw
import numpy as np
import pytest
import trimesh
from support import bent, box, rigged_glb, splat_records


def forms_of(mesh):
    """The same mesh as the objects of several packages."""
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    packed = np.insert(faces, 0, 3, axis=1).ravel()
    return {
        "trimesh": mesh,
        "pair": (vertices, faces),
        "Open3D": SimpleNamespace(vertices=vertices, triangles=faces),
        "PyVista": SimpleNamespace(points=vertices, faces=packed),
        "meshio": SimpleNamespace(points=vertices, cells_dict={"triangle": faces}),
        "scene": trimesh.Scene(mesh),
    }


def test_meshes_are_models_everywhere(model, cage, bound):
    expected = cw.reshape(model, cage, bent(cage), grid=16)
    for name, form in forms_of(model).items():
        assert cw.generate_cage(form, target=40) == cage, name
        assert abs(cw.bind(form, cage, grid=24)[0] - bound[0]).max() == 0, name
        assert cw.reshape(form, cage, bent(cage), grid=16) == expected, name
        vertices, triangles = cw.read_model(form)
        assert np.allclose(vertices, model.vertices) and np.array_equal(triangles, model.faces), name
        assert not [problem for problem in cw.check_cage(cage, form) if problem["severity"] == "error"], name
    posed = cw.read_model(expected)[0]
    assert np.allclose(posed, cw.deform(*cw.bind(model, cage, grid=16)[:1], bent(cage)), atol=1e-5)
    assert cw.transfer(rigged_glb(), model)[0][:4] == b"glTF"


def test_faces_of_several_sizes_are_packed_as_in_vtk():
    vertices, quads = box()
    packed = [3, *quads[0][:3], 3, *quads[0][[0, 2, 3]], *np.insert(quads[1:], 0, 4, axis=1).ravel()]
    _, triangles = cw.read_model(SimpleNamespace(points=vertices, faces=np.array(packed)))
    assert len(triangles) == 12


def test_file_objects_are_read(cage, tmp_path):
    glb = rigged_glb()
    (tmp_path / "a.glb").write_bytes(glb)
    expected = cw.reshape(glb, cage, bent(cage), grid=12)
    with open(tmp_path / "a.glb", "rb") as file:
        assert cw.reshape(file, cage, bent(cage), grid=12) == expected
    assert cw.reshape(io.BytesIO(glb), cage, bent(cage), grid=12) == expected
    cage.save(tmp_path / "cage.obj")
    with open(tmp_path / "cage.obj", "rb") as file:
        assert cw.Cage.load(file) == cw.Cage.load(tmp_path / "cage.obj")
    with open(tmp_path / "cage.obj") as file, pytest.raises(TypeError, match="model: the file is read as str, .* open it with mode 'rb'"):
        cw.read_model(file)


def test_file_objects_are_written(cage, tmp_path):
    (tmp_path / "a.splat").write_bytes(splat_records().tobytes())
    splats = cw.Splats(tmp_path / "a.splat")
    field = cw.Field(cage, bent(cage), cells=12)
    for name, save in [("a.obj", cage.save), ("a.npz", field.save), ("a.ply", splats.save)]:
        save(tmp_path / name)
        with open(tmp_path / f"b-{name}", "wb") as file:
            save(file)
        assert (tmp_path / f"b-{name}").read_bytes() == (tmp_path / name).read_bytes()
    memory = io.BytesIO()
    splats.save(memory, format="ply")
    assert memory.getvalue() == (tmp_path / "a.ply").read_bytes()
    with pytest.raises(cw.ModelError, match="or the format"):
        splats.save(memory)
    with pytest.raises(TypeError, match="path: expected a path or a file opened with mode 'wb', got int"):
        cage.save(3)


def test_a_file_gives_the_cage_of_the_command(tmp_path):
    (tmp_path / "a.glb").write_bytes(rigged_glb())
    vertices = cw.read_model(tmp_path / "a.glb", states=True)
    expected = cw.generate_cage(*vertices, rig=tmp_path / "a.glb", target=40)
    assert cw.generate_cage(tmp_path / "a.glb", target=40) == expected


def test_a_list_shares_one_solve_and_gives_the_same_bytes(cage, model):
    models = [rigged_glb(), b"no model", model]
    results = {}
    fractions = []
    assert cw.reshape(models, cage, bent(cage), grid=16, each=results.__setitem__, progress=fractions.append) == []
    assert results[0] == cw.reshape(models[0], cage, bent(cage), grid=16)
    assert results[2] == cw.reshape(model, cage, bent(cage), grid=16)
    assert isinstance(results[1], cw.ModelError) and fractions[-1] == 1 and fractions == sorted(fractions)
    assert cw.reshape([model], cage, bent(cage), grid=16) == [results[2]]
    with pytest.raises(cw.ModelError):
        cw.reshape(models, cage, bent(cage), grid=16)


def test_reports_are_json_and_give_the_same_deformation(model, cage):
    points = np.vstack([model.vertices, [[0.0, 0.0, 1.05], [0.0, 0.0, 3.0]]])
    weights, report = cw.bind(points, cage, grid=24)
    assert report["offsets"]["vertex"]
    read = json.loads(json.dumps(report))
    assert np.array_equal(cw.deform(weights, bent(cage), read), cw.deform(weights, bent(cage), report))
    with pytest.raises(cw.ArrayError, match="offsets of the report do not match the weights"):
        cw.deform(weights[:5], bent(cage), report)
