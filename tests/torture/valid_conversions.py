"""Valid calls of conversions: meshes and distance fields, lenses, field steps."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

import edgegrad
from edgegrad import calibration, distance_fields
from tests.support import shapes
from tests.support.fields.splines import exact_sphere

# Argument or field to other words that an error about it may have.
NAMES: dict[str, tuple[str, ...]] = {
    "mesh": ("one", "other"), "cells": ("grid", "lower", "box"), "attributes": ("attribute",), "model": ("parameters",),
    "field": ("values",), "width": ("shape", "size"), "height": ("shape", "size"), "picture": ("Lens",),
    "one": ("mesh",), "other": ("mesh",), "finer": ("grid",), "lower": ("box", "surface"), "upper": ("box", "surface"),
}  # fmt: skip


def box() -> edgegrad.Mesh:
    vertices, faces = shapes.cube(1.0)
    return edgegrad.Mesh(vertices.astype(np.float64), faces.astype(np.int32), ("clay",))


def ball() -> edgegrad.Field:
    return exact_sphere(0.6, 8)


def lens() -> calibration.Lens:
    return calibration.Lens(6, 4, 5.0, 5.0, 3.0, 2.0, k1=0.1)


def undistorted(picture: Any, weight: Any) -> Any:
    return lens().undistort(picture, weight)


def fisheye() -> calibration.FisheyeLens:
    return calibration.FisheyeLens(6, 4, 2.0, 2.0, 3.0, 2.0, k1=0.1)


def used(made: calibration.Intrinsics) -> Any:
    return made.shift, made.camera(np.eye(4)), made.undistort(np.ones((made.height, made.width, 1), np.float32))


def lens_of(**fields: Any) -> Any:
    return used(calibration.Lens(**fields))


def fisheye_of(**fields: Any) -> Any:
    return used(calibration.FisheyeLens(**fields))


def panorama_of(**fields: Any) -> Any:
    return used(calibration.PanoramaLens(**fields))


def steps(**fields: Any) -> Any:
    return edgegrad.FieldSteps(**fields)


def calls() -> list[tuple[str, Any, Any]]:
    """Names, functions, and functions that make their valid arguments."""
    low, high = np.full(3, -1.0), np.ones(3)
    pixels = np.random.default_rng(1).random((4, 6, 3)).astype(np.float32)
    return [
        ("from_mesh", distance_fields.from_mesh, lambda: {
            "mesh": box(), "cells": (20, 20, 20), "lower": low, "upper": high, "material": "clay", "most_memory": 1e8}),
        ("to_mesh", distance_fields.to_mesh, lambda: {
            "field": ball(), "finer": 0, "open_border": False, "most_memory": 1e8}),
        ("redistanced", distance_fields.redistanced, lambda: {"field": ball()}),
        ("refined", distance_fields.refined, lambda: {"field": ball(), "times": 1}),
        ("resampled", distance_fields.resampled, lambda: {
            "field": ball(), "cells": (6, 6, 6), "lower": 0.9 * low, "upper": 0.9 * high}),
        ("laplacian", distance_fields.laplacian, lambda: {"field": ball()}),
        ("eikonal", distance_fields.eikonal, lambda: {"field": ball()}),
        ("topology", distance_fields.topology, lambda: {"mesh": box()}),
        ("chamfer_distance", distance_fields.chamfer_distance, lambda: {
            "one": box(), "other": box(), "samples": 10, "seed": 1}),
        ("Lens", lens_of, lambda: asdict(lens())),
        ("Lens.undistort", undistorted, lambda: {"picture": pixels, "weight": np.ones((4, 6))}),
        ("Lens.distort", lens().distort, lambda: {"ideal": np.zeros((2, 2))}),
        ("FisheyeLens", fisheye_of, lambda: asdict(fisheye())),
        ("FisheyeLens.project", fisheye().project, lambda: {"points": np.ones((2, 3))}),
        ("PanoramaLens", panorama_of, lambda: asdict(calibration.PanoramaLens(6, 3, 3.0, 3.0, 3.0, 2.0))),
        ("FieldSteps", steps, lambda: asdict(edgegrad.FieldSteps())),
    ]  # fmt: skip
