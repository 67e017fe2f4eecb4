"""Sentences that fit into the width of a panel."""

from __future__ import annotations

import functools
import re
import textwrap
from typing import Any

from ..problem import sentence as as_sentence

# Mean width of a character, and width of the margins and an icon of a panel; pixels at scale 1.
CHARACTER, MARGINS = 6.6, 52
FIXED_SPACE = "\N{NO-BREAK SPACE}"


def wrapped(context: Any, layout: Any, sentence: str, icon: str = "NONE") -> None:
    """Draw a sentence on as many lines as it needs."""
    scale = context.preferences.system.ui_scale
    width = max(16, int((context.region.width / scale - MARGINS) / CHARACTER))
    column = layout.column(align=True)
    column.scale_y = 0.8
    for k, line in enumerate(lines(sentence, width)):
        column.label(text=line, icon=icon if k == 0 or icon == "NONE" else "BLANK1")


@functools.lru_cache(maxsize=1024)
def lines(sentence: str, width: int) -> tuple[str, ...]:
    """Return the lines of a sentence, of as many characters at most, as Blender writes it.

    Numbers stay beside their units, and the numbers of a size together.
    """
    whole = re.sub(r"(?<=\d) (?=(s|min|h)\b|× \d)|(?<=×) (?=\d)", FIXED_SPACE, as_sentence(sentence))
    return tuple(line.replace(FIXED_SPACE, " ") for line in textwrap.wrap(whole, width))
