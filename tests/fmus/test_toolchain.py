"""The toolchain: which compiler, which flags, what the libraries are linked against, and that builds are reproducible.

The readers of library formats below are ours, so that no tool has to be there: ELF and PE after their specifications,
Mach-O after Apple's ``loader.h``, ``fat.h`` and ``cs_blobs.h``.
"""

import hashlib
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

import fmpy
import platformdirs
import pytest
from fmpy.validation import validate_fmu
from railcosim.components import CATALOGUE
from railcosim.fmus import build as build_module
from railcosim.fmus import native_fmu, toolchain
from railcosim.fmus.build import build, native_problem
from railcosim.fmus.toolchain import PLATFORMS, SYSTEMS, CompilerError, chosen, compile_library, folders

SOURCE = (
    "#include <math.h>\n#ifdef _WIN32\n__declspec(dllexport)\n#else\n"
    '__attribute__((visibility("default")))\n#endif\ndouble f(double x)\n{\n    return tanh(x);\n}\n'
)
needs_zig = pytest.mark.skipif(not toolchain.has_zig(), reason="ziglang is not installed")
needs_native = pytest.mark.skipif(bool(native_problem(CATALOGUE["Gust"])), reason="native FMUs cannot be built here")
needs_compiler = pytest.mark.skipif(not toolchain.system_compiler(), reason="there is no system compiler")


@pytest.fixture
def fresh_choice():
    """Look for compilers anew; call it after the environment has changed, and it happens again at the end."""

    cached = (toolchain.system_compiler, toolchain.has_zig, toolchain.identity)

    def forget():
        for function in cached:
            function.cache_clear()

    forget()
    yield forget
    forget()


@pytest.fixture
def nothing(monkeypatch, fresh_choice):
    """A machine without compilers."""
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setattr(toolchain, "has_zig", lambda: False)
    fresh_choice()


@pytest.fixture
def write_source(tmp_path):
    def write(folder="a", text=SOURCE, name="it.c"):
        place = tmp_path / folder
        place.mkdir(parents=True, exist_ok=True)
        (place / name).write_text(text)
        return place / name

    return write


@pytest.fixture(scope="session")
def zig_cache():
    """One for all sessions: ziglang compiles Windows' C library once per cache, which takes a minute."""
    return Path(platformdirs.user_cache_dir("railcosim", appauthor=False)) / "zig"


# ---------------------------------------------------------------- names


def test_platforms_come_in_one_order_whatever_the_wish():
    assert chosen([]) == (toolchain.here(),)
    assert chosen(["win64", "linux64", "win64"]) == ("linux64", "win64")
    assert chosen(["all"]) == SYSTEMS == ("linux64", "win64", "darwin64", "aarch64-linux")
    assert chosen(["wasm", "all"]) == tuple(PLATFORMS), "a page is no system, and asked for by name"
    with pytest.raises(CompilerError, match=r"there is no platform 'linux32'; did you mean 'linux64'\?"):
        chosen(["linux32"])
    with pytest.raises(CompilerError, match="there is no platform 'amiga'; it has aarch64-linux, all, darwin64"):
        chosen(["amiga"])


def test_every_platform_has_the_folder_its_importers_look_into(tmp_path):
    """FMI 2.0's names for x86; Arm Linux alone stands in linux64 too, where FMPy and OpenModelica look."""
    assert folders(SYSTEMS) == {name: (name,) for name in SYSTEMS}
    assert folders(["win64", "wasm"]) == {"win64": ("win64",), "wasm": ("wasm32-wasi",)}
    assert folders(["aarch64-linux"]) == {"aarch64-linux": ("aarch64-linux", "linux64")}
    for names, found in ((["aarch64-linux"], {"linux64"}), (PLATFORMS, {"linux64", "win64", "darwin64"})):
        fmu = tmp_path / "it.fmu"
        with zipfile.ZipFile(fmu, "w") as archive:
            for name, places in folders(names).items():
                for place in places:
                    archive.writestr(f"binaries/{place}/it{PLATFORMS[name].suffix}", b"")
        assert set(fmpy.supported_platforms(str(fmu))) == found


