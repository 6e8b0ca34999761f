"""A log description, or a bare data file with usual names, becomes a Recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from steelyard import check
from steelyard.errors import BadFile
from steelyard.findings import Finding
from steelyard.io.recordings import guess
from steelyard.io.recordings.arm_joints import arm_of, posed, with_joints_in_order
from steelyard.io.recordings.description import Description, read_description
from steelyard.io.recordings.joined_tables import own_rows
from steelyard.io.recordings.stream_files import Cells, channels_of, open_tables, read_cells, seconds_of, stream_names
from steelyard.io.streams.missing_rows import without_missing
from steelyard.io.streams.requirements import require_answerable, require_matched_rows
from steelyard.io.tables.files import Table, find_file, open_table
from steelyard.logs.recording import Recording, Stream
from steelyard.robots.serial import SerialArm


def read_recording(path: Path | str, data: Path | str | None = None) -> Recording:
    """Read a log.

    path  a description (.toml) of files and topics of bags, or a bare data file (.csv .tsv .txt, .gz, .npz, .parquet)
    data  folder in which relative paths are sought first; then $STEELYARD_DATA, then beside the description

    Returns the streams in SI, each on its own clock; all clocks count from one common origin.
    Raises BadFile, BadDescription or BadValue: what was expected, what was found, where, and what to do.
    """
    try:
        return _read(Path(path), None if data is None else Path(data))
    except OSError as error:
        raise BadFile(f"{error.filename or path}: cannot be read ({error.strerror or error}).") from None


def _read(path: Path, data: Path | None) -> Recording:
    if not path.exists():
        path = find_file(str(path), Path.cwd(), data)
    if path.suffix.lower() != ".toml":
        table = open_table(path)
        description, cells = guess.describe(table)
        joined = [table] * len(description.streams)
        own = [cells] if len(joined) == 1 else read_cells(description.streams, joined)
        rows = own_rows(description.streams, joined, own)
        return replace(recording_of(description, joined, rows, path.name), name=path.stem, described=False)
    description = read_description(path)
    tables = open_tables(description.streams, path.parent, data)
    arm = None if description.arm is None else arm_of(description.arm, path, data)
    if arm is not None:
        streams = [with_joints_in_order(*each, arm) for each in zip(description.streams, tables, strict=True)]
        description = replace(description, streams=tuple(streams))
    rows = own_rows(description.streams, tables, read_cells(description.streams, tables))
    recording = recording_of(description, tables, rows, path.name, arm)
    tool = description.tool
    tool = None if tool is None else str(find_file(tool, path.parent, data, f"{path.name}, [log], tool"))
    return replace(recording, name=path.stem, tool=tool)


def recording_of(
    description: Description,
    tables: Sequence[Table],
    cells: Sequence[Cells],
    name: str,
    arm: SerialArm | None = None,
) -> Recording:
    """Return the recording that a description makes of its tables, checked, without the tool that it names.

    Raises BadDescription or BadValue; `name` stands in messages.
    """
    require_answerable(description.streams, name)
    streams, findings = _streams(description, tables, cells, name)
    if arm is not None:
        streams = tuple(posed(*each, arm) for each in zip(description.streams, streams, strict=True))
    placed = description.placed
    return Recording(
        streams,
        gravity=check.frozen(description.gravity),
        wrench_sign=description.wrench_sign,
        noise=description.noise,
        object_pose=None if placed is None else placed.pose,
        object_pose_std=None if placed is None else placed.std,
        name=name,
        findings=findings,
        notes=description.notes,
        gravity_std=description.gravity_std,
    )


def _streams(
    description: Description, tables: Sequence[Table], cells: Sequence[Cells], where: str
) -> tuple[tuple[Stream, ...], tuple[Finding, ...]]:
    """Return the streams in SI units without the rows that miss a number, and what was left out."""
    specs = description.streams
    channels = [channels_of(*each, description.gravity, True) for each in zip(specs, tables, cells, strict=True)]
    times = seconds_of(specs, tables, cells, [len(next(iter(c.values()))) for c in channels], gaps=True)
    names = stream_names(specs)
    streams = tuple(
        Stream(
            name,
            values,
            time,
            {q.name: "W" for q in spec.quantities if q.frame == "W"},
            spec.delay,
            spec.mount,
            spec.poses,
            "s" if spec.time is None else spec.time.unit,
        )
        for name, spec, values, time in zip(names, specs, channels, times, strict=True)
    )
    require_matched_rows(streams, where)
    return without_missing(specs, streams)
