"""Derivatives of the tables with respect to the scene's parameters, forwards and backwards."""
