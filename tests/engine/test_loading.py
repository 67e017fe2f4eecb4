"""How the native module and Embree are loaded."""

from __future__ import annotations

import importlib.util
import pathlib
import re
import shutil
import subprocess
import sys
import warnings

import pytest

from edgegrad.rendering import engine as engines

native_engine = pytest.importorskip("edgegrad.rendering.native_engine", reason="the native module isn't built")


def test_a_missing_wheel_falls_back_with_one_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> None:
        raise ImportError("the package 'embreex', which brings the Embree library, is not installed")

    monkeypatch.setattr(native_engine, "embree_library", missing)
    monkeypatch.setattr(engines, "_warned_of_fallback", False)
    with pytest.raises(ImportError, match="embreex"):
        engines.engine_class("native")
    with pytest.warns(RuntimeWarning, match="using the reference engine"):
        assert engines.engine_class("auto").__module__.startswith("edgegrad.reference")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        engines.engine_class("auto")


def test_a_wrong_library_is_an_error() -> None:
    # In a process of its own: this one has Embree loaded already.
    code = (
        "from edgegrad import _native\n"
        "for path in ('/nowhere/libembree4.so', _native.__file__):\n"
        "    try:\n"
        "        _native.embree_version(path)\n"
        "    except RuntimeError as error:\n"
        "        print(error)\n"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert "can't load Embree from /nowhere/libembree4.so" in out
    assert "has no function rtcNewDevice" in out


@pytest.mark.skipif(sys.platform == "win32" or not shutil.which("cc"), reason="no C compiler here")
def test_another_embree_is_an_error(tmp_path: pathlib.Path) -> None:
    # A library that has all the functions, each of which returns 3; so does the one for its version.
    source = pathlib.Path(__file__).parents[2] / "native" / "embree" / "library.cpp"
    names = re.findall(r'resolve\(handle, "(\w+)"', source.read_text())
    stub, library = tmp_path / "stub.c", tmp_path / "libembree3.so"
    stub.write_text("".join(f"long {name}(void) {{ return 3; }}\n" for name in names))
    subprocess.run(["cc", "-shared", "-fPIC", "-o", str(library), str(stub)], check=True)
    code = f"from edgegrad import _native\n_native.embree_version({str(library)!r})\n"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "the embreex wheel has Embree 3.3.3, but version 4 is needed" in run.stderr


@pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="bpy is not installed")
@pytest.mark.parametrize("order", ["bpy, edgegrad", "edgegrad, bpy"])
def test_loads_beside_blender_in_any_order(order: str) -> None:
    code = (
        f"import {order.split(', ')[0]}\nimport {order.split(', ')[1]}\nimport numpy as np\n"
        "scene = edgegrad.Scene(edgegrad.Camera(np.eye(4), 0.7, 4, 4), world=edgegrad.World(np.ones(3)))\n"
        "print(edgegrad.render(scene, spp=1, engine='native').mean())\n"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert float(out.split()[-1]) == 1.0
