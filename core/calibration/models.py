"""Camera models by the names that COLMAP gives them."""

from __future__ import annotations

from collections.abc import Sequence

from .fisheye import LEAST_OMEGA, FisheyeLens, PanoramaLens
from .intrinsics import Intrinsics
from .lens import Lens

_ONE_FOCAL, _TWO_FOCAL = ("f", "cx", "cy"), ("fx", "fy", "cx", "cy")
# Parameters of each known model, in the order of COLMAP's files.
MODELS: dict[str, tuple[str, ...]] = {
    "SIMPLE_PINHOLE": _ONE_FOCAL,
    "PINHOLE": _TWO_FOCAL,
    "SIMPLE_RADIAL": (*_ONE_FOCAL, "k1"),
    "RADIAL": (*_ONE_FOCAL, "k1", "k2"),
    "OPENCV": (*_TWO_FOCAL, "k1", "k2", "p1", "p2"),
    "FULL_OPENCV": (*_TWO_FOCAL, "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "SIMPLE_FISHEYE": _ONE_FOCAL,
    "FISHEYE": _TWO_FOCAL,
    "SIMPLE_RADIAL_FISHEYE": (*_ONE_FOCAL, "k1"),
    "RADIAL_FISHEYE": (*_ONE_FOCAL, "k1", "k2"),
    "OPENCV_FISHEYE": (*_TWO_FOCAL, "k1", "k2", "k3", "k4"),
    "FOV": (*_TWO_FOCAL, "omega"),
    "EQUIRECTANGULAR": ("w", "h"),
}
PANORAMA, OF_TANGO = "EQUIRECTANGULAR", "FOV"


def is_fisheye(model: str) -> bool:
    return model.endswith("FISHEYE") or model == OF_TANGO


def lens_of_model(where: str, model: str, width: int, height: int, values: Sequence[float]) -> Intrinsics:
    """Return the lens of a camera model of COLMAP (`MODELS`).

    Raises
    ------
    ValueError
        If the model is unknown here, or has another number of parameters.
    """
    if model not in MODELS:
        raise ValueError(f"{where}: its camera model '{model}' is not supported (known: {', '.join(MODELS)}); "
                         "undistort the pictures first, for example with COLMAP's image_undistorter")
    names = MODELS[model]
    if len(values) != len(names):
        raise ValueError(f"{where}: camera model '{model}' has {len(names)} parameters ({', '.join(names)}), not "
                         f"{len(values)}")  # fmt: skip
    named = dict(zip(names, values, strict=True))
    if model == PANORAMA:
        wide, high = named["w"], named["h"]
        return PanoramaLens(width, height, 0.5 * wide, high, 0.5 * wide, 0.5 * high)
    if model == OF_TANGO and named["omega"] < LEAST_OMEGA:
        raise ValueError(f"{where}: omega of camera model '{model}' must be {LEAST_OMEGA:g} or more, not "
                         f"{named['omega']:g}; use the model PINHOLE")  # fmt: skip
    focal = named.pop("f", None)
    named = named if focal is None else {"fx": focal, "fy": focal} | named
    return FisheyeLens(width, height, **named) if is_fisheye(model) else Lens(width, height, **named)
