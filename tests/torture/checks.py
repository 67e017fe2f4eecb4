"""What must hold for every scene: finite, not negative, the same bits, modes that agree, a plan that holds."""

from __future__ import annotations

import copy
import warnings
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad import Renderer, SunLight, plan
from edgegrad.expression import Bump, Coordinates, RayLength, nodes_of
from edgegrad.planning.term import NOT_COMPUTED
from edgegrad.scene import parameters
from tests.support.scenes.world_sizes import ORDERS, resized, resized_tangent
from tests.torture.drawing.additions import amount, any_negative
from tests.torture.scenes import Case

F64 = NDArray[np.float64]
THREADS = (1, 2, 5)
# Scenes whose last digits are changed, and the part of the change that the gap between the modes may be.
TRIALS, CHAOS = 4, 2.0
# A world of ordinary size becomes so many times as large.
LARGER = 2.0**10
# Tangents relative to the parameters.
STEP = 0.1
# Rounding of both modes relative to what they sum (chains of glass multiply it by a hundred), and to the picture where
# it cancels within samples. A part that one mode lacks is far larger.
SUMS, CANCELLED = 1e-4, 1e-5 * STEP
# Below this part of the picture, a derivative that is not 0 is rounding.
NOTHING = 1e-9
# The part of the brightest light that counts as one of the picture's values.
UNSEEN = 1e-3
# Errors for limits that the author of a scene cannot know in advance.
LIMITS = ("textures need more than",)


