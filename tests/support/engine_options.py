"""Options of engines that `Renderer` has no argument for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from edgegrad.rendering.options import RenderOptions
from edgegrad.rendering.renderer import Renderer


def set_options(renderer: Renderer, **changes: Any) -> None:
    """Give all derivatives and decisions of a renderer other values of some fields of `RenderOptions`."""
    engine: Any = renderer._engine
    for name in ("forward", "backward", "decide"):
        original = getattr(type(engine), name)

        def changed(*given: Any, original: Any = original, **others: Any) -> Any:
            changed = (replace(a, **changes) if isinstance(a, RenderOptions) else a for a in given)
            return original(engine, *changed, **others)

        setattr(engine, name, changed)
