"""The add-on where its library cannot be loaded, its preferences, and that disabling it leaves no trace."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad_addon
from edgegrad.rendering import native_engine
from edgegrad_addon import load_failure, preferences, registration
from tests.support.scenes import blender_scenes as bs

BASES = ("Operator", "Panel", "UIList", "PropertyGroup", "AddonPreferences")


@pytest.fixture(autouse=True)
def _scene() -> None:
    bs.empty()


@pytest.fixture
def broken(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    def fail() -> str:
        raise ImportError("libm.so.6: version `GLIBC_2.99' not found (required by _native.so)")

    monkeypatch.setattr(native_engine, "embree_version", fail)
    edgegrad_addon.register()
    yield
    edgegrad_addon.unregister()


def registered() -> set[str]:
    """Names of everything that Blender's types hold which comes from the add-on."""
    found = {f"{base}: {cls.__name__}" for base in BASES for cls in getattr(bpy.types, base).__subclasses__()
             if cls.__module__.startswith("edgegrad_addon") and cls.is_registered}  # fmt: skip
    found |= {f"Scene.{name}" for name in dir(bpy.types.Scene) if "edgegrad" in name}
    found |= {f"bpy.ops.edgegrad.{name}" for name in dir(bpy.ops.edgegrad)}
    drawn = getattr(bpy.types.UI_MT_button_context_menu.draw, "_draw_funcs", [])
    return found | {f"menu: {one.__module__}" for one in drawn if one.__module__.startswith("edgegrad_addon")}


def test_disabling_leaves_no_trace() -> None:
    assert registered() == set()
    edgegrad_addon.register()
    assert {"Scene.edgegrad", "bpy.ops.edgegrad.fit", "bpy.ops.edgegrad.fit_as_field"} <= registered()
    edgegrad_addon.unregister()
    assert registered() == set()
    handlers = [one for name in dir(bpy.app.handlers) if isinstance(held := getattr(bpy.app.handlers, name), list)
                for one in held if one.__module__.startswith("edgegrad_addon")]  # fmt: skip
    assert not handlers


def test_a_library_that_does_not_load_is_named_in_the_panel(broken: None, capfd: Any) -> None:
    assert registered() == {"Panel: LoadFailurePanel"}
    said = load_failure.LoadFailurePanel.sentence
    assert "GLIBC_2.99' not found" in said and "install the extension's zip for this platform (" in said
    assert "Python 3." in said
    lines: list[str] = []

    class Column:
        def label(self, text: str, icon: str) -> None:
            lines.append(text)

    class Layout:
        def column(self, align: bool) -> Column:
            return Column()

    panel: Any = type("Shown", (), {"layout": Layout(), "sentence": said})()
    load_failure.LoadFailurePanel.draw(panel, None)
    assert " ".join(lines) == said and max(map(len, lines)) <= 60
    assert load_failure._refuse([]) == 1
    assert capfd.readouterr().err.endswith(f"edgegrad: error: can't be loaded: {said}\n")


def test_a_failure_leaves_no_trace_either(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(load_failure, "cause", lambda: "no engine")
    edgegrad_addon.register()
    assert registered() == {"Panel: LoadFailurePanel"}
    edgegrad_addon.unregister()
    assert registered() == set()


def test_the_number_of_threads_is_a_preference(monkeypatch: pytest.MonkeyPatch) -> None:
    assert preferences.threads() == 0  # not enabled
    addon = bpy.context.preferences.addons.new()
    addon.module = "edgegrad_addon"
    registration.register()
    try:
        addon.preferences.threads = 3
        assert preferences.threads() == 3
    finally:
        registration.unregister()
        bpy.context.preferences.addons.remove(addon)