@pytest.mark.parametrize(
    ("system", "machine", "name"),
    [
        ("linux", "x86_64", "linux64"),
        ("linux", "aarch64", "aarch64-linux"),
        ("win32", "AMD64", "win64"),
        ("darwin", "arm64", "darwin64"),
    ],
)
def test_the_platform_of_this_machine(monkeypatch, system, machine, name):
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr(toolchain.platform, "machine", lambda: machine)
    assert toolchain.here() == name


# ---------------------------------------------------------------- which compiler


@pytest.mark.parametrize(
    ("system", "cc", "there", "expected"),
    [
        ("linux", "", "gcc clang", "/bin/gcc"),
        ("linux", "", "cc gcc", "/bin/cc"),
        ("linux", "clang", "cc clang", "/bin/clang"),
        ("linux", "missing", "cc", "/bin/cc"),
        ("linux", "", "cl", None),
        ("win32", "", "cl gcc", "/bin/cl"),
        ("win32", "", "gcc", "/bin/gcc"),
    ],
)
def test_the_system_compiler(monkeypatch, fresh_choice, system, cc, there, expected):  # noqa: PLR0917
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr(shutil, "which", lambda name: f"/bin/{name}" if name in there.split() else None)
    monkeypatch.setenv("CC", cc)
    fresh_choice()
    assert toolchain.system_compiler() == expected


@pytest.mark.parametrize("name", ["cl", "cl.exe", "CL.EXE"])
def test_cl_gets_its_own_flags(name):
    """As Microsoft's manual has them; nothing of this was tried on Windows."""
    command = toolchain._system_command(f"/msvc/bin/{name}", "it.c", "scratch/it.dll")
    assert {"/O2", "/fp:precise", "/LD", "/std:c11", "/Fe:scratch/it.dll", "/Fo:scratch/", "it.c"} <= set(command)
    assert command.index("it.c") < command.index("/link") < command.index("/Brepro")
    assert not [word for word in command[1:] if word.startswith("-")]


@pytest.mark.parametrize(("system", "flag"), [("linux", "-lm"), ("darwin", "-Wl,-install_name,@rpath/it.so")])
def test_flags_of_the_other_systems(monkeypatch, system, flag):
    monkeypatch.setattr(sys, "platform", system)
    command = toolchain._system_command("/bin/cc", "it.c", "scratch/it.so")
    assert {flag, "-fPIC", "-shared", "-ffp-contract=off", "-fvisibility=hidden"} <= set(command)
    monkeypatch.setattr(sys, "platform", "win32")
    assert not {"-lm", "-fPIC"} & set(toolchain._system_command("/bin/gcc", "it.c", "scratch/it.dll"))


@pytest.mark.usefixtures("nothing")
def test_without_any_compiler_the_message_says_what_to_install(write_source, tmp_path):
    here = toolchain.here()
    other = "win64" if here != "win64" else "linux64"
    with pytest.raises(CompilerError) as caught:
        compile_library(write_source(), tmp_path / "out.so", here, only=True)
    assert str(caught.value) == (
        f"there is no C compiler for {here}: 'pip install railcosim[cross]' brings one for every platform, "
        "or install cc, gcc or clang"
    )
    with pytest.raises(CompilerError) as caught:
        compile_library(write_source(), tmp_path / "out.dll", other, only=False)
    assert str(caught.value).endswith("'pip install railcosim[cross]' brings one for every platform")
    assert not toolchain.can_compile()


