"""Distance fields beside meshes: `python -m tests.benchmarks.fields`."""
