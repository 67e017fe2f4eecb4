"""``python -m edgegrad`` and its progress bar, without Blender."""

from __future__ import annotations

import importlib.util
import io
import sys
from types import ModuleType

import pytest

from edgegrad import __main__ as command_line
from edgegrad.progress import ProgressBar


def test_info_names_engine_and_libraries(capsys: pytest.CaptureFixture[str]) -> None:
    assert command_line.main(["info"]) == 0
    out = capsys.readouterr().out
    for word in ("engine", "Embree", "threads", "numpy"):
        assert word in out
    assert command_line.main(["info", "--loud"]) == 2
    assert "--loud" in capsys.readouterr().err


def test_wrong_usage_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert command_line.main([]) == 2
    assert "usage" in capsys.readouterr().err
    assert command_line.main(["bake"]) == 2
    assert "no command 'bake'" in capsys.readouterr().err
    assert command_line.main(["--help"]) == 0
    assert "fit FILE.blend" in capsys.readouterr().out


def test_blender_commands_go_to_the_add_on(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[list[str]] = []

    def run(argv: list[str]) -> int:
        seen.append(argv)
        return 7

    package, module = ModuleType("edgegrad_addon"), ModuleType("edgegrad_addon.command_line")
    module.main = run  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "edgegrad_addon", package)
    monkeypatch.setitem(sys.modules, "edgegrad_addon.command_line", module)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: object())
    assert command_line.main(["fit", "a.blend", "--iterations", "3"]) == 7
    assert seen == [["fit", "a.blend", "--iterations", "3"]]


def test_missing_blender_is_told(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert command_line.main(["fit", "a.blend"]) == 1
    assert "pip install edgegrad[blender]" in capsys.readouterr().err


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_progress_bar_redraws_one_line_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("edgegrad.progress.REDRAW", 0.0)
    stream = Terminal()
    with ProgressBar("fit", stream) as bar:
        bar.update(0.5, "loss 0.1")
        bar.update(1.0)
    text = stream.getvalue()
    assert text.count("\n") == 1 and text.endswith("\n")
    assert "fit [############............]  50%" in text and "loss 0.1" in text and "100%" in text
    first, second = text.rstrip("\n").split("\r")[1:]
    assert len(second) >= len(first), "the longer line before must be covered"


def test_progress_in_a_log_is_few_lines() -> None:
    stream = io.StringIO()
    with ProgressBar("fit", stream) as bar:
        for k in range(1000):
            bar.update((k + 1) / 1000)
        for _ in range(5):
            bar.update(1.0)  # work that follows the last step
    assert stream.getvalue().count("\n") == 2 and "\r" not in stream.getvalue()


def test_closed_output_does_not_end_the_work() -> None:
    stream = io.StringIO()
    bar = ProgressBar("fit", stream)
    stream.close()
    bar.update(1.0)
    bar.update(1.0)
