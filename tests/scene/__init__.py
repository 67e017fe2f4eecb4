"""Tests of scenes, files and expressions."""
