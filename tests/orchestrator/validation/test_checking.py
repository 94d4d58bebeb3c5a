"""`orchestrate validate` on good, broken, crashing and hanging FMUs: what it finds, and that nothing takes it down."""

import os
import shutil
import signal
import sys
import threading
import time
import zipfile

import pytest
from railcosim.fmus.build import build, native_problem
from railcosim.fmus.references import resolve
from railcosim.orchestrator import FmuFileError, world
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.validation import checking, validate
from railcosim.orchestrator.validation.probing import PROBES

needs_native = pytest.mark.skipif(
    bool(native_problem(resolve("PointMassTrain"))), reason="native FMUs cannot be made here"
)
needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")

CRASH = "*(volatile int *)0 = 1;"


def verdicts(report):
    return {finding.check: finding.verdict for finding in report.findings}


def detail(report, check):
    return next(finding.detail for finding in report.findings if finding.check == check)


@needs_native
@pytest.mark.parametrize("fmi", ["2", pytest.param("3", marks=pytest.mark.long)])
def test_our_native_fmus_pass_everything(fmi):
    report = validate(build("PointMassTrain", kind="native", fmi=fmi))
    assert set(verdicts(report).values()) <= {"pass", "skipped", "note"}
    assert set(PROBES.values()) < set(verdicts(report))
    assert report.passed


@pytest.mark.long
def test_our_python_fmus_pass():
    report = validate(build("PointMassTrain", kind="python"))
    assert report.passed, report.findings
    assert verdicts(report)[PROBES["order"]] in ("pass", "warning")  # pythonfmu's wrapper takes any order


@needs_compiler
def test_a_good_fmu_of_another_maker_passes(lag):
    report = validate(lag())
    assert {check for check, verdict in verdicts(report).items() if verdict not in ("pass", "skipped")} == {"notes"}
    assert detail(report, "notes") == "Lag lists no dependencies of y; no direct feed-through is assumed"
    assert "rules of railcosim" not in verdicts(report)


@pytest.mark.sample(5)
@needs_compiler
@pytest.mark.parametrize(
    ("code", "probe", "part"),
    [
        ({"on_instantiate": CRASH}, "instantiate", "took its process down at fmi2Instantiate (SIGSEGV)"),
        ({"on_instantiate": "return 0;"}, "instantiate", "cannot be instantiated"),
        ({"on_step": CRASH}, "simulate", "took its process down at fmi2DoStep (SIGSEGV)"),
        ({"on_step": "abort();"}, "simulate", "SIGABRT"),
        ({"on_step": "exit(0);"}, "simulate", "exit code 0"),
        ({"on_step": "if (t > 0.5) return fmi2Error;"}, "simulate", "t = 0.6 s, status error: fmi2DoStep failed"),
        (
            {"on_step": 'M->log(0,"probe0",fmi2Error,"e","broken");return fmi2Fatal;'},
            "simulate",
            "t = 0 s, status fatal: fmi2DoStep failed; it said: [error] broken",
        ),
        (
            {"on_step": 'M->log(0,"another name",fmi2Error,"e","broken");return fmi2Fatal;'},
            "simulate",
            "fmi2DoStep failed; it said: [ERROR] broken",
        ),
        ({"on_step": "M->k = 0.0 / 0.0;"}, "simulate", "output y is nan at t = 0.1 s"),
        ({"on_get": "if (vr[i] == 2) { v[i] = 7; continue; }"}, "starts", "k starts at 7.0, not at 1.0"),
        ({"on_reset": "return fmi2OK;"}, "reset", "t = 0 s, status error: fmi2EnterInitializationMode failed"),
        ({"on_step": "static double n; M->u = n++;"}, "reset", "other outputs after fmi2Reset"),
        ({"shared_state": "1"}, "instances", "other outputs beside a second instance"),
        ({"on_restore": "M->y = 0;"}, "state", "other outputs after fmi2SetFMUstate"),
        ({"on_step": "memset((char *)c - 8, 65, 8);"}, "simulate", "took its process down at fmi2FreeInstance"),
    ],
)
def test_what_is_wrong_is_found_and_takes_nothing_down(found, code, probe, part):
    verdict, detail = found(probe, **code)
    assert verdict == "fail"
    assert part in detail


@needs_compiler
def test_leniency_of_another_maker_is_a_warning(found):
    verdict, detail = found("order", on_step="M->y += 1; return fmi2OK;")
    assert verdict == "warning"
    assert "fmi2DoStep before initialization, fmi2DoStep with a negative step" in detail


@needs_compiler
def test_a_wrong_call_that_takes_the_process_down_is_named_and_the_others_are_made(found):
    verdict, detail = found("order", on_get="if (vr[i] > 2) " + CRASH, on_step="if (h < 0) abort();")
    assert verdict == "warning"
    assert detail.startswith(
        "took the process down: fmi2DoStep with a negative step (SIGABRT), "
        "fmi2GetReal of a value reference that is not there (SIGSEGV)\n"
    )


