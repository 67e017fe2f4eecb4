"""Reads neutral test scenes (``.npz``) into `edgegrad.Scene`.

The format: keys ``scene/...`` hold a nested description (camera, meshes with one BSDF each, lights, one
scalar parameter theta and how it moves the scene); the other keys hold reference arrays, usually ``image``,
``grad_fd`` (d image / d theta by central differences of width ``eps``) and ``grad_fd_stderr``. The scenes are
y-up and stay so: only relative positions matter.

=====================  =================================================================
mesh k                 ``meshes.mesh{k}``, its material ``materials.mesh{k}``; one-sided emission
light j                ``lights.light{j}``; all constant lights together are the world
environment map        ``images.environment``
texture of mesh k      ``images.mesh{k}``, by the mesh's attribute ``UVMap``
=====================  =================================================================

Derivatives are of every parameter; where a scene's shadows aren't differentiated, the file's differences have a
term more (`edgegrad.plan`).
"""

from __future__ import annotations

import copy
import pathlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.expression import Attribute, ImageTexture
from edgegrad.scene.light import Light

Tangent = dict[str, NDArray[np.float64]]


# World to the image's own space (`edgegrad.World`): the files' environments have +Y up and u = atan2(x, -z)/(2 pi).
ENVIRONMENT_ROTATION = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
# Rows per interval of an environment map's grid (`_environment`).
ENVIRONMENT_ROWS = 8


class UnsupportedFeature(NotImplementedError):
    """This version of Edgegrad has no derivative by the file's parameter; it says why."""


def load_picture(path: str | pathlib.Path) -> tuple[edgegrad.Scene, dict[str, NDArray[Any]]]:
    """Scene at theta = 0 and the reference arrays of any file, and ``max_depth`` as a 0-d array."""
    data, arrays = read(path)
    arrays["max_depth"] = np.asarray(int(data["max_depth"]))
    return to_edgegrad(data), arrays


def load(path: str | pathlib.Path) -> tuple[edgegrad.Scene, Tangent, dict[str, NDArray[Any]]]:
    """Scene at theta = 0, its tangent d/d theta, and the reference arrays of a file.

    Returns
    -------
    The scene; a dict from parameter path to an array of the parameter's shape; the reference arrays,
    with ``max_depth`` and ``eps`` (width of the central difference) of the file as 0-d arrays beside them.

    Raises
    ------
    UnsupportedFeature
        Naming the first feature that has no derivative yet.
    """
    data, arrays = read(path)
    scene, tangent = at_theta(data, 0.0)
    arrays["max_depth"] = np.asarray(int(data["max_depth"]))
    arrays["eps"] = np.asarray(float(data["parameter"]["eps"]))
    return scene, tangent, arrays


def load_at(path: str | pathlib.Path, theta: float) -> tuple[edgegrad.Scene, Tangent]:
    """Scene and tangent with the file's parameter at `theta`."""
    return at_theta(read(path)[0], theta)


