"""The application: which commands there are, and how their failures are told."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Annotated, Any

import typer

from simplexmesh.cli import demo, info, reconstruct, view
from simplexmesh.cli.report import error, note
from simplexmesh.errors import DivergedError

BAD_INPUT = 2
INTERRUPTED = 130

app = typer.Typer(
    name="simplexmesh",
    help="Compact, well-formed surface models from scans and volumes.",
    epilog="Example: simplexmesh reconstruct kitten.xyz --vertices 3000 -o kitten.vtp",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
)
app.command("demo", epilog=demo.EXAMPLE)(demo.command)
app.command("reconstruct", epilog=reconstruct.EXAMPLE)(reconstruct.command)
app.command("info", epilog=info.EXAMPLE)(info.command)
app.command("view", epilog=view.EXAMPLE)(view.command)


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


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command and leave with its code: 0 done, 2 bad input, 1 diverged, 130 interrupted."""
    sys.exit(run(arguments))


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its code; what went wrong is told in one sentence on the error stream."""
    arguments = None if arguments is None else list(arguments)
    with _warnings_as_notes():
        try:
            code: Any = app(args=arguments, prog_name="simplexmesh", standalone_mode=False)
        except KeyboardInterrupt:
            error("interrupted, nothing was written")
            return INTERRUPTED
        except DivergedError as problem:
            error(str(problem))
            return 1
        except BrokenPipeError:
            sys.stderr.close()  # whoever read our output has left; Python would complain about it at exit
            return 1
        except (ValueError, TypeError, OSError) as problem:
            error(_sentence(problem))
            return BAD_INPUT
        except Exception as problem:
            if not hasattr(problem, "format_message"):  # a wrong command line, by the parser's own kind of error
                raise
            error(problem.format_message() or "no command was given; see simplexmesh --help")
            return BAD_INPUT
    return code if isinstance(code, int) else 0


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
