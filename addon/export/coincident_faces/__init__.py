"""Search for faces and lights that lie exactly on other faces."""
