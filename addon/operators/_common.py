"""Shared by the operators: messages and pictures in Blender."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from edgegrad import images
from edgegrad.images.code_values import write_codes

from ..problem import Problem, Report, sentence
from ..status import STATUS

# Errors that the user can correct. Any other exception is a defect of Edgegrad and shows its traceback.
EXPECTED = (Problem, ValueError, OSError, FloatingPointError, ImportError)


def say(operator: Any, kind: str, text: str) -> None:
    """Show a message of a kind, such as "INFO", in Blender's message area."""
    operator.report({kind}, sentence(text))


def tell(operator: Any, report: Report, notes: Sequence[str] = ()) -> None:
    """Show the warnings of an export, and notes on the derivatives, in Blender's message area and in the panel."""
    STATUS.say(report.lines, notes)
    for line in report.lines:
        say(operator, "WARNING", line)
    for note in notes:
        say(operator, "INFO", note)


def done(operator: Any, said: str, failed: bool = False) -> set[str]:
    """Report what the work has led to, there and in the panel; return the result of the operator."""
    STATUS.ended(said, failed=failed)
    say(operator, "WARNING" if failed else "INFO", STATUS.said)
    return {"FINISHED"}


def refuse(operator: Any, error: BaseException) -> set[str]:
    """Report an error; return the result of the operator."""
    say(operator, "ERROR", str(error))
    return {"CANCELLED"}


def failed(operator: Any, error: BaseException) -> set[str]:
    """Report an error that ends some work, there and in the panel; return the result of the operator."""
    STATUS.ended(str(error), failed=True)
    return refuse(operator, error)


def show(name: str, pixels: NDArray[Any], open_editor: bool = True) -> Any:
    """Show a linear picture (H, W, 3), row 0 on top, as an image in Blender; replace an image of the same name."""
    file = file_of(name, ".exr")
    images.write_image(file, pixels)
    return show_file(name, file, open_editor)


def show_codes(name: str, codes: NDArray[np.uint8], open_editor: bool = True) -> Any:
    """Show an sRGB picture (H, W, 3) of 8-bit codes, row 0 on top, as an image in Blender."""
    file = file_of(name, ".png")
    write_codes(file, codes)
    return show_file(name, file, open_editor)


def show_file(name: str, file: Path, open_editor: bool) -> Any:
    """Show a file in Blender's temporary folder as an image.

    Blender would ask at each save of the .blend whether to save an image whose pixels a script has set.
    """
    image = bpy.data.images.get(name)
    if image is not None and (image.source != "FILE" or bpy.path.abspath(image.filepath) != str(file)):
        bpy.data.images.remove(image)
        image = None
    if image is None:
        image = bpy.data.images.load(str(file))
        image.name = name
        image.alpha_mode = "NONE"
    else:
        image.reload()
    if open_editor:
        open_image(image)
    return image


def file_of(name: str, suffix: str) -> Path:
    """Return the file in Blender's temporary folder for an image."""
    return Path(bpy.app.tempdir) / f"{name}{suffix}"


def open_image(image: Any) -> None:
    """Show the image in an Image Editor; if there is none, open one as set in the preferences for renders."""
    if bpy.app.background:
        return
    editor = _image_editor()
    if editor is None:
        bpy.ops.render.view_show("INVOKE_DEFAULT")
        editor = _image_editor()
    if editor is not None:  # None if the preferences do not open an editor
        editor.spaces.active.image = image


def _image_editor() -> Any:
    areas = (area for window in bpy.context.window_manager.windows for area in window.screen.areas)
    return next((area for area in areas if area.type == "IMAGE_EDITOR"), None)
