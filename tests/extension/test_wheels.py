"""The wheels of the extension: merged for several Pythons, and listed in the manifest. Nothing is built here."""

from __future__ import annotations

import hashlib
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from extension.build import ADDON, MANIFEST, with_wheels
from extension.compile_check import of_database
from extension.merge import WheelName, merge
from extension.wheels import check_served

SHARED = {"engine/__init__.py": b"from . import core\n", "engine.libs/big.so": bytes(range(256)) * 40}
METADATA = {"engine-1.0.dist-info/METADATA": b"Name: engine\nVersion: 1.0\n", "engine-1.0.dist-info/RECORD": b""}


def wheel(folder: Path, tags: str, files: dict[str, bytes]) -> Path:
    path = folder / f"engine-1.0-{tags}.whl"
    with zipfile.ZipFile(path, "w") as out:
        for name, content in (SHARED | METADATA | files).items():
            out.writestr(name, content)
    return path


def test_a_merged_wheel_serves_each_python(tmp_path: Path) -> None:
    platforms = "manylinux_2_27_x86_64.manylinux_2_28_x86_64"
    old = wheel(tmp_path, f"cp311-cp311-{platforms}", {"engine/core.cpython-311.so": b"1"})
    new = wheel(tmp_path, "cp312-abi3-manylinux_2_28_x86_64", {"engine/core.abi3.so": b"2", "bin/tool": b"3"})
    merged = merge([old, new], tmp_path)
    assert merged.name == "engine-1.0-cp311.cp312-abi3.cp311-manylinux_2_28_x86_64.whl"
    with zipfile.ZipFile(merged) as made:
        names = made.namelist()
        assert len(names) == len(set(names)) and "bin/tool" not in names
        assert {"engine/core.cpython-311.so", "engine/core.abi3.so", *SHARED} <= set(names)
        assert all(made.read(name) == content for name, content in SHARED.items())
        tags = [line for line in made.read("engine-1.0.dist-info/WHEEL").decode().splitlines() if "Tag" in line]
        assert len(tags) == 4 and "Tag: cp312-abi3-manylinux_2_28_x86_64" in tags
        record = dict(line.split(",", 1) for line in made.read("engine-1.0.dist-info/RECORD").decode().splitlines())
        assert set(record) == set(names)
        digest = hashlib.sha256(SHARED["engine.libs/big.so"]).digest()
        assert record["engine.libs/big.so"].startswith("sha256=") and record["engine.libs/big.so"].endswith(",10240")
        assert len(record["engine.libs/big.so"].split(",")[0]) == len("sha256=") + 43 and digest


def test_wheels_that_differ_in_a_file_are_refused(tmp_path: Path) -> None:
    one = wheel(tmp_path, "cp311-cp311-any", {})
    other = wheel(tmp_path, "cp313-cp313-any", {"engine/__init__.py": b"something else"})
    with pytest.raises(ValueError, match=r"cp313-any\.whl: its engine/__init__\.py is not that of engine-1\.0-cp311"):
        merge([one, other], tmp_path)


def test_wheels_of_several_packages_are_refused(tmp_path: Path) -> None:
    names = [tmp_path / "one-1.0-cp311-cp311-any.whl", tmp_path / "one-1.1-cp313-cp313-any.whl"]
    with pytest.raises(ValueError, match="wheels of several packages or versions: one-"):
        merge(names, tmp_path)


def test_wheels_without_a_common_platform_are_refused(tmp_path: Path) -> None:
    names = [tmp_path / "one-1.0-cp311-cp311-win_amd64.whl", tmp_path / "one-1.0-cp313-cp313-win_arm64.whl"]
    with pytest.raises(ValueError, match="without a common platform"):
        merge(names, tmp_path)


def test_a_name_that_is_no_wheels_is_refused() -> None:
    with pytest.raises(ValueError, match=r"one\.zip: not the name of a wheel"):
        WheelName.of(Path("one.zip"))


def test_each_python_needs_a_wheel_of_edgegrad() -> None:
    old, stable = Path("edgegrad-1-cp311-cp311-any.whl"), Path("edgegrad-1-cp312-abi3-any.whl")
    check_served([old, stable])
    with pytest.raises(RuntimeError, match=r"serves Python 3\.13: add --interpreter of Python 3\.12 or newer"):
        check_served([old])
    with pytest.raises(RuntimeError, match=r"serves Python 3\.11: add --interpreter of Python 3\.11$"):
        check_served([stable])


def test_the_manifest_lists_platform_and_wheels_before_its_tables() -> None:
    text = (ADDON / MANIFEST).read_text()
    found = tomllib.loads(with_wheels(text, "linux-x64", ["./wheels/a.whl"]))
    assert found["platforms"] == ["linux-x64"] and found["wheels"] == ["./wheels/a.whl"]
    assert found["permissions"] == tomllib.loads(text)["permissions"]
    with pytest.raises(ValueError, match="must not list wheels"):
        with_wheels('wheels = ["a.whl"]\n', "linux-x64", [])


def test_the_names_of_pythons_extension_modules_prefer_their_own_python() -> None:
    # A merged wheel relies on this order: the module of this very Python, then that of the stable ABI.
    from importlib.machinery import EXTENSION_SUFFIXES

    version = f"{sys.version_info.major}{sys.version_info.minor}"
    assert any(version in suffix for suffix in EXTENSION_SUFFIXES[:1])


def test_the_check_of_other_platforms_leaves_out_optimisation_and_sources_with_pythons_headers() -> None:
    entries = [{"file": f"/e/native/{name}.cpp", "directory": "/b",
                "command": "/usr/bin/ccache /b/c++ -DX=1 -O3 -fPIC "
                           f"-o CMakeFiles/{target}.dir/a.o -c /e/native/{name}.cpp"}
               for target, name in (("edgegrad_engine", "scene/bvh"), ("_native", "python/module"))]  # fmt: skip
    (linux,) = of_database(entries, "aarch64-linux-gnu.2.28")
    assert linux.source == "/e/native/scene/bvh.cpp" and linux.folder == "/b"
    assert linux.options == ("-DX=1", "-fPIC", "-c", "/e/native/scene/bvh.cpp")
    (windows,) = of_database(entries, "x86_64-windows-gnu")
    assert windows.options == ("-DX=1", "-c", "/e/native/scene/bvh.cpp")
