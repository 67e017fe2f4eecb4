"""Qualities of a fit: each sets iterations, samples and pictures per iteration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .running.fit_job import duration


@dataclass(frozen=True)
class Quality:
    """Settings of a fit, with a name.

    Attributes
    ----------
    label, use
        Name, and what it is good for.
    iterations, samples, views
        Steps, samples per pixel of each, and pictures that each renders (0: all). Steps get shorter towards the last.
    """

    label: str
    use: str
    iterations: int
    samples: int
    views: int


CUSTOM = "CUSTOM"
QUALITIES = {
    "DRAFT": Quality("Draft", "To see whether a fit goes the right way: few noisy iterations of one picture", 60, 4, 1),
    "NORMAL": Quality("Normal", "For most fits", 200, 16, 0),
    "FINE": Quality("Fine", "For the last bit of precision: more iterations and samples", 400, 64, 0),
    CUSTOM: Quality("Custom", "The numbers in Details and in Advanced", 0, 0, 0),
}

# Blender asks for the number several times while it draws the panel.
_NUMBERS = {(one.iterations, one.samples, one.views): k for k, one in enumerate(QUALITIES.values())}
_CUSTOM_NUMBER = list(QUALITIES).index(CUSTOM)


def get(settings: Any) -> int:
    """Return the number of the quality whose values the settings have."""
    return _NUMBERS.get((settings.iterations, settings.samples, settings.views_per_iteration), _CUSTOM_NUMBER)


def put(settings: Any, number: int) -> None:
    """Set the values of a quality; those of `CUSTOM` are the present ones."""
    name = list(QUALITIES)[number]
    if name != CUSTOM:
        one = QUALITIES[name]
        settings.iterations, settings.samples, settings.views_per_iteration = one.iterations, one.samples, one.views


def time_to_go(settings: Any, cost: float) -> str:
    """Return the time of a fit in words, from the cost of a sample per pixel of a picture; empty if it is not known."""
    pictures = min(settings.views_per_iteration or len(settings.targets), len(settings.targets))
    if not (cost > 0.0 and pictures):
        return ""
    return f"about {duration(cost * settings.iterations * settings.samples * pictures)}"
