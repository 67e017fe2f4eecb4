"""Target pictures of a fit, checked against their cameras and brought to their size."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._check import array, choice, instance, light_values, names, number, numeric, shown, text
from .._fields import Check, Checked, by, optional
from ..images import resample, same_aspect
from ..rendering.renderer import Renderer
from ..scene.camera import Camera
from ..scene.scene import Scene
from .silhouettes import check_silhouette, is_negative

# Gains that a fit finds: one factor, or one for each channel.
EXPOSURE, WHITE_BALANCE = "exposure", "white balance"
# What alpha means: the picture is over the world of the scene, or pixels that are not opaque are ignored.
OVER_WORLD, AS_MASK = "world", "mask"
# Alpha from which a pixel is opaque.
OPAQUE = 0.999


def _gain(where: str, name: str, value: Any) -> Any:
    if isinstance(value, str):
        if value not in (EXPOSURE, WHITE_BALANCE):
            raise ValueError(f"{where}: {name} must be a number, three numbers, '{EXPOSURE}' or '{WHITE_BALANCE}', not "
                             f"{shown(value)}")  # fmt: skip
        return value
    single = numeric(where, name, value).ndim == 0
    out = array(where, name, [value] * 3 if single else value, (3,), np.float64)
    if out.min() <= 0.0:
        raise ValueError(f"{where}: {name} must be above 0, not {out.min():g}")
    return out


def _image(where: str, name: str, value: Any) -> NDArray[Any]:
    """Check a picture, or a silhouette of two axes."""
    if numeric(where, name, value, booleans=True).ndim != 2:
        return light_values(where, name, value, (None, None, None))
    return array(where, name, value, (None, None), np.float32, least=0.0, booleans=True)


@dataclass
class Target(Checked):
    """A picture that the scene should match, or a silhouette that some of its objects should have.

    Attributes
    ----------
    image
        (H, W, 3) linear Rec.709 radiance, or (H, W, 4) with straight alpha, as returned by `images.read_image`. With
        `objects`: (H, W) silhouette, 1 where the objects are seen and 0 elsewhere, between at their outline. Its
        aspect must be that of the camera's picture or crop. A larger image is averaged to the camera's size
        (`images.resample`); for a smaller one, pictures of the image's size are rendered.
    camera
        Camera that took the picture; None: the scene's camera.
    mask
        (H, W) weight of each pixel, >= 0 (0: ignored), of the size of the image or another one of the same aspect;
        None: all 1.
    weight
        Weight of this picture among the targets, > 0.
    alpha
        Meaning of the image's alpha. "world": the picture is composited over the scene's world, as a render shows the
        world behind the objects. "mask": pixels that are not opaque are ignored.
    gain
        Factor, or (3,) factors of the channels, by which the image is brighter than the scene, such as 2.0 for an
        exposure of one stop more; > 0. "exposure": an unknown factor; "white balance": an unknown factor of each
        channel. In each iteration, an unknown gain is the one with the smallest loss.
    shared
        Targets with the same text here share their unknown gain, as photographs with equal settings of the camera
        do; "": the gain is that of this target alone.
    objects
        Names of meshes and fields whose silhouette the image is; None: it is a picture.
    """

    image: ArrayLike
    camera: Camera | None = None
    mask: ArrayLike | None = None
    weight: float = 1.0
    alpha: str = OVER_WORLD
    gain: ArrayLike | str = 1.0
    shared: str = ""
    objects: Sequence[str] | None = None

    checks: ClassVar[Mapping[str, Check]] = {
        "image": _image,
        "camera": optional(by(instance, Camera)),
        "mask": optional(by(array, (None, None), np.float64, least=0.0, booleans=True)),
        "weight": by(number, above=0.0),
        "alpha": by(choice, (OVER_WORLD, AS_MASK)),
        "gain": _gain,
        "shared": text,
        "objects": optional(by(names, "names of meshes and fields")),
    }


@dataclass(frozen=True)
class View:
    """A checked target of the size of its camera's picture.

    Attributes
    ----------
    gain
        Kind of an unknown gain, or the (3,) known one, by which `image` is already divided.
    objects
        Names of the objects whose silhouette the image is; None: it is a picture.
    """

    image: NDArray[np.float32]
    camera: Camera
    mask: NDArray[np.float64] | None
    weight: float
    gain: str | NDArray[np.float64] = field(default_factory=lambda: np.ones(3))
    shared: str = ""
    objects: frozenset[str] | None = None


# Samples per pixel of the world behind pictures with alpha; more samples reduce the noise of a textured world.
WORLD_SPP = 64

# One or several targets; a bare picture belongs to the scene's camera.
Targets = Target | NDArray[Any] | Sequence[Target | NDArray[Any]]


def views(scene: Scene, targets: Targets, engine: str = "auto") -> list[View]:
    """Check the targets, bring them to the size of their cameras, and scale their weights to a mean of 1.

    If a picture of the scene's own camera is smaller than what the camera renders, the scene gets a camera of the
    picture's size.

    Raises
    ------
    ValueError
        For a wrong target; names its position in the list and the field.
    """
    if not isinstance(targets, (Target, Iterable)) or isinstance(targets, (str, bytes, Mapping)):
        raise ValueError(f"fit: targets must be an edgegrad.Target, a picture or a list of them, not {shown(targets)}")
    several = [targets] if isinstance(targets, (Target, np.ndarray)) else list(targets)
    checked = [_checked(scene, f"target {k}", target) for k, target in enumerate(several)]
    if not checked:
        raise ValueError("fit: there is no target; give at least one")
    # All pictures of the scene's own camera are compared in the size of the smallest of them.
    for k, target in enumerate(checked):
        if target.camera is None:
            scene.camera = camera_for(f"target {k}", scene.camera, np.shape(target.image)[:2])
    out = [_view(scene, f"target {k}", target, engine) for k, target in enumerate(checked)]
    mean = sum(view.weight for view in out) / len(out)
    return [replace(view, weight=view.weight / mean) for view in out]


def _checked(scene: Scene, where: str, target: Target | NDArray[Any]) -> Target:
    if isinstance(target, np.ndarray):
        target = Target(target)
    if not isinstance(target, Target):
        raise ValueError(f"{where}: must be an edgegrad.Target or a picture, not {shown(target)}")
    target = replace(target)  # the caller's target stays unchanged
    target.check_fields(where)
    try:
        (scene.camera if target.camera is None else target.camera).validate()
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None
    image = np.asarray(target.image)
    shape = image.shape
    if 0 in shape:
        raise ValueError(f"{where}: image has no pixels")
    if target.objects is not None:
        _check_silhouette(scene, where, target)
    elif len(shape) != 3 or shape[2] not in (3, 4):
        raise ValueError(f"{where}: image must have the shape (H, W, 3) or (H, W, 4), not {shape}; a silhouette (H, W) "
                         "needs the names of its objects")
    elif isinstance(target.gain, str) and target.alpha == OVER_WORLD and (image[..., 3:] < 1.0).any():
        raise ValueError(f"{where}: image has an alpha over the world and an unknown gain, but the world's light has "
                         "no such gain; use alpha='mask', or give the gain")
    return target


def _check_silhouette(scene: Scene, where: str, target: Target) -> None:
    image, objects = np.asarray(target.image), tuple(target.objects or ())
    if image.ndim != 2:
        raise ValueError(f"{where}: image must have the shape (H, W), since it is the silhouette of objects, not "
                         f"{image.shape}")  # fmt: skip
    if image.max() > 1.0:
        raise ValueError(f"{where}: image is a silhouette and must not be above 1, but contains {image.max():g}")
    if isinstance(target.gain, str) or np.any(np.asarray(target.gain) != 1.0):
        raise ValueError(f"{where}: a silhouette has no gain; leave it out")
    check_silhouette(where, scene, objects)


def camera_for(where: str, camera: Camera, size: tuple[int, ...]) -> Camera:
    """Return the camera, or one of the picture's size if the picture is smaller.

    Raises
    ------
    ValueError
        If the picture has another aspect than the camera.
    """
    (height, width), (high, wide) = camera.size, size
    if (high, wide) == (height, width):
        return camera
    if not same_aspect((high, wide), (height, width)):
        raise ValueError(f"{where}: image is {wide} x {high} pixels, but its camera's picture is {width} x {height}, "
                         "of another aspect; crop the image, or give the camera the image's size")
    if wide >= width and high >= height:
        return camera
    if camera.crop is None:
        return camera.of_size(high, wide)
    raise ValueError(f"{where}: image is {wide} x {high} pixels, smaller than the crop of its camera, {width} x "
                     f"{height}; reduce the camera's size and its crop alike")


def _view(scene: Scene, where: str, target: Target, engine: str) -> View:
    camera = scene.camera
    if target.camera is not None:
        camera = camera_for(where, target.camera, np.shape(target.image)[:2])
    size = camera.size
    image = np.asarray(target.image)
    mask = None if target.mask is None else np.asarray(target.mask)
    if mask is not None and not mask.any():
        raise ValueError(f"{where}: mask is 0 everywhere")
    if target.objects is not None:
        image = np.repeat(image[..., None], 3, axis=2)
        image = 1.0 - image if is_negative(scene, target.objects) else image
    if image.shape[2] == 4 and target.alpha == AS_MASK:
        opaque = (image[..., 3] >= OPAQUE).astype(np.float64)
        if not opaque.any():
            raise ValueError(f"{where}: image has no opaque pixel, and its alpha is its mask")
        mask = opaque if mask is None else opaque * _resized_mask(where, mask, opaque.shape)
        image = image[..., :3]
    elif image.shape[2] == 4:
        # EXR pixels with alpha 0 may still contain light (a glow), which adds to the background.
        alpha = image[..., 3:]
        image = np.concatenate([image[..., :3] * np.where(alpha > 0.0, alpha, 1.0), alpha], axis=2)
    if mask is not None and image.shape[:2] != size:
        # Ignored pixels have no part in the means.
        mask = _resized_mask(where, mask, image.shape[:2])
        weight = resample(mask, size)[..., None]
        image = resample(mask[..., None] * image, size) / np.where(weight > 0.0, weight, 1.0)
    image = resample(image, size)
    if mask is not None:
        mask = _resized_mask(where, mask, size)
        if not mask.any():
            raise ValueError(f"{where}: mask is 0 everywhere where the image is opaque")
    gain: Any = target.gain
    alpha, image = image[..., 3:], image[..., :3]
    if not isinstance(gain, str):
        with np.errstate(over="ignore"):
            image = (image / gain).astype(np.float32)
        if not np.isfinite(image).all():
            raise ValueError(f"{where}: gain of {np.min(gain):.3g} makes the image larger than single precision holds; "
                             "give the factor by which the image is brighter than the scene")
    if alpha.size and (alpha < 1.0).any():
        image = image + (1.0 - alpha) * _world_alone(scene, camera, engine)
    objects = None if target.objects is None else frozenset(target.objects)
    return View(np.asarray(image, np.float32), camera, mask, target.weight, gain, target.shared, objects)


def _resized_mask(where: str, mask: NDArray[Any], size: tuple[int, ...]) -> NDArray[Any]:
    if not same_aspect(mask.shape, size):
        raise ValueError(f"{where}: mask is {mask.shape[1]} x {mask.shape[0]} pixels, but must have the aspect of its "
                         f"image, {size[1]} x {size[0]} pixels")  # fmt: skip
    return resample(mask, (size[0], size[1]))


def _world_alone(scene: Scene, camera: Camera, engine: str) -> NDArray[np.float32]:
    """Render the world without objects."""
    behind = Scene(camera, world=scene.world, images=scene.images)
    return Renderer(behind, engine=engine).render(spp=WORLD_SPP, max_depth=1)


def camera_of_gradient(renderer: Renderer, camera: Camera, wrt: list[str]) -> Camera | None:
    """Camera argument of a gradient of a picture. Derivatives by a camera are those by the scene's own."""
    if not any(path.startswith("camera.") for path in wrt):
        return camera
    if renderer.scene.camera is not camera:
        renderer.scene.camera = camera
    renderer.update(["camera.to_world"])
    return None


def checked_loss(found: Any, image: NDArray[np.float32]) -> tuple[float, NDArray[Any]]:
    """Return what a loss has returned, if it has the form (value, adjoint); the numbers may be non-finite."""
    if not isinstance(found, tuple) or len(found) != 2:
        raise ValueError(f"fit: loss must return (value, adjoint), not {shown(found)}")
    value = numeric("fit", "the value that loss returns", found[0])
    adjoint = numeric("fit", "the adjoint that loss returns", found[1])
    if value.ndim or adjoint.shape != image.shape:
        raise ValueError(f"fit: loss must return a number and an array of the shape {image.shape}, not arrays of the "
                         f"shapes {value.shape} and {adjoint.shape}")
    return float(value), adjoint
