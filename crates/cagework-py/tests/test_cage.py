import pickle

import cagework as cw
import numpy as np
import pytest
import trimesh
from support import box, command


def test_generated_cage_is_closed_and_encloses_the_model(model, cage):
    assert len(cage.vertices) <= 44 and cage.report["target_met"]
    surface = trimesh.Trimesh(cage.vertices, cage.triangles, process=False)
    assert surface.is_watertight and surface.is_winding_consistent and surface.volume > model.volume
    assert cage.checked["valid"] and cage.checked["vertices"] == len(cage.vertices)
    codes = {problem["code"] for problem in cw.check_cage(cage, model.vertices)}
    assert "model_outside" not in codes


def test_generated_cage_equals_that_of_the_command(model, tmp_path):
    model.export(tmp_path / "model.obj")
    command(tmp_path, "cage model.obj -o cage.obj --vertices 30 --triangles")
    ours = cw.generate_cage(*cw.read_model(tmp_path / "model.obj"), target=30, quads=False)
    theirs = cw.Cage.load(tmp_path / "cage.obj")
    assert np.array_equal(ours.vertices, theirs.vertices) and np.array_equal(ours.triangles, theirs.triangles)


def test_vertices_and_faces_are_returned_unchanged():
    vertices, faces = box()
    cage = cw.Cage(vertices, faces)
    assert cage.vertices.dtype == np.float64 and np.array_equal(cage.vertices, vertices)
    assert [sorted(face) for face in cage.faces] == [sorted(face) for face in faces]
    with pytest.raises(ValueError, match="read-only"):
        cage.vertices[0] = 0.0
    again = cw.Cage(cage.vertices, [list(face) for face in cage.faces])
    assert all(np.array_equal(a, b) for a, b in zip(again.faces, cage.faces))


def test_cages_can_be_pickled(cage, model):
    copy = pickle.loads(pickle.dumps(cage))
    assert copy == cage and hash(copy) == hash(cage)
    # JSON may round the last digit of the time.
    assert {**copy.report, "elapsed_ms": 0} == {**cage.report, "elapsed_ms": 0} and copy.rings == cage.rings
    assert copy != cw.Cage(2 * cage.vertices, cage.faces)
    first, second = (cw.bind(model.vertices, c, grid=12)[0] for c in (cage, copy))
    assert first.data.tobytes() == second.data.tobytes()


def test_check_finds_the_open_edges_that_trimesh_finds(model):
    # Removing two adjacent triangles opens four edges.
    neighbours = model.face_adjacency[0]
    opened = trimesh.Trimesh(model.vertices, np.delete(model.faces, neighbours, axis=0), process=False)
    found = {problem["code"]: problem for problem in cw.check_cage(opened)}
    assert found["open_edge"]["count"] == 4 and found["open_edge"]["severity"] == "error"
    shared = set(map(tuple, np.sort(opened.edges, axis=1)[trimesh.grouping.group_rows(opened.edges_sorted, 1)]))
    assert {tuple(sorted(edge)) for edge in found["open_edge"]["places"]["edges"]} == shared


def test_check_lists_points_outside():
    cube = cw.Cage(*box())
    points = np.array([[0.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
    found = {problem["code"]: problem for problem in cw.check_cage(cube, points)}
    assert found["model_outside"]["places"]["vertices"] == [1]
