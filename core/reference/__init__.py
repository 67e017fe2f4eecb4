"""The reference estimators: the interior and boundary integrals of the derivative in numpy and embreex.

Tests compare the native engine with this package, which is also the fallback if the native module cannot be loaded. It
is written for readability. It computes in float64; only the ray queries (embreex) use float32. `native/derivations.md`
derives the formulas.

==================  ==============================================================================
`surfaces`          the triangles of the scene in float64
`film`              the camera: pixel rays, projection, splatting
`rays`              closest hit and occlusion with ignored faces
`sampling`          random numbers, light choice, hemispheres
`light`             direct illumination: area, point and sun lights, the constant environment
`blocks`            the adjoint blocks E, M, S, N and their forward and reverse sinks
`radiance`          the picture
`interior`          interior term: derivative of the radiance along a pixel's ray, with fixed visibility
`edges`             potentially visible edges: candidates, frustum clipping, near faces
`primary`           primary boundary term: edges that move across a pixel, formula (P)
`shadow`            shadow boundary term: edges that move between receivers and lights, formula (S)
`engine`            the interface that `edgegrad.Renderer` calls
==================  ==============================================================================
"""

from .engine import Engine

__all__ = ["Engine"]
