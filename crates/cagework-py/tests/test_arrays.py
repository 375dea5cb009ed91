import subprocess
import sys
import tracemalloc

import cagework as cw
import numpy as np
import pytest
import scipy.sparse
from support import box

CUBE = cw.Cage(*box())
POINTS = np.zeros((5, 3))
N_POINTS = 200_000


def test_whole_numbers_are_converted():
    points = np.array([[1, 0, 0], [0, -1, 2]], "i4")
    np.testing.assert_array_equal(
        cw.Field(CUBE, 2 * CUBE.vertices, cells=8).map(points), cw.Field(CUBE, 2 * CUBE.vertices, cells=8).map(points * 1.0)
    )


@pytest.mark.parametrize(
    ("call", "actual", "expected"),
    [
        (lambda: cw.bind(np.zeros((5, 2)), CUBE), "float64 of shape [5, 2]", "float32 or float64 of shape [n, 3]"),
        (lambda: cw.bind(np.zeros(3, "f4"), CUBE), "float32 of shape [3]", "float32 or float64 of shape [n, 3]"),
        (lambda: cw.bind(np.zeros((5, 3), bool), CUBE), "bool of shape [5, 3]", "float32 or float64 of shape [n, 3]"),
        (lambda: cw.bind([["a", "b", "c"]], CUBE), "<U1 of shape [1, 3]", "float32 or float64 of shape [n, 3]"),
        (lambda: cw.generate_cage(POINTS, POINTS), "float64 of shape [5, 3]", "integers of shape [n, 3]"),
        (lambda: cw.generate_cage(POINTS, [[0, 1, 2, 3]]), "int64 of shape [1, 4]", "integers of shape [n, 3]"),
        (lambda: cw.Cage(POINTS, np.zeros((2, 3))), "float64 of shape [2, 3]", "integers of shape"),
        (lambda: cw.Cage(POINTS, [[0.5, 1.0, 2.0]]), "float64 of shape [3]", "integers of shape [n]"),
        (lambda: cw.reshape(b"", CUBE, np.zeros((7, 3))), "float64 of shape [7, 3]", "float32 or float64 of shape [8, 3]"),
        (lambda: CUBE.save("x", np.zeros((7, 3))), "float64 of shape [7, 3]", "float32 or float64 of shape [8, 3]"),
        (lambda: cw.deform(np.eye(8), POINTS), "ndarray", "a sparse matrix or array of SciPy"),
        (lambda: cw.deform(scipy.sparse.eye_array(8, dtype=int), POINTS), "int64 of shape [8]", "float32 or float64"),
        (lambda: cw.deform(scipy.sparse.eye_array(8), POINTS), "float64 of shape [5, 3]", "float32 or float64 of shape [8, 3]"),
    ],
)
def test_wrong_types_and_shapes_are_reported_with_the_expected_ones(call, actual, expected):
    with pytest.raises(cw.ArrayError) as error:
        call()
    assert f"got {actual}" in str(error.value) and f"expected {expected}" in str(error.value)
    assert isinstance(error.value, cw.Error) and isinstance(error.value, ValueError)


NAN = np.where(np.arange(8)[:, None] == 3, np.nan, CUBE.vertices)
TRIANGLE = [[0, 1, 2]]


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: cw.Field(CUBE, NAN, cells=8), "posed"),
        (lambda: cw.Field(CUBE, CUBE.vertices, cells=8).pose(NAN), "posed"),
        (lambda: CUBE.save("nan.obj", NAN), "vertices"),
        (lambda: cw.pull(NAN / 2, TRIANGLE, CUBE, cw.bind(CUBE.vertices / 2, CUBE, grid=8)[0], [0], POINTS[:1]), "vertices"),
        (lambda: cw.pull(CUBE.vertices / 2, TRIANGLE, CUBE, scipy.sparse.eye_array(8), [0], POINTS[:1], start=NAN), "start"),
    ],
)
def test_rows_that_are_not_finite_are_named(call, name):
    with pytest.raises(cw.ArrayError, match=f"{name}: row 3 is .NaN, NaN, NaN.; coordinates must be finite"):
        call()


def test_masked_entries_are_refused():
    masked = np.ma.masked_array(POINTS, mask=np.arange(15).reshape(5, 3) == 7)
    for call in [
        lambda: cw.bind(masked, CUBE, grid=8),
        lambda: cw.generate_cage(POINTS, np.ma.masked_equal(TRIANGLE, 1)),
        lambda: cw.Cage(CUBE.vertices, np.ma.masked_equal(box()[1], 1)),
    ]:
        with pytest.raises(cw.ArrayError, match="(points|triangles|faces): entries are masked"):
            call()
    unmasked = np.ma.masked_array(POINTS)
    assert abs(cw.bind(unmasked, CUBE, grid=8)[0] - cw.bind(POINTS, CUBE, grid=8)[0]).max() == 0


