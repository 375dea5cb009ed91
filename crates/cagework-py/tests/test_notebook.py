"""The notebook widget without a notebook. `cargo xtask notebooks` tests it in JupyterLab."""

import json
import struct

import cagework_notebook
import numpy as np
import pytest
import support

import cagework as cw


@pytest.fixture
def widget(model, cage, bound):
    return cw.show(model, cage, *bound)


def test_widget_sends_the_model_its_cage_and_all_weights(widget, model, cage, bound):
    sent = widget._sent
    vertices, triangles = cw.read_model(sent["file"])
    # The file contains float32: coordinates below 4 are rounded by at most 2**-23.
    np.testing.assert_allclose(vertices, model.vertices, atol=2.0**-23)
    np.testing.assert_array_equal(triangles, model.faces)
    np.testing.assert_array_equal(np.frombuffer(sent["positions"]).reshape(-1, 3), cage.vertices)
    assert sent["name"] == "model.ply" and len(sent["data"]) == len(sent["indices"]) == 4 * bound[0].nnz
    assert np.frombuffer(sent["corners"], "u4").size == sum(1 + len(face) for face in cage.faces)


# A tetrahedron in centimetres with y up, as FBX text.
FBX = b"""; FBX 7.4.0 project file
FBXHeaderExtension: {
  FBXVersion: 7400
}
Objects: {
  Geometry: 1, "Geometry::tetra", "Mesh" {
    Vertices: *12 {
      a: 100,100,100,-100,-100,100,-100,100,-100,100,-100,-100
    }
    PolygonVertexIndex: *12 {
      a: 0,1,-4,0,2,-2,0,3,-3,1,2,-4
    }
  }
  Model: 2, "Model::tetra", "Mesh" {
  }
}
Connections: {
  C: "OO", 2, 0
  C: "OO", 1, 2
}
"""


def test_models_are_sent_as_one_file_with_the_same_vertices(tmp_path):
    glb = support.rigged_glb()
    length = struct.unpack_from("<I", glb, 12)[0]
    document = json.loads(glb[20 : 20 + length])
    document["buffers"][0]["uri"] = "figure.bin"
    (tmp_path / "figure.bin").write_bytes(glb[28 + length :])
    (tmp_path / "figure.gltf").write_text(json.dumps(document))
    (tmp_path / "figure.glb").write_bytes(glb)
    (tmp_path / "tetra.fbx").write_bytes(FBX)
    for model in (tmp_path / "figure.gltf", tmp_path / "figure.glb", glb, bytearray(glb), memoryview(glb), tmp_path / "tetra.fbx", FBX):
        vertices, triangles = cw.read_model(model)
        sent = cw.show(model, cw.generate_cage(vertices, triangles, target=20))._sent
        assert sent["file"][:4] == b"glTF" and sent["name"].endswith(".glb")
        for before, after in zip((vertices, triangles), cw.read_model(sent["file"]), strict=True):
            np.testing.assert_array_equal(before, after)
        assert sent["file"] == glb or model not in (glb, tmp_path / "figure.glb")
    with open(tmp_path / "figure.glb", "rb") as file:
        assert cw.show(file, cw.generate_cage(glb, target=20))._sent["file"] == glb
    np.testing.assert_allclose(cw.read_model(FBX)[0].max(axis=0), 1)


def test_offset_columns_of_outside_points_follow_those_of_the_cage(model, cage):
    points = np.vstack([model.vertices, [[0.0, 0.0, 3.0]]])
    weights, report = cw.bind(points, cage, grid=24)
    sent = cw.show((points, model.faces), cage, weights, report)._sent
    assert len(sent["data"]) == 4 * (weights.nnz + len(report["offsets"]["value"]))
    assert np.frombuffer(sent["indices"], "u4").max() >= len(cage.vertices)


def test_pose_from_the_notebook_and_from_python_is_one_array(widget, cage):
    seen = []
    widget.observe(lambda change: seen.append(change["new"]), "pose")
    posed = cage.vertices + [0.0, 0.5, 0.0]
    widget.set_state({"pose": memoryview(posed.tobytes())})
    np.testing.assert_array_equal(widget.pose, posed)
    widget.pose = cage.vertices * 2
    assert [len(pose) for pose in seen] == [len(cage.vertices)] * 2
    np.testing.assert_array_equal(np.frombuffer(widget.get_state("pose")["pose"]).reshape(-1, 3), cage.vertices * 2)
    with pytest.raises(ValueError, match="read-only"):
        widget.pose[0] = 0


def test_wrong_shapes_are_rejected_in_a_sentence(widget, model, cage, bound):
    n = len(cage.vertices)
    with pytest.raises(cw.ArrayError, match=rf"pose: expected shape \[{n}, 3\], got \[2, 3\]"):
        widget.pose = np.zeros((2, 3))
    for wrong in (np.nan, np.inf, 1e308):
        with pytest.raises(cw.ArrayError, match=r"pose: expected finite numbers of at most 3.4e\+38"):
            widget.pose = np.full((n, 3), wrong)
    with pytest.raises(cw.ArrayError, match=rf"weights: .*{n} cage vertices.*got \[5, {n}\]"):
        cw.show(model, cage, bound[0][:5])
    quad = cw.show((model.vertices, [[0, 1, 2, 3]]), cage)
    assert len(cw.read_model(quad._sent["file"])[1]) == 2
    with pytest.raises(FileNotFoundError, match="nowhere.glb"):
        cw.show("nowhere.glb", cage)


def test_missing_files_of_the_widget_are_named(model, cage, bound, tmp_path, monkeypatch):
    monkeypatch.setattr(cagework_notebook, "FILES", tmp_path)
    cagework_notebook._file.cache_clear()
    with pytest.raises(ImportError, match="without widget.js: build its wheel with `cargo xtask notebook-wheel`"):
        cw.show(model, cage, *bound)


def test_missing_package_is_named(model, cage, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "cagework_notebook", None)
    with pytest.raises(ImportError, match=r"`cargo xtask notebook-wheel`, then `pip install target/notebook/\*.whl`"):
        cw.show(model, cage)
