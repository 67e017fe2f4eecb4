"""Tests of pictures, of engines, and of whole derivatives."""
