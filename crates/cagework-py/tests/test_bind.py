import json

import cagework as cw
import numpy as np
import pytest
import scipy.sparse
from support import bent, box, command

# A few units in the last place of float32 for coordinates near 1.
TOLERANCE = 1e-6


def test_weights_are_identical_to_those_of_the_command(model, cage, tmp_path):
    model.export(tmp_path / "model.obj")
    cage.save(tmp_path / "cage.obj")
    for options, line in [
        ({}, ""),
        ({"grid": 20, "sparsify": 1e-3, "tau": 1e-4}, "-g 20 --sparsify 1e-3 --tau 1e-4"),
        ({"grid": 12, "method": "classic"}, "-g 12 --method classic"),
    ]:
        command(tmp_path, f"bind model.obj --cage cage.obj {line} --weights w.npz --report r.json")
        expected = scipy.sparse.load_npz(tmp_path / "w.npz")
        points, _ = cw.read_model(tmp_path / "model.obj")
        weights, report = cw.bind(points, cw.Cage.load(tmp_path / "cage.obj"), **options)
        assert isinstance(weights, scipy.sparse.csr_array) and weights.shape == expected.shape
        for part in ["indptr", "indices", "data"]:
            ours, theirs = getattr(weights, part), getattr(expected, part)
            assert ours.dtype == theirs.dtype and ours.tobytes() == theirs.tobytes(), part
        expected_report = json.loads((tmp_path / "r.json").read_text())
        for name in ["grid", "method", "solver", "tau", "iterations", "delta_history", "rest_error", "notices"]:
            assert report[name] == expected_report[name], name


def test_rows_sum_to_one_and_reproduce_the_rest_pose(model, cage, bound):
    weights, report = bound
    assert weights.shape == (len(model.vertices), len(cage.vertices)) and report["outside_vertices"] == 0
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=TOLERANCE)
    np.testing.assert_allclose(weights @ cage.vertices, model.vertices, atol=TOLERANCE)


def test_affine_map_of_the_cage_is_applied_to_the_model(model, cage, bound):
    # The weights commute with affine maps, because rows sum to 1 and reproduce the rest positions.
    turn = np.array([[0.5, -1.0, 0.2], [0.9, 0.4, 0.0], [0.0, 0.3, 1.5]])
    moved = bound[0] @ (cage.vertices @ turn.T + [3.0, -2.0, 1.0])
    np.testing.assert_allclose(moved, model.vertices @ turn.T + [3.0, -2.0, 1.0], atol=10 * TOLERANCE)


def test_deform_is_the_matrix_product_except_for_points_far_outside(cage, bound):
    weights, _ = bound
    posed = bent(cage)
    np.testing.assert_allclose(cw.deform(weights, posed), weights @ posed, atol=TOLERANCE)

    cube = cw.Cage(*box())
    # The cube's diagonal is 3.46. One point is inside; the others are at distances of 0.1, within 5 % of the diagonal,
    # and 1, beyond 15 %.
    weights, report = cw.bind(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.1], [0.0, 0.0, 2.0]]), cube, grid=8)
    assert report["outside_vertices"] == 2 and report["staying_vertices"] == 1
    assert report["outside"]["vertex"] == [1, 2] and report["outside"]["share"] == [1, 0]
    assert np.array_equal(cw.deform(weights, 2 * cube.vertices, json.loads(json.dumps(report))), cw.deform(weights, 2 * cube.vertices, report))
    moved = cube.vertices + [5.0, 0.0, 0.0]
    expected = [[5.0, 0.0, 0.0], [5.0, 0.0, 1.1], [0.0, 0.0, 2.0]]
    np.testing.assert_allclose(cw.deform(weights, moved, report), expected, atol=TOLERANCE)
    # The rows of points outside do not reproduce them; their offsets contain the difference.
    np.testing.assert_allclose(weights @ moved, expected * np.array([[1], [1], [0]]), atol=10 * TOLERANCE)


def test_pull_equals_the_command(model, cage, tmp_path):
    model.export(tmp_path / "model.obj")
    cage.save(tmp_path / "cage.obj")
    points, triangles = cw.read_model(tmp_path / "model.obj")
    cage = cw.Cage.load(tmp_path / "cage.obj")
    top, bottom = int(points[:, 2].argmax()), int(points[:, 2].argmin())
    to = points[top] + np.float32([0.3, 0.0, 0.1])
    job = {"grabs": [{"vertex": top, "to": to.tolist()}], "pins": [{"vertex": bottom}], "reach": "all"}
    (tmp_path / "job.json").write_text(json.dumps(job))
    command(tmp_path, "bind model.obj --cage cage.obj -g 24 --weights w.npz")
    command(tmp_path, "pull model.obj --cage cage.obj --weights w.npz -g 24 --job job.json -o posed.obj")
    weights, report = cw.bind(points, cage, grid=24)
    options = {"pins": [bottom], "report": report, "reach": float("inf"), "grid": 24}
    posed = cw.pull(points, triangles, cage, weights, [top], [to], **options)
    for same in (tmp_path / "model.obj", (points, triangles)):
        assert np.array_equal(cw.pull(same, None, cage, weights, [top], [to], **options), posed)
    assert np.array_equal(posed.astype(np.float32), cw.read_model(tmp_path / "posed.obj")[0])
    assert np.abs(weights @ posed - points)[bottom].max() < 0.01
    assert np.abs((weights @ posed)[top] - to).max() < 0.01


def test_puller_returns_the_poses_of_pull_and_its_drag_reaches_changing_targets(model, cage):
    weights, report = cw.bind(model.vertices, cage, grid=24)
    given, options = (model.vertices, model.faces, cage, weights), {"report": report, "grid": 24}
    puller, top = cw.Puller(*given, **options), int(model.vertices[:, 2].argmax())
    goals = [model.vertices[[top]] + offset for offset in ([0.3, 0.0, 0.1], [-0.2, 0.1, 0.0])]
    for goal in goals:
        assert np.array_equal(puller.pull([top], goal), cw.pull(*given, [top], goal, **options))
    drag = puller.drag([top], start=cage.vertices)
    for goal in [*goals, model.vertices[[top]]]:
        assert np.abs((weights @ drag.to(goal))[top] - goal).max() < 0.01
    with pytest.raises(cw.ArrayError, match=r"shape \[1, 3\]"):
        drag.to(model.vertices[:2])


def test_bind_many_equals_bind_without_further_solves(model, cage):
    models = [model.vertices, (model.vertices * 0.9).astype(np.float32)]
    results = cw.bind_many(models, cage, grid=24)
    for points, (weights, report) in zip(models, results):
        expected, expected_report = cw.bind(points, cage, grid=24)
        assert weights.data.tobytes() == expected.data.tobytes() and np.array_equal(weights.indices, expected.indices)
        assert report["rest_error"] == expected_report["rest_error"] and report["timings_ms"]["solve"] == 0.0
    assert cw.bind_many([], cage) == []


def test_smooth_cage_equals_the_command(model, tmp_path):
    cage = cw.generate_cage(model.vertices, model.faces, target=40, smooth=2)
    cage.save(tmp_path / "cage.obj")
    model.export(tmp_path / "model.obj")
    command(tmp_path, "bind model.obj --cage cage.obj --smooth 2 -g 16 --weights w.npz")
    points, _ = cw.read_model(tmp_path / "model.obj")
    weights, report = cw.bind(points, cw.Cage.load(tmp_path / "cage.obj", smooth=2), grid=16)
    assert report["smooth"] == 2
    assert weights.data.tobytes() == scipy.sparse.load_npz(tmp_path / "w.npz").data.tobytes()
