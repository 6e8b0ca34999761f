"""Outward normals of a cloud that has none, without a mesh: winding-number normal consistency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.shape.cloud import Cloud
from steelyard.shape.spacing import Neighbours, areas
from steelyard.shape.winding import Sight, Tree

_STEPS = 15
_WIDEST, _NARROWEST = 2.0, 0.25  # width of the softened dipoles, first and last, in spacings
_SAMPLED = 4  # one leaf in so many gives the length of a step


@dataclass(frozen=True, eq=False)
class Oriented:
    """A cloud's surface as oriented elements, in units of its diagonal.

    xyz      (N, 3) about the mean, over the diagonal
    normals  (N, 3) unit vectors that leave the solid
    area     (N,) of surface that each point stands for
    near     its neighbours
    tree     of the points
    """

    xyz: Array
    normals: Array
    area: Array
    near: Neighbours
    tree: Tree


def orient(cloud: Cloud) -> Array:
    """Return outward unit normals (N, 3) of the points of a closed surface."""
    return oriented(cloud).normals


def oriented(cloud: Cloud) -> Oriented:
    """Return the surface elements of a cloud; normals that it carries are kept."""
    xyz = (cloud.xyz - cloud.xyz.mean(0)) / cloud.diagonal
    near, tree = Neighbours.of(xyz), Tree.of(xyz)
    normals = cloud.normals if cloud.normals is not None else consistent(tree, float(np.median(near.spacing)))
    return Oriented(xyz, normals, areas(near, normals), near, tree)


def consistent(tree: Tree, spacing: float) -> Array:
    """Return unit normals (N, 3) that agree with the winding number they make.

    Each step moves the dipoles toward a winding number of 1/2 at every point, then turns them against the gradient of
    that number, lengths kept; the softening narrows from step to step. Source: Lin, Shi, Liu 2024, algorithm 1.
    """
    sight = Sight.of(tree, tree)
    dipoles: Any = np.zeros((3, len(tree.order)), np.float32)
    found: Any = np.zeros(len(tree.order), np.float32)
    for width in spacing * np.linspace(_WIDEST, _NARROWEST, _STEPS):
        push = sight.adjoint(np.float32(0.5) - found, width)
        moved = sight.winding(push, width, _SAMPLED)
        step = float((push**2).mean() * 3 / np.maximum((moved**2).mean(), 1e-30))
        dipoles = dipoles + np.float32(step) * push
        found, gradient = sight.winding_and_gradient(dipoles, width)
        dipoles = -np.linalg.norm(dipoles, axis=0) * _units(gradient)
    return np.asarray(tree.back(_units(dipoles)).T, np.float64)


def _units(vectors: Any) -> Any:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=0), 1e-30)
