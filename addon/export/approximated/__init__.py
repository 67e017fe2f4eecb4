"""Approximations of subsurface scattering and volumes, and warnings about their error."""
