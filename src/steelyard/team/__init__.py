"""One payload, many robots: grasps, mass, centre of mass and inertia from what a team of robots measures."""

from steelyard.team.estimate import GraspEstimate, TeamEstimate
from steelyard.team.joint import JointTeam
from steelyard.team.published import PublishedTeam

__all__ = ["GraspEstimate", "JointTeam", "PublishedTeam", "TeamEstimate"]
