"""Renders by Blender with the engine Edgegrad, without a window."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
import edgegrad_addon
from edgegrad_addon.export import export_scene, render_export
from edgegrad_addon.render_engine import engine, final
from tests.support.scenes import blender_scenes as bs

SIZE, SAMPLES = 24, 11
TILT = (0.3, 0.4, 0.1)


@pytest.fixture(autouse=True)
def scene() -> Iterator[Any]:
    made = bs.empty(SIZE)
    edgegrad_addon.register()
    bs.camera()
    bs.light("POINT")
    bs.world((0.1, 0.2, 0.3))
    bs.add("Cube", bs.cube("Cube", bs.material("Red", (0.8, 0.3, 0.2))), rotation=TILT).pass_index = 3
    bs.add("Plane", bs.plane("Plane", 4.0, bs.material("Green", (0.2, 0.4, 0.3))), (0, 0, -2)).pass_index = 7
    made.render.engine = "EDGEGRAD"
    made.edgegrad_render.samples = SAMPLES
    yield made
    edgegrad_addon.unregister()


def rendered(folder: Path, **arguments: Any) -> dict[str, NDArray[np.float32]]:
    """Render a frame; return its channels by the last two parts of their names."""
    render, settings = bpy.context.scene.render, bpy.context.scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
    render.filepath = str(folder / "frame_####.exr" if arguments.get("animation") else folder / "frame.exr")
    assert bpy.ops.render.render(write_still=True, **arguments) == {"FINISHED"}
    return channels(folder / "frame.exr") if not arguments.get("animation") else {}


def channels(path: Path) -> dict[str, NDArray[np.float32]]:
    with OpenEXR.File(str(path), separate_channels=True) as file:
        found = {name: channel.pixels.copy() for part in file.parts for name, channel in part.channels.items()}
    return {".".join(name.split(".")[-2:]): values for name, values in found.items()}


def color(found: dict[str, NDArray[np.float32]], name: str = "Combined", letters: str = "RGB") -> NDArray[np.float32]:
    return np.stack([found[f"{name}.{letter}"] for letter in letters], axis=2)


class Watched:
    """Blender's engine with some functions replaced."""

    def __init__(self, of: Any, replaced: dict[str, Callable[..., Any]]) -> None:
        self._of = of
        self.__dict__ |= replaced

    def __getattr__(self, name: str) -> Any:
        return getattr(self._of, name)


def watch(monkeypatch: Any, **replaced: Callable[..., Any]) -> None:
    """Render with replaced functions of Blender's engine."""
    monkeypatch.setattr(engine, "render_frame",
                        lambda of, depsgraph: final.render_frame(Watched(of, replaced), depsgraph))  # fmt: skip


def expected(samples: int = SAMPLES, seed: int = 0) -> NDArray[np.float32]:
    export = export_scene(bpy.context.scene)
    return render_export(export.scene, export.settings, samples, seed)


def test_a_frame_is_the_picture_of_all_samples(scene: Any, tmp_path: Path) -> None:
    scene.edgegrad_render.seed = 5
    found = rendered(tmp_path)
    assert color(found).tobytes() == expected(seed=5).tobytes()
    assert (found["Combined.A"] == 1.0).all()


