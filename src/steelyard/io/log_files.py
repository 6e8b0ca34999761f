"""A log description, or a bare data file with usual names, becomes a Recording that holds what every answer needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from steelyard import check
from steelyard.errors import BadDescription, BadValue, NoDescription
from steelyard.io.contents import load_toml, readable
from steelyard.io.example import GRAVITY_LINE, columns_text, lines_of, toml_string
from steelyard.io.recordings import guess
from steelyard.io.recordings.arm_joints import arm_of, posed, with_joints_in_order
from steelyard.io.recordings.description import Description, parse_description
from steelyard.io.recordings.not_told import line
from steelyard.io.recordings.stream_files import open_table, open_tables, own_rows, read_cells, streams_of
from steelyard.io.streams.channels import without_missing
from steelyard.io.streams.entries import StreamSpec
from steelyard.io.tables.files import Columns, Table, data_folder, find_file
from steelyard.logs.recording import QUANTITIES, Recording, Stream
from steelyard.robots.serial import SerialArm


def read_recording(path: Path | str, data: Path | str | None = None) -> Recording:
    """Read a log.

    path  a description (.toml) of files and topics of bags, or a bare data file (.csv .tsv .txt, .gz, .npz, .parquet)
    data  folder in which relative paths are sought first; then $STEELYARD_DATA, then beside the description

    Returns the streams in SI, each on its own clock; all clocks count from one common origin.
    Raises BadFile, BadDescription or BadValue: what was expected, what was found, where, and what to do.
    """
    with readable(path):
        return _read(Path(path), data_folder(data))


def describe_file(path: Path | str, data: Path | str | None = None) -> str:
    """Return the description (TOML) of a bare data file or bag, to be saved beside it and added to.

    What only its user can tell is marked, to be filled in. Raises BadInput where there is nothing to be described.
    """
    path = _found(Path(path), data_folder(data))
    try:
        with readable(path):
            table = open_table(path)
            return _text(guess.describe(table)[0], table)
    except NoDescription as error:
        if not error.example:
            raise
        return error.example


def _text(description: Description, table: Table) -> str:
    """Return the TOML text of what `guess.describe` found in a table; it reads as the table does without it."""
    gravity = f"gravity = [0, 0, {description.gravity[2]:.12g}]      # in the world frame W, m/s^2"
    if description.gravity_std:
        gravity = GRAVITY_LINE
    log = f'[log]\n{gravity}\nwrench  = "on-object"        # or "on-sensor": what the object does to the sensor\n'
    return "\n[[stream]]\n".join([log, *(lines_of(_lines(spec, table)) for spec in description.streams)])


def _lines(spec: StreamSpec, table: Table) -> dict[str, str]:
    rows = {"path": toml_string(table.path.name)}
    if spec.poses:
        rows["kind"] = '"poses"'
    if spec.time is not None:
        units = spec.time.units
        unit = columns_text(units) if len(units) > 1 else toml_string(units[0])
        rows["time"] = line(table, [int(n) for n in spec.time.columns], f"unit = {unit}")
    for each in spec.quantities:
        how = f'form = "{each.form}"' if each.form else f"unit = {toml_string(each.unit)}"
        rows[each.name] = line(table, [int(n) for n in each.columns], how)
    return rows


def _found(path: Path, data: Path | None) -> Path:
    return path if path.exists() else find_file(str(path), Path.cwd(), data)


def _read(path: Path, data: Path | None) -> Recording:
    path = _found(path, data)
    if path.suffix.lower() != ".toml":
        table = open_table(path)
        description, cells = guess.describe(table)
        tables = [table] * len(description.streams)
        own = [cells] if len(tables) == 1 else read_cells(description.streams, tables)
        read = recording_of(description, tables, own_rows(description.streams, tables, own), path.name)
        return replace(read, name=path.stem, described=False, sign_said=False)
    description = parse_description(load_toml(path), path.name)
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
    description: Description, tables: Sequence[Table], cells: Sequence[Columns], name: str, arm: SerialArm | None = None
) -> Recording:
    """Return the recording that a description makes of its tables, checked, without the tool that it names.

    Raises BadDescription or BadValue; `name` stands in messages.
    """
    _require_answerable(description.streams, name)
    specs = description.streams
    found = streams_of(specs, tables, cells, [description.gravity] * len(specs), gaps=True)
    _require_matched_rows(found, name)
    streams, findings = without_missing(specs, found)
    if arm is not None:
        streams = tuple(posed(*each, arm) for each in zip(specs, streams, strict=True))
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


def _require_answerable(specs: Sequence[StreamSpec], name: str) -> None:
    """Raise BadDescription where quantities that every answer needs are missing, or one is given twice."""
    given = [quantity for spec in specs for quantity in spec.names]
    given += ["rotation"] * given.count("joint_position")
    for quantity in given:
        if given.count(quantity) > 1:
            raise BadDescription(f'{name}: "{quantity}" is given by {given.count(quantity)} streams. Give it in one.')
    shown = ", ".join(quantity for quantity in QUANTITIES if quantity in given)
    missing = [quantity for quantity in ("force", "torque") if quantity not in given]
    if missing:
        raise BadDescription(
            f"{name}: no {' and no '.join(missing)} is given, only {shown}. An answer needs the wrench: "
            'force and torque (torque = "zero" for a passive gimbal).'
        )
    if not {"rotation", "gravity", "specific_force"} & set(given):
        raise BadDescription(
            f"{name}: nothing says where gravity points in the sensor frame; given are {shown}. "
            "Add rotation (S to W), joint_position with a URDF, gravity (in S) or specific_force (an accelerometer)."
        )


def _require_matched_rows(streams: Sequence[Stream], name: str) -> None:
    """Raise where streams without a clock stand beside others that they cannot be matched with by row."""
    still = [stream for stream in streams if stream.time is None]
    if not still or len(streams) == 1:
        return
    if len(still) < len(streams):
        timed = next(stream for stream in streams if stream.time is not None)
        raise BadDescription(
            f'{name}: stream "{still[0].name}" has no time and "{timed.name}" has one, '
            "so their rows cannot be matched. Give time to all streams or to none."
        )
    if len({len(stream) for stream in streams}) > 1:
        shown = ", ".join(f'"{stream.name}" {len(stream)}' for stream in streams)
        raise BadValue(f"{name}: streams without time are matched by row, but their lengths differ: {shown} rows.")
