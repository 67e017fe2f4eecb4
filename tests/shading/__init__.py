"""Tests of BSDFs and their derivatives."""