@needs_compiler
@pytest.mark.parametrize("only", [True, pytest.param(False, marks=needs_zig)])
def test_a_refusal_shows_what_the_compiler_said_and_leaves_nothing(write_source, tmp_path, only, zig_cache):
    if not only and toolchain.here() != "linux64":
        pytest.skip("a cold cache of another platform takes too long")
    source = write_source(text="int f(void) { return missing_name; }\n")
    with pytest.raises(CompilerError, match=r"failed \(exit code 1\):\n(.*\n)*.*missing_name"):
        compile_library(source, tmp_path / "out" / "it.so", toolchain.here(), only=only, cache=zig_cache)
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [source]


def test_what_made_the_binary_is_part_of_its_identity(monkeypatch, fresh_choice, tmp_path):
    here = toolchain.here()
    other = "win64" if here != "win64" else "linux64"
    compiler = tmp_path / "gcc"
    compiler.write_text("one")
    monkeypatch.setenv("CC", str(compiler))
    compiler.chmod(0o755)
    found = []
    for text in ("one", "another"):
        compiler.write_text(text)
        fresh_choice()
        found.append(toolchain.identity((here,)))
    found += [toolchain.identity((other,)), toolchain.identity(tuple(PLATFORMS))]
    assert len(set(found)) == 4
    monkeypatch.setattr(toolchain, "FLAGS", (*toolchain.FLAGS, "-O3"))
    fresh_choice()
    assert toolchain.identity((here,)) not in found


# ---------------------------------------------------------------- what comes out


@needs_compiler
def test_the_same_source_gives_the_same_bytes_wherever_it_stands(write_source, tmp_path):
    first, second = write_source("a"), write_source("deeper/b c/ü")
    for source, out in ((first, tmp_path / "x" / "it.so"), (second, tmp_path / "it.so")):
        compile_library(source, out, toolchain.here(), only=True)
    assert (tmp_path / "x" / "it.so").read_bytes() == (tmp_path / "it.so").read_bytes()
    assert str(tmp_path).encode() not in (tmp_path / "it.so").read_bytes()
    assert [path.name for path in first.parent.iterdir()] == ["it.c"]


def elf(data):
    """Machine, needed libraries, versions required, and exported names of a 64-bit ELF library."""
    assert data[:5] == b"\x7fELF\x02"
    machine, start, size, count, names = struct.unpack_from("<18xH20xQ10xHHH", data)
    headers = [struct.unpack_from("<IIQQQQIIQQ", data, start + k * size) for k in range(count)]
    table = data[headers[names][4] :]

    def text(where, offset):
        return where[offset : where.index(b"\0", offset)].decode()

    section = {text(table, h[0]): data[h[4] : h[4] + h[5]] for h in headers if h[1] != 8}
    strings = section[".dynstr"]
    dynamic = [struct.unpack_from("<QQ", section[".dynamic"], k) for k in range(0, len(section[".dynamic"]), 16)]
    symbols = [struct.unpack_from("<IBBHQQ", section[".dynsym"], k) for k in range(0, len(section[".dynsym"]), 24)]
    versions, at, more = set(), 0, section.get(".gnu.version_r", b"")
    while more:
        _, number, _, first, after = struct.unpack_from("<HHIII", more, at)
        entry = at + first
        for _ in range(number):
            _, _, _, name, next_entry = struct.unpack_from("<IHHII", more, entry)
            versions.add(text(strings, name))
            entry += next_entry
        at += after
        if not after:
            break
    return {
        "machine": {62: "x86_64", 183: "aarch64"}[machine],
        "needed": {text(strings, value) for tag, value in dynamic if tag == 1},
        "paths": [text(strings, value) for tag, value in dynamic if tag in (15, 29)],
        "versions": versions,
        "exports": {text(strings, s[0]) for s in symbols if s[3] and s[1] >> 4 in (1, 2)},
    }


