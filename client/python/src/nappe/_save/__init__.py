"""Frames that are kept: trajectories, and the files that they are saved as."""
