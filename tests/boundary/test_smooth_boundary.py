"""Edges between the facets of smooth-shaded meshes: what goes on across them is no jump, what a facet's own plane cuts
off is one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import edgegrad
from edgegrad.expression import Attribute
from edgegrad.rendering.renderer import Renderer
from tests.support import shapes
from tests.support.picture_differences import check_agreement
from tests.support.shapes import displaced_sphere
from tests.support.small_scenes import Floats, along, camera, matte, need

EPS = 0.01


def lamp_scene(mesh: edgegrad.Mesh) -> edgegrad.Scene:
    """A mesh under a point light from the side, so that the terminator is seen."""
    return edgegrad.Scene(camera(size=32, fov=0.6), {"body": mesh}, {"clay": matte(0.6, 0.5, 0.4)},
                          {"lamp": edgegrad.PointLight(np.array([3.0, 1.0, 0.5]), 500.0)})


def few_faces(theta: float) -> edgegrad.Scene:
    """A sphere of 80 faces that moves and stretches; its normals follow it."""
    vertices = displaced_sphere(2, 0.0)["vertices"]
    faces = np.asarray(displaced_sphere(2, 0.0)["faces"], np.int32)
    vertices = vertices + theta * (np.array([0.6, -0.4, 0.5]) + 0.5 * vertices[:, ::-1])
    return lamp_scene(edgegrad.Mesh(vertices, faces, ("clay",), smoothing=faces))


def closed_mesh(theta: float) -> edgegrad.Scene:
    """A bumpy closed body with a sharp edge around it, that moves."""
    data = displaced_sphere(8, 0.15)
    vertices, faces = np.asarray(data["vertices"]), np.asarray(data["faces"], np.int32)
    half = vertices[faces].mean(axis=1)[:, 1] > 0.1
    smoothing = faces + len(vertices) * half[:, None].astype(np.int32)
    _, number = np.unique(smoothing, return_inverse=True)
    return lamp_scene(edgegrad.Mesh(vertices + theta * np.array([0.5, 0.7, -0.3]), faces, ("clay",),
                                    smoothing=number.reshape(faces.shape).astype(np.int32)))


def split_normals(theta: float) -> edgegrad.Scene:
    """A ball stored with one vertex per corner, with custom normals that turn away from its own, and not all alike."""
    vertices, faces = shapes.split(*shapes.ball(2))
    normals = vertices + 0.25 * np.sin(5.0 * vertices[:, [1, 2, 0]])
    normals[:384] += [0.0, 0.15, 0.0]  # a seam
    body = edgegrad.Mesh(vertices + theta * np.array([0.5, 0.7, -0.3]), faces, ("clay",), smoothing=faces,
                         normals=normals)
    return lamp_scene(body)


@pytest.mark.parametrize("make", [few_faces, closed_mesh, split_normals])
def test_smooth_meshes_agree_with_central_differences(make: Callable[[float], edgegrad.Scene]) -> None:
    need("native")
    check_agreement(along(make, ["meshes.body.vertices"]), eps=EPS, reference_spp=256)


def patch(height: float) -> tuple[edgegrad.Scene, dict[str, Floats]]:
    """A patch that fills the picture, with bumps so low that no facet hides light from itself; colours, normals vary.

    It slides along itself, so that all of the interior term is about what is interpolated.
    """
    vertices, faces = shapes.sheet(17, 6.0)
    vertices[:, 2] = height * np.cos(7.0 * vertices[:, 0]) * np.sin(5.0 * vertices[:, 1])
    colors = 0.5 + 0.4 * np.sin(3.0 * vertices)
    bent = np.array([0.0, 0.0, 1.0]) + 0.3 * np.sin(2.0 * vertices[:, [1, 0, 2]]) * [1, 1, 0]
    mesh = edgegrad.Mesh(vertices, faces, ("clay",), smoothing=faces, normals=bent,
                         attributes={"color": colors[faces].astype(np.float32)})
    clay = edgegrad.Material(np.ones(3), textures={"base_color": Attribute("color")})
    to_world = np.eye(4)
    to_world[:3, 3] = (0.5, -0.4, 3.0)
    lamp = edgegrad.AreaLight(to_world, np.array([1.0, 0.7]), "RECTANGLE", 30.0)
    scene = edgegrad.Scene(camera(size=32, fov=0.6), {"body": mesh}, {"clay": clay}, {"lamp": lamp})
    return scene, {"meshes.body.vertices": np.broadcast_to([1.0, 0.4, 0.0], vertices.shape)}


def test_what_goes_on_across_an_edge_is_no_jump() -> None:
    """Normals, colours and light samples of both sides are those at the edge itself, and cancel."""
    need("native")
    scene, tangent = patch(1e-4)
    assert edgegrad.plan(scene, list(tangent)).terms[1].edges > 100
    parts = {term: Renderer(scene).render_forward(tangent, spp=16, terms=[term]) for term in ("interior", "primary")}
    size = {term: float(np.linalg.norm(part)) for term, part in parts.items()}
    # The remainder is rounding of positions and normals on the two sides.
    assert size["primary"] < 1e-5 * size["interior"]
    assert size["interior"] > 1.0
