"""One payload, many robots: grasps, mass, centre of mass and inertia from what a team of robots measures."""