def test_percentage_and_region(scene: Any, tmp_path: Path) -> None:
    """A region is rendered alone, with the pixels that it has in the full picture, and the rest is black."""
    render = scene.render
    render.resolution_percentage = 50
    full = color(rendered(tmp_path))
    assert full.shape == (SIZE // 2, SIZE // 2, 3) and full.tobytes() == expected().tobytes()
    render.use_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.75, 0.5, 1.0
    inside = np.s_[0 : SIZE // 4, SIZE // 8 : 3 * SIZE // 8]
    found = color(rendered(tmp_path))
    assert np.array_equal(found[inside], full[inside])
    assert found.sum(dtype=np.float64) == full[inside].sum(dtype=np.float64)
    render.use_crop_to_border = True
    assert np.array_equal(color(rendered(tmp_path)), full[inside])


def test_passes_show_what_the_camera_sees(scene: Any, tmp_path: Path) -> None:
    layer = scene.view_layers[0]
    for one in final.CHANNELS:
        setattr(layer, one.switch, True)
    ours = rendered(tmp_path)
    names = {one.content: one.name for one in final.CHANNELS}
    scene.render.engine = "CYCLES"
    theirs = rendered(tmp_path)
    # Depth and index are those of one point of a pixel, and differ at outlines.
    inner = np.isin(ours[f"{names['object index']}.X"], (0.0, 3.0, 7.0))
    index = theirs[f"{names['object index']}.X"]
    same = inner & (ours[f"{names['object index']}.X"] == index)
    assert same.mean() > 0.9 and set(np.unique(index)) == {0.0, 3.0, 7.0}
    depth, other = ours[f"{names['depth']}.Z"], theirs[f"{names['depth']}.Z"]
    hit = same & (index > 0.0)
    assert np.abs(depth - other)[hit].max() < 0.1 and np.abs(depth - other)[hit].mean() < 0.03
    assert (depth[same & (index == 0.0)] == other[same & (index == 0.0)]).all()
    # Normal and colour are means of many samples over the pixel.
    for content, letters in (("normal", "XYZ"), ("albedo", "RGB")):
        one, two = color(ours, names[content], letters), color(theirs, names[content], letters)
        assert np.abs(one - two).mean() < 0.02 and one[hit].std() > 0.05
        eroded = np.pad(index, 1, mode="edge")
        flat = np.all([eroded[1 + y : SIZE + 1 + y, 1 + x : SIZE + 1 + x] == index
                       for x in (-1, 0, 1) for y in (-1, 0, 1)], axis=0)  # fmt: skip
        if content == "albedo":
            assert one[flat] == pytest.approx(two[flat], abs=1e-5)


def test_transparent_film_and_holdouts_have_alpha(scene: Any, tmp_path: Path) -> None:
    scene.render.film_transparent = True
    bpy.data.objects["Plane"].is_holdout = True
    ours = rendered(tmp_path)
    assert color(ours).tobytes() == expected().tobytes()
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 256
    theirs = rendered(tmp_path)["Combined.A"]
    alpha = ours["Combined.A"]
    assert np.abs(alpha - theirs).mean() < 0.03 and set(np.unique(np.rint(alpha))) == {0.0, 1.0}
    assert np.array_equal(alpha == 0.0, theirs == 0.0) or np.abs(alpha - theirs).max() < 0.5


def test_clear_materials_let_channels_through(scene: Any, tmp_path: Path) -> None:
    """A plane of which 3/4 are transparent stands before the others."""
    scene.render.film_transparent = True
    layer = scene.view_layers[0]
    layer.use_pass_diffuse_color = True
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    half = bs.material("Half", (0.5, 0.5, 0.5), "ShaderNodeBsdfPrincipled", Alpha=0.25)
    bs.add("Front", bs.plane("Front", 40.0, half), (0, 0, 2))
    found = rendered(tmp_path)
    name = next(one.name for one in final.CHANNELS if one.content == "albedo")
    middle = SIZE // 2, SIZE // 2
    assert found["Combined.A"][0, 0] == pytest.approx(0.25, abs=0.15)
    assert found["Combined.A"][middle] == 1.0
    seen = color(found, name)
    behind, front = np.array([0.2, 0.4, 0.3]), np.full(3, 0.5)
    assert seen[6:-6, 6:-6].mean(axis=(0, 1)) == pytest.approx(0.25 * front + 0.75 * behind, abs=0.03)


def add_fog() -> None:
    """Add a cube that scatters light."""
    fog = bpy.data.materials.new("Fog")
    fog.use_nodes = True
    nodes = fog.node_tree.nodes
    nodes.clear()
    fog.node_tree.links.new(nodes.new("ShaderNodeVolumeScatter").outputs[0],
                            nodes.new("ShaderNodeOutputMaterial").inputs["Volume"])  # fmt: skip
    bs.add("Fog", bs.cube("Fog", fog), scale=(1.5, 1.5, 1.5))


def test_volumes_leave_channels_as_they_are(scene: Any, tmp_path: Path) -> None:
    for one in final.CHANNELS:
        setattr(scene.view_layers[0], one.switch, True)
    clear = rendered(tmp_path)
    add_fog()
    foggy = rendered(tmp_path)
    assert not np.array_equal(foggy["Combined.R"], clear["Combined.R"]) and (foggy["Combined.A"] == 1.0).all()
    for one in final.CHANNELS:
        for letter in "XYZRGB":
            if (name := f"{one.name}.{letter}") in clear:
                np.testing.assert_allclose(foggy[name], clear[name], rtol=1e-5, atol=1e-5)


def test_the_alpha_of_fog_is_what_it_hides_of_the_world(scene: Any, tmp_path: Path) -> None:
    for name in ("Cube", "Plane"):
        bpy.data.objects.remove(bpy.data.objects[name])
    add_fog()
    scene.render.film_transparent = True
    ours = rendered(tmp_path)["Combined.A"]
    scene.render.engine, scene.cycles.samples = "CYCLES", 64
    theirs = rendered(tmp_path)["Combined.A"]
    assert 0.05 < ours.mean() < 0.95 and ours.mean() == pytest.approx(theirs.mean(), rel=0.01)
    assert np.abs(ours - theirs).mean() < 0.05


def test_animated_values_are_those_of_each_frame(scene: Any, tmp_path: Path) -> None:
    cube = bpy.data.objects["Cube"]
    shader = bs.shader(bpy.data.materials["Red"]).inputs["Color"]
    light = bpy.data.lights["Light"]
    background = scene.world.node_tree.nodes["Background"].inputs["Strength"]
    for frame in (1, 3):
        cube.location.x = 0.2 * frame
        shader.default_value = (0.2 * frame, 0.2, 0.1, 1.0)
        light.energy, background.default_value = 50.0 * frame, 0.5 * frame
        cube.keyframe_insert("location", frame=frame)
        shader.keyframe_insert("default_value", frame=frame)
        light.keyframe_insert("energy", frame=frame)
        background.keyframe_insert("default_value", frame=frame)
    scene.frame_start, scene.frame_end = 1, 3
    rendered(tmp_path, animation=True)
    for frame in (1, 2, 3):
        scene.frame_set(frame)
        found = color(channels(tmp_path / f"frame_{frame:04d}.exr"))
        assert found.tobytes() == expected().tobytes(), f"frame {frame}"


def test_a_cancelled_render_keeps_its_last_picture(scene: Any, tmp_path: Path, monkeypatch: Any) -> None:
    """After some samples, Blender says that the user has cancelled."""
    begun: list[int] = []
    watch(monkeypatch, test_break=lambda: len(begun) > 2)
    add = edgegrad.Progressive.add

    def counted(self: Any, spp: int, progress: Any = None) -> Any:
        begun.append(spp)
        return add(self, spp, progress)

    monkeypatch.setattr(edgegrad.Progressive, "add", counted)
    scene.edgegrad_render.samples = 1 << 20
    found = color(rendered(tmp_path))
    assert begun == [1, 2, 4]
    assert found.tobytes() == expected(3).tobytes()


def test_errors_are_one_sentence(scene: Any, tmp_path: Path) -> None:
    camera = scene.camera
    camera.data.type = "PANO"
    lens = camera.data if hasattr(camera.data, "panorama_type") else camera.data.cycles
    lens.panorama_type = "MIRRORBALL"
    with pytest.raises(RuntimeError, match=r"Camera 'Camera': panoramas of the type Mirror Ball can't be"):
        bpy.ops.render.render()


def test_what_is_left_out_is_reported(scene: Any, monkeypatch: Any) -> None:
    said: list[str] = []
    watch(monkeypatch, report=lambda kind, text: said.append(text))
    scene.view_layers[0].use_pass_mist = True
    scene.render.use_border = True
    scene.render.border_max_x = 0.5
    bpy.data.objects["Cube"].is_shadow_catcher = True
    bpy.ops.render.render()
    assert [line.split(":")[0] for line in said] == ["Object 'Cube'", "View layer 'ViewLayer'"]
    assert said[1].endswith("its passes Mist are not rendered")


def test_a_frame_in_another_thread_bakes_nothing(scene: Any, tmp_path: Path, monkeypatch: Any) -> None:
    """Blender renders in a thread of its own if it has a window; bakes need its main thread."""
    said: list[str] = []
    errors: list[BaseException] = []

    def in_thread(of: Any, depsgraph: Any) -> None:
        def run() -> None:
            try:
                final.render_frame(Watched(of, {"report": lambda kind, text: said.append(text)}), depsgraph)
            except BaseException as error:
                errors.append(error)

        thread = threading.Thread(target=run)
        thread.start()
        thread.join()

    monkeypatch.setattr(engine, "render_frame", in_thread)
    assert color(rendered(tmp_path)).tobytes() == expected().tobytes() and not said and not errors
    material = bpy.data.materials["Red"]
    made = material.node_tree.nodes.new("ShaderNodeTexGabor")
    material.node_tree.links.new(made.outputs["Value"], bs.shader(material).inputs["Color"])
    rendered(tmp_path)
    assert len(said) == 1 and not errors
    assert said[0].startswith("Material 'Red': isn't baked; the sockets' own values are used")


def test_view_layers_are_rendered_one_by_one(scene: Any, tmp_path: Path) -> None:
    other = scene.view_layers.new("Other")
    other.use_sky = False
    found = rendered(tmp_path)
    with OpenEXR.File(str(tmp_path / "frame.exr"), separate_channels=True) as file:
        names = {name.split(".")[0] for part in file.parts for name in part.channels}
    assert {"ViewLayer", "Other"} <= names and found


def test_panels_are_shown_and_hidden(scene: Any) -> None:
    panel = bpy.types.RENDER_PT_output if hasattr(bpy.types, "RENDER_PT_output") else bpy.types.RENDER_PT_format
    surface = bpy.types.EEVEE_MATERIAL_PT_surface
    assert "EDGEGRAD" in panel.COMPAT_ENGINES and "EDGEGRAD" in surface.COMPAT_ENGINES
    assert "EDGEGRAD" not in bpy.types.EEVEE_MATERIAL_PT_volume.COMPAT_ENGINES
    edgegrad_addon.unregister()
    assert "EDGEGRAD" not in panel.COMPAT_ENGINES and "EDGEGRAD" not in surface.COMPAT_ENGINES
    edgegrad_addon.register()
