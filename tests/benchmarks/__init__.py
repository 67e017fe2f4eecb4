"""Benchmarks: run time and error beside other renderers. They are run by hand (``make benchmark``), never as tests."""
