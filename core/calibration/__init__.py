"""Cameras from a calibration: what structure from motion and camera trackers have found, as cameras of a fit."""

from .calibrated import Calibrated, read_calibration
from .lens import MODELS, Lens

__all__ = ["MODELS", "Calibrated", "Lens", "read_calibration"]
