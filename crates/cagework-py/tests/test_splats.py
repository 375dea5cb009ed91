import pickle
import sys
from types import ModuleType, SimpleNamespace

import cagework as cw
import numpy as np
import pytest
from support import bent, box, command, splat_records

QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@pytest.fixture(scope="module")
def cage():
    return cw.Cage(*box(2))


@pytest.fixture
def capture(tmp_path):
    records = splat_records()
    (tmp_path / "a.splat").write_bytes(records.tobytes())
    return tmp_path / "a.splat", records


def test_arrays_are_those_of_the_file(capture):
    path, records = capture
    splats = cw.Splats(path)
    q = (records["q"].astype(float) - 128) / 128
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    assert len(splats) == 200 and splats.harmonics.shape == (200, 0, 3)
    assert (splats.positions == records["p"]).all() and (splats.scales == records["s"]).all()
    assert np.allclose(splats.rotations, q[:, [1, 2, 3, 0]], atol=1e-6)
    assert np.allclose(splats.colors, records["c"][:, :3] / 255) and np.allclose(splats.opacities, records["c"][:, 3] / 255)


def test_splats_turn_with_the_cage(capture, cage, tmp_path):
    splats = cw.Splats(capture[0])
    turned = splats.deformed(cw.Field(cage, cage.vertices @ QUARTER.T, cells=24))
    assert np.allclose(turned.positions, splats.positions @ QUARTER.T, atol=1e-5)
    assert np.allclose(turned.covariances, QUARTER @ splats.covariances @ QUARTER.T, atol=1e-7)
    turned.save(tmp_path / "b.ply")
    assert np.allclose(cw.Splats(tmp_path / "b.ply").covariances, turned.covariances, atol=1e-8)
    field = cw.Field(cage, bent(cage))
    moved = splats.deformed(field)
    gradients = field.gradient(splats.positions)
    expected = gradients @ splats.covariances @ gradients.transpose(0, 2, 1)
    assert np.allclose(moved.covariances, expected, atol=1e-7)
    assert splats.first_order_errors(field).max() < 0.1


def test_rest_pose_is_the_same_file_and_a_cage_encloses_the_shells(capture, cage, tmp_path):
    splats = cw.Splats(capture[0])
    splats.deformed(cw.Field(cage, cage.vertices, cells=16)).save(tmp_path / "b.splat")
    assert (tmp_path / "b.splat").read_bytes() == capture[0].read_bytes()
    vertices, triangles = splats.shells()
    assert len(triangles) % 8 == 0 and triangles.max() == len(vertices) - 1
    assert len(cw.generate_cage(vertices, triangles).vertices) >= 8


def test_reshape_writes_captures_and_clouds_as_the_command_does(capture, cage, tmp_path):
    points = capture[1]["p"].astype(float)
    header = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n" + "".join(f"property double {x}\n" for x in "xyz")
    lines = "\n".join(" ".join(map(repr, point.tolist())) for point in points)
    (tmp_path / "cloud.ply").write_text(f"{header}end_header\n{lines}\n")
    turned = cage.vertices @ QUARTER.T
    cage.save(tmp_path / "cage.obj")
    cage.save(tmp_path / "pose.obj", turned)
    for name in ["a.splat", "cloud.ply"]:
        data = cw.reshape(tmp_path / name, cage, turned)
        command(tmp_path, f"deform {name} --cage cage.obj --pose pose.obj -o out-{name}")
        assert data == (tmp_path / f"out-{name}").read_bytes(), name
    body = (tmp_path / "out-cloud.ply").read_text().split("end_header\n")[1]
    vertices = np.loadtxt(body.splitlines())
    assert np.allclose(vertices, points @ QUARTER.T, atol=1e-5)
    assert np.allclose(cw.Splats(tmp_path / "out-a.splat").positions, points @ QUARTER.T, atol=1e-5)
    with pytest.raises(cw.OptionError, match="takes one pose"):
        cw.reshape(tmp_path / "a.splat", cage, {"a": turned})


def test_wrong_files_are_refused(tmp_path):
    (tmp_path / "a.splat").write_bytes(bytes(33))
    with pytest.raises(cw.ModelError, match="not a multiple of the 32 bytes"):
        cw.Splats(tmp_path / "a.splat")
    cage = cw.Cage(*box(1))
    cage.save(tmp_path / "a.obj")
    with pytest.raises(cw.ModelError, match="no Gaussian splats"):
        cw.Splats(tmp_path / "a.obj")