@needs_compiler
def test_a_death_between_two_wrong_calls_is_none_of_theirs(found):
    """Every third instance of a process ends it, which counts them by open files; the next process goes on."""
    code = "int dup2(int, int); if (dup2(91, 92) == 92) abort(); if (dup2(90, 92) == 92) dup2(0, 91); dup2(0, 90);"
    verdict, detail = found("order", on_instantiate=code, on_step="return fmi2OK;")
    assert verdict == "warning"
    assert detail.startswith(
        "accepted without an error: fmi2DoStep before initialization, fmi2DoStep with a negative step, "
        "fmi2DoStep after fmi2Terminate\ntook the process down: instantiation (SIGABRT)\n"
    )


@pytest.mark.long
@needs_compiler
def test_an_fmu_that_hangs_is_ended(lag):
    begin = time.monotonic()
    report = validate(lag(on_step="for (;;) {}"), timeout=3.0)
    assert "not finished after 3 s by fmi2DoStep and was ended" in detail(report, PROBES["simulate"])
    assert verdicts(report)[PROBES["instantiate"]] == "pass"
    assert time.monotonic() - begin < 60.0


@needs_compiler
@pytest.mark.skipif(sys.platform.startswith("win"), reason="POSIX signals")
@needs_compiler
def test_an_interruption_does_not_wait_for_a_probe_that_hangs(lag, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    started, start = [], world.start

    def note(*arguments, **how):
        started.append(start(*arguments, **how))
        threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGUSR1)).start()
        return started[-1]

    monkeypatch.setattr(world, "start", note)
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    before = signal.signal(signal.SIGUSR1, interrupt)
    try:
        with pytest.raises(KeyboardInterrupt):
            validate(lag(on_instantiate="for (;;) {}"), timeout=1000.0)
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert started
    assert all(process.returncode is not None for process in started)


def test_the_schema_and_the_validator_are_asked(lag, lag_description):
    elsewhere = {"platform": "elsewhere64"}  # where nothing is tried
    report = validate(lag(lag_description.replace('<Real start="0"/>', '<Real begin="0" start="0"/>'), **elsewhere))
    assert verdicts(report)["schema"] == "fail"
    assert "line 6" in detail(report, "schema")
    unknowns = '<InitialUnknowns><Unknown index="1"/></InitialUnknowns>'
    report = validate(lag(lag_description.replace(unknowns, ""), **elsewhere))
    assert (verdicts(report)["schema"], verdicts(report)["description"]) == ("pass", "pass")
    assert verdicts(report)["initial unknowns"] == "note"
    assert "InitialUnknowns" in detail(report, "initial unknowns")
    assert report.passed
    report = validate(lag(lag_description.replace('<Outputs><Unknown index="1"/></Outputs>', ""), **elsewhere))
    assert "ModelStructure/Outputs" in detail(report, "description")
    assert not report.passed


@needs_compiler
def test_what_a_run_remarks_is_told(lag, tmp_path):
    """Of the archive and the description, and what the FMU does to the process it shares with others."""
    with zipfile.ZipFile(lag(platform="elsewhere64")) as old, zipfile.ZipFile(tmp_path / "b.fmu", "w") as new:
        for entry in old.namelist():
            new.writestr(entry.replace("/", "\\"), old.read(entry))
    report = validate(tmp_path / "b.fmu")
    assert (verdicts(report)["archive"], verdicts(report)["notes"]) == ("warning", "note")
    assert "it has paths with backslashes" in detail(report, "archive")
    assert "backslashes" not in detail(report, "notes")


@needs_compiler
@pytest.mark.parametrize("place", ["on_instantiate", "on_step", "on_free"])
def test_what_it_does_to_its_process_is_told(found, place):
    verdict, told = found("surroundings", **{place: 'chdir("/");'}, options=["-include", "unistd.h"])
    assert (verdict, told) == (
        "note",
        "it changed the working directory, put back since; isolate it to keep that to itself",
    )


@needs_compiler
def test_a_library_of_another_name_or_platform(lag):
    report = validate(lag(library="Other"))
    assert "not named after the model identifier 'Lag'" in detail(report, "binary")
    assert verdicts(report)[PROBES["simulate"]] == "pass"
    report = validate(lag(platform="elsewhere64"))
    assert verdicts(report)["binary"] == "skipped"
    assert "it brings elsewhere64" in detail(report, "binary")


