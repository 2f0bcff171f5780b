"""The command line.

A new command is a module that defines ``command``, and its name in `_PANELS`. A module is
imported when its command runs, so that no command pays for another's imports.
"""

from __future__ import annotations

import re
import sys
from difflib import get_close_matches
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from mdfconv import __version__
from mdfconv.cli.completion import whole_words
from mdfconv.cli.process import run
from mdfconv.errors import MdfconvError
from mdfconv.registry import unknown_name

# As the help shows them: what is asked every day first.
_PANELS = {
    "Commands": (
        "convert", "inspect", "mtl", "gltf", "mitsuba", "texture", "formula", "fit", "list",
    ),
    "Studies": ("fit-table", "plot-error", "compare", "light", "furnace", "fresnel", "report"),
    "Audits": ("bench", "stability", "recommend"),
}  # fmt: skip
_COMMANDS = {name: panel for panel, names in _PANELS.items() for name in names}

# A value may be negative, which looks like an option: `_Command` sorts out the real typos.
_CONTEXT = {"help_option_names": ["-h", "--help"], "ignore_unknown_options": True}

# How Typer says that a word is no number.
_NO_NUMBER = re.compile(r"'(.*)' is not a valid")


class _Command(TyperCommand):
    """A command that takes negative numbers for values and other unknown options for mistakes."""

    def parse_args(self, ctx: Any, args: list[str]) -> Any:
        options = self.get_params(ctx)
        known = [name for option in options for name in option.opts + option.secondary_opts]
        for word in args[: args.index("--")] if "--" in args else args:
            name = word.partition("=")[0]
            if len(word) > 1 and word[0] == "-" and name not in known and not _is_number(word):
                near = get_close_matches(name, known, n=2, cutoff=0.8)
                hint = f"; did you mean {' or '.join(near)}?" if near else ""
                raise MdfconvError(f"no such option: {name}{hint}")
        try:
            return super().parse_args(ctx, args)
        except typer.BadParameter as error:
            from mdfconv.distributions.parameter import percent_hint

            wrong = _NO_NUMBER.match(error.message)
            hint = percent_hint(wrong[1]) if wrong else ""
            if hint:
                error.message += f" {hint[0].upper()}{hint[1:]}"
            raise

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except MdfconvError as error:
            options = {option.name: option.opts[0] for option in self.get_params(ctx)}
            if error.argument not in options:
                raise
            # The library speaks of its arguments; here they are options.
            option = f" ({options[error.argument]})"
            if not error.hint:
                raise MdfconvError(error.reason + option) from None
            raise MdfconvError(error.reason, error.hint + option) from None


def _is_number(text: str) -> bool:
    try:
        float(text.partition(",")[0])
    except ValueError:
        return False
    return True


class _LazyGroup(TyperGroup):
    """A group whose commands are imported when they are asked for."""

    def list_commands(self, ctx: Any) -> list[str]:
        return list(_COMMANDS)

    def get_command(self, ctx: Any, name: str) -> Any:
        if name not in _COMMANDS:
            raise unknown_name("command", name, list(_COMMANDS))
        module = import_module(f"{__name__}.{name.replace('-', '_')}_command")
        single = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
        panel = _COMMANDS[name]
        add = single.command(name, cls=_Command, context_settings=_CONTEXT, rich_help_panel=panel)
        add(module.command)
        return typer.main.get_command(single)


app = typer.Typer(cls=_LazyGroup, context_settings=_CONTEXT, pretty_exceptions_enable=False)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"mdfconv {__version__}")
        raise typer.Exit


_VERSION = typer.Option(
    "--version", callback=_show_version, is_eager=True, help="Print the version and exit."
)


@app.callback(invoke_without_command=True)
def _root(context: typer.Context, version: Annotated[bool, _VERSION] = False) -> None:
    """Convert roughness between microfacet distributions.

    mdfconv convert --from beckmann --to ggx 0.2

    mdfconv list
    """
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


def main() -> None:
    """Run the command line and exit with the status that `process` has for what happened."""
    sys.exit(run(_answer))


@whole_words()
def _answer() -> int | None:
    return typer.main.get_command(app).main(standalone_mode=False)
