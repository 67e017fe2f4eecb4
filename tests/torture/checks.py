"""What must hold for every scene: finite, not negative, the same bits, modes that agree, a plan that holds."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad import Renderer, parameters, plan
from edgegrad.derivative_plan import NOT_COMPUTED
from tests.torture.scenes import Case

F64 = NDArray[np.float64]
THREADS = (1, 2, 5)
# What a scene may be refused for: limits that no scene's author can see in advance.
LIMITS = ("textures need more than",)


@dataclass
class Findings:
    """What is wrong with a scene, and what was measured of it.

    Attributes
    ----------
    wrong
        Name of a check to a sentence; empty: all hold.
    told
        Names of what a warning has told of, as samples that are left out since no float holds them.
    numbers
        Measured values by name, for the log.
    """

    wrong: dict[str, str] = field(default_factory=dict)
    told: list[str] = field(default_factory=list)
    numbers: dict[str, float] = field(default_factory=dict)


def examine(case: Case) -> Findings:
    """Do all checks of a scene."""
    found = Findings()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            _examine(case, found)
        except ValueError as error:
            if not any(limit in str(error) for limit in LIMITS):
                found.wrong["refused"] = str(error)
            else:
                found.told.append("limit")
        except Exception as error:  # any other exception is an error of the library
            found.wrong["exception"] = f"{type(error).__name__}: {error}"
    for warning in caught:
        text = str(warning.message)
        if "leaves out" in text:
            found.told.append("samples left out")
        elif "not finite" in text:
            found.told.append("not finite")
        else:
            found.wrong["warning"] = f"{warning.category.__name__}: {text}"
    found.told = sorted(set(found.told))
    return found


def _examine(case: Case, found: Findings) -> None:
    tangent, adjoint = directions(case)
    results: list[dict[str, NDArray[Any]]] = []
    for threads in THREADS:
        renderer = Renderer(case.scene, threads=threads)
        results.append({
            "picture": renderer.render(**case.options),
            "forward": renderer.render_forward(tangent, **case.options),
            **renderer.render_backward(adjoint, case.wrt, **case.options),
        })
    first = results[0]
    for threads, other in zip(THREADS[1:], results[1:], strict=True):
        differing = [name for name, value in first.items() if value.tobytes() != other[name].tobytes()]
        if differing:
            found.wrong["bits"] = f"{', '.join(differing)} differ between 1 and {threads} threads"
    unsound = [name for name, value in first.items() if not np.isfinite(value).all()]
    if unsound:
        found.wrong["finite"] = f"{', '.join(unsound)} not finite"
    least = float(np.nanmin(first["picture"]))
    if least < 0.0:
        found.wrong["negative"] = f"a picture of {least:g}"
    _check_plan(case, renderer, tangent, found)
    if not unsound:
        _check_modes(case, first, tangent, adjoint, found)


def directions(case: Case) -> tuple[dict[str, F64], NDArray[np.float32]]:
    """A tangent of the parameters that are asked for, relative to their sizes, and an adjoint picture."""
    rng = np.random.default_rng(case.options["seed"])
    tangent = {}
    for path in case.wrt:
        value = np.asarray(parameters.get(case.scene, path), np.float64)
        size = float(np.abs(value).max(initial=0.0)) or 1.0
        tangent[path] = 0.1 * size * rng.normal(size=value.shape)
    return tangent, rng.normal(size=(*case.scene.camera.size, 3)).astype(np.float32)


def _check_plan(case: Case, renderer: Renderer, tangent: dict[str, F64], found: Findings) -> None:
    """Whether terms that the plan calls zero are."""
    said = plan(case.scene, case.wrt, max_depth=case.options["max_depth"])
    for term in said.terms:
        if term.computed or NOT_COMPUTED in term.why:
            continue
        alone = renderer.render_forward(tangent, **case.options, terms=(term.name,))
        if alone.any():
            found.wrong["plan"] = f"the {term.name} term isn't zero ({np.abs(alone).max():g}) as the plan says"


def _check_modes(case: Case, first: dict[str, Any], tangent: dict[str, F64], adjoint: NDArray[np.float32],
                 found: Findings) -> None:  # fmt: skip
    """Whether <J v, w> = <v, J^T w>."""
    pushed = first["forward"].astype(np.float64) * adjoint
    pulled = np.concatenate([(first[path] * tangent[path]).ravel() for path in case.wrt])
    gap = abs(float(pushed.sum()) - float(pulled.sum()))
    size = float(np.abs(pushed).sum() + np.abs(pulled).sum())
    found.numbers["gap"] = gap / size if size > 0.0 else 0.0
    if gap > 1e-3 * size:
        found.wrong["modes"] = f"forward {pushed.sum():g}, reverse {pulled.sum():g}, of parts {size:g}"
