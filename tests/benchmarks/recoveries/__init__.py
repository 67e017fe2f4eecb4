"""What an artist has changed in a scene is found again from pictures by Cycles, by the command line."""
