"""What the controllers of common arms call their columns, for the example of a description.

Their names alone do not say what a log needs (axes, point, form of a turn), so that a file with them is not read
without a description; the example of one can say it, for its user to check.
Source: the makers' interfaces: UR's RTDE, libfranka's RobotState and log, Kinova's Kortex, KUKA's RSI and the recorder
of its Sunrise, UFACTORY's report, FANUC's W, P, R.
"""

from __future__ import annotations

from collections.abc import Iterator

from steelyard.io.streams.usual_names import Names, short

_XYZ = ("x", "y", "z")
_CBA = ("c", "b", "a")


def _numbered(name: str, *numbers: int) -> tuple[str, ...]:
    return tuple(f"{name}_{number}" for number in numbers)


def _lettered(name: str, letters: tuple[str, ...] = _XYZ) -> tuple[str, ...]:
    return tuple(f"{name}_{letter}" for letter in letters)


# Lines of their own: what must be set in the controller before a run, which no name of a column shows.
_PAYLOAD = "\n# the payload that is set in the controller is taken away from this wrench: set none before the run"
_TCP = "\n# the TCP that is set in the controller must be S"

_BASE = "in the base's axes, as {} gives it"
_HAND = "of {} in W; S must be there"

_TURNS = "KUKA turns by A about z first; Doosan and Kawasaki about z, y, z: a, b, c in form zyz; S to W"

# Quantity, names as they are simplified, the rest of its line, what its user must know. Franka's O_T_EE needs no line:
# a 4 x 4 matrix shows itself how it is written.
_KNOWN = (
    ("force", _numbered("actual_tcp_force", 0, 1, 2), 'unit = "N", frame = "W"', _BASE.format("UR") + _PAYLOAD),
    ("torque", _numbered("actual_tcp_force", 3, 4, 5), 'unit = "N*m", frame = "W"', _BASE.format("UR")),
    (
        "position",
        _numbered("actual_tcp_pose", 0, 1, 2),
        'unit = "m"',
        f"of the TCP in W{_TCP}: the flange (TCP all zero) on an e-Series",
    ),
    ("rotation", _numbered("actual_tcp_pose", 3, 4, 5), 'form = "rotation-vector", unit = "rad"', "S to W"),
    ("force", _numbered("o_f_ext_hat_k", 0, 1, 2), 'unit = "N", frame = "W"', _BASE.format("Franka") + _PAYLOAD),
    (
        "torque",
        _numbered("o_f_ext_hat_k", 3, 4, 5),
        'unit = "N*m", frame = "W"',
        _BASE.format("Franka") + ", about K, which is EE unless it was set",
    ),
    ("force", _numbered("k_f_ext_hat_k", 0, 1, 2), 'unit = "N"', "of K; S must be there" + _PAYLOAD),
    ("torque", _numbered("k_f_ext_hat_k", 3, 4, 5), 'unit = "N*m"', "of K; S must be there"),
    ("time", ("duration",), 'unit = "ms"', "as libfranka logs it; check the unit"),
    (
        "force",
        _lettered("tool_external_wrench_force"),
        'unit = "N", frame = "W"',
        "estimated by Kinova; try both frames" + _PAYLOAD,
    ),
    ("torque", _lettered("tool_external_wrench_torque"), 'unit = "N*m", frame = "W"', "as the force"),
    ("position", _lettered("tool_pose"), 'unit = "m"', _HAND.format("the tool")),
    ("rotation", _lettered("tool_pose_theta"), 'form = "rpy", unit = "deg"', "S to W"),
    ("force", _numbered("ft_raw_force", 0, 1, 2), 'unit = "N"', "of UFACTORY's sensor, without its compensation"),
    ("torque", _numbered("ft_raw_force", 3, 4, 5), 'unit = "N*m"', "as the force"),
    ("force", _numbered("ft_ext_force", 0, 1, 2), 'unit = "N"', "UFACTORY takes the payload away; log ft_raw_force"),
    ("torque", _numbered("ft_ext_force", 3, 4, 5), 'unit = "N*m"', "as the force"),
    ("time", ("ipoc",), 'unit = "ms"', "as KUKA's RSI counts it"),
    ("position", _lettered("rist"), 'unit = "mm"', f"of the TCP in W{_TCP}"),
    ("rotation", _lettered("rist", _CBA), 'form = "rpy", unit = "deg"', "S to W"),
    (
        "force",
        _lettered("cartforce1"),
        'unit = "N"',
        "estimated by KUKA, in the frame that the recorder was given" + _PAYLOAD,
    ),
    ("torque", ("carttorque1_taux", "carttorque1_tauy", "carttorque1_tauz"), 'unit = "N*m"', "as the force"),
    ("position", _lettered("cartposmsr1"), 'unit = "mm"', _HAND.format("the recorder's frame")),
    ("rotation", _lettered("cartposmsr1", _CBA), 'form = "rpy", unit = "rad"', "S to W"),
    ("rotation", _CBA, 'form = "rpy", unit = "deg"', _TURNS),
    ("rotation", ("w", "p", "r"), 'form = "rpy", unit = "deg"', "as FANUC turns; S to W"),
)


def known_lines(names: Names) -> Iterator[tuple[str, tuple[int, ...], str, str]]:
    """Yield quantity, column numbers, rest of the line and remark of each that is there, also behind one prefix.

    A remark may have a second line, which is a comment of its own.
    """
    told = set()
    for quantity, wanted, rest, remark in _KNOWN:
        columns = () if quantity in told else names.all_of(wanted, short(wanted))
        if columns:
            told.add(quantity)
            yield quantity, columns, rest, remark
