"""Reads neutral test scenes (``.npz``) into `edgegrad.Scene`.

The format: keys ``scene/...`` hold a nested description (camera, meshes with one BSDF each, lights, one
scalar parameter theta and how it moves the scene); the other keys hold reference arrays, usually ``image``,
``grad_fd`` (d image / d theta by central differences of width ``eps``) and ``grad_fd_stderr``. The scenes are
y-up and stay so: only relative positions matter.

=====================  =================================================================
mesh k                 ``meshes.mesh{k}``, its material ``materials.mesh{k}``; one-sided emission
light j                ``lights.light{j}``; all constant lights together are the world
=====================  =================================================================
"""

from __future__ import annotations

import copy
import pathlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad

Tangent = dict[str, NDArray[np.float64]]


class UnsupportedFeature(NotImplementedError):
    """The file asks for something that this version of Edgegrad doesn't do; the message names it."""


def load(path: str | pathlib.Path) -> tuple[edgegrad.Scene, Tangent, dict[str, NDArray[Any]]]:
    """Scene at theta = 0, its tangent d/d theta, and the reference arrays of a file.

    Returns
    -------
    The scene; a dict from parameter path to an array of the parameter's shape; the reference arrays,
    with ``max_depth`` and ``eps`` (width of the central difference) of the file as 0-d arrays beside them.

    Raises
    ------
    UnsupportedFeature
        Naming the first feature that isn't supported.
    """
    data, arrays = _read(path)
    scene, tangent = _at(data, 0.0)
    arrays["max_depth"] = np.asarray(int(data["max_depth"]))
    arrays["eps"] = np.asarray(float(data["parameter"]["eps"]))
    return scene, tangent, arrays


def load_at(path: str | pathlib.Path, theta: float) -> tuple[edgegrad.Scene, Tangent]:
    """Scene and tangent with the file's parameter at `theta`."""
    return _at(_read(path)[0], theta)


# ---------------------------------------------------------------- the file
def _read(path: str | pathlib.Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
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
def _at(data: dict[str, Any], theta: float) -> tuple[edgegrad.Scene, Tangent]:
    """Scene and tangent at theta. Each kind's motion and its derivative stand side by side."""
    data = copy.deepcopy(data)
    if int(data["max_depth"]) > 2:
        raise UnsupportedFeature(f"max_depth {int(data['max_depth'])}: paths longer than direct light")
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
        raise UnsupportedFeature("parameter 'camera': derivative by the camera's position")
    elif kind == "add":
        tangent = _added(data, str(p["path"]), np.asarray(p["direction"], np.float64), theta)
    else:
        raise UnsupportedFeature(f"parameter kind '{kind}'")
    return _scene(data), tangent


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
        case ["lights", j, "intensity"] if data["lights"][int(j)]["type"] == "point":
            return {f"lights.light{j}.color": _colour(direction)}
        case ["lights", j, "irradiance"]:
            return {f"lights.light{j}.color": _colour(direction)}
        case ["lights", _, "radiance"]:
            return {"world.color": _colour(direction)}
    _scene(data)  # where the value's own feature isn't supported, say so first
    raise UnsupportedFeature(f"parameter '{path}': derivative by {last}")


# ---------------------------------------------------------------- the scene
def _scene(data: dict[str, Any]) -> edgegrad.Scene:
    cam = data["camera"]
    camera = edgegrad.Camera(
        np.asarray(cam["to_world"], np.float64), float(np.radians(cam["fov_x"])), int(cam["width"]), int(cam["height"])
    )
    meshes: dict[str, edgegrad.Mesh] = {}
    materials: dict[str, edgegrad.Material] = {}
    lights: dict[str, edgegrad.PointLight | edgegrad.SunLight | edgegrad.AreaLight] = {}
    for k, mesh in enumerate(data["meshes"]):
        name = f"mesh{k}"
        materials[name] = _material(name, mesh, int(data["max_depth"]))
        meshes[name] = edgegrad.Mesh(
            np.array(mesh["vertices"], np.float64), np.asarray(mesh["faces"], np.int32), (name,)
        )
    world = np.zeros(3)
    for j, light in enumerate(data["lights"]):
        kind = str(light["type"])
        if kind == "point":
            # intensity = power color/(4 pi)
            lights[f"light{j}"] = edgegrad.PointLight(
                np.asarray(light["position"], np.float64), 4.0 * np.pi, color=_colour(light["intensity"])
            )
        elif kind == "directional":
            lights[f"light{j}"] = edgegrad.SunLight(
                np.asarray(light["direction"], np.float64), 1.0, color=_colour(light["irradiance"])
            )
        elif kind == "constant":
            world = world + _colour(light["radiance"])
        else:
            raise UnsupportedFeature(f"light {j}: type '{kind}'")
    return edgegrad.Scene(camera, meshes, materials, lights, edgegrad.World(world, 1.0))


def _material(name: str, mesh: dict[str, Any], max_depth: int) -> edgegrad.Material:
    bsdf = mesh["bsdf"]
    if str(bsdf["type"]) != "diffuse":
        raise UnsupportedFeature(f"{name}: bsdf '{bsdf['type']}'")
    if "texture" in bsdf:
        raise UnsupportedFeature(f"{name}: textured reflectance")
    reflectance = _colour(bsdf["reflectance"])
    # Shading normals show only in reflected light.
    if int(mesh.get("smooth", 0)) and reflectance.any() and max_depth > 1:
        raise UnsupportedFeature(f"{name}: smooth shading normals")
    return edgegrad.Material(reflectance, _colour(mesh.get("emission", 0.0)), emission_two_sided=False)


def _colour(value: Any) -> NDArray[np.float64]:
    return np.broadcast_to(np.asarray(value, np.float64), (3,)).copy()
