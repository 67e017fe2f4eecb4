"""Cameras from a calibration: what structure from motion and camera trackers have found, as cameras of a fit."""

from .calibrated import Calibrated, read_calibration
from .fisheye import FisheyeLens, PanoramaLens
from .intrinsics import Intrinsics
from .lens import Lens
from .models import MODELS, lens_of_model

__all__ = ["MODELS", "Calibrated", "FisheyeLens", "Intrinsics", "Lens", "PanoramaLens", "lens_of_model",
           "read_calibration"]
