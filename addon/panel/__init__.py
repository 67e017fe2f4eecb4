"""The Edgegrad tab in the sidebar of the 3D view."""
