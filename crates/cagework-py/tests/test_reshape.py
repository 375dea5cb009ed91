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
        ({"ground": True}, "--ground"),
        ({"feet": "lock"}, "--feet lock"),
    ],
)
def test_rigged_model_is_identical_to_that_of_the_command(rigged, options, line):
    folder, cage = rigged
    command(folder, "bind model.glb --cage cage.obj -g 20 --weights w.npz")
    command(folder, f"deform model.glb --cage cage.obj --weights w.npz --pose pose.obj {line} -o out.glb")
    posed, _ = cw.read_model(folder / "pose.obj")
    data = cw.reshape(folder / "model.glb", cage, posed, grid=20, **options)
    assert data == (folder / "out.glb").read_bytes() and data != rigged_glb()
    for same in [rigged_glb(), bytearray(rigged_glb()), memoryview(rigged_glb())]:
        assert data == cw.reshape(same, cage, posed, grid=20, **options)
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


def document_of(glb):
    (length,) = struct.unpack_from("<I", glb, 12)
    return json.loads(glb[20 : 20 + length])


def edited(glb, edit):
    """A GLB whose JSON a function has changed."""
    document = document_of(glb)
    edit(document)
    (length,) = struct.unpack_from("<I", glb, 12)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = glb[20 + length :]
    return struct.pack("<IIIII", 0x46546C67, 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({}, ""),
        ({"times": [0.5, 2.0], "interpolation": "cubic"}, "--times 0.5,2 --interpolation cubic"),
        ({"static": True}, "--static"),
    ],
)
def test_named_poses_are_identical_to_those_of_the_command(rigged, options, line):
    folder, cage = rigged
    cage.save(folder / "tall.obj", cage.vertices * [1.0, 1.0, 1.2])
    command(folder, "bind model.glb --cage cage.obj -g 20 --weights w.npz")
    named = "--pose pose.obj --name bent --pose tall.obj --name tall"
    command(folder, f"deform model.glb --cage cage.obj --weights w.npz {named} {line} -o poses.glb")
    poses = {name: cw.read_model(folder / file)[0] for name, file in [("bent", "pose.obj"), ("tall", "tall.obj")]}
    data = cw.reshape(folder / "model.glb", cage, poses, grid=20, **options)
    assert data == (folder / "poses.glb").read_bytes()
    assert document_of(data)["meshes"][0]["extras"]["targetNames"][-2:] == ["bent", "tall"]


def test_poses_become_expressions_of_a_vrm(rigged):
    _, cage = rigged
    vrm = {"specVersion": "1.0", "humanoid": {"humanBones": {"hips": {"node": 1}}}}
    glb = edited(rigged_glb(), lambda document: document.update(extensions={"VRMC_vrm": vrm}, extensionsUsed=["VRMC_vrm"]))
    data = cw.reshape(glb, cage, {"happy": bent(cage), "odd": bent(cage)}, expressions=True, grid=12)
    document = document_of(data)
    expressions = document["extensions"]["VRMC_vrm"]["expressions"]
    assert list(expressions["preset"]) == ["happy"] and list(expressions["custom"]) == ["odd"]
    assert len(document["animations"]) == 1
    with pytest.raises(cw.OptionError, match="no VRM data"):
        cw.reshape(rigged_glb(), cage, {"happy": bent(cage)}, expressions=True, grid=12)


def test_clips_and_clothes_follow_the_skeleton_of_a_body(rigged, tmp_path):
    folder, cage = rigged

    def without_mesh(document):
        for key in ("meshes", "skins", "materials"):
            del document[key]
        document["nodes"][0] = {}

    (folder / "clip.glb").write_bytes(edited(rigged_glb(), without_mesh))
    options = "--cage cage.obj --pose pose.obj -g 20 --skeleton model.glb -o out"
    command(folder, f"refit clip.glb {options}")
    posed, _ = cw.read_model(folder / "pose.obj")
    data = cw.reshape(folder / "clip.glb", cage, posed, skeleton=folder / "model.glb", grid=20)
    assert data == (folder / "out" / "clip.glb").read_bytes()
    assert document_of(data)["nodes"][2] != document_of(rigged_glb())["nodes"][2]
    with pytest.raises(cw.ModelError, match="no triangles"):
        cw.reshape(folder / "clip.glb", cage, posed, grid=20)
    with pytest.raises(cw.ModelError, match="has no skeleton"):
        cw.reshape(folder / "clip.glb", cage, posed, skeleton=folder / "cage.obj", grid=20)


def test_one_cage_encloses_several_models(rigged):
    path = rigged[0] / "model.glb"
    vertices, triangles = cw.read_model(path, states=True)
    both, faces = cw.read_model([path, rigged_glb(radius=0.4)], states=True)
    assert np.array_equal(both[: len(vertices)], vertices) and len(both) == 2 * len(vertices)
    assert np.array_equal(faces[len(triangles) :], triangles + len(vertices))
    with pytest.raises(cw.ModelError, match="list of models is empty"):
        cw.read_model([])


@pytest.mark.parametrize(
    ("posed", "options", "message"),
    [
        ("dict", {"ground": True}, "the option ground takes one pose"),
        ("dict", {"times": [1.0, 2.0]}, r"times: expected one number per pose \(1\), got 2"),
        ("dict", {"times": [-1.0]}, "the time of pose 1 is -1 s"),
        ("dict", {"skeleton": rigged_glb()}, "a shared skeleton takes one pose"),
        ("array", {"expressions": True}, "expressions: one pose gives the deformed model"),
        ("array", {"feet": "glue"}, "feet: .*free, lock"),
        ("array", {"static": True, "feet": "lock"}, "need a model with a skeleton"),
    ],
)
def test_options_that_do_not_fit_are_refused(rigged, posed, options, message):
    _, cage = rigged
    with pytest.raises(cw.OptionError, match=message):
        cw.reshape(rigged_glb(), cage, {"a": bent(cage)} if posed == "dict" else bent(cage), grid=12, **options)