@needs_native
@pytest.mark.long
def test_our_own_rules_bind_our_own_fmus(tmp_path):
    """The same archive with what we promise taken out of it."""
    path = tmp_path / "worse.fmu"
    with zipfile.ZipFile(build("PointMassTrain", kind="native")) as old, zipfile.ZipFile(path, "w") as new:
        for entry in old.namelist():
            content = old.read(entry)
            if entry == "modelDescription.xml":
                for good, bad in (
                    (b' canSerializeFMUstate="true"', b""),
                    (b' canInterpolateInputs="true"', b""),
                    (b' dependencies=""', b""),
                    (b' description="speed"', b""),
                    (b'<BaseUnit kg="1" m="1" s="-2"/>', b""),
                ):
                    assert good in content
                    content = content.replace(good, bad)
            if not entry.startswith(("documentation", "sources")):
                new.writestr(entry, content)
    found = detail(validate(path), "rules of railcosim")
    for part in (
        "canSerializeFMUstate is not declared",
        "canInterpolateInputs is not declared",
        "the output speed lists no dependencies",
        "speed has no description",
        "the unit 'N' is not defined by base units",
        "documentation/index.html is missing",
        ".c is listed and missing",
    ):
        assert part in found


@pytest.mark.parametrize("index", ["99", "", "x", "9" * 50])
def test_a_file_that_says_it_is_ours_is_not_believed(tmp_path, xml, index):
    ours = '<VendorAnnotations><Tool name="railcosim"><component kind="native"/></Tool></VendorAnnotations>'
    text = xml["description"]([xml["variable"]("y", "output")], simulation='needsExecutionTool="false"')
    text = text.replace("<ModelVariables>", f"{ours}<ModelVariables>")
    text = text.replace("<InitialUnknowns>", f'<Derivatives><Unknown index="{index}"/></Derivatives><InitialUnknowns>')
    text = text.replace('<InitialUnknowns><Unknown index="1"/>', f'<InitialUnknowns><Unknown index="{index}"/>')
    path = xml["write_archive"](tmp_path / "theirs.fmu", {"modelDescription.xml": text})
    assert "y is calculated and missing from InitialUnknowns" in detail(validate(path), "rules of railcosim")


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("no_zip.fmu", None),
        ("no_description.fmu", {"readme.txt": "x"}),
        ("no_xml.fmu", {"modelDescription.xml": "<fmi"}),
        ("fmi3.fmu", {"modelDescription.xml": '<fmiModelDescription fmiVersion="3.0"/>'}),
        ("outside.fmu", {"modelDescription.xml": "<fmiModelDescription/>", "../evil": "x"}),
    ],
)
def test_a_file_that_is_no_fmu_is_refused(tmp_path, xml, name, content, capsys):
    path = tmp_path / name
    path.write_text("nothing") if content is None else xml["write_archive"](path, content)
    with pytest.raises(FmuFileError, match=name):
        validate(path)
    assert call(["validate", str(path)]) == 2
    assert name in capsys.readouterr().err


@needs_compiler
@pytest.mark.long
def test_the_command_prints_a_table_and_tells_by_its_exit_code(lag, capsys):
    lenient = lag(on_get="if (vr[i] > 2) " + CRASH)
    assert call(["validate", str(lenient)]) == 0  # a warning fails nothing
    good = capsys.readouterr().out
    assert " 1 warning" in good
    assert "20 steps of 0.1 s, 1 outputs finite" in good
    assert "\nvalid: " in good
    assert call(["validate", str(lag(on_step=CRASH))]) == 1
    bad = capsys.readouterr().out
    assert "SIGSEGV" in bad
    assert "\nnot valid: " in bad
    assert call(["validate", "nowhere.fmu"]) == 2


@pytest.mark.skipif(sys.platform.startswith("win"), reason="POSIX signals")
@needs_compiler
def test_what_an_fmu_prints_is_its_last_words(found):
    _, detail = found("simulate", on_step='write(2,"all is lost",11);abort();')
    assert "last words: all is lost" in detail


Y = '<ScalarVariable name="y" valueReference="1" causality="output"><Real {}/></ScalarVariable>'


@pytest.mark.parametrize(
    ("given", "found"),
    [
        (
            'unit="m"',
            [("schema", "pass", "FMI 2.0"), ("description", "pass", "more than 0 MiB names and model structure")],
        ),
        ('colour="red"', [("schema", "fail", "'colour'"), ("description", "skipped", "does not keep the schema")]),
        (
            'unit="mm"',
            [("schema", "pass", "FMI 2.0"), ("description", "fail", 'The unit "mm" of variable "y" (line 2)')],
        ),
    ],
)
def test_a_description_too_large_for_fmpy_is_read_in_parts(tmp_path, monkeypatch, given, found):
    monkeypatch.setattr(checking, "_LARGE", 0)
    (tmp_path / "modelDescription.xml").write_text(
        '<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g"><CoSimulation modelIdentifier="m"/>\n'
        '<UnitDefinitions><Unit name="m"/></UnitDefinitions>'
        f"<ModelVariables>{Y.format(given)}</ModelVariables><ModelStructure/></fmiModelDescription>"
    )
    findings = checking._described(tmp_path / "their.fmu", tmp_path, "2.0")
    assert [(each.check, each.verdict) for each in findings] == [(check, verdict) for check, verdict, _ in found]
    assert all(part in each.detail for each, (*_, part) in zip(findings, found, strict=True))
