"""Checkpoints of a fit: what it needs to go on after its process has ended, with a result of the same bits."""

from __future__ import annotations

import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...rendering.renderer import Renderer
from ...scene import parameters
from ..run import Run
from .checkpoint_file import CheckpointError, read_tree, write_checkpoint
from .fingerprint import Fingerprint, difference
from .resumable import State


@dataclass(frozen=True)
class Checkpoint:
    """The contents of a checkpoint that matter to a reader.

    Attributes
    ----------
    iteration, iterations
        Number of iterations done, and their total number.
    losses
        Loss before each step so far.
    best
        Index into `losses` of the best values.
    values
        Maps a parameter path to the best value so far.
    """

    iteration: int
    iterations: int
    losses: list[float]
    best: int
    values: dict[str, Any]


def read_checkpoint(path: str | Path) -> Checkpoint:
    """Read the best values so far from a checkpoint of `edgegrad.fit`.

    Raises
    ------
    ValueError
        If the file is no checkpoint or is damaged; names it.
    OSError
        If there is no such file.
    """
    tree = read_tree(path)
    state = _part(path, tree, "state")
    try:
        values = {name: value if np.ndim(value) else float(value) for name, value in state["best_values"].items()}
        return Checkpoint(state["done"], tree["iterations"], state["losses"].tolist(), state["best"], values)
    except (KeyError, AttributeError, TypeError, ValueError):
        raise _damaged(path) from None


@dataclass
class Checkpoints:
    """The checkpoint file of one fit.

    Attributes
    ----------
    path, every
        The file, and after how many iterations it is replaced.
    fingerprint
        Of the scene and the targets.
    options
        The arguments of the fit, as text by name.
    kernels
        Instruction set of the engine: others round differently.
    notes
        Sentences on how the fit went on from the file.
    """

    path: Path
    every: int
    fingerprint: Fingerprint
    options: dict[str, str]
    kernels: str
    notes: list[str] = field(default_factory=list)
    _failed: bool = False

    def attach(self, run: Run, resume: bool) -> None:
        """Let a fit, which has just begun, write the file; with `resume`, let it go on from the file."""
        if resume:
            self._resume(run)
        run.checkpoint, run.checkpoint_every = lambda: self._save(run), self.every

    def _save(self, run: Run) -> None:
        """Replace the file; a failure is a warning, once, since the fit itself can go on."""
        tree = {"fingerprint": self.fingerprint, "options": self.options, "kernels": self.kernels,
                "iterations": run.iterations, "state": state_of(run)}  # fmt: skip
        try:
            write_checkpoint(self.path, tree)
            self._failed = False
        except OSError as error:
            if not self._failed:
                warnings.warn(f"fit: no checkpoint was written after iteration {run.done}: {error}", RuntimeWarning,
                              stacklevel=4)  # fmt: skip
            self._failed = True

    def _resume(self, run: Run) -> None:
        """Bring a fit, which has just begun, to the state in the file, if there is one.

        Raises
        ------
        CheckpointError
            If the file is damaged or belongs to another fit; names the first difference.
        """
        if not self.path.exists():
            self.notes.append(f"there was no checkpoint '{self.path}', so the fit began at its start")
            return
        tree = read_tree(self.path)
        for part, now in (("fingerprint", self.fingerprint), ("options", self.options)):
            stored = _part(self.path, tree, part)
            if part == "options":
                self._check_options(stored)
            elif (found := difference(stored, now)) is not None:
                raise CheckpointError(f"checkpoint '{self.path}': belongs to another scene: {found}; resume with the "
                                      "scene and the targets that the fit began with, or begin anew")  # fmt: skip
        if tree.get("kernels") != self.kernels:
            self.notes.append(f"the checkpoint '{self.path}' was written with the kernels {tree.get('kernels')}; those "
                              f"of this run ({self.kernels}) round differently")  # fmt: skip
        try:
            restore(run, _part(self.path, tree, "state"))
        except (KeyError, IndexError, TypeError, AttributeError, ValueError):
            raise _damaged(self.path) from None

    def _check_options(self, stored: Mapping[str, str]) -> None:
        for name, now in self.options.items():
            before = stored.get(name, "missing")
            if before != now:
                was, is_now = _apart(before, now)
                raise CheckpointError(f"checkpoint '{self.path}': belongs to a fit with other options: {name} was "
                                      f"{was} and is {is_now}; resume with equal options, or begin anew")  # fmt: skip


