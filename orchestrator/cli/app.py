"""``orchestrate``: the command line. Each command is a thin layer over what Python can call as well."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Annotated

import typer

from ...components.errors import ComponentError
from .. import world
from ..errors import FmuError, RailcosimError, RunError, ScenarioError
from . import analysis, models, reports, runs, scenarios, searches, studies
from .lines import Log, folded, tell
from .options import FMU_FAILED, OK, WRONG_INPUT
from .streams import flush_streams, secure_streams
from .supervision import supervised

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def main() -> None:
    """Entry point: every expected error becomes one message and an exit code."""
    secure_streams()
    logging.getLogger().addHandler(Log(logging.WARNING))
    # pythonfmu 0.7 frees its interpreter state twice when C++ is torn down, and some exits crash: leave before that.
    world.exit_at_once(supervised(_command))


def _command() -> int:
    code = call()
    flush_streams()
    return code


def call(arguments: Sequence[str] | None = None) -> int:
    """Run a command, with the arguments of the process by default, and return its exit code."""
    try:
        app(arguments)
    except RunError as error:
        what = "an FMU" if isinstance(error, FmuError) else "the run"
        return _fail([f"{what} failed: {error}"], FMU_FAILED)
    except ScenarioError as error:
        return _fail(folded(error.problems), WRONG_INPUT)
    except (RailcosimError, ComponentError) as error:
        return _fail([str(error)], WRONG_INPUT)
    except OSError as error:
        return _fail([f"{error.filename or 'a file'}: {error.strerror or error}"], WRONG_INPUT)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else OK
    return OK


def _fail(messages: Sequence[str], code: int) -> int:
    for message in messages:
        tell(f"error: {message}")
    return code


def _version(wanted: bool) -> None:
    if wanted:
        import importlib.metadata

        print(f"railcosim {importlib.metadata.version('railcosim')}")
        raise typer.Exit()


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Co-simulate trains, cruise controllers and ATO controllers as FMUs."""


app.command()(runs.run)
app.command("list")(scenarios.list_all)
for command in (
    scenarios.check,
    runs.plot,
    runs.reproduce,
    reports.report,
    models.describe,
    models.build,
    models.pack,
    models.validate,
    models.new,
    analysis.compare,
    analysis.linearize,
    searches.falsify,
    searches.optimize,
    studies.study,
    studies.replay,
):
    app.command()(command)


if __name__ == "__main__":
    main()
