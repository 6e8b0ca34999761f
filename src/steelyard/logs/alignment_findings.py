"""What alignment has to say: delays, turned accelerometers, taps, and what the motion could not tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding, quoted
from steelyard.logs.clock import UNSURE_S
from steelyard.logs.clock_rates import ClockRate
from steelyard.logs.delays import Clocks
from steelyard.logs.holes import holes
from steelyard.logs.imu import Imu, Mounting
from steelyard.logs.jumped_stamps import Placed
from steelyard.logs.recording import Stream
from steelyard.spatial import Rotation

_TURNED = np.radians(5)
_LOOSE_M, _LOOSE_RAD = 0.1, 0.1
_THIRD = 0.1  # of its size: below this, gravity hardly sweeps a third direction


def delay_findings(
    clocks: Clocks, names: tuple[str, ...], wrench: str, streams: Sequence[Stream]
) -> tuple[Finding, ...]:
    """Return `stream-delayed` for each of the named streams; `wrench` is the one that holds the wrench."""
    moved = {stream.name: stream.moved for stream in streams}
    return tuple(_delayed(n, clocks.delays_s[n], clocks.delays_std_s[n], n == wrench, moved.get(n, 0.0)) for n in names)


def rate_findings(rates: Mapping[str, ClockRate]) -> tuple[Finding, ...]:
    """Return `clock-unsteady` for each stream whose clock runs fast or slow beside the wrench's."""
    return tuple(
        Finding(
            "clock-unsteady",
            f"The clock of '{name}' runs {_parts(abs(clock.more))} {'fast' if clock.more > 0 else 'slow'} "
            f"(± {1e6 * clock.more_std:.2g} ppm) beside the wrench's; its stamps were put right.",
            "Check the rate or the time column of this stream, or stamp all streams by one clock.",
        )
        for name, clock in rates.items()
    )


def jump_findings(jumps: Sequence[Placed], start: float) -> tuple[Finding, ...]:
    """Return `clock-unsteady` for each clock that jumps; `start` [s] is where the log's own time begins."""
    remedy = "Look for what set this clock, or for rows that were lost and not counted, or cut the log there."
    return tuple(Finding("clock-unsteady", _jumped(jump, start), remedy) for jump in jumps)


def _jumped(jump: Placed, start: float) -> str:
    way = "leaps ahead" if jump.size > 0 else "falls behind"
    others = "the wrench" if jump.parted == (jump.name,) else quoted(jump.parted)
    unsure = f", without its rows within {UNSURE_S:g} s" if jump.cut else ""
    return (
        f"The clock of '{jump.name}' {way} by {1e3 * abs(jump.size):.1f} ± {1e3 * jump.std:.2g} ms at "
        f"{jump.at - start:.1f} s, beside {others}; its stamps from there on were put right{unsure}."
    )


def _parts(share: float) -> str:
    """Return a share as clocks are told of: in parts of a million, or per cent from a thousandth on."""
    return f"{100 * share:.3g} %" if share >= 1e-3 else f"{1e6 * share:.3g} ppm"


def _delayed(name: str, delay: float, std: float, own: bool, moved: float) -> Finding:
    size = f"{abs(delay) * 1e3:.2f} ± {std * 1e3:.2f} ms"
    given = f"delay = {{ value = {1e3 * (delay + moved):.2f}, unit = 'ms' }}"
    if not own:
        side = "late" if delay > 0 else "early"
        text = f"The stamps of '{name}' are {side} by {size} against the wrench (corrected here)."
        return Finding("stream-delayed", text, f"Give this stream {given}, so that it is not estimated anew.")
    late, early = ("motion", "wrench") if delay > 0 else ("wrench", "motion")
    text = f"In the rows of '{name}' the {late} is {size} later than the {early} (corrected here)."
    remedy = f"Describe the motion as a second [[stream]] of this file, with {given}."
    return Finding("stream-delayed", text, remedy)


def gaps(streams: Sequence[Stream], jumps: Sequence[Placed] = ()) -> tuple[str, ...]:
    """Return a note on each timed stream that has no rows for a while, but those left out beside jumps."""
    out = []
    for stream in streams:
        long = holes(stream)
        for at in (j.at - max(j.size, 0.0) for j in jumps if j.cut and j.name == stream.name):
            long = long[(at < long[:, 0]) | (at > long[:, 1])]
        if stream.time is not None and len(long):
            many = f" in {len(long)} gaps, the first" if len(long) > 1 else ""
            first = float(long[0, 0] - stream.time[0])
            out.append(f"'{stream.name}' has no rows for {np.ptp(long, axis=1).sum():.2g} s{many} at {first:.4g} s")
    return tuple(out)