def test_blender_script_makes_a_lattice_with_the_deformed_points(cage, tmp_path, monkeypatch):
    """Runs the script with a stand-in for bpy, which records what the script sets. Blender's x, y, z are x, -z, y of the model."""
    cage.save(tmp_path / "cage.obj")
    cage.save(tmp_path / "pose.obj", bent(cage))
    options = "--lattice-cells 12 --lattice lattice.py --lattice-format blender"
    command(tmp_path, f"deform cage.obj --cage cage.obj --pose pose.obj {options}")
    made = SimpleNamespace(data=SimpleNamespace(points=SimpleNamespace()), object=SimpleNamespace())
    made.data.points.foreach_set = lambda name, values: setattr(made, name, values)
    blender = ModuleType("bpy")
    blender.data = SimpleNamespace(
        lattices=SimpleNamespace(new=lambda name: made.data),
        objects=SimpleNamespace(new=lambda name, data: made.object),
    )
    blender.context = SimpleNamespace(collection=SimpleNamespace(objects=SimpleNamespace(link=lambda it: None)))
    monkeypatch.setitem(sys.modules, "bpy", blender)
    exec((tmp_path / "lattice.py").read_text(), {})
    n = np.array([made.data.points_u, made.data.points_v, made.data.points_w])
    # Points from -0.5 to 0.5 with x fastest, scaled and moved by the object.
    w, v, u = np.meshgrid(*[np.linspace(-0.5, 0.5, k) for k in n[::-1]], indexing="ij")
    local = np.stack([u, v, w], -1).reshape(-1, 3)
    rest, moved = (at * made.object.scale + made.object.location for at in (local, made.co_deform.reshape(-1, 3)))
    field = cw.Field(cage, bent(cage), cells=12)
    x, y, z = field.map(np.stack([rest[:, 0], rest[:, 2], -rest[:, 1]], -1)).T
    assert np.allclose(moved, np.stack([x, -z, y], -1), atol=1e-5)


def test_batches_of_poses_are_products(cage):
    """The examples of docs/python.md that pose many times at once, in NumPy and, if installed, in PyTorch and JAX."""
    points = np.random.default_rng(3).uniform(-0.9, 0.9, (50, 3))
    weights, _ = cw.bind(points, cage)
    poses = np.stack([cage.vertices, bent(cage), cage.vertices @ QUARTER.T])
    C = poses.transpose(1, 0, 2).reshape(len(cage.vertices), -1)
    batch = (weights @ C).reshape(-1, len(poses), 3)
    for k, pose in enumerate(poses):
        assert np.allclose(batch[:, k], weights @ pose, atol=1e-6)
    try:
        import torch
    except ImportError:
        pass
    else:
        W = torch.sparse_csr_tensor(weights.indptr, weights.indices, weights.data, weights.shape)
        other = (W @ torch.from_numpy(C).to(W.dtype)).reshape(-1, len(poses), 3)
        assert np.allclose(other.numpy(), batch, atol=1e-5)
    try:
        import jax
        from jax.experimental import sparse
    except ImportError:
        pass
    else:
        W = sparse.BCOO.from_scipy_sparse(weights)
        other = (W @ jax.numpy.asarray(C, W.dtype)).reshape(-1, len(poses), 3)
        assert np.allclose(other, batch, atol=1e-5)


def test_splats_are_compared_and_pickled(capture, cage, tmp_path):
    splats = cw.Splats(capture[0])
    bend = splats.deformed(cw.Field(cage, bent(cage), cells=16))
    assert bend != splats and splats == cw.Splats(capture[0])
    for one in (splats, bend):
        copy = pickle.loads(pickle.dumps(one))
        assert copy == one and hash(copy) == hash(one)
        one.save(tmp_path / "a.splat")
        copy.save(tmp_path / "b.splat")
        assert (tmp_path / "a.splat").read_bytes() == (tmp_path / "b.splat").read_bytes()
    with pytest.raises(cw.ModelError, match="damaged"):
        cw._native.restored_splats([])
