"""Tests of what is computed, skipped and said."""