def swings(rigid: float) -> str:
    """Return the note on a structure that swings from `rigid` [Hz] on."""
    return (
        f"above {rigid:g} Hz the wrench does not follow the poses, as where an arm swings or noise is most of it: "
        "it was low-passed there"
    )


def mount_findings(imu: Imu | None, mounting: Mounting | None) -> tuple[Finding, ...]:
    """Return `imu-rotated` where the accelerometer, whose mount was not given, is turned."""
    if imu is None or mounting is None:
        return ()
    angle = float(mounting.rotation.angle())
    std = float(np.max(mounting.rotation_std))
    if imu.rotation is not None or angle <= max(_TURNED, 3 * std):
        return ()
    message = (
        f"The accelerometer of '{imu.name}' is turned by {np.degrees(angle):.1f} ± {np.degrees(std):.1f} "
        f"degrees against S: {axes_in_words(mounting.rotation)} (corrected here)."
    )
    return (Finding.of("imu-rotated", message),)


def tap_findings(taps: Array, start: float, rows: int, total: int) -> tuple[Finding, ...]:
    """Return `outliers` for intervals (K, 2) [s] of taps; `start` [s] is where the log's own time begins."""
    if not len(taps):
        return ()
    at = ", ".join(f"{t - start:.2f}" for t in taps.mean(1)[:8]) + (", ..." if len(taps) > 8 else "")
    bursts = "one short burst (tap or knock)" if len(taps) == 1 else f"{len(taps)} short bursts (taps or knocks)"
    were = "was" if rows == 1 else "were"
    return (Finding.of("outliers", f"Found {bursts} at {at} s; {rows} of {total} rows {were} left out."),)


def planar_finding(gravity: Array) -> tuple[Finding, ...]:
    """Return `nearly-planar` where gravity (N, 3) in S sweeps two directions and hardly a third.

    Hardly = its standard deviation along the third direction is below a tenth of its size.
    """
    size = float(np.linalg.norm(gravity, axis=1).mean())
    spread, axes = np.linalg.eigh(np.cov(gravity.T, bias=True))
    stds = np.sqrt(np.maximum(spread, 0)) / size
    if not (stds[0] < _THIRD < stds[1]):
        return ()
    axis = axes[:, 0] * np.sign(axes[np.abs(axes[:, 0]).argmax(), 0])
    shown = ", ".join(f"{v:.2f}" for v in np.round(axis, 2) + 0.0)
    across = np.abs((gravity - gravity.mean(0)) @ axes[:, 0]) / size
    rms, most = np.degrees(np.arcsin(np.minimum([stds[0], across.max()], 1.0)))
    leaves = f"leaves one plane in S by {rms:.1f} degrees rms, {most:.1f} at most; across that plane, along ({shown}), "
    stays = f"stays in one plane in S within 0.1 degrees; across it, along ({shown}), "
    message = f"Gravity {stays + 'nothing' if most < 0.05 else leaves + 'only so much'} tells a load from a bias."
    return (Finding.of("nearly-planar", message),)


def axes_in_words(rotation: Rotation) -> str:
    """Return where the x, y, z axes point, as "x, y, z along -z, -x, +y", or that they follow no axes."""
    m = rotation.matrix
    best = np.abs(m).argmax(0)
    if np.abs(m[best, np.arange(3)]).min() < np.cos(np.radians(15)):
        return "its axes follow none of S"
    along = ", ".join(f"{'+' if m[b, i] > 0 else '-'}{'xyz'[b]}" for i, b in enumerate(best))
    return f"its x, y, z axes lie along {along}"


def notes(clocks: Clocks, acceleration_from: str) -> tuple[str, ...]:
    """Return in words what the motion could not tell."""
    out = []
    if (mounting := clocks.mounting) is not None:
        if axes := ", ".join("xyz"[i] for i in np.flatnonzero(mounting.position_std > _LOOSE_M)):
            out.append(f"the accelerometer's place along {axes} of S is not fixed by this motion")
        if float(np.max(mounting.rotation_std)) > _LOOSE_RAD:
            out.append("the accelerometer's mount rotation is not fixed about every axis by this motion")
    if acceleration_from == "none":
        out.append(
            "no stream measures the acceleration of S: it is taken as zero, with a spread that grows with turning"
        )
    return tuple(out)
