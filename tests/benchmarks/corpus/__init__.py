"""Benchmarks of derivatives and fits on the scenes of the comparison with Cycles."""
