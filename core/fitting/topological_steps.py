"""Topological steps of a fit: holes are opened and parts are added where the pictures ask for it.

Every few turns through the pictures, `field_proposals` proposes another field. The scene with this field is rendered
from all views. The proposal is taken over only if the loss falls, in two renders with independent random numbers that
are the same before and after.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ..rendering.renderer import Renderer
from ..scene import parameters
from ..scene.field import Field
from ..scene.scene import Scene
from .field_proposals import Evidence, added, carved, evidence
from .field_variables import Coefficients
from .losses import Loss
from .targets import View

F64 = NDArray[np.float64]
Pictures = list[list[NDArray[np.float32]]]  # two of each view
# Render a view with one of the two sets of random numbers.
Render = Callable[[int, int], NDArray[np.float32]]

# A proposal must lower the loss by at least this part of it.
LEAST_FALL = 0.01
# Part of a fit after which the topology stays, so that the last steps of the surface can settle.
LAST_PART = 0.75


def is_due(options_every: int, k: int, full_turn: int, iterations: int) -> bool:
    """Whether a topological step follows the iteration k, counted from 0."""
    every = options_every * full_turn
    return bool(every and (k + 1) % every == 0 and k + 1 <= LAST_PART * iterations)


def take_step(
    item: Coefficients, scene: Scene, renderer: Renderer, views: Sequence[View], loss: Loss, render: Render
) -> bool:
    """Propose other fields for one variable, and keep the first that lowers the loss; return whether there is one.

    The scene and the renderer have the kept field afterwards.
    """
    field: Field = parameters.owner(scene, item.path)[0]
    if "camera" not in field.visible_to:
        return False
    now = _pictures(views, render)
    losses = _losses(views, loss, now)
    kinds = field.visible_to
    try:
        field.visible_to = kinds - {"camera"}
        renderer.update()
        behind = _pictures(views, render)
    finally:
        field.visible_to = kinds
        renderer.update()
    found = [evidence(v.camera, v.image, v.mask, a, b) for v, a, b in zip(views, now, behind, strict=True)]
    before = parameters.get(scene, item.path)
    for values in _proposals(item, field, found):
        parameters.put(scene, item.path, item.scene_values(values))
        renderer.update([item.path])
        after = _losses(views, loss, _pictures(views, render))
        if np.all(after < (1.0 - LEAST_FALL) * losses):
            item.adopt(values)
            return True
    parameters.put(scene, item.path, before)
    renderer.update([item.path])
    return False


def _proposals(item: Coefficients, field: Field, views: Sequence[Evidence]) -> Iterator[F64]:
    """Coefficients of other fields: with all changes, with one kind of them, and carved as each view asks for alone."""
    nodes = item.nodes()
    points = item.node_places(field)
    scale = float(np.cbrt(np.abs(np.linalg.det(field.transform[:3, :3]))))
    values = nodes.ravel()
    carving = carved(values, points, scale, views)
    proposed = [added(carving, points, scale, views), carving, added(values, points, scale, views)]
    proposed += [carved(values, points, scale, [view]) for view in views]
    tried = {(values < 0.0).tobytes()}
    for one in proposed:
        signs = (one < 0.0).tobytes()
        if signs not in tried:
            tried.add(signs)
            changed = item.coefficients_of(one.reshape(nodes.shape))
            if changed is not None:
                yield changed


def _pictures(views: Sequence[View], render: Render) -> Pictures:
    return [[render(j, twin) for twin in range(2)] for j in range(len(views))]


def _losses(views: Sequence[View], loss: Loss, pictures: Pictures) -> F64:
    """(2,) losses of the two sets of pictures."""
    return np.array([
        sum(view.weight * loss(picture[twin], view.image, view.mask)[0]
            for view, picture in zip(views, pictures, strict=True))
        for twin in range(2)
    ])  # fmt: skip
