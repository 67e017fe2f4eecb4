"""Tests of lights: their samples, their choice, and the surfaces that they light."""
