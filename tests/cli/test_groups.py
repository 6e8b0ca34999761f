"""Groups of commands: whole lines of help, and the nearest command where one is mistyped."""

from __future__ import annotations

import click
import pytest
from click.testing import CliRunner

from steelyard.cli.main import cli


@pytest.mark.parametrize("group", ["bench", "workshop"])
def test_no_line_of_help_is_cut(group: str) -> None:
    assert "..." not in CliRunner().invoke(cli, [group, "--help"]).output.split("Commands:")[1]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["identfy"], 'There is no command "identfy". Did you mean "identify"?\n'),
        (["workshop", "biuld"], 'There is no command "biuld". Did you mean "build"?\n'),
        (["bench", "partcoverage"], 'There is no command "partcoverage". Did you mean "part-coverage"?\n'),
        (["workshop", "zzz"], 'There is no command "zzz". Commands here: build.\n'),
    ],
)
def test_a_mistyped_command(arguments: list[str], said: str) -> None:
    done = CliRunner().invoke(cli, arguments)
    assert done.exit_code == 2
    assert done.output.endswith(f"Error: {said}")


def commands(group: click.Group) -> list[click.Command]:
    ctx = click.Context(group)
    found = [group.get_command(ctx, name) for name in group.list_commands(ctx)]
    below = [each for one in found if isinstance(one, click.Group) for each in commands(one)]
    return [*(one for one in found if one is not None), *below]


def test_every_option_says_what_it_is_for() -> None:
    assert isinstance(cli, click.Group)
    options = [(c.name, p) for c in commands(cli) for p in c.params if isinstance(p, click.Option)]
    assert [f"{name} {option.opts[-1]}" for name, option in options if not option.help] == []
