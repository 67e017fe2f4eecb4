"""A temporary scene with a camera, whose pictures by Cycles are the bakes of worlds and lamps."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Euler
from numpy.typing import NDArray

from edgegrad.images import read_image

from ...problem import Problem
from ..nodes.links import reached
from ..surroundings.camera import panorama_settings
from .bake import Temporary, new_scene

SAMPLES = 16


class BakeScene:
    """An empty scene with a camera.

    Attributes
    ----------
    scene, camera, lens
        Blender's scene, camera object and camera.
    pose
        Transform of the camera for panoramas; at first it looks along +X.
    """

    def __init__(self, keep: Temporary, where: str) -> None:
        scene = self.scene = keep(new_scene())
        self._where = where
        scene.render.engine = "CYCLES"
        scene.render.resolution_percentage = 100
        scene.render.use_compositing = scene.render.use_sequencer = False
        cycles = scene.cycles
        cycles.device, cycles.samples, cycles.pixel_filter_type = "CPU", SAMPLES, "BOX"
        cycles.use_adaptive_sampling = cycles.use_denoising = False
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
        settings = scene.render.image_settings
        settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
        # Blender creates this image at the first render.
        if "Render Result" not in bpy.data.images:
            keep.later(lambda: bpy.data.images.get("Render Result"))
        self.lens = keep(bpy.data.cameras.new("Edgegrad bake"))
        self.camera = keep(bpy.data.objects.new("Edgegrad bake", self.lens))
        scene.collection.objects.link(self.camera)
        scene.camera = self.camera
        self.pose = Euler((0.5 * np.pi, 0.0, -0.5 * np.pi)).to_matrix().to_4x4()

    def panorama(self, width: int) -> NDArray[np.float32]:
        """Render the whole sphere around the camera, as `pose` turns it, to (width / 2, width, 3)."""
        self.lens.type = "PANO"
        panorama_settings(self.lens).panorama_type = "EQUIRECTANGULAR"
        self.camera.matrix_world = self.pose
        return self.picture(width, width // 2)

    def picture(self, width: int, height: int) -> NDArray[np.float32]:
        """Render the view of the camera to (height, width, 3), linear."""
        render = self.scene.render
        render.resolution_x, render.resolution_y = width, height
        try:
            with tempfile.TemporaryDirectory() as folder:
                render.filepath = str(Path(folder) / "picture.exr")
                bpy.ops.render.render(write_still=True, scene=self.scene.name)
                return np.asarray(read_image(render.filepath)[..., :3], np.float32)
        except (OSError, ValueError) as error:
            # This is an error of the disk, not of the scene: a fit without the light would be useless.
            raise Problem(f"{self._where}: its picture can't be kept in the temporary folder "
                          f"'{tempfile.gettempdir()}' ({error}); make space, or set TMPDIR") from None  # fmt: skip


def own_groups(tree: Any, keep: Temporary) -> None:
    """Replace the groups of a tree by copies, so that their nodes can be changed."""
    for node in tree.nodes:
        if node.type == "GROUP" and node.node_tree is not None:
            node.node_tree = keep(node.node_tree.copy())
            own_groups(node.node_tree, keep)


def show_to(tree: Any, path: Mapping[str, float]) -> None:
    """Replace the outputs of Light Path nodes by constants (`ray_kinds.LIGHT_PATHS`), since only camera rays render."""
    for node in [node for node in reached(tree) if node.type == "LIGHT_PATH"]:
        inside = node.id_data
        for output in node.outputs:
            targets = [link.to_socket for link in output.links]
            if targets:
                value = inside.nodes.new("ShaderNodeValue")
                value.outputs[0].default_value = path.get(output.identifier, 0.0)
                for socket in targets:
                    inside.links.new(value.outputs[0], socket)
