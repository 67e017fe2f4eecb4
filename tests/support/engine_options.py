"""Options of engines that `Renderer` has no argument for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from edgegrad.rendering.options import RenderOptions
from edgegrad.rendering.renderer import Renderer


def set_options(renderer: Renderer, **changes: Any) -> None:
    """Give all derivatives of a renderer other values of some fields of `RenderOptions`."""
    engine: Any = renderer._engine
    for mode in ("forward", "backward"):
        original = getattr(type(engine), mode)

        def changed(
            tables: Any, values: Any, wanted: Any, options: RenderOptions, original: Any = original, **others: Any
        ) -> Any:
            return original(engine, tables, values, wanted, replace(options, **changes), **others)

        setattr(engine, mode, changed)
