"""A whole scenario as one FMU, for a tool that is to run it as a block.

The archive is made with fmu-manipulation-toolbox, whose container runtime keeps every value between steps and therefore
gives what our own master gives, with ``jacobi`` and with ``gauss-seidel`` (FMPy's container reads outputs after it has
set inputs, and settles initial values in a single sweep). Its description we write ourselves: the toolbox's lists a
connected output twice, knows no units, and differs at every build.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import logging
import re
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from lxml import etree

from ...fmus.build import build, write_archive
from .. import world
from ..errors import RailcosimError, ScenarioError
from ..fmi import Model, Workspace, is_fmu_name
from ..master import ALGORITHMS, Explicit
from ..problems import Problem
from ..run import Checked, check
from ..system import System
from ..wiring import Link, described
from .description import describe, page, start_text
from .exposure import Exposed, select

TOOLBOX = "fmu_manipulation_toolbox"
_LIBRARY = "packed_scenario"
"""What the library is called until the archive is complete: no other path inside may hold that word."""
RUNTIMES = ("linux64", "win64", "darwin64")
"""Platforms for which the toolbox has a container runtime."""


@dataclass(frozen=True)
class Packed:
    """What was written.

    Attributes:
        path: the FMU. exposed: its variables. platforms: folders of its binaries. notes: what a user should know.
    """

    path: Path
    exposed: tuple[Exposed, ...]
    platforms: tuple[str, ...]
    notes: tuple[str, ...]


def pack(
    system: System,
    path: Path,
    *,
    expose: Sequence[str] = (),
    platforms: Sequence[str] = (),
    trusted: bool = True,
) -> Packed:
    """Write one FMU that holds a whole scenario: its native FMUs, connections and start values.

    The same values come out as from `run` with the system's algorithm and step. The step is fixed inside; the tool
    around it takes steps that are whole multiples of it.

    Args:
        system: what to pack.
        path: the file to write; its name becomes the model's.
        expose: what to show, such as ``"train[:].speed"``, ``"cruise[2]"`` (all outputs of one instance); outputs and
            local variables become outputs, unconnected inputs inputs, parameters parameters. By default every output
            of the instances named ``train``, or of all instances where there is none.
        platforms: for which to build the components, some of ``linux64``, ``win64`` and ``darwin64`` or ``all``; this
            machine's by default.
        trusted: whether Python code that the scenario names is imported wherever it stands.

    Raises:
        ScenarioError: the system cannot run, or has what a container cannot do; all of it is listed.
        RailcosimError: fmu-manipulation-toolbox is missing or refuses.
    """
    if not is_fmu_name(path.name):
        raise ScenarioError(Problem(str(path), "an FMU is a file that ends in .fmu"))
    platforms = _chosen(platforms)
    with Workspace() as workspace:
        checked = check(system, workspace, "native", trusted=trusted)
        exposed, problems = select(expose, system, checked)
        problems += _refused(system, checked, platforms)
        if problems:
            raise ScenarioError(list(dict.fromkeys(problems)))
        with world.TemporaryDirectory(dir=workspace.folder) as folder:
            given = Path(folder) / "given"
            files = {name: _file(system, name, model, platforms, given) for name, model in checked.models.items()}
            archive, references = _container(system, checked, exposed, files, Path(folder))
    archive["documentation/index.html"] = page(system, checked, exposed).encode()
    archive["documentation/licenses/fmu_manipulation_toolbox.txt"] = _license()
    name, digest = _identifier(path), _digest(archive, exposed, system)
    archive = {entry.replace(_LIBRARY, name): content for entry, content in archive.items()}
    archive["modelDescription.xml"] = describe(
        system, checked, dict(zip(exposed, references, strict=True)), name, digest
    )
    write_archive(archive, path)
    found = sorted({name.split("/")[1] for name in archive if name.startswith("binaries/")})
    return Packed(path, exposed, tuple(found), tuple(_notes(system, checked)))


def _chosen(platforms: Sequence[str]) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(name.strip() for name in platforms if name.strip()))
    return RUNTIMES if names == ("all",) else names


# -------------------------------------------------------------------- what a container cannot do


def _refused(system: System, checked: Checked, platforms: Sequence[str]) -> list[Problem]:
    problems = [problem for link in checked.wiring.links for problem in _refused_link(link, checked)]
    lost = {
        f"algorithm = {system.stepping.algorithm}": not issubclass(ALGORITHMS[system.stepping.algorithm], Explicit),
        f"extrapolation = {system.stepping.extrapolation}": bool(system.stepping.extrapolation),
        "algebraic_loops = solve": system.stepping.algebraic_loops == "solve",
        "refresh": system.stepping.refresh,
        "[[events]]": bool(system.events),
        **{
            f"{name}: a step of its own": x.step not in (None, system.stepping.step)
            for name, x in system.instances.items()
        },
    }
    why = "cannot be packed: a container has one step, and holds values"
    problems += [Problem("", f"{what} {why}") for what in lost if lost[what]]
    for name, model in checked.models.items():
        if model.interface.own_kind == "python" or "pythonfmu" in model.interface.generator.lower():
            python = f"{model.interface.model} is a Python FMU, which a host without Python cannot load"
            problems.append(Problem(name, python, "only native FMUs are packed"))
        if model.interface.version != "2.0":
            other = f"{model.interface.model} is FMI {model.interface.version}"
            problems.append(Problem(name, other, "only FMI 2.0 is packed"))
        binaries = model.folder / "binaries"
        if is_fmu_name(system.instances[name].model):  # the others are built for what is asked
            problems += [
                Problem(name, f"{system.instances[name].model} has no binary for {platform}")
                for platform in platforms
                if platform in RUNTIMES and not (binaries / platform).is_dir()
            ]
        if model.interface.single_instance:
            problems.append(Problem(name, f"{model.interface.model} can be instantiated only once per process"))
        for variable, value in checked.wiring.starts[name].items():
            if isinstance(value, str) and (not value or any(c.isspace() for c in value)):
                text = "a text with blanks, or none, cannot be a start value in a container"
                problems.append(Problem(f"{name}.{variable}", text))
    problems += [
        Problem("", f"there is no container runtime for {platform}", f"there is one for {', '.join(RUNTIMES)}")
        for platform in platforms
        if platform not in RUNTIMES
    ]
    return problems


def _refused_link(link: Link, checked: Checked) -> Iterator[Problem]:
    connection = link.connection
    where, ends = described(connection), (link.target, link.source)
    types = [checked.models[name].interface.variables[variable].type for name, variable in (link.source, link.target)]
    if link.delay:
        delay = f"delay = {link.delay} cannot be packed: a container hands values on without delay"
        yield Problem(where, delay, names=ends)
    if len(set(types)) > 1 or link.threshold is not None:
        yield Problem(where, f"a {types[0]} that feeds a {types[1]} cannot be packed", names=ends)
    if link.mapping is not None:
        yield Problem(where, "a map cannot be packed", names=ends)
    if (link.scale, link.offset) == (1.0, 0.0):
        return
    what = f"scale {link.scale:g} and offset {link.offset:g}"
    if connection.scale in (None, 1.0) and not connection.offset:
        what = f"the conversion of units (times {link.scale:g}, plus {link.offset:g})"
    yield Problem(where, f"{what} cannot be packed", names=ends)


# -------------------------------------------------------------------- the container


def _file(system: System, name: str, model: Model, platforms: Sequence[str], given: Path) -> Path:
    """The FMU of an instance: of a component, with a binary for every platform asked for.

    One that was given is archived anew: the toolbox does not put right what was put right when it was unpacked.
    """
    instance = system.instances[name]
    if not is_fmu_name(instance.model):
        assert model.path is not None  # only plain components have none
        if not platforms:
            return model.path
        return build(instance.model, instance.build, kind="native", platforms=tuple(platforms))
    anew = given / model.digest / f"{Path(instance.model).stem}.fmu"
    if not anew.exists():
        found = (path for path in world.rglob(model.folder, "*") if path.is_file())
        write_archive({path.relative_to(model.folder).as_posix(): world.read_bytes(path) for path in found}, anew)
    return anew


def _container(
    system: System, checked: Checked, exposed: Sequence[Exposed], files: Mapping[str, Path], folder: Path
) -> tuple[dict[str, bytes], list[int]]:
    """The toolbox's archive without its description, and the value reference of everything exposed.

    Raises:
        RailcosimError: the toolbox is not there, or refuses.
    """
    try:
        from fmu_manipulation_toolbox.container import FMUContainer  # noqa: PLC0415 (an extra)
        from fmu_manipulation_toolbox.container.errors import FMUContainerError  # noqa: PLC0415
    except ImportError as error:
        raise RailcosimError(
            "packing needs fmu-manipulation-toolbox: pip install fmu-manipulation-toolbox (extra 'railcosim[pack]')"
        ) from error
    sequential = ALGORITHMS[system.stepping.algorithm].in_order
    try:
        with _silent():
            container = FMUContainer(_LIBRARY, folder)
            for instance in checked.order.sequence if sequential else checked.models:
                container.get_fmu(str(files[instance]), instance)
            for instance, starts in checked.wiring.starts.items():
                variables = checked.models[instance].interface.variables
                for variable, value in starts.items():
                    container.add_start_value(instance, variable, start_text(variables[variable].type, value))
            for link in checked.wiring.links:
                container.add_link(*link.source, *link.target)
            for k, shown in enumerate(exposed):
                if shown.causality == "output":
                    container.add_output(shown.instance, shown.variable.name, _alias(k))
                else:
                    container.add_input(_alias(k), shown.instance, shown.variable.name)
            container.make_fmu(f"{_LIBRARY}.fmu", step_size=system.stepping.step, sequential=sequential)
    except FMUContainerError as error:
        raise RailcosimError(
            f"fmu-manipulation-toolbox cannot pack {system.provenance.name}: {error.reason}"
        ) from error
    with world.open(folder / f"{_LIBRARY}.fmu", "rb") as stream, zipfile.ZipFile(stream) as made:
        archive = {entry: made.read(entry) for entry in made.namelist() if not entry.endswith("/")}
    return archive, _references(archive.pop("modelDescription.xml"), len(exposed))


def _alias(k: int) -> str:
    """A name of our own while the toolbox works: it names connected outputs itself, as we would."""
    return f"exposed.{k}"


def _references(description: bytes, count: int) -> list[int]:
    root = etree.fromstring(description)
    references = {v.get("name"): int(v.get("valueReference", "")) for v in root.iter("ScalarVariable")}
    return [references[_alias(k)] for k in range(count)]


@contextmanager
def _silent() -> Iterator[None]:
    """The toolbox reports every unconnected input as an error, and every loop of connections."""
    logger = logging.getLogger(TOOLBOX)
    before, logger.disabled = logger.disabled, True
    try:
        yield
    finally:
        logger.disabled = before


def _license() -> bytes:
    for file in importlib.metadata.files(TOOLBOX) or ():
        if file.name.upper().startswith("LICENSE") and ".dist-info" in str(file):
            return file.read_binary()
    return b"BSD-2-Clause, see https://github.com/grouperenault/fmu_manipulation_toolbox\n"


def _identifier(path: Path) -> str:
    """The model's name: the file's, as C and FMI allow it."""
    name = re.sub(r"\W", "_", path.stem, flags=re.ASCII)
    return f"_{name}" if not name or name[0].isdigit() else name


def _digest(archive: Mapping[str, bytes], exposed: Sequence[Exposed], system: System) -> str:
    hashed = hashlib.sha256(
        f"{system.provenance.name} {system.provenance.preset} {[shown.name for shown in exposed]}".encode()
    )
    for name in sorted(archive):
        hashed.update(f"\n{name} {hashlib.sha256(archive[name]).hexdigest()}".encode())
    return hashed.hexdigest()


def _notes(system: System, checked: Checked) -> Iterator[str]:
    yield from checked.notes
    if not ALGORITHMS[system.stepping.algorithm].is_sweeping:
        late = {f"{link.source[0]}.{link.source[1]}" for link in checked.wiring.links if link.direct}
        if late:
            names = ", ".join(sorted(late))
            yield f"{system.stepping.algorithm}: {names} pass directly through their models and act one step late"
