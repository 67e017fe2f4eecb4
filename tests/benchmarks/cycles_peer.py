"""Pictures by Cycles of the scene that is open in Blender's module, several seeds each, kept in a cache."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from edgegrad import images

F32 = NDArray[np.float32]


def prepare(scene: Any, samples: int, bounces: int, limits: Mapping[str, float]) -> None:
    """Settings with which Cycles estimates the same integral as Edgegrad, without bias.

    Its defaults clamp indirect light at 10, skip lights that add less than 1 %, and stop where the noise is low; none
    of these has a counterpart in Edgegrad. Filter Glossy is off, since Edgegrad has a part of it only; scenes that show
    it have it in `limits`. Transparent surfaces don't count as bounces.
    """
    scene.render.engine = "CYCLES"
    scene.render.use_compositing = scene.render.use_sequencer = False
    file = scene.render.image_settings
    file.file_format, file.color_mode, file.color_depth = "OPEN_EXR", "RGB", "32"
    cycles = scene.cycles
    cycles.device, cycles.samples = "CPU", samples
    cycles.use_adaptive_sampling = cycles.use_denoising = cycles.use_fast_gi = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0  # off
    cycles.blur_glossy = cycles.light_sampling_threshold = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = bounces
    for kind, limit in limits.items():
        setattr(cycles, kind, limit)
    cycles.transparent_max_bounces = 64


def render(folder: Path, seeds: int) -> tuple[F32, float]:
    """(seeds, H, W, 3) linear pictures of the open scene, and the median of their seconds."""
    scene = bpy.context.scene
    path = folder / "cycles.exr"
    scene.render.filepath = str(path)
    pictures, seconds = [], []
    for seed in range(seeds):
        scene.cycles.seed = seed
        start = time.perf_counter()
        bpy.ops.render.render(write_still=True)
        seconds.append(time.perf_counter() - start)
        pictures.append(images.read_image(path)[..., :3])
    path.unlink()
    if seeds > 1 and np.array_equal(pictures[0], pictures[1]):
        raise RuntimeError("Cycles gave the same picture for two seeds, so that its noise can't be estimated")
    return np.stack(pictures), float(np.median(seconds))


def cached(file: Path, blend: Path, key: str | None = None) -> tuple[F32, float] | None:
    """What `keep` stored in the file, if it was for the same .blend and key (None: whatever the key)."""
    if not (file.is_file() and blend.is_file()):
        return None
    with np.load(file) as stored:
        same = key in (None, str(stored["key"])) and str(stored["blend"]) == _digest(blend)
        return (stored["pictures"], float(stored["seconds"])) if same else None


def keep(file: Path, blend: Path, key: str, pictures: F32, seconds: float) -> None:
    """Store pictures of a .blend under a key."""
    np.savez_compressed(file, key=np.array(key), blend=np.array(_digest(blend)), pictures=pictures, seconds=seconds)


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()
