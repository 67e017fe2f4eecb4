"""Drawing of pictures in a 3D view."""

from __future__ import annotations

from typing import Any

import gpu
import numpy as np
from gpu_extras.presets import draw_texture_2d

from .view_thread import Shown


class Picture:
    """The picture of a view on the graphics card."""

    def __init__(self) -> None:
        self._shown: Shown | None = None
        self._texture: Any = None

    def draw(self, engine: Any, scene: Any, shown: Shown, width: int, height: int) -> None:
        """Draw a picture at its place in a region of this size, through the scene's view transform."""
        if shown is not self._shown:
            rows, columns, _ = shown.pixels.shape
            buffer = gpu.types.Buffer("FLOAT", rows * columns * 4, np.ascontiguousarray(shown.pixels).ravel())
            self._texture = gpu.types.GPUTexture((columns, rows), format="RGBA16F", data=buffer)
            self._shown = shown
        gpu.state.blend_set("ALPHA_PREMULT")
        engine.bind_display_space_shader(scene)
        left, bottom, wide, high = shown.request.seen.place
        draw_texture_2d(self._texture, (left * width, bottom * height), wide * width, high * height)
        engine.unbind_display_space_shader()
        gpu.state.blend_set("NONE")