# ---------------------------------------------------------------- the file
def read(path: str | pathlib.Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """A file's nested description and its reference arrays."""
    with np.load(path, allow_pickle=False) as file:
        flat = {key.removeprefix("scene/"): file[key] for key in file.files if key.startswith("scene/")}
        arrays = {key: file[key] for key in file.files if not key.startswith("scene/")}
    if not flat:
        raise ValueError(f"{path}: holds no scene (keys 'scene/...')")
    root: dict[str, Any] = {}
    for key, value in flat.items():
        *head, last = key.split("/")
        at = root
        for part in head:
            at = at.setdefault(part, {})
        at[last] = value.item() if value.ndim == 0 else value
    data = _lists(root)
    data.setdefault("meshes", [])
    data.setdefault("lights", [])
    return data, arrays


def _lists(node: Any) -> Any:
    """Dicts with the keys '0', '1', ... as lists."""
    if not isinstance(node, dict):
        return node
    if "0" in node:
        return [_lists(node[str(k)]) for k in range(len(node))]
    return {key: _lists(value) for key, value in node.items()}


# ---------------------------------------------------------------- the parameter theta
def at_theta(data: dict[str, Any], theta: float) -> tuple[edgegrad.Scene, Tangent]:
    """Scene and tangent at theta. Each kind's motion and its derivative stand side by side."""
    data = copy.deepcopy(data)
    p, tangent = data["parameter"], {}
    kind = str(p["kind"])
    if kind in ("translate", "vertex", "scale", "rotate"):
        for k in np.atleast_1d(p["meshes"]).astype(int):
            v = np.array(data["meshes"][k]["vertices"], np.float64)
            rate = np.zeros_like(v)
            if kind == "translate":
                rate[:] = p["direction"]
                moved = v + theta * rate
            elif kind == "vertex":
                rate[int(p["vertex"])] = p["direction"]
                moved = v + theta * rate
            elif kind == "scale":
                rate[:] = v - p["center"]
                moved = v + theta * rate
            else:  # Rodrigues' formula
                axis, d = p["axis"] / np.linalg.norm(p["axis"]), v - p["center"]
                c, s, turned, along = np.cos(theta), np.sin(theta), np.cross(axis, d), np.outer(d @ axis, axis)
                moved = p["center"] + c * d + s * turned + (1.0 - c) * along
                rate = -s * d + c * turned + s * along
            data["meshes"][k]["vertices"] = moved
            tangent[f"meshes.mesh{k}.vertices"] = rate
    elif kind == "camera":
        pose = np.array(data["camera"]["to_world"], np.float64)
        rate = np.zeros((4, 4))
        rate[:3, 3] = p["direction"]
        data["camera"]["to_world"] = pose + theta * rate
        tangent["camera.to_world"] = rate
    elif kind == "add":
        tangent = _added(data, str(p["path"]), np.asarray(p["direction"], np.float64), theta)
    else:
        raise UnsupportedFeature(f"parameter kind '{kind}'")
    return to_edgegrad(data), tangent


def _added(data: dict[str, Any], path: str, direction: NDArray[np.float64], theta: float) -> Tangent:
    """Add theta * direction to the value at a path such as ``meshes/0/bsdf/reflectance``; the tangent."""
    *head, last = path.split("/")
    at: Any = data
    for part in head:
        at = at[int(part) if isinstance(at, list) else part]
    value = np.asarray(at[last], np.float64)
    at[last] = value + theta * direction
    match path.split("/"):
        case ["meshes", k, "vertices"]:
            return {f"meshes.mesh{k}.vertices": np.broadcast_to(direction, value.shape).copy()}
        case ["meshes", k, "bsdf", "reflectance"]:
            return {f"materials.mesh{k}.base_color": _colour(direction)}
        case ["meshes", k, "emission"]:
            return {f"materials.mesh{k}.emission": _colour(direction)}
        case ["meshes", k, "bsdf", "roughness"]:
            return {f"materials.mesh{k}.roughness": np.asarray(float(direction))}
        case ["lights", j, "intensity"]:
            return {f"lights.light{j}.color": _colour(direction)}
        case ["lights", j, "irradiance"]:
            return {f"lights.light{j}.color": _colour(direction)}
        case ["lights", _, "radiance"]:
            return {"world.color": _colour(direction)}
    raise UnsupportedFeature(f"parameter '{path}': derivative by {last}")


# ---------------------------------------------------------------- the scene
def to_edgegrad(data: dict[str, Any]) -> edgegrad.Scene:
    """The scene of a nested description."""
    cam = data["camera"]
    camera = edgegrad.Camera(
        np.asarray(cam["to_world"], np.float64), float(np.radians(cam["fov_x"])), int(cam["width"]), int(cam["height"])
    )
    meshes: dict[str, edgegrad.Mesh] = {}
    materials: dict[str, edgegrad.Material | edgegrad.Mixture] = {}
    images: dict[str, edgegrad.Image] = {}
    for k, mesh in enumerate(data["meshes"]):
        name = f"mesh{k}"
        faces = np.asarray(mesh["faces"], np.int32)
        texture = mesh["bsdf"].get("texture")
        if texture is not None:
            # The files' pictures have row 0 at v = 0; an image's is at the top.
            images[name] = edgegrad.Image(np.asarray(texture, np.float32)[::-1].copy())
        materials[name] = _material(name, mesh)
        meshes[name] = edgegrad.Mesh(
            np.array(mesh["vertices"], np.float64),
            faces,
            (name,),
            smoothing=faces.copy() if _smooth(mesh) else None,
            attributes={"UVMap": np.asarray(mesh["uv"], np.float32)[faces]} if texture is not None else {},
        )
    lights: dict[str, Light] = {}
    constant = np.zeros(3)
    for j, light in enumerate(data["lights"]):
        kind = str(light["type"])
        if kind == "constant":
            constant += _colour(light["radiance"])
        elif kind == "envmap":
            images["environment"] = _environment(np.asarray(light["bitmap"], np.float64))
        else:
            lights[f"light{j}"] = _light(kind, light)
    world = edgegrad.World(constant)
    if "environment" in images:
        if constant.any():
            raise ValueError("the file has both a constant environment and a map; a world has one of them")
        world = edgegrad.World(np.ones(3), image="environment", rotation=ENVIRONMENT_ROTATION)
    return edgegrad.Scene(camera, meshes, materials, lights, world, images)


def _smooth(mesh: dict[str, Any]) -> bool:
    return bool(mesh.get("smooth", 0))


def _material(name: str, mesh: dict[str, Any]) -> edgegrad.Material:
    bsdf = mesh["bsdf"]
    emission = _colour(mesh.get("emission", 0.0))
    material = edgegrad.Material(emission=emission, emission_two_sided=False, multiscatter=False)
    match str(bsdf["type"]):
        case "diffuse" if "texture" in bsdf:
            material.textures = {"base_color": ImageTexture(name, Attribute("UVMap"))}
        case "diffuse":
            material.base_color = _colour(bsdf["reflectance"])
        case "conductor":  # a Fresnel term of 1; alpha = roughness^2
            material.kind, material.base_color = "GLOSSY", _colour(bsdf["reflectance"])
            material.roughness = float(np.sqrt(bsdf["alpha"]))
        case "principled":
            material.kind, material.base_color = "DISNEY", _colour(bsdf["base_color"])
            material.roughness, material.metallic = float(bsdf["roughness"]), float(bsdf["metallic"])
            material.specular_ior_level = float(bsdf["specular"])
        case "dielectric":
            material.kind, material.base_color = "GLASS", np.ones(3)
            material.roughness, material.ior = 0.0, float(bsdf["ior"])
        case kind:
            raise ValueError(f"{name}: unknown bsdf '{kind}'")
    return material


def _light(kind: str, light: dict[str, Any]) -> Light:
    match kind:
        case "point":  # intensity = power color/(4 pi)
            return edgegrad.PointLight(
                np.asarray(light["position"], np.float64), 4.0 * np.pi, color=_colour(light["intensity"])
            )
        case "directional":
            return edgegrad.SunLight(
                np.asarray(light["direction"], np.float64), 1.0, color=_colour(light["irradiance"])
            )
        case "spot":  # full intensity within `beam` of the axis, then linear in the angle to 0 at `cutoff`
            position = np.asarray(light["position"], np.float64)
            cutoff, beam = float(light["cutoff"]), float(light["beam"])
            return edgegrad.SpotLight(
                position, np.asarray(light["target"], np.float64) - position, 4.0 * np.pi,
                angle=float(np.radians(2.0 * cutoff)), blend=1.0 - beam / cutoff, falloff="LINEAR",
                color=_colour(light["intensity"]),
            )  # fmt: skip
    raise ValueError(f"unknown light '{kind}'")


def _environment(bitmap: NDArray[np.float64]) -> edgegrad.Image:
    """An environment map as an image.

    The files' rows are nodes at the polar angles k pi/(h - 1), poles included, linear in between; an image's are
    centres of h equal strips. So the rows are interpolated to strips that are much finer than the nodes' distance:
    what differs is the rounding-off of the kink at each node. Columns are centres of strips in both.
    """
    height = len(bitmap)
    rows = ENVIRONMENT_ROWS * (height - 1)
    at = (np.arange(rows) + 0.5) / ENVIRONMENT_ROWS
    below = np.minimum(at.astype(int), height - 2)
    share = (at - below)[:, None, None]
    return edgegrad.Image(((1.0 - share) * bitmap[below] + share * bitmap[below + 1]).astype(np.float32))


def _colour(value: Any) -> NDArray[np.float64]:
    return np.broadcast_to(np.asarray(value, np.float64), (3,)).copy()
