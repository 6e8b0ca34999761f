"""Gyros of unlike gains: a rigid payload turns at one rate, and one robot says more of it than the others.

How far grasps are apart is told by how fast they move per turn, so that a gain of all gyros, which nothing shows, is
one of all distances. What gains differ by says how large it may be.
Source: own; with weights of 1 / variance mean and residual are independent, so that noise makes no gain.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding, percent
from steelyard.spatial import Pose
from steelyard.team.poses.covariance import Spread
from steelyard.team.twists.rows import TwistStretch

# Stretches whose scatter tells the standard deviations; a gain is named from so many of them, and from this share on.
STRETCHES, BEYOND, LEAST = 20, 6.0, 2e-3
# Rows that are needed.
FEWEST = 200


@dataclass(frozen=True, eq=False)
class TurningGains:
    """By which share each robot (N,) says more of the payload's turns than all do on average, and how surely."""

    size: Array
    std: Array

    @classmethod
    def of(cls, parts: Sequence[TwistStretch], grasps: Pose, noise: Array) -> TurningGains:
        """Return the gains by the rows in motion that all robots saw; none where those are few.

        noise  (N, 2) [rad/s, m/s]: robots count by it, so that their own noise is no gain
        """
        share = noise[:, 0] ** -2.0 / (noise[:, 0] ** -2.0).sum()
        seen = [part.twist[part.seen.all(1), :, :3] for part in parts if part.rows.kind != "still"]
        turns = np.concatenate(seen) if seen else np.zeros((0, len(share), 3))
        if len(turns) < FEWEST:
            return cls(np.zeros(len(share)), np.full(len(share), np.inf))
        alike = np.einsum("nij,tnj->tni", grasps.rotation.matrix, turns)
        mean = np.einsum("n,tni->ti", share, alike)
        more = np.einsum("tni,ti->tn", alike - mean[:, None], mean)
        stretches = np.array_split(np.arange(len(mean)), STRETCHES)
        pull = np.array([more[rows].sum(0) for rows in stretches])
        known = np.array([(mean[rows] ** 2).sum() for rows in stretches])
        size = pull.sum(0) / known.sum()
        left = pull - size * known[:, None]
        std = np.sqrt((left**2).sum(0) * STRETCHES / (STRETCHES - 1)) / known.sum()
        return cls(size, std)

    @property
    def named(self) -> Array:
        """Which robots (N,) say clearly more or less than the others."""
        return np.asarray(np.abs(self.size) > np.maximum(LEAST, BEYOND * self.std))

    def findings(self, names: Sequence[str]) -> Iterator[Finding]:
        """Yield turning-gains where some are named."""
        if not self.named.any():
            return
        each = ", ".join(f"'{name}' {100 * size:+.1f} %" for name, size in zip(names, self.size, strict=True))
        yield Finding.of(
            "turning-gains",
            f"The robots' angular velocities differ in size, from their mean by {each}: distances between grasps may "
            f"be off by about {percent(self.common)}, which their bars hold.",
        )

    @property
    def common(self) -> float:
        """What their mean may be off by (a share): as much as they differ, since any of them may be right."""
        return float(np.sqrt((self.size**2).sum() / (len(self.size) - 1)))

    def widened(self, spread: Spread, grasps: Pose) -> Spread:
        """Return the spread of the grasps with distances from the reference as unsure as a gain of all makes them."""
        if not self.named.any():
            return spread
        moved = np.zeros((len(self.size), 6))
        moved[:, 3:] = self.common * grasps.rotation.inverse().apply(grasps.position)
        return replace(spread, full=spread.full + np.outer(moved.ravel(), moved.ravel()))
