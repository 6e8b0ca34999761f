"""Stamps put right from where their clock jumps: at a gap that the jump leaves, else where both delays fit best.

What smooths the motion goes across a jump at first, so that what is left of it is looked for once it is put right.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from steelyard.logs.clock import NEAR_S, SAME_S, UNSURE_S, jump_gap
from steelyard.logs.clock_fit import ROWS, settled
from steelyard.logs.clock_jumps import ClockJump
from steelyard.logs.delays import Question
from steelyard.logs.recording import Recording, Stream

# A jump is first good to so much of itself.
_SAME = 0.15


@dataclass(frozen=True)
class Placed:
    """Stamps of `name` that were put right by `size` [s] from `row` on.

    at      [s] on the wrench's clock, where it was not put right
    std     standard deviation [s] of the size
    parted  the streams beside whose clock, or whose own clock, this one jumps
    cut     rows to either side were left out, since no gap shows where the jump is
    """

    name: str
    row: int
    size: float
    std: float
    at: float
    parted: tuple[str, ...]
    cut: bool


def put_right(
    recording: Recording, jumps: Mapping[str, ClockJump], wrench: str
) -> tuple[Recording, tuple[Placed, ...]]:
    """Return the recording with stamps put right from the jumps on, and where that is; `wrench` is its stream."""
    placed = _placed({s.name: s for s in recording.streams}, jumps, wrench)
    cut = {s.name: _without_unsure(s, placed[s.name]) for s in recording.streams if s.name in placed}
    found = tuple(row for _, row in cut.values())
    return moved(recording.changed(lambda s: cut[s.name][0] if s.name in cut else s), found), found


def moved(recording: Recording, placed: Iterable[Placed]) -> Recording:
    """Return the recording with stamps earlier by the sizes from the rows on."""
    by = {p.name: p for p in placed}

    def earlier(stream: Stream) -> Stream:
        if (jump := by.get(stream.name)) is None:
            return stream
        return replace(stream, time=stream.stamps - jump.size * (np.arange(len(stream)) >= jump.row))

    return recording.changed(earlier)


def still_jumping(
    question: Question, delays: Mapping[str, float], placed: Iterable[Placed], wrench: str
) -> tuple[Placed, ...]:
    """Return what is left of jumps that were put right."""
    every = question.thinned(ROWS)
    out = []
    for jump in placed:
        start = {n: ClockJump(delays[n], 0.0, jump.at) for n in question.others}
        found = settled(every, start, start)
        left = found[jump.parted[0]]
        out.append(replace(jump, size=-left.more if jump.name == wrench else left.more, std=left.more_std))
    return tuple(out)


def together(jumps: Iterable[Placed]) -> tuple[Placed, ...]:
    """Return the jumps, those of one clock at one time as one; what was found last is known as well as it."""
    out: list[Placed] = []
    for jump in jumps:
        same = next((k for k, p in enumerate(out) if p.name == jump.name and abs(p.at - jump.at) < NEAR_S), None)
        if same is None:
            out.append(jump)
        else:
            out[same] = replace(out[same], size=out[same].size + jump.size, std=jump.std)
    return tuple(out)


def _placed(streams: Mapping[str, Stream], jumps: Mapping[str, ClockJump], wrench: str) -> dict[str, Placed]:
    """Return which stamps jump, by stream: those that a gap shows, of a stream or of the wrench, else the stream's."""
    out: dict[str, Placed] = {}
    late = streams[wrench].delay or 0.0
    for name, jump in jumps.items():
        own = Placed(name, 0, jump.more, jump.more_std, jump.middle, (name,), cut=True)
        for gapped, size, off in ((name, jump.more, jump.late), (wrench, -jump.more, late)):
            stamps = streams[gapped].stamps
            k = jump_gap(stamps, size, jump.middle + off, max(SAME_S, _SAME * abs(size)))
            if k is not None:
                parted = (*out[gapped].parted, name) if gapped in out else (name,)
                at = float(stamps[k]) - off
                own = replace(own, name=gapped, row=k + 1, size=size, at=at, parted=parted, cut=False)
                break
        out[own.name] = own
    return out


def _without_unsure(stream: Stream, placed: Placed) -> tuple[Stream, Placed]:
    """Return the stream without rows that may be of either side of a jump, and the row it is at then."""
    if not placed.cut:
        return stream, placed
    late = stream.stamps - placed.at
    before = late <= -UNSURE_S - max(placed.size, 0.0)
    return stream.rows(before | (late > UNSURE_S)), replace(placed, row=int(before.sum()))
