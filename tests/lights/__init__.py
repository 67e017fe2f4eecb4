"""Tests of lights: their samples, their choice, and what they light."""
