"""The reference estimators: the integrals of the derivative in numpy and embreex, written to be read.

This package is the oracle that the native engine is tested against, and the fallback where the native
module can't be loaded. It computes in float64; only the ray queries (embreex) are float32.

==================  ==============================================================================
`surfaces`          the scene's triangles in float64
`film`              the camera: pixel rays, projection, splatting
`rays`              closest hit and occlusion with ignored faces
`sampling`          random numbers, light choice, hemispheres
`light`             what reaches a point: area, point and sun lights, the constant environment
`blocks`            the adjoint blocks E, M, S, N and their forward and reverse sinks
`radiance`          the picture
`interior`          derivative of what a pixel's ray sees
`edges`             edges that may be seen: candidates, frustum clipping, near faces
`primary`           derivative by what moves across the pixel: formula (P)
`shadow`            derivative by what moves between lit points and lights: formula (S)
`engine`            the interface that `edgegrad.Renderer` calls
==================  ==============================================================================
"""

from .engine import Engine

__all__ = ["Engine"]
