"""Group: verbs listed with their whole line of help, and a mistyped verb told the nearest one."""

from __future__ import annotations

import click


class Group(click.Group):
    """A click group that cuts no help short and knows what a mistyped command was meant to be."""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands."""
        rows = [(name, self.line_of(ctx, name)) for name in self.list_commands(ctx)]
        with formatter.section("Commands"):
            formatter.write_dl(rows)

    def line_of(self, ctx: click.Context, name: str) -> str:
        """Return the line of help of one command: its first sentence, whole."""
        command = self.get_command(ctx, name)
        return "" if command is None else command.get_short_help_str(limit=1000)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that is called, or raise the error that names the nearest."""
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError:
            text = f'There is no command "{args[0]}".{self._near(ctx, args[0])}'
            raise click.UsageError(text, ctx) from None

    def _near(self, ctx: click.Context, wrong: str) -> str:
        """Return the command that was likely meant, or else all there are."""
        from difflib import get_close_matches  # only where one was mistyped: --help stays quick

        names = self.list_commands(ctx)
        near = get_close_matches(wrong.lower(), names, n=1)
        return f' Did you mean "{near[0]}"?' if near else f" Commands here: {', '.join(names)}."
