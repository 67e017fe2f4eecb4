"""Edgegrad's operators; each also runs in background mode."""
