"""The command-line application: its commands, and how errors are reported."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from simplexmesh._base.errors import DivergedError
from simplexmesh.cli import (
    curvature,
    decimate,
    demo,
    features,
    info,
    library,
    primitives,
    reconstruct,
    register,
    view,
    warm_up,
)
from simplexmesh.cli.report import INTERRUPTED, KEPT, NOTES, as_json, note

BAD_INPUT = 2
_MEANT = {
    "curvature": "saliency normals",
    "reconstruct": "fit",
    "decimate": "simplify",
    "features": "edges zones",
    "primitives": "shapes planes cylinders",
    "pipes": "plant",
    "register": "align match",
    "view": "show plot",
    "library recognize": "recognise recognize",
} | {f"library {word}": word for word in ("add", "list", "remove")}
SUGGESTIONS = {word: command for command, words in _MEANT.items() for word in words.split()}
"""Words that a user may try as a command, and the command to suggest."""

IN_PYTHON = (
    (r"\bposes=\[np\.eye\(4\)\] \* \d+ keep", "--poses none keeps"),
    (r"\b([a-z]+)='(\w+)' or '(\w+)'", r"--\1 \2 or \3"),
    (r"\b([a-z]+)='(\w+)'", r"--\1 \2"),
)
"""Arguments as messages of the library name them, and the options of the command in their place."""

EXPECTED = {"int_parsing": "a whole number", "int_from_float": "a whole number", "float_parsing": "a number"}
NOTHING_WRITTEN = "interrupted; nothing was written"


class _Plain:
    """Help that shows no type after flags."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters, flags without a type."""
        parameters: list[Any] = super().get_params(ctx)  # type: ignore[misc]
        for parameter in parameters:
            if getattr(parameter, "is_flag", False):
                parameter.metavar = ""
        return parameters


class _Command(_Plain, TyperCommand):
    pass


class _Group(_Plain, TyperGroup):
    pass


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
for _module in (demo, reconstruct, decimate, register, curvature, features, info, view, warm_up):
    _name = _module.__name__.rpartition(".")[2].replace("_", "-")
    app.command(_name, cls=_Command, epilog=_module.EXAMPLE)(_module.command)
app.command("primitives", cls=_Command, epilog=primitives.EXAMPLE)(primitives.primitives)
app.command("pipes", cls=_Command, epilog=primitives.EXAMPLE_PIPES)(primitives.pipes)
_library = typer.Typer(
    cls=_Group,
    help="Keep models in a library and find which of them a scan shows: add, list, remove, recognize.",
    epilog=library.EXAMPLE,
    no_args_is_help=True,
    rich_markup_mode="rich",
)
_library.command("add", cls=_Command, epilog=library.ADD_EXAMPLE)(library.add)
_library.command("list", cls=_Command, epilog=library.LIST_EXAMPLE)(library.list_models)
_library.command("remove", cls=_Command, epilog=library.REMOVE_EXAMPLE)(library.remove)
_library.command("recognize", cls=_Command, epilog=library.RECOGNIZE_EXAMPLE)(library.recognize)
app.add_typer(_library, name="library")


def _show_version(wanted: bool) -> None:
    if wanted:
        from simplexmesh import __version__

        typer.echo(f"simplexmesh {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    pass


def run(arguments: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit code; an error is one sentence on standard error."""
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    NOTES.clear()
    with _warnings_as_notes():
        code, problem = _outcome(arguments)
    if problem:
        typer.secho(f"error: {problem}", err=True, fg="red")
        if "--json" in arguments:
            with suppress(OSError):  # standard output may be what failed
                as_json({"error": problem})
    return code


def _outcome(arguments: list[str]) -> tuple[int, str]:
    """Run the command; return its exit code and the error message, empty without an error."""
    try:
        code: Any = app(args=arguments, prog_name="simplexmesh", standalone_mode=False)
    except KeyboardInterrupt:
        return INTERRUPTED, NOTHING_WRITTEN
    except DivergedError as problem:
        return 1, str(problem)
    except BrokenPipeError:
        sys.stderr.close()  # the reader of our output is gone; Python would complain about it at exit
        return 1, ""
    except (ValueError, TypeError, OSError, ImportError) as problem:
        return BAD_INPUT, _sentence(problem)
    except Exception as problem:
        if not hasattr(problem, "format_message"):  # the parser's errors for a wrong command line have it
            raise
        return BAD_INPUT, _usage_error(problem)
    if code == KEPT:  # the command itself has reported what it kept
        return INTERRUPTED, ""
    if code == INTERRUPTED:  # the parser returns this for an interrupt that was not caught
        return INTERRUPTED, NOTHING_WRITTEN
    return (code if isinstance(code, int) else 0), ""


def _usage_error(problem: Any) -> str:
    """Return what is wrong with a command line: the parser's message, or a more helpful one."""
    message = problem.format_message() or "no command was given; see simplexmesh --help"
    if (unknown := re.fullmatch(r"No such command '(.*)'\.", message)) and unknown[1] in SUGGESTIONS:
        return f"{message} Did you mean 'simplexmesh {SUGGESTIONS[unknown[1]]}'?"
    cause, parameter = problem.__cause__, getattr(problem, "param", None)
    if parameter is not None and hasattr(cause, "errors"):  # from pydantic, which newer versions of typer use
        first = cause.errors()[0]
        if first["type"] in EXPECTED:
            return f"{max(parameter.opts, key=len)} must be {EXPECTED[first['type']]}, not {first['input']!r}"
    return message


def _sentence(problem: Exception) -> str:
    """Return the message of an exception in one line; of the operating system's, without the error number."""
    if isinstance(problem, OSError) and problem.strerror:
        where = f"{problem.filename}: " if problem.filename else ""
        return where + problem.strerror.lower()
    return _in_the_shell(str(problem)) or type(problem).__name__


def _in_the_shell(message: str) -> str:
    """Return a message of the library in one line, with options for its arguments."""
    message = " ".join(message.split())
    for written, option in IN_PYTHON:
        message = re.sub(written, option, message)
    return message


@contextmanager
def _warnings_as_notes() -> Iterator[None]:
    """Print each warning as a note, in one line."""

    def show(message: Warning | str, *_: object, **__: object) -> None:
        note(_in_the_shell(str(message)))

    with warnings.catch_warnings():
        warnings.simplefilter("default")
        warnings.showwarning = show
        yield
