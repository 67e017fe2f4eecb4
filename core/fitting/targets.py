"""Target pictures of a fit, checked against their cameras."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._check import array, instance, light_values, number, shown
from .._fields import Check, Checked, by, optional
from ..rendering.renderer import Renderer
from ..scene.camera import Camera
from ..scene.scene import Scene


@dataclass
class Target(Checked):
    """A picture that the scene should match.

    Attributes
    ----------
    image
        (H, W, 3) linear Rec.709 radiance of the size of the camera's picture or crop, or (H, W, 4) with straight
        alpha, as returned by `images.read_image`. A picture with alpha is composited over the scene's world, as a
        render shows the world behind the objects.
    camera
        Camera that took the picture; None: the scene's camera.
    mask
        (H, W) weight of each pixel, >= 0 (0: ignored); None: all 1.
    weight
        Weight of this picture among the targets, > 0.
    """

    image: ArrayLike
    camera: Camera | None = None
    mask: ArrayLike | None = None
    weight: float = 1.0

    checks: ClassVar[Mapping[str, Check]] = {
        "image": by(light_values, (None, None, None)),
        "camera": optional(by(instance, Camera)),
        "mask": optional(by(array, (None, None), np.float64, least=0.0, booleans=True)),
        "weight": by(number, above=0.0),
    }


@dataclass(frozen=True)
class View:
    """A checked target."""

    image: NDArray[np.float32]
    camera: Camera
    mask: NDArray[np.float64] | None
    weight: float


# Samples per pixel of the world behind pictures with alpha; more samples reduce the noise of a textured world.
WORLD_SPP = 64

# One or several targets; a bare picture belongs to the scene's camera.
Targets = Target | NDArray[Any] | Sequence[Target | NDArray[Any]]


def views(scene: Scene, targets: Targets, engine: str = "auto") -> list[View]:
    """Check the targets, and scale their weights to a mean of 1.

    Raises
    ------
    ValueError
        For a wrong target; names its position in the list and the field.
    """
    if not isinstance(targets, (Target, Iterable)) or isinstance(targets, (str, bytes, Mapping)):
        raise ValueError(f"fit: targets must be an edgegrad.Target, a picture or a list of them, not {shown(targets)}")
    several = [targets] if isinstance(targets, (Target, np.ndarray)) else list(targets)
    out = [_view(scene, f"target {k}", target, engine) for k, target in enumerate(several)]
    if not out:
        raise ValueError("fit: there is no target; give at least one")
    mean = sum(view.weight for view in out) / len(out)
    return [View(view.image, view.camera, view.mask, view.weight / mean) for view in out]


def _view(scene: Scene, where: str, target: Target | NDArray[Any], engine: str) -> View:
    if isinstance(target, np.ndarray):
        target = Target(target)
    if not isinstance(target, Target):
        raise ValueError(f"{where}: must be an edgegrad.Target or a picture, not {shown(target)}")
    target = replace(target)  # the caller's target stays unchanged
    target.check_fields(where)
    camera = scene.camera if target.camera is None else target.camera
    try:
        camera.validate()
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None
    size = camera.size
    image = np.asarray(target.image)
    if image.shape[2] not in (3, 4):
        raise ValueError(f"{where}: image must have the shape (H, W, 3) or (H, W, 4), not {image.shape}")
    if image.shape[:2] != size:
        raise ValueError(
            f"{where}: image is {image.shape[1]} x {image.shape[0]} pixels, but its camera's picture is "
            f"{size[1]} x {size[0]}"
        )
    if image.shape[2] == 4:
        alpha = image[..., 3:]
        # EXR pixels with alpha 0 may still contain light (a glow), which adds to the background.
        image = image[..., :3] * np.where(alpha > 0.0, alpha, 1.0)
        if (alpha < 1.0).any():
            image += (1.0 - alpha) * _world_alone(scene, camera, engine)
    mask = None
    if target.mask is not None:
        mask = np.asarray(target.mask)
        if mask.shape != size:
            raise ValueError(f"{where}: mask must have the shape {size} of its image, not {mask.shape}")
        if not mask.any():
            raise ValueError(f"{where}: mask is 0 everywhere")
    return View(image, camera, mask, target.weight)


def _world_alone(scene: Scene, camera: Camera, engine: str) -> NDArray[np.float32]:
    """Render the world without objects."""
    behind = Scene(camera, world=scene.world, images=scene.images)
    return Renderer(behind, engine=engine).render(spp=WORLD_SPP, max_depth=1)
