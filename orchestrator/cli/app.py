"""``orchestrate``: the command line. Each command is a thin layer over what Python can call as well."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Sequence
from typing import Annotated, Any

import typer

from ...components.errors import ComponentError
from .. import world
from ..errors import RailcosimError
from . import analysis, models, reports, runs, scenarios, searches, studies
from .completing import completing_bash
from .documents import answering, fail, failed, wants_json
from .lines import Log
from .options import OK, with_factor
from .streams import flush_streams, secure_streams
from .supervision import supervised

app = typer.Typer(
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

_USAGE: Any = typer.BadParameter.__mro__[2]
"""`ClickException`: where it is imported from differs between versions of typer."""

_ASKED = "_ORCHESTRATE_COMPLETE"
"""The variable of the environment by which a shell asks what could be typed."""


def main() -> None:
    """Entry point: every expected error becomes one message and an exit code."""
    secure_streams()
    logging.getLogger().addHandler(Log(logging.WARNING))
    # pythonfmu 0.7 frees its interpreter state twice when C++ is torn down, and some exits crash: leave before that.
    asked = _ASKED in os.environ  # by a shell, which is not to wait: no FMU is loaded
    world.exit_at_once(_command() if asked else supervised(_command))


def _command() -> int:
    code = call()
    flush_streams()
    return code


def call(arguments: Sequence[str] | None = None) -> int:
    """Run a command, with the arguments of the process by default, and return its exit code."""
    words = with_factor(sys.argv[1:] if arguments is None else arguments)
    try:
        with completing_bash(_ASKED):
            code = app(words, standalone_mode=False, complete_var=_ASKED)
    except _USAGE as error:
        if wants_json(words):
            return fail([error.format_message()], error.exit_code, words)
        error.show()
        return int(error.exit_code)
    except (RailcosimError, ComponentError, OSError) as error:
        return fail(failed(error), arguments=words)
    except SystemExit as end:  # of a completion
        code = end.code
    return code if isinstance(code, int) else OK


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


app.command()(answering(runs.run))
app.command("list")(answering(scenarios.list_all, "list"))
app.command("import")(answering(scenarios.import_ssp, "import"))
for command in (
    scenarios.export,
    scenarios.check,
    runs.plot,
    runs.convert,
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
    searches.drive,
    studies.study,
    studies.replay,
):
    app.command()(answering(command))


if __name__ == "__main__":
    main()
