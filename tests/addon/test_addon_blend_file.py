"""A .blend is saved completely or not at all, and opened without running the Python code in it."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon import blend_file, command_line
from tests.support.scenes import blender_scenes as bs
from tests.support.scenes.disks import file_size_limit, fill, names, small_disk


@pytest.mark.parametrize("compress", [False, True])
def test_blend_is_whole_or_the_earlier_one(compress: bool, tmp_path: Path) -> None:
    """Blender itself reports success where a compressed file is cut off, and puts it in the earlier file's place."""
    bs.empty()
    path = tmp_path / "fitted.blend"
    bpy.context.preferences.filepaths.use_file_compression = compress
    bpy.context.preferences.filepaths.save_version = 0
    blend_file.save_blend(path)
    whole, size = path.read_bytes(), path.stat().st_size
    assert whole.startswith(b"BLENDER") is not compress
    for limit in (0, 1, size // 2, size - 1):
        with file_size_limit(limit), pytest.raises(OSError, match=r"fitted\.blend'.*can't be written.*MB are free"):
            blend_file.save_blend(path)
        assert names(tmp_path) == ["fitted.blend"] and path.read_bytes() == whole
    cut = tmp_path / "cut.blend"
    for length in {0, 1, 8, 20, 100, *range(0, size, 997), *range(size - 40, size)}:
        cut.write_bytes(whole[:length])
        assert not blend_file.is_complete(cut), length
    cut.write_bytes(whole[: size // 2] + whole[size // 2 + 7 :])
    assert blend_file.is_complete(cut) is not compress  # Blender reports what is missing of an uncompressed one


def test_earlier_versions_are_kept_as_blender_does(tmp_path: Path) -> None:
    bs.empty()
    bpy.context.preferences.filepaths.save_version = 2
    path = tmp_path / "fitted.blend"
    contents = []
    for number in range(4):
        bs.add(f"Object {number}", None)
        blend_file.save_blend(path)
        contents.append(path.read_bytes())
    assert names(tmp_path) == ["fitted.blend", "fitted.blend1", "fitted.blend2"]
    found = [(tmp_path / name).read_bytes() for name in names(tmp_path)]
    assert found == contents[:0:-1]


def test_versions_take_no_space_on_a_full_disk(tmp_path: Path) -> None:
    bs.empty()
    with small_disk(tmp_path / "disk", 4096) as disk:
        path = disk / "fitted.blend"
        blend_file.save_blend(path)
        size = path.stat().st_size
        fill(disk, leave=size + 16384)
        blend_file.save_blend(path)
        assert names(disk) == ["filler", "fitted.blend", "fitted.blend1"]
        with pytest.raises(OSError, match=r"fitted\.blend'"):
            blend_file.save_blend(path)
        assert names(disk) == ["filler", "fitted.blend", "fitted.blend1"] and blend_file.is_complete(path)


@pytest.fixture
def scripted(tmp_path: Path) -> Any:
    """A saved .blend with a driver and a registered text in Python, each of which leaves a trace; and the traces."""
    bs.empty(4)
    bs.camera(name="Front")
    bs.world((0.2, 0.2, 0.2))
    bs.add("Cube", bs.cube("Cube"))
    empty = bs.add("Empty", None)
    traces = {"driver": tmp_path / "driver ran", "text": tmp_path / "text ran"}
    text = bpy.data.texts.new("startup.py")
    text.write(f"open({str(traces['text'])!r}, 'w').close()")
    text.use_module = True
    plain, python = empty.driver_add("location", 0).driver, empty.driver_add("location", 1).driver
    plain.expression = "frame * 2"
    path = tmp_path / "scripted.blend"
    python.expression = f"open({str(traces['driver'])!r}, 'w').close() or 1.0"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bs.empty()
    yield path, traces
    bpy.ops.wm.read_factory_settings(use_empty=True)


def render(tmp_path: Path, *more: Any) -> int:
    return command_line.main(["render", *map(str, more), "--out", str(tmp_path / "a.png"), "--samples", "1"])


def test_python_in_a_blend_is_not_run_and_that_is_told(scripted: Any, tmp_path: Path, capsys: Any) -> None:
    path, traces = scripted
    # Even where the user lets Blender itself run it.
    bpy.context.preferences.filepaths.use_scripts_auto_execute = True
    assert render(tmp_path, path) == 0
    assert not any(trace.exists() for trace in traces.values())
    warnings = [line for line in capsys.readouterr().err.splitlines() if line.startswith("edgegrad: warning")]
    assert len(warnings) == 1 and "scripted.blend'" in warnings[0] and "Python in it was not run" in warnings[0]
    assert "--allow-scripts" in warnings[0]
    bs.empty()
    assert render(tmp_path, path, "--allow-scripts") == 0
    assert all(trace.exists() for trace in traces.values())
    assert "Python" not in capsys.readouterr().err


def test_registered_texts_alone_are_told_and_plain_expressions_are_not(scripted: Any, tmp_path: Path,
                                                                       capsys: Any) -> None:  # fmt: skip
    path, _ = scripted
    bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=False)
    bpy.data.objects["Empty"].driver_remove("location", 1)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bs.empty()
    assert render(tmp_path, path) == 0
    assert "(Text 'startup.py')" in capsys.readouterr().err
    bpy.data.texts.remove(bpy.data.texts["startup.py"])
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bs.empty()
    assert render(tmp_path, path) == 0
    assert "Python" not in capsys.readouterr().err


def test_a_file_that_blender_opened_follows_blenders_own_option(scripted: Any, tmp_path: Path, capsys: Any) -> None:
    path, traces = scripted
    bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=False)
    for more in ([], [path]):
        assert render(tmp_path, *more) == 0
        assert "--enable-autoexec" in capsys.readouterr().err
        assert render(tmp_path, *more, "--allow-scripts") == 1
        assert "edgegrad: error: " in (said := capsys.readouterr().err) and "--enable-autoexec" in said
    assert not any(trace.exists() for trace in traces.values())
    bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=True)
    assert render(tmp_path, "--allow-scripts") == 0 and all(trace.exists() for trace in traces.values())


def test_no_file_at_all_is_told(tmp_path: Path, capsys: Any) -> None:
    bs.empty(4)
    bs.camera()
    bs.world((0.2, 0.2, 0.2))
    bs.add("Cube", bs.cube("Cube"))
    assert render(tmp_path) == 0
    assert "edgegrad: warning: no .blend is given or open" in capsys.readouterr().err
