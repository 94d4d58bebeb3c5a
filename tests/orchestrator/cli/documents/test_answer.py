"""What a command answers: lines, or one document, with the same exit code."""

import json
import os
import subprocess
import sys

import pytest
from railcosim.orchestrator.cli import runs
from railcosim.orchestrator.cli.app import app, call
from railcosim.orchestrator.cli.documents import DOCUMENTS, Answer, answering, fail, wants_json

SMALL = """
title = "A train on its own"
[simulation]
stop_time = 2.0
step = 0.1
[instances.train]
component = "PointMassTrain"
start = { speed = 10.0, force = 0.0 }
[require]
forward = "always train.speed > LIMIT"
"""
FAILING = '''
from railcosim.components import Component, Output
from railcosim.components.maths import sqrt

class Failing(Component):
    """Has no value beyond a second."""

    y = Output("m")

    def outputs(self):
        print("printed by an FMU")
        return {"y": sqrt(1.05 - self.time)}
'''


@pytest.fixture
def small(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(limit=0.0):
        (tmp_path / "small.toml").write_text(SMALL.replace("LIMIT", str(limit)))
        return "small.toml"

    return write


def answered(capsys, *arguments):
    """Exit code, document and stderr."""
    code = call(list(arguments))
    said = capsys.readouterr()
    document = json.loads(said.out)
    assert document["exit_code"] == code
    return code, document, said.err


RUN = ("--kind", "plain", "--no-figures", "-o", "out", "--json")


def test_a_run_is_one_document_with_all_digits(small, capsys):
    code, document, said = answered(capsys, "run", small(), *RUN, "--set", "train.speed=0.1")
    assert (code, document["command"], document["error"]) == (0, "run", None)
    assert said.splitlines()[-1] == "small: 100 % of 2 s"
    (verdict,) = document["result"]["requirements"]
    assert (verdict["verdict"], verdict["name"]) == ("pass", "forward")
    assert document["result"]["directory"] == "out"
    assert answered(capsys, "run", small(99), *RUN, "-q")[::2] == (1, "")


def test_wrong_input_is_a_document_with_its_problems(small, capsys):
    code, document, said = answered(capsys, "run", small(), *RUN, "--set", "train.sped=1", "--set", "train.frce=1")
    assert (code, document["command"], document["result"]) == (2, "run", None)
    problems = document["error"]["problems"]
    assert [each["remedy"] for each in problems] == ["did you mean 'speed'?", "did you mean 'force'?"]
    assert said == "".join(f"error: {line}\n" for line in document["error"]["message"].splitlines())


def test_a_command_line_that_cannot_be_read_is_a_document(small, capsys):
    code, document, _ = answered(capsys, "run", small(), "--stop", "soon", "--json")
    assert (code, document["command"]) == (2, "run")
    assert "--stop" in document["error"]["message"]
    assert answered(capsys, "--json", "--nothing")[1]["command"] == ""
    assert call(["run", small(), "--stop", "soon"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert "Usage: " in said.err
    assert not wants_json(["run", "--", "--json"])


def test_an_fmu_that_fails_leaves_error_and_result(small, capsys, tmp_path):
    (tmp_path / "failing.py").write_text(FAILING)
    text = '[simulation]\nstop_time = 2\nstep = 0.1\n[instances.bad]\ncomponent = "failing.py:Failing"\n'
    (tmp_path / "failing.toml").write_text(text)
    code, document, said = answered(capsys, "run", "failing.toml", *RUN)
    assert code == 3
    assert document["error"]["instance"] == "bad"
    assert document["error"]["time"] == pytest.approx(1.0, abs=0.11)
    assert document["result"]["status"] == "failed"
    assert document["result"]["time_reached"] > 0.5
    assert "error: an FMU failed: bad" in said
    assert "printed by an FMU" in said


@pytest.mark.parametrize("end", [KeyboardInterrupt, runs.typer.Exit(143)])
def test_a_signal_before_there_is_anything_to_tell(end, capsys):
    def command() -> Answer:
        raise end

    with pytest.raises(runs.typer.Exit) as exit_:
        answering(command)(as_json=True)
    document = json.loads(capsys.readouterr().out)
    code = 130 if end is KeyboardInterrupt else 143
    assert (exit_.value.exit_code, document["exit_code"]) == (code, code)
    assert document["error"]["message"] == "interrupted"


def test_other_errors_have_a_message(capsys):
    assert fail(["gone", "for good"], 3, ["run", "--json"]) == 3
    assert json.loads(capsys.readouterr().out)["error"]["message"] == "gone\nfor good"
    assert fail(["gone"], 3, ["run"]) == 3
    assert capsys.readouterr() == ("", "error: gone\n")
    code, document, _ = answered(capsys, "new", "no/such/folder/mine.py", "--json")
    assert (code, document["command"]) == (2, "new")


def test_every_command_takes_it():
    names = {each.name or each.callback.__name__ for each in app.registered_commands}
    assert names == set(DOCUMENTS)


@pytest.mark.skipif(sys.platform == "win32", reason="descriptors")
def test_in_a_process_what_c_code_prints_does_not_reach_the_document():
    code = """
import ctypes, os, sys
from railcosim.orchestrator.cli.streams import aside, flush_streams, secure_streams
secure_streams()
print("before")
with aside():
    print("python")
    os.write(1, b"descriptor\\n")
    ctypes.CDLL(None).puts(b"C")
print("{}")
ctypes.CDLL(None).fflush(None)
flush_streams()
os._exit(0)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=os.environ)
    assert done.stdout == "before\n{}\n"
    assert sorted(done.stderr.split()) == ["C", "descriptor", "python"]
