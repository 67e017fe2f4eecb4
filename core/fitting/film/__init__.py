"""Fits of films: every frame is a picture, with values of its own of the keyed parameters."""