def pe(data):
    """Machine, own name, imported libraries and exported names of a 64-bit Windows library."""
    at = struct.unpack_from("<I", data, 0x3C)[0]
    signature, machine, count, _, _, _, optional, _ = struct.unpack_from("<4sHHIIIHH", data, at)
    assert signature == b"PE\0\0"
    head = at + 24
    assert struct.unpack_from("<H", data, head)[0] == 0x20B
    exports, _, imports, _ = struct.unpack_from("<4I", data, head + 112)
    sections = [struct.unpack_from("<8xIIII", data, head + optional + 40 * k) for k in range(count)]

    def place(address):
        return next(a - v + address for n, v, s, a in sections if v <= address < v + max(n, s))

    def text(address):
        begin = place(address)
        return data[begin : data.index(b"\0", begin)].decode()

    _, _, _, name, _, _, total, _, names, _ = struct.unpack_from("<IIIIIIIIII", data, place(exports))
    listed = struct.unpack_from(f"<{total}I", data, place(names))
    libraries, entry = set(), place(imports)
    while (library := struct.unpack_from("<12xI", data, entry)[0]) != 0:
        libraries.add(text(library).lower())
        entry += 20
    return {"machine": machine, "name": text(name), "needed": libraries, "exports": {text(a) for a in listed}}


def mach_o(data):
    """The slices of a universal Mach-O file by processor: own name, needed libraries, oldest macOS, exports."""
    magic, count = struct.unpack_from(">II", data)
    assert magic == 0xCAFEBABE
    slices = [struct.unpack_from(">IIIII", data, 8 + 20 * k) for k in range(count)]
    assert all(offset % (1 << align) == 0 and offset + size <= len(data) for _, _, offset, size, align in slices)
    names = {0x01000007: "x86_64", 0x0100000C: "arm64"}
    return {names[cpu]: _mach_o_slice(data[offset : offset + size], cpu) for cpu, _, offset, size, _ in slices}


def _mach_o_slice(data, cpu):
    magic, own_cpu, _, kind, count, _, _, _ = struct.unpack_from("<8I", data)
    assert (magic, own_cpu, kind) == (0xFEEDFACF, cpu, 6)
    found, at = {"needed": set(), "signed": None}, 32
    for _ in range(count):
        command, size = struct.unpack_from("<II", data, at)
        body = data[at : at + size]
        if command in (0xC, 0xD):
            name = body[struct.unpack_from("<I", body, 8)[0] :].rstrip(b"\0").decode()
            found["needed"].add(name) if command == 0xC else found.update(name=name)
        elif command == 0x32:
            oldest = struct.unpack_from("<I", body, 12)[0]
            found["oldest"] = (oldest >> 16, oldest >> 8 & 255)
        elif command == 0x2:
            symbols, number, strings, _ = struct.unpack_from("<4I", body, 8)
            entries = (struct.unpack_from("<IBBHQ", data, symbols + 16 * k) for k in range(number))
            shown = [strings + name for name, type_, section, _, _ in entries if type_ & 0x1F == 0xF and section]
            found["exports"] = {data[k : data.index(b"\0", k)].decode() for k in shown}
        elif command == 0x1D:
            found["signed"] = _is_signed(data, struct.unpack_from("<I", body, 8)[0])
        at += size
    return found


def _is_signed(data, at):
    """Whether the ad-hoc signature, without which an Arm Mac loads nothing, has the hash of every page."""
    magic, _, count = struct.unpack_from(">III", data, at)
    assert magic == 0xFADE0CC0
    directory = next(
        at + offset
        for kind, offset in (struct.unpack_from(">II", data, at + 12 + 8 * k) for k in range(count))
        if kind == 0
    )
    hashes, _, _, slots, limit, length, kind, _, page = struct.unpack_from(">16xIIIIIBBBB", data, directory)
    assert (length, kind) == (32, 2)
    pages = [data[k : min(k + (1 << page), limit)] for k in range(0, limit, 1 << page)]
    stored = [data[directory + hashes + 32 * k :][:32] for k in range(slots)]
    return stored == [hashlib.sha256(part).digest() for part in pages]


def binaries(fmu):
    """The libraries in an FMU by folder."""
    with zipfile.ZipFile(fmu) as archive:
        paths = [name for name in archive.namelist() if name.startswith("binaries/")]
        return {path.split("/")[1]: archive.read(path) for path in paths}


