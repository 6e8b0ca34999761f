"""Mass, centre of mass and inertia of what a team carries, from still and moving rows at once."""
