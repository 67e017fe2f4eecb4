"""Mitsuba 3 on the benchmark scenes: pictures, and derivatives by its projective sampling.

Needs ``pip install mitsuba`` (measured with 3.9.1) and an LLVM of version 16 or newer as a shared library
(Debian: libllvm19), which is found by itself; DRJIT_LIBLLVM_PATH overrides it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]

OLDEST_LLVM = 17
# Mitsuba's camera looks down +Z with +X to the left; the scenes' looks down -Z.
_TURNED = np.diag([-1.0, 1.0, -1.0, 1.0])

# Integrators of derivatives with visibility terms. How Mitsuba guides the samples of indirect silhouettes decides its
# cost, so several settings are measured; its default one costs up to 100 s a gradient. "primary only" leaves indirect
# silhouettes out: exactly what convex bodies under an even sky need.
PROJECTIVE: dict[str, dict[str, Any]] = {
    "light guiding": {"proj_seed_spp": 16, "octree_extra_leaf_sample": 16, "octree_max_depth": 7},
    "no guiding": {"guiding": "none"},
    "primary only": {"sppi": 0},
    "default guiding": {},
}
# What moves no edge.
INTERIOR = "prb"
_LOADED_AS_PROPERTY = ("guiding", "sppi")
# Pixel samplers; each renders through a sensor of its own.
SAMPLERS = ("independent", "multijitter", "ldsampler")
# Seconds between the renderers' turns. Mitsuba's worker threads go on looking for work for 20 ms after a call: a call
# of ours that follows at once took 1.3 to 1.6 times as long (cornell_albedo at 4 samples, 15 instead of 12 ms).
REST = 0.04


def find_llvm() -> str | None:
    """Path of the newest LLVM shared library that Dr.Jit can use, or None."""
    candidates = []
    for pattern in ("usr/lib/*/libLLVM*.so*", "usr/lib/llvm-*/lib/libLLVM*.so*", "usr/lib64/libLLVM*.so*"):
        for path in Path("/").glob(pattern):
            version = re.search(r"libLLVM(?:-|\.so\.)(\d+)", path.name)
            if version and int(version[1]) >= OLDEST_LLVM:
                candidates.append((int(version[1]), str(path)))
    return max(candidates)[1] if candidates else None


def load_mitsuba(threads: int) -> tuple[Any, Any]:
    """The modules mitsuba and drjit, on the processor and with so many threads.

    Raises
    ------
    ImportError
        If Mitsuba or LLVM is missing.
    """
    if "DRJIT_LIBLLVM_PATH" not in os.environ:
        llvm = find_llvm()
        if llvm is None:
            raise ImportError(f"Mitsuba needs LLVM {OLDEST_LLVM} or newer (Debian: apt-get install libllvm19)")
        os.environ["DRJIT_LIBLLVM_PATH"] = llvm
    import drjit
    import mitsuba

    mitsuba.set_variant("llvm_ad_rgb")
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    drjit.set_thread_count(threads)
    return mitsuba, drjit


class MitsubaPeer:
    """One benchmark scene in Mitsuba (variant ``llvm_ad_rgb``).

    Parameters
    ----------
    scene
        A scene of `tests.benchmarks.scenes`.
    threads
        Threads that Dr.Jit may use.
    tangent
        What derivatives are taken of (`peer_scenes.at_theta`), and along what.

    Raises
    ------
    ImportError
        If Mitsuba or LLVM is missing.
    """

    def __init__(
        self, scene: dict[str, Any], threads: int, tangent: Mapping[str, NDArray[np.float64]] | None = None
    ) -> None:
        tangent = tangent or {}
        self._mi, self._dr = load_mitsuba(threads)
        self.version: str = self._mi.__version__
        self._depth = int(scene["max_depth"])
        description: dict[str, Any] = {"type": "scene"}
        description |= {f"sensor{k}": self._sensor(scene["camera"], sampler) for k, sampler in enumerate(SAMPLERS)}
        description |= {f"mesh{k}": self._mesh(f"mesh{k}", m) for k, m in enumerate(scene["meshes"])}
        description |= {f"light{k}": self._light(light) for k, light in enumerate(scene["lights"])}
        self._scene = self._mi.load_dict(description)
        self._params = self._mi.traverse(self._scene)
        self._moved: dict[str, tuple[Any, Any]] = {}  # a parameter's value and its rate along theta
        for path, rate in tangent.items():
            key = _key(path)
            value = self._params[key]
            if key == "sensor0.to_world":
                self._moved[key] = self._mi.Transform4f(value), np.asarray(rate)[:3, 3]
            else:
                kind, flat = type(value), np.asarray(rate, np.float32)
                flat = flat.ravel() if path.endswith("vertices") else flat
                self._moved[key] = kind(value), kind(flat) if flat.ndim else kind(float(flat))
        self._params.keep(list(self._moved))
        self._integrators: dict[str, Any] = {}

    def _rgb(self, value: Any) -> dict[str, Any]:
        return {"type": "rgb", "value": [float(c) for c in value]}

    def _sensor(self, camera: dict[str, Any], sampler: str) -> dict[str, Any]:
        film = {"type": "hdrfilm", "width": int(camera["width"]), "height": int(camera["height"]),
                "rfilter": {"type": "box"}, "pixel_format": "rgb", "component_format": "float32"}
        return {
            "type": "perspective",
            "fov": float(camera["fov_x"]),
            "fov_axis": "x",
            "near_clip": 0.01,
            "far_clip": 1e4,
            "to_world": self._mi.ScalarTransform4f(np.asarray(camera["to_world"]) @ _TURNED),
            "film": film,
            "sampler": {"type": sampler},
        }

    def _mesh(self, name: str, data: dict[str, Any]) -> Any:
        mi = self._mi
        properties = mi.Properties()
        properties["mesh_bsdf"] = mi.load_dict(self._bsdf(data["bsdf"]))
        if "emission" in data:
            properties["emitter"] = mi.load_dict({"type": "area", "radiance": self._rgb(data["emission"])})
        mesh = mi.Mesh(name, len(data["vertices"]), len(data["faces"]), props=properties,
                       has_vertex_normals=bool(data.get("smooth", 0)), has_vertex_texcoords="uv" in data)
        values = mi.traverse(mesh)
        values["vertex_positions"] = np.asarray(data["vertices"], np.float32).ravel()
        values["faces"] = np.asarray(data["faces"], np.uint32).ravel()
        if "uv" in data:
            values["vertex_texcoords"] = np.asarray(data["uv"], np.float32).ravel()
        values.update()
        return mesh

    def _bsdf(self, data: dict[str, Any]) -> dict[str, Any]:
        kind = str(data["type"])
        if kind == "dielectric":
            return {"type": "dielectric", "int_ior": float(data["ior"])}
        if kind == "conductor":
            bsdf = {"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": float(data["alpha"]),
                    "specular_reflectance": self._rgb(data["reflectance"])}
        elif kind == "principled":
            bsdf = {"type": "principled", "base_color": self._rgb(data["base_color"])}
            bsdf |= {key: float(data[key]) for key in ("roughness", "metallic", "specular")}
        elif "texture" in data:
            pixels = self._mi.TensorXf(np.asarray(data["texture"], np.float32))
            bitmap = {"type": "bitmap", "data": pixels, "raw": True, "filter_type": "bilinear"}
            bsdf = {"type": "diffuse", "reflectance": bitmap}
        else:
            bsdf = {"type": "diffuse", "reflectance": self._rgb(data["reflectance"])}
        return {"type": "twosided", "bsdf": bsdf}

    def _light(self, data: dict[str, Any]) -> dict[str, Any]:
        kind = str(data["type"])
        if kind == "point":
            return {"type": kind, "position": [float(x) for x in data["position"]],
                    "intensity": self._rgb(data["intensity"])}
        if kind == "directional":
            return {"type": kind, "direction": [float(x) for x in data["direction"]],
                    "irradiance": self._rgb(data["irradiance"])}
        if kind == "spot":
            pose = self._mi.ScalarTransform4f().look_at(
                origin=[float(x) for x in data["position"]], target=[float(x) for x in data["target"]], up=[0, 0.6, 0.8]
            )
            return {"type": kind, "to_world": pose, "intensity": self._rgb(data["intensity"]),
                    "cutoff_angle": float(data["cutoff"]), "beam_width": float(data["beam"])}
        if kind == "constant":
            return {"type": kind, "radiance": self._rgb(data["radiance"])}
        return {"type": "envmap", "bitmap": self._mi.Bitmap(np.asarray(data["bitmap"], np.float32))}

    def _integrator(self, kind: str) -> Any:
        if kind not in self._integrators:
            if kind in PROJECTIVE:
                settings = PROJECTIVE[kind]
                properties: dict[str, Any] = {k: v for k, v in settings.items() if k in _LOADED_AS_PROPERTY}
                direct = {"type": "direct_projective"}
                deep = {"type": "prb_projective", "max_depth": self._depth, "rr_depth": 1000}
                integrator = self._mi.load_dict((direct if self._depth <= 2 else deep) | properties)
                for name, value in settings.items():
                    if name not in properties:
                        setattr(integrator, name, value)
            else:
                limit = {"max_depth": self._depth} if kind in ("path", INTERIOR) else {}
                integrator = self._mi.load_dict({"type": kind, **limit})
            self._integrators[kind] = integrator
        return self._integrators[kind]

    def configurations(self) -> list[tuple[str, str]]:
        """(integrator, sampler) that render this scene: "path", and "direct" where that is the same."""
        kinds = ("path", "direct") if self._depth == 2 else ("path",)
        return [(kind, sampler) for kind in kinds for sampler in SAMPLERS]

    def render(self, *, spp: int, seed: int, integrator: str = "path", sampler: str = "independent") -> F32:
        """(H, W, 3) image; Russian roulette as Mitsuba has it by default."""
        sensor = SAMPLERS.index(sampler)
        return np.array(self._integrator(integrator).render(self._scene, sensor=sensor, seed=seed, spp=spp))

    def derivative_settings(self) -> list[str]:
        """Integrators that are made for what moves in this scene."""
        moves = any(key.endswith(("vertex_positions", "to_world")) for key in self._moved)
        return list(PROJECTIVE) if moves else [INTERIOR]

    def forward(self, *, spp: int, seed: int, setting: str) -> F32:
        """(H, W, 3) derivative of the picture along theta."""
        mi, dr = self._mi, self._dr
        theta = dr.opaque(mi.Float, 0)  # a literal would be folded away
        dr.enable_grad(theta)
        for key, (value, rate) in self._moved.items():
            if key == "sensor0.to_world":
                self._params[key] = mi.Transform4f().translate(mi.Vector3f(*map(float, rate)) * theta) @ value
            else:
                self._params[key] = value + rate * theta
        self._params.update()
        dr.forward(theta, dr.ADFlag.ClearEdges)
        try:
            return np.array(self._integrator(setting).render_forward(self._scene, params=theta, seed=seed, spp=spp))
        finally:
            self._reset()

    def backward(self, adjoint: F32, *, spp: int, seed: int, setting: str) -> NDArray[np.float64]:
        """(n,) gradient of sum(adjoint * image) with respect to all values that move, one after the other."""
        mi, dr = self._mi, self._dr
        for key, (value, _) in self._moved.items():
            free = type(value)(value)
            dr.enable_grad(free)
            self._params[key] = free
        self._params.update()
        self._integrator(setting).render_backward(
            self._scene, params=self._params, grad_in=mi.TensorXf(adjoint), seed=seed, spp=spp
        )
        found = [np.array(dr.grad(self._params[key]), np.float64).ravel() for key in self._moved]
        self._reset()
        return np.concatenate(found)

    def _reset(self) -> None:
        for key, (value, _) in self._moved.items():
            self._params[key] = type(value)(value)
        self._params.update()


def _key(path: str) -> str:
    """Mitsuba's name of a parameter."""
    collection, *_, field = path.split(".")
    if collection == "camera":
        return "sensor0.to_world"
    name = path.split(".")[1]
    names = {"vertices": "vertex_positions", "base_color": "bsdf.brdf_0.reflectance.value",
             "roughness": "bsdf.brdf_0.roughness.value", "emission": "emitter.radiance.value",
             "color": "intensity.value"}
    return f"{name}.{names[field]}"
