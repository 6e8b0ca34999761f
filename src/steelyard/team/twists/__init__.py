"""Grasps of a team whose bases move, from the twists that its robots measure."""
