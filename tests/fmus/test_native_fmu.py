"""Native FMUs as files: what is in them, that they are reproducible, that their sources serve, and what is refused."""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import fmpy.build
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from lxml import etree
from railcosim.components import Component, ComponentError, Simulation, simulate
from railcosim.components.tracing import TracingError
from railcosim.fmus import native_fmu, toolchain
from railcosim.fmus.build import build, build_component
from railcosim.fmus.references import resolve
from railcosim.fmus.toolchain import CompilerError

HERE = Path(__file__).parent
MIXED, FUNCTIONS = (f"{HERE / 'native_samples.py'}:{name}" for name in ("Mixed", "Functions"))
TEXTS = {"Types", "Everything"}
STRICT = ("-std=c11", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror")
HEADERS = Path(fmpy.__file__).parent / "c-code"


def native(reference, profile="standard"):
    if reference.rpartition(":")[2] in TEXTS:
        pytest.skip("computes a text")
    return build(reference, kind="native", profile=profile)


def unzip(path, folder):
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    return folder


def compile_program(sources, target, *flags, compiler=("gcc",)):
    done = subprocess.run(
        [*compiler, *flags, *sources, "-o", target, "-lm"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return target


# ---------------------------------------------------------------- the archive


@pytest.mark.few
def test_the_validator_finds_nothing(reference):
    assert list(validate_fmu(str(native(reference)))) == []


def test_the_archive_is_whole(tmp_path):
    folder = unzip(build("PointMassTrain", kind="native"), tmp_path)
    files = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    assert {
        "modelDescription.xml",
        "documentation/index.html",
        f"binaries/{toolchain.PLATFORMS[toolchain.here()].folder}/PointMassTrain{toolchain.PLATFORMS[toolchain.here()].suffix}",
        *(
            f"sources/{name}"
            for name in ("all.c", "model.h", "equations.c", "instance.h", "fmi2.h", "fmi2.c", "life.c")
        ),
        *(f"sources/{name}" for name in ("values.c", "inputs.c", "derivatives.c", "state.c")),
        *(f"sources/{name}" for name in ("tape.c", "noise.c", "log.c", "simulation.c")),
    } <= files
    assert not any("fmi2Functions" in name for name in files)


def test_the_description_says_what_a_native_fmu_can(tmp_path):
    root = etree.parse(unzip(build("PointMassTrain", kind="native"), tmp_path) / "modelDescription.xml").getroot()
    slave = root.find("CoSimulation")
    state = ("canGetAndSetFMUstate", "canSerializeFMUstate")
    for capability in (*state, "providesDirectionalDerivative", "canInterpolateInputs"):
        assert slave.get(capability) == "true"
    assert slave.get("needsExecutionTool") == "false"
    assert [file.get("name") for file in slave.find("SourceFiles")] == ["all.c"]
    variables = {v.get("name"): v for v in root.find("ModelVariables")}
    index = {name: k for k, name in enumerate(variables, 1)}
    assert variables["der(speed)"].find("Real").get("derivative") == str(index["speed"])
    assert variables["der(speed)"].find("Real").get("unit") == "m/s2"
    rates = [int(u.get("index")) for u in root.find("ModelStructure/Derivatives")]
    assert rates == [index["der(position)"], index["der(speed)"]]
    (rate,) = (u for u in root.find("ModelStructure/Derivatives") if int(u.get("index")) == index["der(position)"])
    assert rate.get("dependencies") == str(index["speed"])


def test_model_exchange_stands_beside_co_simulation(tmp_path):
    path = build("Consist", kind="native", profile="model-exchange")
    assert list(validate_fmu(str(path))) == []
    root = etree.parse(unzip(path, tmp_path) / "modelDescription.xml").getroot()
    exchange, slave = root.find("ModelExchange"), root.find("CoSimulation")
    state = ("canGetAndSetFMUstate", "canSerializeFMUstate")
    for capability in (*state, "providesDirectionalDerivative", "completedIntegratorStepNotNeeded"):
        assert exchange.get(capability) == "true"
    assert exchange.get("canInterpolateInputs") is None
    assert slave.get("canInterpolateInputs") == "true"
    assert [file.get("name") for file in exchange.find("SourceFiles")] == ["all.c"]
    again = [v.get("name") for v in root.find("ModelVariables") if v[0].get("reinit") == "true"]
    assert again == ["speed[1]", "speed[2]", "speed[3]"]
    # At rest each carriage is set off either way; and it comes to rest.
    assert root.get("numberOfEventIndicators") == "9"
    assert (tmp_path / "sources" / "exchange2.c").is_file()
    plain = etree.parse(unzip(build("Consist", kind="native"), tmp_path / "plain") / "modelDescription.xml").getroot()
    assert not list(plain.iter("ModelExchange"))
    assert not {"reinit", "numberOfEventIndicators"} & {key for element in plain.iter() for key in element.attrib}
    assert not list((tmp_path / "plain" / "sources").glob("exchange*"))


def test_it_runs_in_fmpy_as_in_plain_python(tmp_path):
    given = {"force": 3e5, "speed": 3.0}
    starts = {"force": 3e5, "speed_start": 3.0}
    result = fmpy.simulate_fmu(
        str(build("PointMassTrain", kind="native")), stop_time=10.0, output_interval=0.5, start_values=starts
    )
    expected = simulate(resolve("PointMassTrain")(**given), 10.0, 0.5)
    for name in ("position", "speed", "acceleration"):
        assert np.array_equal(result[name], expected[name]), name


# ---------------------------------------------------------------- building


@pytest.mark.long
def test_the_same_component_gives_the_same_bytes(monkeypatch, tmp_path):
    contents = []
    for place in ("one", "a much longer place/two"):
        monkeypatch.setenv("RAILCOSIM_CACHE", str(tmp_path / place))
        contents.append(build("ComfortCruise", kind="native").read_bytes())
    assert contents[0] == contents[1]


def test_the_code_does_not_depend_on_the_order_of_a_set():
    """In a process of another hash seed."""
    program = (
        "from railcosim.fmus import native_fmu; from railcosim.fmus.references import resolve; import sys\n"
        f"print(native_fmu.sources(resolve({MIXED!r})(), 'guid'))"
    )
    texts = {
        subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert len(texts) == 1


def test_a_hit_in_the_cache_neither_traces_nor_compiles(monkeypatch):
    path = build("Gust", kind="native")
    before = path.stat().st_mtime_ns

    def never(*_, **__):
        raise AssertionError("built again")

    monkeypatch.setattr(native_fmu, "contents", never)
    monkeypatch.setattr(subprocess, "run", never)
    assert build("Gust", kind="native") == path
    assert path.stat().st_mtime_ns == before


def test_values_and_kinds_make_different_fmus():
    train = resolve("PointMassTrain")
    paths = [build_component(train(**given), "native") for given in ({}, {"mass": 3e5}, {"speed": 1.0})]
    guids = {fmpy.read_model_description(path).guid for path in [*paths, build("PointMassTrain")]}
    assert len(guids) == 4


# ---------------------------------------------------------------- refusals


def component(body, declarations="", methods=""):
    return (
        "import math\n"
        "from railcosim.components import Component, Input, Memory, Output, Parameter, State, maths\n"
        "class C(Component):\n"
        '    "One."\n'
        '    u = Input("1", 0.5)\n'
        '    mode = Parameter("1", "slow")\n'
        '    y = Output("1")\n'
        f"{declarations}"
        "    def outputs(self):\n"
        f"        {body}\n"
        f"{methods}"
    )


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("return {'y': 1.0 if self.u > 0.0 else 2.0}", "asked for its truth"),
        ("return {'y': math.tanh(self.u)}", "turned into a plain number"),
        ("return {'y': maths.where(self.mode == 'fast', self.u, 0.0)}", "a text is read"),
        ("return {'y': max(self.u, 0.0)}", "asked for its truth"),
    ],
)
def test_equations_that_cannot_be_traced_are_refused_with_the_line(write_component, body, said):
    path = write_component(component(body), name="law.py")
    with pytest.raises(ComponentError) as caught:
        build(path, kind="native")
    message = str(caught.value)
    assert said in message
    assert "C.outputs" in message


def test_packages_that_c_does_not_have_are_refused_with_the_reason(write_component):
    path = write_component(component("return {'y': self.u}", declarations='    requires = ("scipy",)\n'))
    with pytest.raises(ComponentError, match=r"C imports scipy.*Python FMU"):
        build(path, kind="native")


def test_what_the_compiler_said_is_told(monkeypatch, tmp_path):
    compiler = tmp_path / "cc"
    compiler.write_text("#!/bin/sh\necho 'all.c:1: error: no sense' >&2\nexit 1\n")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    for cached in (toolchain.system_compiler, toolchain.identity):
        getattr(cached, "cache_clear", lambda: None)()
    try:
        with pytest.raises(CompilerError, match="no sense"):
            build_component(resolve("Gust")(size=0.123), "native")
    finally:
        monkeypatch.undo()
        for cached in (toolchain.system_compiler, toolchain.identity):
            getattr(cached, "cache_clear", lambda: None)()


@pytest.mark.parametrize(
    "name",
    [
        *("Tape", "state", "all", "library"),
        *(pytest.param(x, marks=pytest.mark.long) for x in ("tape", "Log", "inputs", "equations", "Noise", "instance")),
    ],
)
def test_a_component_may_bear_the_name_of_a_file_of_the_runtime(write_component, unpack, name):
    text = component("return {'y': 2.0 * self.u}").replace("class C(", f"class {name}(")
    path = write_component(text).removesuffix(":C") + f":{name}"
    result = fmpy.simulate_fmu(str(unpack(build(path, kind="native"))), stop_time=1.0, output_interval=0.5)
    assert list(result["y"]) == [1.0, 1.0, 1.0]


# ---------------------------------------------------------------- the sources


COMPILERS = {"gcc": ("gcc",), "zig": (sys.executable, "-m", "ziglang", "cc")}


def strictly_compiled(reference, folder, compiler, *flags, profile="standard"):
    if shutil.which(COMPILERS[compiler][0]) is None:
        pytest.skip(f"{compiler} is not installed")
    source = unzip(native(reference, profile), folder) / "sources" / "all.c"
    compile_program([source], folder / "o", *STRICT, *flags, "-c", "-I", HEADERS, compiler=COMPILERS[compiler])


@pytest.mark.few
def test_every_component_compiles_without_a_warning(tmp_path, reference):
    strictly_compiled(reference, tmp_path, "gcc", "-fsyntax-only")


@pytest.mark.sample(2)
@pytest.mark.parametrize("profile", ["standard", "model-exchange"])
@pytest.mark.parametrize("compiler", COMPILERS)
def test_the_optimizer_of_either_compiler_finds_nothing_to_warn_of(tmp_path, compiler, profile):
    strictly_compiled(MIXED, tmp_path, compiler, "-O2", profile=profile)


def test_fmi_3_has_folders_of_its_own():
    found = toolchain.folders(toolchain.PLATFORMS, "3")
    assert found["darwin64"] == ("x86_64-darwin", "aarch64-darwin")
    others = {"x86_64-linux", "x86_64-windows", "aarch64-linux", "wasm32-wasi"}
    assert {folder for name in found for folder in found[name]} == {*found["darwin64"], *others}


@pytest.mark.parametrize("profile", ["standard", pytest.param("model-exchange", marks=pytest.mark.long)])
@pytest.mark.parametrize("compiler", COMPILERS)
def test_so_it_is_in_fmi_3(tmp_path, compiler, profile):
    if shutil.which(COMPILERS[compiler][0]) is None:
        pytest.skip(f"{compiler} is not installed")
    folder = unzip(build(MIXED, kind="native", profile=profile, fmi="3"), tmp_path)
    flags = (*STRICT, "-O2", "-c", "-isystem", HEADERS)
    compile_program([folder / "sources" / "all.c"], tmp_path / "o", *flags, compiler=COMPILERS[compiler])


@pytest.mark.long
@pytest.mark.parametrize("compiler", COMPILERS)
def test_every_component_compiles_without_a_warning_when_optimized(tmp_path, reference, compiler):
    strictly_compiled(reference, tmp_path, compiler, "-O2")


@pytest.mark.skipif(shutil.which("nm") is None, reason="needs nm")
def test_nothing_but_the_functions_of_the_standard_is_visible(tmp_path):
    folder = unzip(build(MIXED, kind="native"), tmp_path)
    (library,) = (folder / "binaries").glob("*/*.so")
    listed = subprocess.run(["nm", "-D", "--defined-only", library], capture_output=True, text=True, check=True).stdout
    assert all(line.split()[-1].startswith("fmi2") for line in listed.splitlines())
    own = compile_program(
        [folder / "sources" / "all.c"], tmp_path / "o", "-c", "-I", HEADERS, "-DFMI2_FUNCTION_PREFIX=Own_"
    )
    listed = subprocess.run(["nm", "--defined-only", "-g", own], capture_output=True, text=True, check=True).stdout
    names = [line.split()[-1] for line in listed.splitlines()]
    assert len(names) > 30
    assert all(name.startswith("Own_fmi2") for name in names)
    called = subprocess.run(["nm", "-u", own], capture_output=True, text=True, check=True).stdout
    assert not re.search(r"\b(printf|exit|abort|setlocale)\b", called)


def _prefixing(folder):
    """The standard's headers, with the prefix that FMPy has taken out of its copy put back."""
    place = folder / "headers"
    if not place.exists():
        shutil.copytree(HEADERS, place, ignore=shutil.ignore_patterns("fmi1*", "fmi3*", "*.txt"))
        header = place / "fmi2Functions.h"
        plain = "#define fmi2FullName(name) name\n"
        assert plain in header.read_text()
        header.write_text(
            header.read_text().replace(
                plain,
                "#if defined(FMI2_FUNCTION_PREFIX)\n"
                "  #define fmi2Paste(a,b)     a ## b\n"
                "  #define fmi2PasteB(a,b)    fmi2Paste(a,b)\n"
                "  #define fmi2FullName(name) fmi2PasteB(FMI2_FUNCTION_PREFIX, name)\n"
                f"#else\n  {plain}#endif\n",
            )
        )
    return place


@pytest.mark.sample(2)
@pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++")
@pytest.mark.parametrize(
    ("name", "fmi", "profile"),
    [
        *((MIXED, fmi, "standard") for fmi in ("2", "3")),
        *((name, "2", "standard") for name in ("PidAto", "Gust")),
        *((name, "2", "model-exchange") for name in (MIXED, "PointMassTrain", "Gust")),
        (MIXED, "3", "model-exchange"),
    ],
    ids=[
        "Mixed",
        "3",
        "PidAto",
        "Gust",
        "Mixed-exchange",
        "PointMassTrain-exchange",
        "Gust-exchange",
        "Mixed-exchange-3",
    ],
)
def test_the_sources_compile_as_c_plus_plus_with_the_functions_of_c(tmp_path, name, fmi, profile):
    (tmp_path / "sources").mkdir()
    for file, text in native_fmu.sources(resolve(name)(), "{x}", profile, fmi).items():
        (tmp_path / "sources" / file).write_text(text, encoding="utf-8")
    flags = (
        "-x",
        "c++",
        "-std=c++11",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-c",
        "-I",
        HEADERS,
        f"-DFMI{fmi}_FUNCTION_PREFIX=own_",
    )
    command = ["g++", *flags, tmp_path / "sources" / "all.c", "-o", tmp_path / "it.o"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    listed = subprocess.run(["nm", "-g", tmp_path / "it.o"], capture_output=True, text=True, check=True).stdout
    assert len(re.findall(rf" T own_fmi{fmi}\w+$", listed, re.MULTILINE)) > 30


@pytest.mark.skipif(shutil.which("objdump") is None or not sys.platform.startswith("linux"), reason="needs objdump")
def test_a_library_needs_no_younger_c_library_than_2_17(tmp_path):
    folder = unzip(build(MIXED, kind="native"), tmp_path)
    (library,) = (folder / "binaries").glob("*/*.so")
    listed = subprocess.run(["objdump", "-T", library], capture_output=True, text=True, check=True).stdout
    needed = [tuple(map(int, version.split("."))) for version in re.findall(r"GLIBC_([\d.]+)", listed)]
    assert needed
    assert max(needed) <= (2, 17)
    assert re.search(r"\bexp$", listed, re.MULTILINE)


def test_two_source_fmus_run_side_by_side_in_one_program(tmp_path, sample):
    models = {"TRAIN": "PointMassTrain", "OBSERVER": sample("Estimator")}
    folders = {key: unzip(build(what, kind="native"), tmp_path / key) for key, what in models.items()}
    described = {key: fmpy.read_model_description(folder) for key, folder in folders.items()}
    references = {v.name.upper(): v.valueReference for d in described.values() for v in d.modelVariables}
    flags = [f"-D{key}_GUID={d.guid!r}".replace("'", '"') for key, d in described.items()]
    train = {v.name: v.valueReference for v in described["TRAIN"].modelVariables}
    flags += [f"-DFORCE={train['force']}", f"-DSPEED={train['speed']}"]
    flags += [f"-D{name}={references[name]}" for name in ("MEASURED", "ESTIMATE")]
    headers = ["-I", _prefixing(tmp_path)]
    objects = [
        compile_program([folder / "sources" / "all.c"], tmp_path / f"{key}.o", "-std=c11", "-c", *headers)
        for key, folder in folders.items()
    ]
    program = compile_program([HERE / "c" / "side_by_side.c", *objects], tmp_path / "both", *STRICT, *flags, *headers)
    lines = subprocess.run([program], capture_output=True, text=True, check=True).stdout.split()
    numbers = [float.fromhex(text) for text in lines]
    speed = simulate(resolve("PointMassTrain")(), 5.0, 0.1, lambda t: {"force": 1e5 * (round(t / 0.1) % 7)})["speed"]
    observer = Simulation(resolve(sample("Estimator"))())
    observer.initialize()
    observer.start()
    estimate = []
    for k in range(50):
        observer.time = 0.1 * k
        observer.set("measured", float(speed[k + 1]))
        observer.step(0.1)
        estimate.append(observer.get("estimate"))
    assert numbers[::2] == speed[1:].tolist()
    assert numbers[1::2] == estimate


@pytest.mark.filterwarnings("ignore:Implicitly cleaning up:ResourceWarning")  # FMPy leaves its build folder behind
@pytest.mark.parametrize("what", ["PointMassTrain", MIXED], ids=["PointMassTrain", "Mixed"])
def test_fmpy_compiles_the_sources_to_the_same_results(tmp_path, monkeypatch, what):
    """FMPy's own build of source FMUs, with CMake, its headers and other flags than ours."""
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    if shutil.which("cmake") is None:
        pytest.skip("cmake is not installed")
    folder = unzip(build(what, kind="native"), tmp_path / "fmu")
    ours = fmpy.simulate_fmu(str(folder), stop_time=5.0, output_interval=0.25)
    shutil.rmtree(folder / "binaries")
    fmpy.build.build_platform_binary(folder)
    assert list((folder / "binaries").glob("*/*.so"))
    theirs = fmpy.simulate_fmu(str(folder), stop_time=5.0, output_interval=0.25)
    for name in ours.dtype.names:
        assert np.array_equal(ours[name], theirs[name]), name


@pytest.mark.long
@pytest.mark.skipif(not toolchain.has_zig(), reason="ziglang is not installed")
@pytest.mark.parametrize("what", ["ComfortCruise", MIXED, FUNCTIONS], ids=["ComfortCruise", "Mixed", "Functions"])
def test_the_cross_compiler_gives_the_same_bits(tmp_path, what):
    """An FMU for several platforms is compiled by ziglang, this machine's library included, against an old glibc."""
    others = ("aarch64-linux",) if toolchain.here() != "aarch64-linux" else ("linux64",)
    fmus = [build(what, kind="native"), build(what, kind="native", platforms=(toolchain.here(), *others))]
    folders = [unzip(path, tmp_path / str(k)) for k, path in enumerate(fmus)]
    assert len(list(folders[1].glob("binaries/*/*"))) == 2
    ours, cross = (fmpy.simulate_fmu(str(folder), stop_time=20.0, output_interval=0.25) for folder in folders)
    for name in ours.dtype.names:
        assert np.array_equal(ours[name], cross[name]), name


@pytest.mark.parametrize(
    ("what", "profile"),
    [
        *((MIXED, profile) for profile in ("standard", "model-exchange")),
        pytest.param("PointMassTrain", "model-exchange", marks=pytest.mark.long),
        *(
            pytest.param(x, "standard", marks=pytest.mark.long)
            for x in ("PointMassTrain", "Learner", "Dice", "Counter")
        ),
    ],
)
def test_the_whole_interface_runs_clean_under_the_sanitizers(tmp_path, sample, what, profile):
    """AddressSanitizer (leaks included) and UndefinedBehaviorSanitizer, on a driver that calls everything."""
    if shutil.which("gcc") is None:
        pytest.skip("needs gcc")
    reference = sample(what) if what in ("Learner", "Dice", "Counter") else what
    folder = unzip(build(reference, kind="native", profile=profile), tmp_path / "fmu")
    program = compile_program(
        [HERE / "c" / "whole_api.c"],
        tmp_path / "driver",
        *("-std=c11", "-g", "-O1", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"),
        *("-DFMI2_OVERRIDE_FUNCTION_PREFIX", "-I", folder / "sources", "-I", HEADERS),
        *("-Wall", "-Wextra", "-Werror"),
    )
    environment = {**os.environ, "ASAN_OPTIONS": "detect_leaks=1:strict_string_checks=1"}
    done = subprocess.run([program, tmp_path / "tape"], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr, done.stdout) == (0, "", "clean\n")


def test_the_base_class_is_no_fmu():
    with pytest.raises((ComponentError, TracingError)):
        build_component(
            type("Bad", (Component,), {"__doc__": "x", "outputs": lambda self: {"nothing": 1.0}})(), "native"
        )