def test_negative_indices_are_named():
    with pytest.raises(cw.ArrayError, match="index -1 is not between 0 and 4294967295"):
        cw.generate_cage(POINTS, [[0, 1, -1]])


def test_weights_do_not_depend_on_the_memory_layout():
    points = np.random.default_rng(1).uniform(-0.9, 0.9, (50, 3)).astype(np.float32)
    wide = np.zeros((50, 6), np.float32)
    wide[:, ::2] = points
    expected = cw.bind(points, CUBE, grid=8)[0].data.tobytes()
    for same in [points.astype(np.float64), np.asfortranarray(points), wide[:, ::2], points.astype(">f4"), points.tolist()]:
        assert cw.bind(same, CUBE, grid=8)[0].data.tobytes() == expected


def allocated(call):
    """Peak of the bytes that Python and NumPy allocate during a call, and its result."""
    tracemalloc.start()
    try:
        result = call()
        return tracemalloc.get_traced_memory()[1], result
    finally:
        tracemalloc.stop()


def test_points_and_weights_are_not_copied():
    points = np.random.default_rng(2).uniform(-0.9, 0.9, (N_POINTS, 3)).astype(np.float32)
    cw.bind(points[:10], CUBE, grid=8)  # The first call imports modules, which would count as allocations.
    peak_bytes, (weights, _) = allocated(lambda: cw.bind(points, CUBE, grid=16))
    assert weights.shape == (N_POINTS, 8) and peak_bytes < points.nbytes / 10
    # The index arrays of the weights are views of Rust's memory, not copies.
    assert all(not a.flags.owndata for a in (weights.indices, weights.indptr)) and weights.nnz == 8 * N_POINTS
    # Fortran order requires a copy, which this measurement must detect.
    assert allocated(lambda: cw.bind(np.asfortranarray(points), CUBE, grid=8))[0] > points.nbytes


def test_map_coordinates_keep_their_precision(tmp_path):
    """At map coordinates float32 has steps of 0.5. Results must equal those of the same model at the origin."""
    place = np.array([500_000.25, 0, 4_500_000.5])
    model, faces = box(4)
    model, near = 0.8 * model, cw.Cage(*box())
    far = cw.Cage(near.vertices + place, near.faces)
    assert np.abs(far.vertices - place - near.vertices).max() < 1e-9
    (weights, report), (expected, _) = cw.bind(model + place, far, grid=8), cw.bind(model, near, grid=8)
    assert report["rest_error"]["max"] < 1e-6 and abs(weights - expected).max() < 1e-6
    posed = cw.deform(weights, far.vertices + [0, 0.5, 0])
    assert posed.dtype == np.float64 and np.abs(posed - place - model - [0, 0.5, 0]).max() < 1e-6
    triangles = [[a, b, c] for f in faces for a, b, c in ((f[0], f[1], f[2]), (f[0], f[2], f[3]))]
    generated = cw.generate_cage(model + place, triangles)
    assert (np.abs(generated.vertices - place) < 1.5).all()
    assert not [p for p in cw.check_cage(generated, model + place) if p["severity"] == "error"]
    grabbed = cw.pull(model + place, triangles, far, weights, [0], [model[0] + place - [0.2, 0, 0]], grid=8)
    assert 0.1 < np.abs(grabbed - far.vertices).max() < 1

    far.save(tmp_path / "cage.obj")
    assert np.abs(cw.Cage.load(tmp_path / "cage.obj").vertices - far.vertices).max() < 1e-6
    lines = ["v %.6f %.6f %.6f" % tuple(p) for p in model + place] + ["f %d %d %d" % tuple(np.add(t, 1)) for t in triangles]
    file = "\n".join(lines).encode()
    assert cw.reshape(file, far, far.vertices, grid=8) == file
    moved, _ = cw.read_model(cw.reshape(file, far, far.vertices + [0, 0.5, 0], grid=8))
    assert moved.dtype == np.float64 and np.abs(moved - model - place - [0, 0.5, 0]).max() < 2e-6


def test_without_scipy_rows_multiply_and_deform():
    vertices, faces = (array.tolist() for array in box())
    script = f"""
import sys
sys.modules["scipy"] = sys.modules["scipy.sparse"] = None
import cagework as cw, numpy as np
cage = cw.Cage({vertices}, {faces})
points = np.random.default_rng(1).uniform(-0.9, 0.9, (50, 3))
weights, report = cw.bind(points, cage, grid=8)
assert type(weights).__module__ == "cagework._sparse"
for moved in [weights @ (cage.vertices * 2), cw.deform(weights, cage.vertices * 2, report)]:
    assert np.abs(moved - points * 2).max() < 1e-5
"""
    subprocess.run([sys.executable, "-c", script], check=True)
