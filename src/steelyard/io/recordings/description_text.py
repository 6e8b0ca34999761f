"""The description of a bare data file as a text: what its names told, and room for what they cannot tell."""

from __future__ import annotations

from steelyard.io.example import columns_text, lines_of, toml_string
from steelyard.io.recordings.description import Description
from steelyard.io.recordings.not_told import line
from steelyard.io.streams.entries import StreamSpec
from steelyard.io.tables.files import Table


def description_text(description: Description, table: Table) -> str:
    """Return the TOML text of what `guess.describe` found in a table; it reads as the table does without it."""
    gravity = f"gravity = [0, 0, {description.gravity[2]:.12g}]      # in the world frame W, m/s^2"
    if description.gravity_std:
        gravity = "# gravity = [0, 0, -9.81]    # that of your place, in the world frame W, m/s^2"
    log = f'[log]\n{gravity}\nwrench  = "on-object"        # or "on-sensor": what the object does to the sensor\n'
    return "\n[[stream]]\n".join([log, *(lines_of(_rows(spec, table)) for spec in description.streams)])


def _rows(spec: StreamSpec, table: Table) -> dict[str, str]:
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