def state_of(run: Run) -> State:
    """Return all that the iterations so far have changed."""
    return {
        "done": run.done,
        "measured": run.measured,
        "seconds": time.monotonic() - run.started,
        "unknowns": {item.path: item.state() for item in run.unknowns},
        "values": {item.path: np.asarray(parameters.get(run.work, item.path)) for item in run.unknowns},
        **run.history.state(),
        "touched": run.touched,
        "first_gradient": run.first_gradient,
        "missing": run.missing if run.planned else None,
        "notes": run.notes,
        "learned": run.renderer.learned(),
        "silhouettes": {str(k): one.learned() for k, one in enumerate(_silhouettes(run))},
        "gains": np.array(run.gains.values),
        "steps": run.steps.state(),
        "keyed": None if run.keyed is None else run.keyed.steps.state(),
        "driven": None if run.driven is None else {
            "asked": run.asked[0],
            "views": None if run.asked[1] is None else np.array(run.asked[1]),
            "owner": run.driven.state(),
            "variables": {item.path: item.state() for item in run.driven.variables},
        },
    }  # fmt: skip


def restore(run: Run, state: State) -> None:
    """Take over what `state_of` has returned for a fit that began in the same way."""
    for renderer in (run.renderer, *_silhouettes(run)):
        renderer.find_edges()  # of the scene at the start, as in a fit without an interruption
    for item in run.unknowns:
        item.restore(state["unknowns"][item.path])
        parameters.put(run.work, item.path, state["values"][item.path])
    changed = [item.path for item in run.unknowns]
    run.steps.restore(state["steps"])
    if run.keyed is not None:
        run.keyed.steps.restore(state["keyed"])
    if run.driven is not None:
        run.driven.restore(state["driven"]["owner"])
        views = state["driven"]["views"]
        changed += run.place(state["driven"]["asked"], None if views is None else views.tolist())
        for variable in run.driven.variables:
            variable.restore(state["driven"]["variables"][variable.path])
    run.renderer.update(changed)
    run.renderer.restore_learned(state["learned"])
    if run.silhouettes is not None:
        run.silhouettes.update(changed)
    for k, renderer in enumerate(_silhouettes(run)):
        renderer.restore_learned(state["silhouettes"][str(k)])
    run.gains.values = list(state["gains"])
    run.history.restore(state)
    run.done, run.measured = state["done"], state["measured"]
    run.started -= state["seconds"]
    run.touched = {path: state["touched"][path] for path in run.touched}
    run.first_gradient = state["first_gradient"]
    run.notes = list(state.get("notes", ()))
    if state["missing"] is not None:
        run.missing = tuple(state["missing"])


def _silhouettes(run: Run) -> list[Renderer]:
    """The renderers of silhouettes, in the order of their targets."""
    return [] if run.silhouettes is None else list(run.silhouettes.renderers.values())


def _part(path: str | Path, tree: Mapping[str, Any], name: str) -> Any:
    found = tree.get(name)
    if not isinstance(found, dict):
        raise _damaged(path)
    return found


def _damaged(path: str | Path) -> CheckpointError:
    return CheckpointError(f"checkpoint '{path}': is damaged; remove it, or name another file")


def _apart(before: str, now: str) -> tuple[str, str]:
    """Return two different texts in short form, with the first place where they differ."""
    same = next((k for k, (a, b) in enumerate(zip(before, now, strict=False)) if a != b), min(len(before), len(now)))
    # From the beginning of the item on that differs
    start = 0 if same < 40 else max(before.rfind(", ", 0, same) + 2, same - 40, 0)
    was, is_now = (("..." if start else "") + text[start:] for text in (before, now))
    return _short(was), _short(is_now)


def _short(text: str) -> str:
    return text if len(text) <= 60 else f"{text[:57]}..."
