"""An answer in the words of robots and simulators: each has an order of its own for the entries of the inertia.

All take mass [kg], centre of mass [m] and, about it, the inertia [kg m^2], whose off-diagonals are those of the tensor.
Source: URDF <inertial>, SDFormat <inertial>, MuJoCo's XML reference, Drake's SpatialInertia, UR's script manual
(set_target_payload), libfranka's Robot::setLoad.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.identify.estimate import Estimate
from steelyard.inertia import InertialParameters
from steelyard.spatial import Pose
from steelyard.team.estimate import TeamEstimate


@dataclass(frozen=True, eq=False)
class _Body:
    """Mass [kg], centre of mass (3,) [m], inertia about it (3, 3) [kg m^2], None where it is open."""

    mass: float
    com: Array
    inertia: Array | None

    def entries(self, order: str) -> list[float]:
        """Return entries of the inertia in an order such as "xx yy zz xy xz yz"; zeros where it is open."""
        inertia = np.zeros((3, 3)) if self.inertia is None else self.inertia
        return [float(inertia["xyz".index(pair[0]), "xyz".index(pair[1])]) for pair in order.split()]


_ROWS, _DIAGONAL_FIRST = "xx xy xz yy yz zz", "xx yy zz xy xz yz"


def _numbers(values: Iterable[float], between: str = " ") -> str:
    return between.join(f"{float(value):.9g}" for value in values)


def _urdf(body: _Body) -> str:
    entries = zip(_ROWS.split(), body.entries(_ROWS), strict=True)
    inertia = " ".join(f'i{name}="{value:.9g}"' for name, value in entries)
    return (
        f'<inertial>\n  <origin xyz="{_numbers(body.com)}" rpy="0 0 0"/>\n  <mass value="{body.mass:.9g}"/>\n'
        f"  <inertia {inertia}/>\n</inertial>\n"
    )


def _sdf(body: _Body) -> str:
    entries = zip(_ROWS.split(), body.entries(_ROWS), strict=True)
    inertia = "".join(f"<i{name}>{value:.9g}</i{name}>" for name, value in entries)
    return (
        f"<inertial>\n  <pose>{_numbers(body.com)} 0 0 0</pose>\n  <mass>{body.mass:.9g}</mass>\n"
        f"  <inertia>{inertia}</inertia>\n</inertial>\n"
    )


def _mjcf(body: _Body) -> str:
    inertia = _numbers(body.entries(_DIAGONAL_FIRST))
    return f'<inertial pos="{_numbers(body.com)}" mass="{body.mass:.9g}" fullinertia="{inertia}"/>\n'


def _drake(body: _Body) -> str:
    entries = zip(_DIAGONAL_FIRST.split(), body.entries(_DIAGONAL_FIRST), strict=True)
    inertia = ", ".join(f"I{name}={value:.9g}" for name, value in entries)
    return (
        "# from pydrake.multibody.tree import RotationalInertia, SpatialInertia\n"
        f"SpatialInertia.MakeFromCentralInertia(\n    mass={body.mass:.9g},\n"
        f"    p_PScm_E=[{_numbers(body.com, ', ')}],\n"
        f"    I_SScm_E=RotationalInertia({inertia}),\n)\n"
    )


def _ur(body: _Body) -> str:
    inertia = "" if body.inertia is None else f", [{_numbers(body.entries(_DIAGONAL_FIRST), ', ')}]"
    return f"set_target_payload({body.mass:.9g}, [{_numbers(body.com, ', ')}]{inertia})\n"


def _franka(body: _Body) -> str:
    by_column = _numbers(body.entries("xx yx zx xy yy zy xz yz zz"), ", ")
    return f"robot.setLoad({body.mass:.9g}, {{{{{_numbers(body.com, ', ')}}}}}, {{{{{by_column}}}}});\n"


_SIMULATORS: dict[str, Callable[[_Body], str]] = {"urdf": _urdf, "sdf": _sdf, "mjcf": _mjcf, "drake": _drake}
_CONTROLLERS: dict[str, Callable[[_Body], str]] = {"ur": _ur, "franka": _franka}
TARGETS = {**_SIMULATORS, **_CONTROLLERS}


def inertial_text(estimate: Estimate, target: str, X_BS: Pose | None = None, guess: bool = False) -> str:
    """Return the lines that tell `target` what an answer weighs.

    target  "urdf", "sdf", "mjcf", "drake" (a simulated body) or "ur", "franka" (the payload that a controller is told)
    X_BS    pose of the answer's frame in that of the body, link or flange that is written; theirs is one, if None
    guess   write the best guess of an inertia that the log leaves open

    Where it is open, and no guess is asked for, a controller is told none (Franka: zeros). Raises CannotAnswer where a
    simulator needs it, or there are two bodies; BadValue where no rigid body has these parameters, or `target` is none.
    """
    if target not in TARGETS:
        raise BadValue(f"target must be one of {', '.join(TARGETS)}; got {target!r}.")
    if isinstance(estimate, TeamEstimate) and estimate.hinge is not None:
        raise CannotAnswer("This payload is two bodies with a hinge: no one body is like it.")
    parameters = estimate.parameters if X_BS is None else estimate.parameters.in_frame(X_BS)
    known = guess or bool(estimate.identified[4:].all())
    if target in _SIMULATORS:
        _require_body(parameters, known)
    inertia = parameters.inertia_com if known else None
    return TARGETS[target](_Body(float(parameters.mass), parameters.com, inertia))


def _require_body(parameters: InertialParameters, known: bool) -> None:
    """Raise where a simulator has no use for a body: its inertia is not known, or impossible."""
    if not known:
        raise CannotAnswer(
            "The log leaves the inertia open, and a simulated body needs one. Record a brisker motion, or identify "
            "with a shape (--scan, --parts); --guess (in Python guess=True) writes the result's best guess."
        )
    parameters.require_consistent()
