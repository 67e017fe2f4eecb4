"""Tests of the interior term."""
