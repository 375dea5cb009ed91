"""Builds the extension for one platform from a wheel of cagework: python build.py WHEEL OUT_FOLDER

The wheel serves Python 3.10 and newer, hence all versions of Blender from 4.2 on. Prints the path of the archive.
"""

import re
import sys
import zipfile
from pathlib import Path

PLATFORMS = {
    r"(manylinux|linux).*x86_64": ["linux-x64"],
    r"(manylinux|linux).*aarch64": ["linux-arm64"],
    r"macosx.*universal2": ["macos-arm64", "macos-x64"],
    r"macosx.*arm64": ["macos-arm64"],
    r"macosx.*x86_64": ["macos-x64"],
    r"win_amd64": ["windows-x64"],
    r"win_arm64": ["windows-arm64"],
}


def build(wheel, out):
    folder = Path(__file__).parent
    licences = read_licences(wheel)
    tag = wheel.stem.split("-")[-1]
    platforms = next((names for pattern, names in PLATFORMS.items() if re.search(pattern, tag)), None)
    if platforms is None:
        raise SystemExit(f"{wheel.name}: Blender has no platform {tag}")
    manifest = (folder / "blender_manifest.toml").read_text()
    added = f'platforms = {platforms}\nwheels = ["./wheels/{wheel.name}"]\n'.replace("'", '"')
    # Top-level keys come before the first table.
    manifest = manifest.replace("[permissions]", f"{added}\n[permissions]")
    version = re.search(r'^version = "(.+)"', manifest, re.M)[1]
    archive = out / f"cagework-{version}-{'-'.join(platforms)}.zip"
    out.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("blender_manifest.toml", manifest)
        for source in sorted(folder.glob("*.py")):
            if source != Path(__file__):
                file.write(source, source.name)
        file.write(wheel, f"wheels/{wheel.name}")
        for name, text in licences.items():
            file.writestr(name, text)
    return archive


def read_licences(wheel):
    """The licences of this repository, by name. A wheel that `cargo xtask wheel` has not built lacks those of dependencies."""
    with zipfile.ZipFile(wheel) as file:
        names = [name for name in file.namelist() if name.startswith("cagework/licences/")]
        if not names:
            raise SystemExit(f"{wheel.name} contains no licences: build it with `cargo xtask wheel`")
        return {Path(name).name: file.read(name) for name in names if Path(name).name.startswith("LICENSE-")}


if __name__ == "__main__":
    print(build(Path(sys.argv[1]), Path(sys.argv[2])))
