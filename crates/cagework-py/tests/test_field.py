import pickle

import cagework as cw
import numpy as np
import pytest
from support import bent, box, command

AFFINE_MATRIX = np.array([[1.5, 0.25, 0.0], [0.0, 0.75, -0.5], [0.1, 0.0, 1.0]])
SHIFT = np.array([0.3, 0.0, -0.2])


@pytest.fixture(scope="module")
def cage():
    return cw.Cage(*box(2))


@pytest.fixture(scope="module")
def points():
    return np.random.default_rng(3).uniform(-0.9, 0.9, (500, 3))


def test_affine_motions_are_exact(cage, points):
    field = cw.Field(cage, cage.vertices @ AFFINE_MATRIX.T + SHIFT, cells=24)
    assert np.allclose(field.map(points), points @ AFFINE_MATRIX.T + SHIFT, atol=1e-5)
    assert np.allclose(field.gradient(points), AFFINE_MATRIX, atol=1e-3)
    assert np.allclose(field.inverse(field.map(points)), points, atol=1e-5)
    # Far outside, nothing moves.
    far = np.full((1, 3), 50.0)
    assert (field.map(far) == far).all() and (field.gradient(far) == np.eye(3)).all()


def test_bent_points_agree_with_bound_points_and_are_mapped_back(cage, points):
    field = cw.Field(cage, cage.vertices).pose(bent(cage))
    weights, report = cw.bind(points, cage)
    exact = cw.deform(weights, bent(cage), report)
    assert np.abs(field.map(points) - exact).max() < 1e-3
    assert np.abs(field.inverse(field.map(points)) - points).max() < 1e-5
    assert (np.linalg.det(field.gradient(points)) > 0).all()


def test_other_arrays_are_accepted(cage, points):
    field = cw.Field(cage, cage.vertices + SHIFT, cells=16)
    moved = field.map(points.astype(np.float32))
    assert np.allclose(np.from_dlpack(moved), points + SHIFT, atol=1e-5)
    # Big-endian numbers, as meshio reads them from a VTK file.
    assert (field.map(points.astype(">f8")) == field.map(points)).all()
    for module in ("torch", "jax.numpy"):
        try:
            other = __import__(module, fromlist=["asarray"])
        except ImportError:
            continue
        assert np.allclose(field.map(other.asarray(points)), points + SHIFT, atol=1e-5)


def test_tetrahedra_keep_their_orientation(cage, tmp_path):
    # A grid of 6 x 6 x 6 cubes, each cut into six tetrahedra around a diagonal.
    n = 7
    nodes = np.stack(np.meshgrid(*[np.linspace(-0.9, 0.9, n)] * 3, indexing="ij"), -1).reshape(-1, 3)
    orders = [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)]
    steps = np.eye(3, dtype=int)
    first = np.stack(np.meshgrid(*[np.arange(n - 1)] * 3, indexing="ij"), -1).reshape(-1, 1, 3)
    paths = np.array([np.cumsum([np.zeros(3, int), *steps[list(order)]], axis=0) for order in orders])
    tetrahedra = (first[:, None] + paths[None]).reshape(-1, 4, 3) @ [n * n, n, 1]

    def volumes(at, tetrahedra):
        a, b, c, d = (at[tetrahedra[:, k]] for k in range(4))
        return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)

    field = cw.Field(cage, bent(cage))
    rest = volumes(nodes, tetrahedra)
    assert (np.sign(volumes(field.map(nodes), tetrahedra)) == np.sign(rest)).all()
    try:
        import meshio
    except ImportError:
        return
    # The same with a mesh from a VTK file, whose arrays meshio reads as big-endian numbers, written
    # to another file.
    meshio.Mesh(nodes, [("tetra", tetrahedra)]).write(tmp_path / "rest.vtk")
    mesh = meshio.read(tmp_path / "rest.vtk")
    mesh.points = field.map(mesh.points)
    mesh.write(tmp_path / "bent.vtk")
    moved = meshio.read(tmp_path / "bent.vtk")
    assert not np.allclose(moved.points, nodes, atol=0.1)
    assert (np.sign(volumes(moved.points, moved.cells_dict["tetra"])) == np.sign(rest)).all()


def test_saved_lattice_is_that_of_the_command(cage, tmp_path):
    cage.save(tmp_path / "cage.obj")
    cage.save(tmp_path / "pose.obj", bent(cage))
    command(tmp_path, "deform cage.obj --cage cage.obj --pose pose.obj --lattice command.npz --lattice-cells 12")
    cw.Field(cage, bent(cage), cells=12).save(tmp_path / "python.npz")
    own, other = np.load(tmp_path / "python.npz"), np.load(tmp_path / "command.npz")
    assert sorted(own) == sorted(other) == ["F", "bound", "origin", "spacing", "u"]
    for name in own:
        assert own[name].shape == other[name].shape and np.allclose(own[name], other[name], atol=1e-6), name


def test_wrong_input_is_refused(cage, points):
    with pytest.raises(cw.OptionError, match="cells is 4"):
        cw.Field(cage, cage.vertices, cells=4)
    with pytest.raises(cw.ArrayError, match="posed"):
        cw.Field(cage, cage.vertices[1:])
    with pytest.raises(cw.ArrayError, match="points"):
        cw.Field(cage, cage.vertices, cells=8).map(points[:, :2])


def test_fields_are_compared_and_pickled(cage, points):
    field = cw.Field(cage, bent(cage), cells=8, grid=12)
    copy = pickle.loads(pickle.dumps(field))
    assert copy == field and hash(copy) == hash(field) and (copy.map(points) == field.map(points)).all()
    for other in [field.pose(cage.vertices), cw.Field(cage, bent(cage), cells=9, grid=12), cw.Field(cage, bent(cage), cells=8, grid=13)]:
        assert other != field
