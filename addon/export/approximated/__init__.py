"""What is rendered in place of subsurface scattering and volumes, and how much that leaves out."""
