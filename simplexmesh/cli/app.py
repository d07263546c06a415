"""The application: which commands there are, and how their failures are told."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from simplexmesh.cli import curvature, decimate, demo, info, library, reconstruct, register, view
from simplexmesh.cli.report import INTERRUPTED, KEPT, NOTES, as_json, error, note
from simplexmesh.errors import DivergedError

BAD_INPUT = 2
ELSEWHERE = {
    "saliency": "curvature",
    "normals": "curvature",
    "fit": "reconstruct",
    "simplify": "decimate",
    "align": "register",
    "match": "register",
    "show": "view",
    "plot": "view",
    "recognise": "library recognise",
    "recognize": "library recognise",
    "add": "library add",
    "list": "library list",
    "remove": "library remove",
}
"""What somebody may look for as a command, and the command that does it."""

WANTED = {"int_parsing": "a whole number", "int_from_float": "a whole number", "float_parsing": "a number"}
NOTHING_WRITTEN = "interrupted; nothing was written"


class _Command(TyperCommand):
    """A command whose help shows no type after switches."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters, switches without a type."""
        return _without_types(super().get_params(ctx))


class _Group(TyperGroup):
    """The group of commands, whose help shows no type after switches either."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters, switches without a type."""
        return _without_types(super().get_params(ctx))


def _without_types(parameters: list[Any]) -> list[Any]:
    for parameter in parameters:
        if getattr(parameter, "is_flag", False):
            parameter.metavar = ""
    return parameters


app = typer.Typer(
    name="simplexmesh",
    cls=_Group,
    help="Compact, well-formed surface models from scans and volumes.",
    epilog="Example: simplexmesh reconstruct kitten.xyz --vertices 3000 -o kitten.vtp",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
)
app.command("demo", cls=_Command, epilog=demo.EXAMPLE)(demo.command)
app.command("reconstruct", cls=_Command, epilog=reconstruct.EXAMPLE)(reconstruct.command)
app.command("decimate", cls=_Command, epilog=decimate.EXAMPLE)(decimate.command)
app.command("register", cls=_Command, epilog=register.EXAMPLE)(register.command)
app.command("curvature", cls=_Command, epilog=curvature.EXAMPLE)(curvature.command)
_library = typer.Typer(
    cls=_Group,
    help="Models in one file, and which of them a scan shows: add, list, remove, recognise.",
    epilog=library.EXAMPLE,
    no_args_is_help=True,
    rich_markup_mode="rich",
)
_library.command("add", cls=_Command, epilog=library.ADD_EXAMPLE)(library.add)
_library.command("list", cls=_Command, epilog=library.LIST_EXAMPLE)(library.list_models)
_library.command("remove", cls=_Command, epilog=library.REMOVE_EXAMPLE)(library.remove)
_library.command("recognise", cls=_Command, epilog=library.RECOGNISE_EXAMPLE)(library.recognise)
app.add_typer(_library, name="library")
app.command("info", cls=_Command, epilog=info.EXAMPLE)(info.command)
app.command("view", cls=_Command, epilog=view.EXAMPLE)(view.command)


def _show_version(wanted: bool) -> None:
    if wanted:
        from simplexmesh import __version__

        typer.echo(f"simplexmesh {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None:
    pass


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its code; what went wrong is told in one sentence.

    The sentence goes to the error stream and, as `{"error": ...}`, to the output of a command that was asked for JSON.
    """
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    NOTES.clear()
    with _warnings_as_notes():
        code, problem = _outcome(arguments)
    if problem:
        error(problem)
        if "--json" in arguments:
            with suppress(OSError):  # where the output is what failed
                as_json({"error": problem})
    return code


def _outcome(arguments: list[str]) -> tuple[int, str]:
    """Run the command; return its code and what went wrong, if anything."""
    try:
        code: Any = app(args=arguments, prog_name="simplexmesh", standalone_mode=False)
    except KeyboardInterrupt:
        return INTERRUPTED, NOTHING_WRITTEN
    except DivergedError as problem:
        return 1, str(problem)
    except BrokenPipeError:
        sys.stderr.close()  # whoever read our output has left; Python would complain about it at exit
        return 1, ""
    except (ValueError, TypeError, OSError) as problem:
        return BAD_INPUT, _sentence(problem)
    except Exception as problem:
        if not hasattr(problem, "format_message"):  # a wrong command line, by the parser's own kind of error
            raise
        return BAD_INPUT, _wrong_line(problem)
    if code == KEPT:  # the command said itself what it kept
        return INTERRUPTED, ""
    if code == INTERRUPTED:  # the parser's way to say that nobody caught the interrupt
        return INTERRUPTED, NOTHING_WRITTEN
    return (code if isinstance(code, int) else 0), ""


def _wrong_line(problem: Any) -> str:
    """Return what is wrong with a command line: the parser's sentence, or a better one."""
    said = problem.format_message() or "no command was given; see simplexmesh --help"
    if (unknown := re.fullmatch(r"No such command '(.*)'\.", said)) and unknown[1] in ELSEWHERE:
        return f"{said} Did you mean 'simplexmesh {ELSEWHERE[unknown[1]]}'?"
    cause, parameter = problem.__cause__, getattr(problem, "param", None)
    if parameter is not None and hasattr(cause, "errors"):  # of pydantic, by which newer versions of typer parse
        first = cause.errors()[0]
        if first["type"] in WANTED:
            return f"{max(parameter.opts, key=len)} must be {WANTED[first['type']]}, not {first['input']!r}"
    return said


def _sentence(problem: Exception) -> str:
    """Return an exception in one sentence, the operating system's own kind without its number."""
    if isinstance(problem, OSError) and problem.strerror:
        where = f"{problem.filename}: " if problem.filename else ""
        return where + problem.strerror.lower()
    return " ".join(str(problem).split()) or type(problem).__name__


@contextmanager
def _warnings_as_notes() -> Iterator[None]:
    """Show each warning as one line on the error stream."""

    def show(message: Warning | str, *_: object, **__: object) -> None:
        note(" ".join(str(message).split()))

    with warnings.catch_warnings():
        warnings.simplefilter("default")
        warnings.showwarning = show
        yield