@dataclass
class Findings:
    """What is wrong with a scene, and what was measured of it.

    Attributes
    ----------
    wrong
        Name of a check to a sentence; empty: all hold.
    told
        Names of what a warning has told of, as samples that are left out since no float holds them; and "rounding
        decides" where both modes differ by no more than a change of the last digits makes.
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
    if least < 0.0 and not any_negative(case.scene):
        found.wrong["negative"] = f"a picture of {least:g}"
    _check_plan(case, renderer, tangent, found)
    if not unsound:
        _check_modes(case, first, tangent, adjoint, found)
        _check_size(case, first, tangent, found)


def directions(case: Case) -> tuple[dict[str, F64], NDArray[np.float32]]:
    """A tangent of the requested parameters, relative to their sizes, and an adjoint picture."""
    rng = np.random.default_rng(case.options["seed"])
    tangent = {path: STEP * _sizes(case, path) * rng.normal(size=_value(case, path).shape) for path in case.wrt}
    return tangent, rng.normal(size=(*case.scene.camera.size, 3)).astype(np.float32)


def _value(case: Case, path: str) -> F64:
    return np.asarray(parameters.get(case.scene, path), np.float64)


def _sizes(case: Case, path: str) -> F64:
    """About as much as a parameter's numbers may change: places by the scene's size, wherever it is."""
    value = _value(case, path)
    size = np.full(value.shape, np.abs(value).max(initial=0.0) or 1.0)
    if path.endswith((".vertices", ".position")):
        return np.full(value.shape, case.scale)
    if path.startswith("fields.") and path.endswith((".lower", ".upper")):
        one = case.scene.fields[parameters.split(path)[1]]
        return np.asarray(one.upper - one.lower)
    if path.endswith(".size"):  # of area lights, whose sides may differ by orders
        return value
    if ".textures." in path:  # numbers of different nodes
        return np.where(value == 0.0, 1.0, np.abs(value))
    if value.shape[-2:] == (4, 4):  # the turning part, the shift, and the row that isn't read
        size[..., :3, :3] = np.abs(value[..., :3, :3]).max()
        size[..., :3, 3], size[..., 3, :] = case.scale, 0.0
    return size


def _check_plan(case: Case, renderer: Renderer, tangent: dict[str, F64], found: Findings) -> None:
    """Whether terms that the plan calls zero are."""
    said = plan(case.scene, case.wrt, max_depth=case.options["max_depth"], bounces=case.options.get("bounces"))
    for term in said.terms:
        if term.computed or NOT_COMPUTED in term.why:
            continue
        alone = renderer.render_forward(tangent, **case.options, terms=(term.name,))
        if alone.any():
            found.wrong["plan"] = f"the {term.name} term isn't zero ({np.abs(alone).max():g}) as the plan says"


def _check_modes(case: Case, first: dict[str, Any], tangent: dict[str, F64], adjoint: NDArray[np.float32],
                 found: Findings) -> None:  # fmt: skip
    """Whether <J v, w> = <v, J^T w>, but for rounding.

    That is relative to the absolute values of what is summed. Sums within a sample are not to be seen from here: where
    they cancel, what remains is the rounding of the picture's own values, which the tangent changes by about `STEP`
    (slopes of a sky of one colour); or of light that reaches no pixel (what a diffuse closure scatters of a lamp that
    is visible to glossy rays alone is the whole less itself).
    """
    pushed = first["forward"].astype(np.float64) * adjoint
    pulled = np.concatenate([(first[path] * tangent[path]).ravel() for path in case.wrt])
    gap = abs(float(pushed.sum()) - float(pulled.sum()))
    size = float(np.abs(pushed).sum() + np.abs(pulled).sum())
    picture = float(np.abs(first["picture"].astype(np.float64) * adjoint).sum())
    unseen = UNSEEN * _brightness(case) * float(np.abs(adjoint).sum())
    found.numbers |= {"gap": gap / size if size > 0.0 else 0.0}
    if gap > SUMS * size + CANCELLED * (picture + unseen):
        if gap < CHAOS * _rounding(case, tangent, adjoint, float(pushed.sum())):
            found.told.append("rounding decides")
            return
        found.wrong["modes"] = (f"forward {pushed.sum():g}, reverse {pulled.sum():g}: parts of {size:g}, a picture of "
                                f"{picture:g}")  # fmt: skip


def _rounding(case: Case, tangent: dict[str, F64], adjoint: NDArray[np.float32], pushed: float) -> float:
    """How much the derivative changes if places and textures' numbers change by their last digit in float32.

    Noise textures at coordinates of 1e5, say, differ altogether in the next float. Then both modes, which round
    differently, give the derivatives of different textures.
    """
    scene, largest = copy.deepcopy(case.scene), 0.0
    paths = [path for path in parameters.paths(scene) if path.endswith(".vertices") or ".textures." in path]
    rng = np.random.default_rng(case.options["seed"])
    for _ in range(TRIALS):
        for path in paths:
            value = _value(case, path)
            change = rng.uniform(0.0, 2.0**-22, value.shape)
            zeros = (value == 0.0) & (".textures." in path)  # factors of zero, whose products other terms round
            parameters.put(scene, path, value * (1.0 - change) + zeros * change)
        try:
            picture = Renderer(scene, threads=2).render_forward(tangent, **case.options)
        except ValueError:  # the least value of a field
            return 0.0
        largest = max(largest, abs(float(np.sum(picture.astype(np.float64) * adjoint)) - pushed))
    return largest


def _brightness(case: Case) -> float:
    """About the largest radiance that something in the scene gives, or has by a light without size."""
    scene = case.scene
    found = [float(np.max(scene.world.color)) * scene.world.strength]
    if scene.world.image is not None:
        found[0] *= float(np.max(scene.images[scene.world.image].pixels))
    found += [float(leaf.emission.max()) for name in scene.materials for leaf in scene.closures(name)]
    for lamp in scene.lights.values():
        order = 0 if isinstance(lamp, SunLight) else ORDERS[lamp.decay]
        found.append(abs(amount(lamp)) / case.scale**order)
    return max(found)


def _check_size(case: Case, first: dict[str, Any], tangent: dict[str, F64], found: Findings) -> None:
    """Whether a world that is larger by a power of two has the same picture and derivative.

    Floats then differ by their exponents alone: what else differs is a length in metres in the code. Places and
    lengths of rays that textures read are such lengths, and so is the least size of the boxes that radial tangents
    are relative to. Where a derivative is far below the picture's rounding, its samples fall below the least
    numbers of a float, and a first pass that sees nothing else sends the second one elsewhere: that is left out. So
    does one that sees outlines of suns in mirrors, which move by angles, beside edges, which move by lengths.
    """
    textures = [value for material in case.scene.materials.values() for value in material.textures.values()]
    in_metres = any(isinstance(node, (Bump, Coordinates, RayLength)) for value in textures for node in nodes_of(value))
    if case.scale != 1.0 or in_metres or not (case.scene.meshes or case.scene.fields):
        return
    renderer = Renderer(resized(case.scene, LARGER), threads=2)
    larger = {path: resized_tangent(case.scene, path, value, LARGER) for path, value in tangent.items()}
    others = {"picture": renderer.render(**case.options), "forward": renderer.render_forward(larger, **case.options)}
    picture = float(np.abs(first["picture"].astype(np.float64)).sum())
    if any(isinstance(lamp, SunLight) and lamp.angle > 0.0 for lamp in case.scene.lights.values()):
        del others["forward"]
    for name, other in others.items():
        size = float(np.abs(first[name].astype(np.float64)).sum())
        gap = float(np.abs(first[name].astype(np.float64) - other).sum())
        if 0.0 < min(size, float(np.abs(other.astype(np.float64)).sum())) < NOTHING * picture:
            continue
        if gap > SUMS * size + CANCELLED * picture:
            found.wrong["size"] = f"{name} changes by {gap / size:.2g} in a world that is {LARGER:g} times as large"
