"""The plan: which terms a derivative has in a scene, and why, in words."""
