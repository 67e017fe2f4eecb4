"""Distance fields for tests, and the rays that they meet."""
