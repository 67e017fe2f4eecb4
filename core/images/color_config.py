"""Processors of OpenColorIO, the library of Blender's color management. The package works without it for sRGB."""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
SCENE_LINEAR = "scene_linear"
CURE = ("install it (pip install opencolorio; for Blender of Debian or Ubuntu: apt install python3-pyopencolorio), or "
        "use a picture that was saved as EXR or with the view Standard")


def processor(config: str | None, display: str, view: str, look: str, exposure: float, gamma: float,
              inverse: bool = False) -> Callable[[F64], F64] | None:  # fmt: skip
    """Return the function of (n, 3) colours that Blender applies for these settings, or its inverse.

    None: the view has no inverse in the configuration.

    Raises
    ------
    ValueError
        If the configuration has no such view, look or display.
    ImportError
        If OpenColorIO is not installed.
    """
    ocio = _library(view)
    known = _open(config)
    _check(f"view transform '{view}'", "display", display, known.getDisplays())
    _check(f"display '{display}'", "view transform", view, known.getViews(display))
    steps: list[Any] = [_scale(ocio, 2.0**exposure)]
    if look != "None":
        _check(f"view transform '{view}'", "look", look, [one.getName() for one in known.getLooks()])
        steps.append(ocio.LookTransform(src=SCENE_LINEAR, dst=SCENE_LINEAR, looks=look))
    steps.append(ocio.DisplayViewTransform(src=SCENE_LINEAR, display=display, view=view, looksBypass=True))
    if gamma != 1.0:
        steps.append(ocio.ExponentTransform(value=[1.0 / gamma] * 3 + [1.0]))
    direction = ocio.TRANSFORM_DIR_INVERSE if inverse else ocio.TRANSFORM_DIR_FORWARD
    try:
        found = known.getProcessor(ocio.GroupTransform(steps), direction).getDefaultCPUProcessor()
    except ocio.Exception as error:
        if inverse:
            return None
        raise ValueError(f"view transform '{view}': OpenColorIO can't compute it ({error})") from None

    def apply(colors: F64) -> F64:
        out = np.array(colors, np.float32, order="C")
        if len(out):  # OpenColorIO refuses an empty list
            found.applyRGB(out)
        return out.astype(np.float64)

    return apply


def _library(view: str) -> Any:
    try:
        return importlib.import_module("PyOpenColorIO")
    except ImportError:
        raise ImportError(f"view transform '{view}': needs OpenColorIO, which is not installed; {CURE}") from None


@cache
def _opened(path: str, changed: float) -> Any:
    ocio = importlib.import_module("PyOpenColorIO")
    try:
        return ocio.Config.CreateFromFile(path)
    except ocio.Exception as error:
        raise ValueError(f"color configuration '{path}': can't be read ({error})") from None


def _open(config: str | None) -> Any:
    path = config or os.environ.get("OCIO", "")
    if not path:
        raise ValueError("view transform: no OpenColorIO configuration is given; set ViewTransform.config to Blender's "
                         "datafiles/colormanagement/config.ocio")
    try:
        return _opened(path, os.stat(path).st_mtime)  # noqa: PTH116
    except OSError as error:
        raise ValueError(f"color configuration '{path}': can't be read ({error.strerror})") from None


def _scale(ocio: Any, factor: float) -> Any:
    return ocio.MatrixTransform(matrix=np.diag([factor, factor, factor, 1.0]).ravel().tolist())


def _check(where: str, field: str, name: str, known: Sequence[str]) -> None:
    names = list(known)
    if name not in names:
        raise ValueError(f"{where}: there is no {field} '{name}' in the color configuration (known: "
                         f"{', '.join(names)})")  # fmt: skip