def functions():
    """The functions FMI 2.0 co-simulation asks for, as FMPy's headers declare them."""
    text = (Path(fmpy.__file__).parent / "c-code" / "fmi2Functions.h").read_text()
    listed = set(re.findall(r"^\s*#define \w+\s+fmi2FullName\((\w+)\)", text, re.MULTILINE))
    modes = ("EventMode", "NewDiscrete", "ContinuousTime", "CompletedIntegrator", "SetTime", "ContinuousStates")
    exchange = (*modes, "GetDerivatives", "EventIndicators", "Nominals")
    return {name for name in listed if not any(word in name for word in exchange)}


@needs_native
@pytest.mark.skipif(toolchain.here() not in ("linux64", "aarch64-linux"), reason="reads ELF")
def test_the_library_of_this_machine_needs_the_c_library_alone_and_shows_fmi_alone():
    (library,) = {
        hashlib.sha256(x).digest(): x for x in binaries(build("ComfortCruise", kind="native")).values()
    }.values()
    found = elf(library)
    assert found["needed"] <= {"libc.so.6", "libm.so.6"}
    assert found["paths"] == []
    assert found["exports"] == functions()


@needs_native
@needs_zig
@pytest.mark.long
def test_one_fmu_for_every_platform(monkeypatch, zig_cache):
    """Formats, machines, what they need, how old a system they run on, and that they show FMI's functions alone."""
    monkeypatch.setenv("ZIG_GLOBAL_CACHE_DIR", str(zig_cache))
    fmu = build("ComfortCruise", kind="native", platforms=["all"])
    assert validate_fmu(str(fmu)) == []
    found = binaries(fmu)
    assert set(found) == {"linux64", "win64", "darwin64", "aarch64-linux"}
    for folder, machine in (("linux64", "x86_64"), ("aarch64-linux", "aarch64")):
        linux = elf(found[folder])
        assert linux["machine"] == machine
        assert linux["needed"] <= {"libc.so.6", "libm.so.6"}
        assert linux["exports"] == functions()
        versions = [tuple(map(int, v.removeprefix("GLIBC_").split("."))) for v in linux["versions"]]
        assert (2, 2, 5) <= max(versions) <= (2, 17)
    windows = pe(found["win64"])
    assert (windows["machine"], windows["name"]) == (0x8664, "ComfortCruise.dll")
    assert windows["exports"] == functions()
    assert all(name == "kernel32.dll" or name.startswith("api-ms-win-crt-") for name in windows["needed"])
    mac = mach_o(found["darwin64"])
    assert set(mac) == {"x86_64", "arm64"}
    for part in mac.values():
        assert part["name"] == "@rpath/ComfortCruise.dylib"
        assert part["needed"] == {"/usr/lib/libSystem.B.dylib"}
        assert part["oldest"] == (11, 0)
        assert part["exports"] - {"__mh_dylib_header", "___dso_handle"} == {f"_{name}" for name in functions()}
    assert mac["arm64"]["signed"] is True
    for library in found.values():
        for leak in (tempfile.gettempdir().encode(), str(Path.home()).encode(), b"ziglang"):
            assert leak not in library


@needs_zig
@pytest.mark.parametrize(
    "names",
    [
        pytest.param(["aarch64-linux"], marks=pytest.mark.long),
        pytest.param(list(PLATFORMS), marks=pytest.mark.campaign),  # Windows' C library alone takes a minute
    ],
    ids=len,
)
def test_another_cache_and_no_home_give_the_same_bytes(write_source, tmp_path, monkeypatch, zig_cache, names):
    monkeypatch.delenv("ZIG_GLOBAL_CACHE_DIR", raising=False)
    first, second = write_source(), write_source("elsewhere/b c")
    for name in names:
        compile_library(first, tmp_path / name / f"it{PLATFORMS[name].suffix}", name, only=False, cache=zig_cache)
    monkeypatch.setenv("HOME", "/nonexistent")
    for name in names:
        one, two = (tmp_path / folder / f"it{PLATFORMS[name].suffix}" for folder in (name, f"again/{name}"))
        compile_library(second, two, name, only=False, cache=tmp_path / "zig")
        assert one.read_bytes() == two.read_bytes(), name
    assert (tmp_path / "zig").is_dir()


