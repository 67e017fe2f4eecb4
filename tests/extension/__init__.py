"""Tests of the extension: its zip, its wheels, and how it is loaded."""
