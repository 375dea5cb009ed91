import json
import struct

import cagework as cw
import numpy as np
import pytest
from support import bent, command, rigged_glb


@pytest.fixture(scope="module")
def rigged(tmp_path_factory):
    """A folder with a rigged model, its cage and a pose of the cage as files, and the cage as an object."""
    folder = tmp_path_factory.mktemp("rigged")
    (folder / "model.glb").write_bytes(rigged_glb())
    cage = cw.generate_cage(*cw.read_model(folder / "model.glb"), target=40, clearance=0.05)
    cage.save(folder / "cage.obj")
    cage.save(folder / "pose.obj", bent(cage))
    return folder, cw.Cage.load(folder / "cage.obj")


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({}, ""),
        ({"joints": "turn"}, "--joints turn"),
        ({"joints": "stay", "keep_travel": True}, "--joints stay --keep-travel"),
        ({"mask": {"skin": 0.5}, "rigid": ["arm"]}, "--mask skin=0.5 --rigid arm"),
    ],
)
def test_rigged_model_is_identical_to_that_of_the_command(rigged, options, line):
    folder, cage = rigged
    command(folder, "bind model.glb --cage cage.obj -g 20 --weights w.npz")
    command(folder, f"deform model.glb --cage cage.obj --weights w.npz --pose pose.obj {line} -o out.glb")
    posed, _ = cw.read_model(folder / "pose.obj")
    data = cw.reshape(folder / "model.glb", cage, posed, grid=20, **options)
    assert data == (folder / "out.glb").read_bytes() and data != rigged_glb()
    assert data == cw.reshape(rigged_glb(), cage, posed, grid=20, **options)
    (length,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + length])
    assert len(document["skins"]) == 1 and document["animations"][0]["name"] == "bend"
    assert len(document["meshes"][0]["primitives"][0]["targets"]) == 1


def test_static_and_obj_models_are_identical_to_those_of_the_command(rigged, model):
    folder, cage = rigged
    posed, _ = cw.read_model(folder / "pose.obj")
    command(folder, "bind model.glb --cage cage.obj -g 20 --static --weights s.npz")
    command(folder, "deform model.glb --cage cage.obj --weights s.npz --pose pose.obj --static -o static.glb")
    assert cw.reshape(folder / "model.glb", cage, posed, static=True, grid=20) == (folder / "static.glb").read_bytes()
    model.export(folder / "model.obj")
    command(folder, "bind model.obj --cage cage.obj -g 20 --weights o.npz")
    command(folder, "deform model.obj --cage cage.obj --weights o.npz --pose pose.obj -o out.obj")
    assert cw.reshape(folder / "model.obj", cage, posed, grid=20) == (folder / "out.obj").read_bytes()


def test_rest_pose_leaves_the_file_unchanged(rigged):
    folder, cage = rigged
    assert cw.reshape(folder / "model.glb", cage, cage.vertices, grid=12) == rigged_glb()


def test_states_append_vertices_of_morph_targets_and_clip_frames(rigged):
    path = rigged[0] / "model.glb"
    vertices, triangles = cw.read_model(path)
    n = len(vertices)
    states, same = cw.read_model(path, states=True)
    moving, more = cw.read_model(path, states=True, clip="bend")
    assert np.array_equal(states[:n], vertices) and np.array_equal(same, triangles)
    assert np.array_equal(moving[: len(states)], states) and len(more) > len(triangles)
    # The target widens the capsule by a fifth, and the clip rotates its upper half by 90 degrees.
    width = np.abs(vertices[:, 0]).max()
    assert np.abs(states[:, 0]).max() == pytest.approx(1.2 * width, rel=1e-4)
    assert np.abs(moving[:, 1]).max() > 1.5 * width
    with pytest.raises(cw.ModelError, match="no clip"):
        cw.read_model(path, states=True, clip="run")


def test_gltf_buffers_are_read_from_the_models_folder_only(rigged, tmp_path):
    _, cage = rigged
    glb = rigged_glb()
    (length,) = struct.unpack_from("<I", glb, 12)
    document = json.loads(glb[20 : 20 + length])
    inside = tmp_path / "models"
    inside.mkdir()
    for uri, place in [("data.bin", inside), ("../data.bin", tmp_path)]:
        document["buffers"][0]["uri"] = uri
        (place / "data.bin").write_bytes(glb[28 + length :])
        (inside / "model.gltf").write_text(json.dumps(document))
        if place == inside:
            data = cw.reshape(inside / "model.gltf", cage, bent(cage), grid=12)
            assert np.array_equal(cw.read_model(data)[0], cw.read_model(cw.reshape(glb, cage, bent(cage), grid=12))[0])
        else:
            with pytest.raises(cw.ModelError, match="leads out of the model's folder"):
                cw.read_model(inside / "model.gltf")
