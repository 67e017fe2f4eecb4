"""Derivatives beside finite differences of the picture."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

import edgegrad
from edgegrad.fitting.preparation import copied
from edgegrad.scene import parameters as values

from ..animated.arrays import F64
from ..animated.data_path import Place
from ..animated.driver import Driver
from ..export import Export
from ..preferences import threads
from ..problem import Problem
from .derivative import Derivative, seen_by_first

# Pictures of each side, and derivatives, whose differences give the noise.
SEEDS = 6
BLOCK = 8
# Step of meshes, materials and lights, relative to their size.
STEP = 0.003
# What moves by more of a pixel leaves the blocks of pixels, so that the difference quotient of the picture is another
# one than the derivative. A relative change of a shape or a camera moves things by about that part of the picture.
PIXELS = 0.3
# Part of the derivative by which both may differ, besides three times their noise: the difference quotient of the
# picture has a finite step.
TOLERANCE = 0.03


@dataclass(frozen=True)
class Comparison:
    """Derivative by one number beside the finite difference of the picture, over blocks of pixels.

    Attributes
    ----------
    name, step
        The number, and the step of the finite difference.
    size
        Root of the summed squares of the blocks' finite differences.
    error, noise
        That of the blocks' differences, and what the noise lets expect, both relative to `size`.
    """

    name: str
    step: float
    size: float
    error: float
    noise: float

    @property
    def agrees(self) -> bool:
        """Whether both are equal within the noise."""
        return self.error <= 3.0 * self.noise + TOLERANCE

    def __str__(self) -> str:
        verdict = "agrees" if self.agrees else "DIFFERS"
        return f"{self.name}: {verdict}, difference {self.error:.1%}, noise {self.noise:.1%}, step {self.step:.3g}"


@dataclass
class Case:
    """A number, or a direction, whose derivative is compared; `compared` does not access Blender's data.

    Attributes
    ----------
    name, step
        The number, and the step of the finite difference.
    scenes
        The scene at the step to both sides.
    scene, tangent
        The scene, and the derivative of its values.
    limits
        Limits of the light paths.
    camera
        Name of the camera, for messages.
    """

    name: str
    step: float
    scenes: tuple[edgegrad.Scene, edgegrad.Scene]
    scene: edgegrad.Scene
    tangent: dict[str, Any]
    limits: dict[str, Any]
    camera: str


def cases(driver: Driver, named: Callable[[Place], str] = attrgetter("name")) -> Iterator[Case]:
    """Yield a case for each number of the driver's parameters, seen by its first camera; `named` gives its name."""
    start = {one.path: one.value for one in driver.variables}
    placement = driver.place(start)
    export = driver.export_at(start)
    for one in driver.parameters:
        for k, place in enumerate(one.places):
            step = one.steps[k]  # of the exported arrays, which change less than the picture
            h = step.size * (min(_most_change(export) / step.change, 1.0) if step.change > 0.0 else 1.0)
            sides = []
            for side in (h, -h):
                values = start[one.path].copy()
                values[k] += side
                sides.append(driver.export_at(start | {one.path: values}).scene)
            yield Case(named(place), h, (sides[0], sides[1]), export.scene,
                       seen_by_first(placement.columns[one.path][k], placement), _limits(export),
                       driver.cameras[0].name)  # fmt: skip


def case_of(derivative: Derivative, name: str, camera: str) -> Case:
    """Return the case of a derivative by names, along the direction of its tangent."""
    export, sides = derivative.export, []
    size = max(float(np.max(np.abs(value))) for value in derivative.tangent.values())
    scale = max(_scale(export.scene, path) for path in derivative.tangent)
    h = min(STEP, _most_change(export)) * scale / size
    for side in (h, -h):
        moved = copied(export.scene)
        for path, tangent in derivative.tangent.items():
            values.put(moved, path, np.asarray(values.get(moved, path)) + side * tangent)
        sides.append(moved)
    return Case(name, h, (sides[0], sides[1]), export.scene, derivative.tangent,
                _limits(export), camera)  # fmt: skip


def compare(driver: Driver, samples: int, seed: int = 0) -> Iterator[Comparison]:
    """Yield a comparison for each number of the driver's parameters, seen by its first camera."""
    for case in cases(driver):
        yield compared(case, samples, seed)


def compared(case: Case, samples: int, seed: int = 0, progress: Callable[[float], None] | None = None) -> Comparison:
    """Render the pictures of a case and compare them."""
    done = 0

    def part(fraction: float) -> None:
        if progress is not None:
            progress((done + fraction) / (3 * SEEDS))

    def pictures(render: Callable[[int], Any]) -> F64:
        nonlocal done
        out = []
        for n in range(SEEDS):
            out.append(render(seed + n))
            done += 1
        return _blocks(out)

    sides = []
    for scene in case.scenes:
        moved = edgegrad.Renderer(scene, threads=threads())
        sides.append(pictures(lambda at, moved=moved: moved.render(  # type: ignore[misc]
            spp=4 * samples, seed=at, **case.limits, progress=part)))  # fmt: skip
    taken = (sides[0] - sides[1]) / (2.0 * case.step)
    found = np.zeros_like(taken)
    if case.tangent:
        renderer = edgegrad.Renderer(case.scene, threads=threads())
        found = pictures(lambda at: renderer.render_forward(
            case.tangent, spp=samples, seed=at, **case.limits, progress=part))  # fmt: skip
    size = float(np.linalg.norm(taken.mean(axis=0)))
    if not size > 0.0:
        raise Problem(f"property '{case.name}': camera '{case.camera}' sees nothing of it")
    variance = (taken.var(axis=0, ddof=1) + found.var(axis=0, ddof=1)).sum() / SEEDS
    error = float(np.linalg.norm(taken.mean(axis=0) - found.mean(axis=0)))
    return Comparison(case.name, case.step, size, error / size, float(np.sqrt(variance)) / size)


def _limits(export: Export) -> dict[str, Any]:
    return {"max_depth": export.settings.max_depth, "bounces": export.settings.bounces}


def _most_change(export: Export) -> float:
    """Relative change of values that moves things by `PIXELS`."""
    return PIXELS / max(export.scene.camera.size)


def _scale(scene: edgegrad.Scene, path: str) -> float:
    """Size of a parameter's values, of which `STEP` is a small part: the diagonal of a mesh, or the largest value."""
    value = np.asarray(values.get(scene, path))
    if path.endswith(".vertices"):
        return float(np.linalg.norm(np.ptp(value, axis=0)))
    return float(np.max(np.abs(value))) or 1.0


def _blocks(pictures: list[Any]) -> F64:
    """(n, ...) sums over blocks of pixels."""
    a = np.asarray(pictures, np.float64)
    rows, columns = np.arange(0, a.shape[1], BLOCK), np.arange(0, a.shape[2], BLOCK)
    return np.asarray(np.add.reduceat(np.add.reduceat(a, rows, axis=1), columns, axis=2))
