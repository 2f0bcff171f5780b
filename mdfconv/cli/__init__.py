"""The command line.

A new command is a module that defines ``command``, and one line in `_COMMANDS`. A module is
imported when its command runs, so that no command pays for another's imports.
"""

from __future__ import annotations

import os
import sys
from difflib import get_close_matches
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from mdfconv import __version__
from mdfconv.errors import MdfconvError
from mdfconv.registry import unknown_name

_COMMANDS = (
    "convert",
    "formula",
    "mtl",
    "gltf",
    "mitsuba",
    "texture",
    "light",
    "list",
    "fit",
    "fit-table",
    "plot-error",
    "compare",
    "furnace",
    "fresnel",
    "report",
    "bench",
    "recommend",
    "stability",
)

# A value may be negative, which looks like an option: `_Command` sorts out the real typos.
_CONTEXT = {"help_option_names": ["-h", "--help"], "ignore_unknown_options": True}
# Typer exports BadParameter but not its base, the family of all mistakes in the arguments.
_UsageError: type[Any] = typer.BadParameter.__mro__[1]


class _Command(TyperCommand):
    """A command that takes negative numbers for values and other unknown options for mistakes."""

    def parse_args(self, ctx: Any, args: list[str]) -> Any:
        known = [
            name
            for option in self.get_params(ctx)
            for name in (*option.opts, *option.secondary_opts)
        ]
        for word in args[: args.index("--")] if "--" in args else args:
            name = word.partition("=")[0]
            if len(word) > 1 and word[0] == "-" and name not in known and not _is_number(word):
                near = get_close_matches(name, known, n=1)
                hint = f"; did you mean {near[0]}?" if near else ""
                raise MdfconvError(f"no such option: {name}{hint}")
        return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except MdfconvError as error:
            options = {option.name: option.opts[0] for option in self.get_params(ctx)}
            if error.argument not in options:
                raise
            # The library speaks of its arguments; here they are options.
            hint = f"{error.hint} ({options[error.argument]})"
            raise MdfconvError(error.reason, hint) from None


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
        single.command(name, cls=_Command, context_settings=_CONTEXT)(module.command)
        return typer.main.get_command(single)


app = typer.Typer(cls=_LazyGroup, context_settings=_CONTEXT, pretty_exceptions_enable=False)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"mdfconv {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_show_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
) -> None:
    """Convert roughness between microfacet distributions.

    mdfconv convert --from beckmann --to ggx 0.2

    mdfconv list
    """
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


def main() -> None:
    """Run the command line and exit: 0 for an answer, 2 for a request that has none."""
    for stream in (sys.stdout, sys.stderr):
        # A terminal that cannot show α shows ? instead of a traceback.
        if stream is not None:
            stream.reconfigure(errors="replace")  # type: ignore[union-attr]
    try:
        if sys.stdout is None:
            raise MdfconvError("standard output is closed")
        status = app(standalone_mode=False)
        sys.stdout.flush()
    except MdfconvError as error:
        status = _refuse(str(error))
    except _UsageError as error:
        status = _refuse(error.format_message())
    except typer.Abort:
        status = 130
    except BrokenPipeError:
        # The reader has what it wanted; keep the interpreter from flushing into the pipe again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = 0
    except OSError as error:
        # Standard output failed (a full disk); what is left in its buffer would fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = _refuse(f"cannot write the output: {error.strerror}")
    sys.exit(status or 0)


def _refuse(message: str) -> int:
    typer.echo(f"mdfconv: {' '.join(message.split())}", err=True)
    return 2
