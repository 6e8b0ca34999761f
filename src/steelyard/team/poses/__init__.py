"""Grasps and homes of a team whose bases stand still, from the poses that its robots measure."""
