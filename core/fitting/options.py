"""The options of `edgegrad.fit`, checked before anything is rendered."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from .._check import choice, flag, function, instance, number, whole
from .._fields import Check, Checked, by, optional
from ..rendering.options import MOST_SAMPLES, MOST_THREADS, Progress, checked_bounces, checked_field_edges
from ..scene.bounces import Bounces
from .checkpoints.checkpoint_file import check_checkpoint
from .fields.schedule import FieldSteps
from .fit_step import ON_CANCEL, Callback
from .large_steps import MOST_SMOOTHNESS
from .losses import Loss


def _writable(where: str, name: str, path: Any) -> str | Path:
    check_checkpoint(path)
    return path


@dataclass
class FitOptions(Checked):
    """What a fit is told, besides its scene, targets, parameters and their own rules. `edgegrad.fit` explains each."""

    iterations: int
    spp: int
    gradient_spp: int
    max_depth: int
    bounces: Bounces | None
    loss: Loss
    smoothness: float | None
    slide: float | None
    field_steps: FieldSteps | None
    field_edges: str
    views_per_iteration: int | None
    seed: int
    threads: int
    on_cancel: str
    callback: Callback | None
    progress: Progress | None
    checkpoint: str | Path | None
    checkpoint_every: int
    resume: bool
    uncertainty: bool
    search: int | None
    restarts: int

    checks: ClassVar[Mapping[str, Check]] = {
        "iterations": by(whole, 1, 1_000_000),
        "spp": by(whole, 1, MOST_SAMPLES),
        "gradient_spp": by(whole, 1, MOST_SAMPLES),
        "bounces": lambda where, name, value: checked_bounces(where, value),
        "seed": by(whole, 0, 0xFFFFFFFF),
        "on_cancel": by(choice, ON_CANCEL),
        "uncertainty": flag,
        "threads": by(whole, 0, MOST_THREADS),
        "callback": optional(function),
        "progress": optional(function),
        "loss": function,
        "smoothness": optional(by(number, least=0.0, greatest=MOST_SMOOTHNESS)),
        "slide": optional(by(number, least=0.0, greatest=1.0)),
        "field_steps": optional(by(instance, FieldSteps)),
        "field_edges": lambda where, name, value: checked_field_edges(value),
        "search": optional(by(whole, 0, 1_000_000)),
        "restarts": by(whole, 0, 100),
        "resume": flag,
        "checkpoint": optional(_writable),
        "checkpoint_every": by(whole, 1, 1_000_000),
    }

    def check_for(self, pictures: int, most_depth: int, film: bool) -> None:
        """Check the options; their limits depend on the number of target pictures, the engine, and the kind of fit."""
        self.check_fields("fit")
        self.max_depth = whole("fit", "max_depth", self.max_depth, 1, most_depth)
        if self.views_per_iteration is not None:
            self.views_per_iteration = whole("fit", "views_per_iteration", self.views_per_iteration, 1, pictures)
        if film and (self.search or self.restarts):
            raise ValueError("fit: search and restarts are not for films; find the first frame's pose by a fit of its "
                             "own")  # fmt: skip
        if self.resume and self.checkpoint is None:
            raise ValueError("fit: resume needs a checkpoint; name its file")
