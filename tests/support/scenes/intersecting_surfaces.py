"""Glowing meshes that pass through each other or through themselves."""

from __future__ import annotations

from functools import partial

import numpy as np

import edgegrad
from tests.support import shapes
from tests.support.scenes.glowing_shapes import (
    POSE,
    VIEW,
    glowing_scene,
    moved,
    turn,
)
from tests.support.small_scenes import Make, box, camera, glowing, rectangle


def intersecting_boxes(theta: float) -> edgegrad.Scene:
    """Two emissive boxes through each other, which move and turn."""
    scene = glowing_scene(VIEW)
    one = box((0.1, 0.0, 0.0), (0.5, 0.3, 0.3), "warm", 0.4)
    other = box((-0.1, 0.1, 0.1), (0.25, 0.5, 0.35), "cold", 1.0)
    tilt = turn(0.5 + 0.6 * theta, 2)
    one.vertices = one.vertices @ tilt.T + theta * np.array([0.3, 0.2, 0.4])
    other.vertices = other.vertices @ turn(-0.3, 0).T - theta * np.array([0.2, 0.5, 0.3])
    scene.meshes = {"one": one, "other": other}
    return scene


def sunk_ball(theta: float) -> edgegrad.Scene:
    """A ball that sinks into a floor."""
    scene = glowing_scene(camera((0.2, 1.2, 2.6), (0, 0, 0), 32, 0.8))
    vertices, faces = shapes.ball(3, 0.6)
    scene.meshes = {
        "floor": rectangle((0, 0, 0), (0, 0, 1.2), (1.2, 0, 0), "warm"),
        "ball": edgegrad.Mesh(vertices + [0.1, 0.1, 0.0] + theta * np.array([0.3, -0.8, 0.2]), faces, ("cold",)),
    }
    return scene


def folded(theta: float) -> edgegrad.Scene:
    """One mesh that passes through itself: two bands that cross, of two materials."""
    scene = glowing_scene(VIEW)
    one = rectangle((0, 0, 0), (0.8, 0, 0.3), (0, 0.3, 0.1), "both")
    other = rectangle((0.1, 0, 0), (0.2, 0.5, -0.6), (0.4, -0.3, 0.2), "both")
    vertices = np.concatenate([one.vertices + theta * np.array([0.2, 0.5, 0.3]), other.vertices])
    scene.meshes = {
        "bands": edgegrad.Mesh(
            vertices,
            np.concatenate([one.faces, other.faces + 4]),
            ("both", "glow"),
            face_material=np.array([0, 0, 1, 1], np.int32),
        )
    }
    scene.materials = {"both": glowing(1.5, True), "glow": glowing(0.4, True)}
    return scene


def sunk_balls(theta: float) -> edgegrad.Scene:
    """A ball of many faces that sinks into another."""
    scene = glowing_scene(VIEW)
    vertices, faces = shapes.ball(5, 0.5)
    other = 0.7 * vertices @ turn(0.3, 0).T + [0.05, 0.0, 0.25] + theta * np.array([0.4, 0.5, -0.7])
    scene.meshes = {"ball": edgegrad.Mesh(vertices, faces, ("warm",)), "other": edgegrad.Mesh(other, faces, ("cold",))}
    return scene


def grown_together(theta: float) -> edgegrad.Scene:
    """Both as one mesh, in which the second is inside out: normals that differ little are one smooth surface's."""
    scene = sunk_balls(theta)
    one, other = scene.meshes.values()
    faces = np.concatenate([one.faces, other.faces[:, ::-1] + len(one.vertices)])
    material = np.repeat(np.array([0, 1], np.int32), len(one.faces))
    vertices = np.concatenate([one.vertices, other.vertices])
    scene.meshes = {"balls": edgegrad.Mesh(vertices, faces, ("both", "in"), face_material=material)}
    scene.materials = {"both": glowing(1.5, True), "in": glowing(0.4, True)}
    return scene


def grown_about_one_middle(theta: float, way: int = 1) -> edgegrad.Scene:
    """A mesh of two bodies that cross, each of which is seen whole from the middle of both; `way` -1: the second is
    inside out.
    """
    scene = glowing_scene(VIEW)
    ball, faces = shapes.ball(4, 1.0)
    tilt = turn(0.5, 1).T @ turn(0.3, 0).T
    one, other = ball * [0.75, 0.3, 0.22] @ tilt, ball * [0.2, 0.42, 0.7] @ tilt
    vertices = np.concatenate([one, other + theta * np.array([0.4, 0.3, -0.5])])
    material = np.repeat(np.array([0, 1], np.int32), len(faces))
    faces = np.concatenate([faces, faces[:, ::way] + len(ball)])
    scene.meshes = {"bodies": edgegrad.Mesh(vertices, faces, ("both", "in"), face_material=material)}
    scene.materials = {"both": glowing(1.5, True), "in": glowing(0.4, True)}
    return scene


def speared(theta: float) -> edgegrad.Scene:
    """A ball whose hindmost vertex is drawn through it and out in front: most faces are seen from behind, not those."""
    scene = glowing_scene(VIEW)
    vertices, faces = shapes.ball(2, 0.7)
    hindmost = int(np.argmin(vertices[:, 2] + 1e-3 * vertices[:, 0]))
    vertices[hindmost] = np.array([0.5, -0.1, 1.1]) + theta * np.array([0.8, 0.5, 0.0])
    spear = (faces == hindmost).any(axis=1)
    assert not spear[0]
    scene.meshes = {"body": edgegrad.Mesh(vertices, faces, ("both", "in"), face_material=spear.astype(np.int32))}
    scene.materials = {"both": glowing(1.5, True), "in": glowing(0.4, True)}
    return scene


def camera_moves_before_boxes(theta: float) -> edgegrad.Scene:
    """The camera moves before two boxes that stand still in each other."""
    scene = intersecting_boxes(0.0)
    scene.camera = moved(VIEW, 1, 0.6, (0.7, 0.3, -0.5))(theta).camera
    return scene


INTERSECTING: dict[str, tuple[Make, list[str]]] = {
    "boxes": (intersecting_boxes, ["meshes.one.vertices", "meshes.other.vertices"]),
    "ball in the floor": (sunk_ball, ["meshes.ball.vertices"]),
    "a mesh and itself": (folded, ["meshes.bands.vertices"]),
    "meshes of many faces": (sunk_balls, ["meshes.ball.vertices", "meshes.other.vertices"]),
    "a mesh of many faces and itself": (grown_together, ["meshes.balls.vertices"]),
    "bodies about one middle": (grown_about_one_middle, ["meshes.bodies.vertices"]),
    "one of them inside out": (partial(grown_about_one_middle, way=-1), ["meshes.bodies.vertices"]),
    "a ball and its spear": (speared, ["meshes.body.vertices"]),
    "seen by a moving camera": (camera_moves_before_boxes, POSE),
}
