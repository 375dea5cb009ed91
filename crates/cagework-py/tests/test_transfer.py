import json
import struct

import cagework as cw
import pytest
import trimesh
from support import command, rigged_glb


@pytest.fixture(scope="module")
def dressing(tmp_path_factory):
    """A folder with a rigged capsule and a suit around it."""
    folder = tmp_path_factory.mktemp("dressing")
    (folder / "body.glb").write_bytes(rigged_glb())
    trimesh.creation.capsule(height=1.4, radius=0.31, count=[12, 12]).export(folder / "suit.obj")
    return folder


@pytest.mark.parametrize(("options", "line"), [({}, ""), ({"push_out": 0.02}, "--push-out 0.02")])
def test_clothes_and_report_are_identical_to_those_of_the_command(dressing, options, line):
    reported = json.loads(command(dressing, f"transfer body.glb suit.obj {line} -o out.glb --json"))
    data, report = cw.transfer(dressing / "body.glb", dressing / "suit.obj", **options)
    assert data == (dressing / "out.glb").read_bytes()
    assert report == {name: value for name, value in reported.items() if name != "output"}
    (length,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + length])
    assert len(document["skins"]) == 1
    assert document["meshes"][0]["extras"]["targetNames"] == [target["name"] for target in report["targets"]] == ["target 0"]


def test_errors_name_the_file(dressing):
    with pytest.raises(cw.ModelError, match="suit.obj has no skin"):
        cw.transfer(dressing / "suit.obj", dressing / "suit.obj")
    with pytest.raises(cw.ModelError, match="more than the limit of 1,000 bytes"):
        cw.transfer(dressing / "body.glb", dressing / "suit.obj", memory_limit=1000)
    with pytest.raises(cw.OptionError, match="push_out is -1; it must be a positive distance"):
        cw.transfer(dressing / "body.glb", dressing / "suit.obj", push_out=-1)
    with pytest.raises(FileNotFoundError, match="no.glb"):
        cw.transfer("no.glb", dressing / "suit.obj")
