"""Fits of distance fields: variables for their coefficients, and steps that change their topology."""
