"""Mitsuba 3 on the benchmark scenes: render, and gradients of all vertices by its projective sampling.

Needs ``pip install mitsuba`` (measured with 3.9.1) and an LLVM of version 16 or newer as a shared library
(Debian: libllvm19), which is found by itself; DRJIT_LIBLLVM_PATH overrides it.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]

OLDEST_LLVM = 16
# Mitsuba's camera looks down +Z with +X to the left; the scenes' looks down -Z.
_TURNED = np.diag([-1.0, 1.0, -1.0, 1.0])

# Integrators that give the derivative of direct light with its visibility terms. How Mitsuba guides the samples of
# indirect silhouettes decides its cost, so each setting is measured. "primary only" leaves indirect silhouettes out:
# exactly what sphere_env needs, whose sphere is convex.
BACKWARD: dict[str, dict[str, Any]] = {
    "default guiding": {},
    "light guiding": {"proj_seed_spp": 16, "octree_extra_leaf_sample": 16, "octree_max_depth": 7},
    "no guiding": {"guiding": "none"},
    "primary only": {"sppi": 0},
}
_LOADED_AS_PROPERTY = ("guiding", "sppi")


def find_llvm() -> str | None:
    """Path of the newest LLVM shared library that Dr.Jit can use, or None."""
    candidates = []
    for pattern in ("usr/lib/*/libLLVM*.so*", "usr/lib/llvm-*/lib/libLLVM*.so*", "usr/lib64/libLLVM*.so*"):
        for path in Path("/").glob(pattern):
            version = re.search(r"libLLVM(?:-|\.so\.)(\d+)", path.name)
            if version and int(version[1]) >= OLDEST_LLVM:
                candidates.append((int(version[1]), str(path)))
    return max(candidates)[1] if candidates else None


class MitsubaPeer:
    """One benchmark scene in Mitsuba (variant ``llvm_ad_rgb``).

    Parameters
    ----------
    scene
        A scene of `tests.benchmarks.scenes`: diffuse meshes, some emissive, and constant environments.
    threads
        Threads that Dr.Jit may use.

    Raises
    ------
    ImportError
        If Mitsuba or LLVM is missing.
    """

    def __init__(self, scene: dict[str, Any], threads: int) -> None:
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
        self._mi, self._dr = mitsuba, drjit
        self.version: str = mitsuba.__version__
        camera = scene["camera"]
        film = {"type": "hdrfilm", "width": int(camera["width"]), "height": int(camera["height"]),
                "rfilter": {"type": "box"}, "pixel_format": "rgb", "component_format": "float32"}
        description: dict[str, Any] = {
            "type": "scene",
            "sensor": {
                "type": "perspective",
                "fov": float(camera["fov_x"]),
                "fov_axis": "x",
                "near_clip": 0.01,
                "far_clip": 1e4,
                "to_world": mitsuba.ScalarTransform4f(np.asarray(camera["to_world"]) @ _TURNED),
                "film": film,
                "sampler": {"type": "independent"},
            },
        }
        description |= {f"mesh{k}": self._mesh(f"mesh{k}", m) for k, m in enumerate(scene["meshes"])}
        for k, light in enumerate(scene["lights"]):
            description[f"light{k}"] = {"type": "constant", "radiance": self._rgb(light["radiance"])}
        self._scene = mitsuba.load_dict(description)
        self._params = mitsuba.traverse(self._scene)
        self._keys = [f"mesh{int(k)}.vertex_positions" for k in scene["parameter"]["meshes"]]
        self._params.keep(self._keys)
        self._integrators: dict[str, Any] = {}

    def _rgb(self, value: Any) -> dict[str, Any]:
        return {"type": "rgb", "value": [float(c) for c in value]}

    def _mesh(self, name: str, data: dict[str, Any]) -> Any:
        mi = self._mi
        bsdf: dict[str, Any] = {"type": "diffuse", "reflectance": self._rgb(data["bsdf"]["reflectance"])}
        properties = mi.Properties()
        properties["mesh_bsdf"] = mi.load_dict({"type": "twosided", "bsdf": bsdf})
        if "emission" in data:
            properties["emitter"] = mi.load_dict({"type": "area", "radiance": self._rgb(data["emission"])})
        mesh = mi.Mesh(name, len(data["vertices"]), len(data["faces"]), props=properties)
        values = mi.traverse(mesh)
        values["vertex_positions"] = np.asarray(data["vertices"], np.float32).ravel()
        values["faces"] = np.asarray(data["faces"], np.uint32).ravel()
        values.update()
        return mesh

    def _integrator(self, kind: str) -> Any:
        if kind not in self._integrators:
            if kind in BACKWARD:
                settings = BACKWARD[kind]
                properties: dict[str, Any] = {k: v for k, v in settings.items() if k in _LOADED_AS_PROPERTY}
                description = {"type": "direct_projective"} | properties
                integrator = self._mi.load_dict(description)
                for name, value in settings.items():
                    if name not in properties:
                        setattr(integrator, name, value)
            else:
                limit: dict[str, Any] = {"max_depth": 2, "rr_depth": 1000} if kind == "path" else {}
                integrator = self._mi.load_dict({"type": kind} | limit)
            self._integrators[kind] = integrator
        return self._integrators[kind]

    def render(self, *, spp: int, seed: int, integrator: str = "path") -> F32:
        """(H, W, 3) image; `integrator` is "path" (of depth 2) or "direct"."""
        image = self._integrator(integrator).render(self._scene, seed=seed, spp=spp)
        return np.array(image)

    def backward(self, adjoint: F32, *, spp: int, seed: int, setting: str) -> NDArray[np.float64]:
        """(V, 3) gradient of sum(adjoint * image) with respect to the moving meshes' vertices, one after the other."""
        mi, dr = self._mi, self._dr
        for key in self._keys:
            vertices = mi.Float(dr.detach(self._params[key]))
            dr.enable_grad(vertices)
            self._params[key] = vertices
        self._params.update()
        self._integrator(setting).render_backward(
            self._scene, params=self._params, grad_in=mi.TensorXf(adjoint), seed=seed, spp=spp
        )
        return np.concatenate([np.array(dr.grad(self._params[k]), np.float64).reshape(-1, 3) for k in self._keys])
