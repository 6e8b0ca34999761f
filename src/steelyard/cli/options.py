"""Options that several verbs have, so that they read the same in all."""

from __future__ import annotations

from pathlib import Path

import click

HELP = {"help_option_names": ["-h", "--help"], "show_default": True}
PATH = click.Path(path_type=Path)
JSON = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
RESULT_AS_JSON = click.option("--json", "as_json", is_flag=True, help="Print the result as one JSON object.")
RESULT_FILE = click.option("-o", "--output", type=PATH, help="Write the result as JSON.")
STREAM_FOLDER = click.option("--data", type=PATH, help="Folder that relative paths in the description start from.")
