"""What the controllers of common arms call their columns, for the example of a description.

Their names alone do not say what a log needs (axes, point, form of a turn), so that a file with them is not read
without a description; the example of one can say it, for its user to check.
Source: the makers' interfaces: UR's RTDE, libfranka's RobotState, Kinova's Kortex, KUKA's X, Y, Z, A, B, C.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

_XYZ = ("x", "y", "z")


def _numbered(name: str, *numbers: int) -> tuple[str, ...]:
    return tuple(f"{name}_{number}" for number in numbers)


def _lettered(name: str) -> tuple[str, ...]:
    return tuple(f"{name}_{axis}" for axis in _XYZ)


_BASE = "in the base's axes, as {} gives it"
_HAND = "of {} in W; S must be there"

# Quantity, names as they are simplified, the rest of its line, what its user must know.
_KNOWN = (
    ("force", _numbered("actual_tcp_force", 0, 1, 2), 'unit = "N", frame = "W"', _BASE.format("UR")),
    ("torque", _numbered("actual_tcp_force", 3, 4, 5), 'unit = "N*m", frame = "W"', _BASE.format("UR")),
    ("position", _numbered("actual_tcp_pose", 0, 1, 2), 'unit = "m"', _HAND.format("the TCP")),
    ("rotation", _numbered("actual_tcp_pose", 3, 4, 5), 'form = "rotation-vector", unit = "rad"', "S to W"),
    ("force", _numbered("o_f_ext_hat_k", 0, 1, 2), 'unit = "N", frame = "W"', _BASE.format("Franka")),
    ("torque", _numbered("o_f_ext_hat_k", 3, 4, 5), 'unit = "N*m", frame = "W"', _BASE.format("Franka")),
    ("force", _numbered("k_f_ext_hat_k", 0, 1, 2), 'unit = "N"', "of K; S must be there"),
    ("torque", _numbered("k_f_ext_hat_k", 3, 4, 5), 'unit = "N*m"', "of K; S must be there"),
    ("position", _numbered("o_t_ee", 12, 13, 14), 'unit = "m"', _HAND.format("EE")),
    ("rotation", _numbered("o_t_ee", 0, 4, 8, 1, 5, 9, 2, 6, 10), 'form = "matrix"', "S to W"),
    (
        "force",
        _lettered("tool_external_wrench_force"),
        'unit = "N", frame = "W"',
        "estimated by Kinova; try both frames",
    ),
    ("torque", _lettered("tool_external_wrench_torque"), 'unit = "N*m", frame = "W"', "as the force"),
    ("position", _lettered("tool_pose"), 'unit = "m"', _HAND.format("the tool")),
    ("rotation", _lettered("tool_pose_theta"), 'form = "rpy", unit = "deg"', "S to W"),
    ("rotation", ("c", "b", "a"), 'form = "rpy", unit = "deg"', "KUKA turns by A about z first; S to W"),
)


def known_lines(columns: Mapping[str, int]) -> Iterator[tuple[str, tuple[int, ...], str, str]]:
    """Yield quantity, column numbers, rest of the line and remark of each that is there; columns by simplified name."""
    told = set()
    for quantity, names, rest, remark in _KNOWN:
        if quantity not in told and all(name in columns for name in names):
            told.add(quantity)
            yield quantity, tuple(columns[name] for name in names), rest, remark