# ---------------------------------------------------------------- whole builds


@pytest.fixture
def fresh_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("RAILCOSIM_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@needs_native
def test_a_native_build_is_reproducible(fresh_cache, sample, monkeypatch, tmp_path):
    for reference in ("PointMassTrain", sample("Learner")):
        first = build(reference, kind="native").read_bytes()
        monkeypatch.setenv("RAILCOSIM_CACHE", str(tmp_path / "another"))
        monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
        assert build(reference, kind="native").read_bytes() == first
        monkeypatch.setattr(tempfile, "tempdir", None)
        monkeypatch.setenv("RAILCOSIM_CACHE", str(fresh_cache))


@needs_native
@pytest.mark.parametrize("kind", ["native", "python"])
def test_a_cache_hit_makes_nothing(fresh_cache, monkeypatch, kind):
    path = build("ComfortCruise", kind=kind)
    for module, made in ((native_fmu, "contents"), (build_module.python_fmu, "contents"), (build_module, "write")):
        monkeypatch.setattr(module, made, lambda *_: pytest.fail("a cache hit made something"))
    assert build("ComfortCruise", kind=kind) == path


@needs_native
@pytest.mark.parametrize("failure", [KeyboardInterrupt(), OSError("disk full")])
def test_an_interrupted_native_build_leaves_nothing(fresh_cache, tmp_path, monkeypatch, failure):
    def run(*_, **__):
        raise failure

    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    with monkeypatch.context() as patch:
        patch.setattr(subprocess, "run", run)
        with pytest.raises(type(failure)):
            build("Gust", kind="native")
    assert [path for path in fresh_cache.rglob("*") if path.is_file()] == []
    assert list(scratch.iterdir()) == []
    assert zipfile.ZipFile(build("Gust", kind="native")).testzip() is None


@pytest.mark.long
@needs_native
def test_processes_building_natively_at_once_do_not_break_each_other(fresh_cache):
    code = (
        "import sys, time, zipfile; from railcosim.fmus.build import build\n"
        "time.sleep(max(0, float(sys.argv[1]) - time.time()))\n"
        "for name in sys.argv[2:]:\n"
        "    path = build(name, kind='native'); assert zipfile.ZipFile(path).testzip() is None; print(path)"
    )
    command = [sys.executable, "-c", code, str(time.time() + 1.5), "Gust", "PointMassTrain"]
    running = [subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) for _ in range(3)]
    told = [process.communicate(timeout=120) for process in running]
    assert [process.returncode for process in running] == [0, 0, 0], told
    assert told[0][0] == told[1][0] == told[2][0]
    files = sorted(path.name for path in fresh_cache.rglob("*") if path.is_file())
    assert files == ["Gust.fmu", "Gust.fmu.sha256", "PointMassTrain.fmu", "PointMassTrain.fmu.sha256"]


def test_a_native_fmu_without_casadi_says_what_to_install(fresh_cache, monkeypatch):
    def version(name):
        if name == "casadi":
            raise importlib_metadata.PackageNotFoundError(name)
        return whole(name)

    from railcosim.fmus import identity

    importlib_metadata = identity.importlib.metadata
    whole = importlib_metadata.version
    monkeypatch.setattr(importlib_metadata, "version", version)
    identity._packaging.cache_clear()
    with pytest.raises(ValueError, match=r"needs casadi, which is not installed: pip install 'railcosim\[native\]'"):
        build("Gust", kind="native")
    assert os.environ["RAILCOSIM_CACHE"] == str(fresh_cache)
    assert zipfile.is_zipfile(build("Gust", kind="python"))
