"""Procedural textures."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from edgegrad.expression import procedural as t
from tests.support.node_cases.operands import QX, Cases, P

if TYPE_CHECKING:
    from tests.support.node_cases.blender_nodes import Nodes


def textures() -> Cases:
    """Procedural textures."""
    out: Cases = {
        "checker": (lambda n: n.node("TexChecker", {0: n.p, 1: (0.1, 0.7, 0.3, 1), 2: (0.9, 0.2, 0.4, 1),
                                                    3: 3.0}).outputs[0],
                    t.Checker(P, (0.1, 0.7, 0.3), (0.9, 0.2, 0.4), 3.0)),
    }
    for kind in t.GRADIENTS:
        out[f"gradient {kind}"] = (
            partial(lambda kind, n: n.node("TexGradient", {0: n.p}, gradient_type=kind).outputs[1], kind),
            t.Gradient(P, kind))
    for d in t.DIMENSIONS:
        for output in ("VALUE", "COLOR"):

            def white(n: Nodes, d: str = d, output: str = output) -> Any:
                made = n.node("TexWhiteNoise", {"Vector": n.p, "W": n.component(n.q, 0)}, noise_dimensions=d)
                return made.outputs["Value" if output == "VALUE" else "Color"]

            out[f"white noise {d} {output}"] = (white, t.WhiteNoise(P, QX, d, output))
    return out | _noises() | _waves() | _voronois() | _bricks()


def _noises() -> Cases:
    out: Cases = {}
    values = {"scale": 2.3, "detail": 3.4, "roughness": 0.6, "lacunarity": 2.2, "offset": 0.4, "gain": 1.3}

    def case(d: str, kind: str, normalize: bool, output: str, distortion: float) -> Any:
        def node(n: Nodes) -> Any:
            sockets = {key.capitalize(): value for key, value in values.items()}
            sockets |= {"Distortion": distortion, "Vector": n.p, "W": n.component(n.q, 0)}
            made = n.node("TexNoise", sockets, noise_dimensions=d, noise_type=kind, normalize=normalize)
            return made.outputs[0 if output == "FAC" else 1]

        return node, t.Noise(P, QX, **values, distortion=distortion, dimensions=d, kind=kind, normalize=normalize,
                             output=output)

    for d in t.DIMENSIONS:
        for kind in t.NOISES:
            out[f"noise {d} {kind}"] = case(d, kind, False, "FAC", 0.0)
        out[f"noise {d} color"] = case(d, "FBM", True, "COLOR", 0.5)
    return out


def _waves() -> Cases:
    out: Cases = {}

    def wave(kind: str, direction: str, profile: str, distortion: float) -> Any:
        def node(n: Nodes) -> Any:
            values = {"Vector": n.p, "Scale": 0.7, "Distortion": distortion, "Detail": 2.5, "Detail Scale": 1.2,
                      "Detail Roughness": 0.4, "Phase Offset": 0.3}
            made = n.node("TexWave", values, wave_type=kind, wave_profile=profile)
            setattr(made, f"{kind.lower()}_direction", direction)
            return made.outputs[1]

        return node, t.Wave(P, 0.7, distortion, 2.5, 1.2, 0.4, 0.3, kind, direction, profile)

    for profile in ("SIN", "SAW", "TRI"):
        for direction in ("X", "DIAGONAL"):
            out[f"wave bands {direction} {profile}"] = wave("BANDS", direction, profile, 0.0)
        for direction in ("Z", "SPHERICAL"):
            out[f"wave rings {direction} {profile}"] = wave("RINGS", direction, profile, 0.8)
    for depth in range(11):
        out[f"magic {depth}"] = (
            partial(lambda depth, n: n.node("TexMagic", {0: n.p, 1: 1.3, 2: 0.9}, turbulence_depth=depth).outputs[0],
                    depth),
            t.Magic(P, 1.3, 0.9, depth))
    return out


def _voronois() -> Cases:
    sockets = {"DISTANCE": "Distance", "COLOR": "Color", "POSITION": "Position", "W": "W", "RADIUS": "Radius"}

    def case(d: str, feature: str, metric: str, output: str, detail: float, normalize: bool) -> Any:
        values = {"scale": 1.7, "detail": detail, "roughness": 0.6, "lacunarity": 2.1, "smoothness": 0.7,
                  "exponent": 0.8, "randomness": 0.9}

        def node(n: Nodes) -> Any:
            named = {key.capitalize(): value for key, value in values.items()}
            made = n.node("TexVoronoi", {**named, "Vector": n.p, "W": n.component(n.q, 0)}, voronoi_dimensions=d,
                          feature=feature, distance=metric, normalize=normalize)
            return {socket.name: socket for socket in made.outputs}[sockets[output]]

        return node, t.Voronoi(P, QX, **values, dimensions=d, feature=feature, metric=metric, normalize=normalize,
                               output=output)

    out: Cases = {}
    for d in t.DIMENSIONS:
        for feature in ("F1", "F2", "SMOOTH_F1"):
            for output in ("DISTANCE", "COLOR", "W" if d == "1D" else "POSITION"):
                out[f"voronoi {d} {feature} {output}"] = case(d, feature, "EUCLIDEAN", output, 1.4, True)
            out[f"voronoi {d} {feature} one octave"] = case(d, feature, "EUCLIDEAN", "COLOR", 0.0, False)
        for metric in t.VORONOI_METRICS[1:]:
            out[f"voronoi {d} {metric}"] = case(d, "F1", metric, "DISTANCE", 0.0, True)
        out[f"voronoi {d} edge"] = case(d, "DISTANCE_TO_EDGE", "EUCLIDEAN", "DISTANCE", 0.0, False)
        out[f"voronoi {d} edge octaves"] = case(d, "DISTANCE_TO_EDGE", "EUCLIDEAN", "DISTANCE", 1.4, True)
        out[f"voronoi {d} radius"] = case(d, "N_SPHERE_RADIUS", "EUCLIDEAN", "RADIUS", 0.0, False)
    return out


def _bricks() -> Cases:
    colors = {"Color1": (0.8, 0.1, 0.2, 1), "Color2": (0.2, 0.6, 0.1, 1), "Mortar": (0.9, 0.9, 0.3, 1)}

    def case(output: str, smooth: float, width: float = 0.6, height: float = 0.3) -> Any:
        values = {"Scale": 3.0, "Mortar Size": 0.1, "Mortar Smooth": smooth, "Bias": 0.1, "Brick Width": width,
                  "Row Height": height}

        def node(n: Nodes) -> Any:
            # Only linked sizes can be 0.
            zero = n.node("Math", {0: n.component(n.p, 0), 1: -99.0}, operation="LESS_THAN").outputs[0]
            linked = {key: value or zero for key, value in values.items()}
            made = n.node("TexBrick", {"Vector": n.p, **colors, **linked}, offset=0.4, offset_frequency=3,
                          squash=1.3, squash_frequency=2)
            return made.outputs[0 if output == "COLOR" else 1]

        c: list[Any] = [tuple(float(x) for x in color[:3]) for color in colors.values()]
        return node, t.Brick(P, *c, *values.values(), offset=0.4,  # type: ignore[misc]
                             offset_frequency=3, squash=1.3, squash_frequency=2, output=output)

    return {"brick": case("COLOR", 0.2), "brick mortar": case("FAC", 0.0),
            "brick no height": case("COLOR", 0.2, height=0.0), "brick no width": case("COLOR", 0.2, width=0.0)}
