"""A component as a Python FMU: our equations and slave behind the compiled FMI wrapper that pythonfmu ships.

pythonfmu's own packager writes a description that does not validate, embeds by module name and is not reproducible; of
pythonfmu this takes the wrapper library alone (linux64 and win64 are all it has).
"""

from __future__ import annotations

from pathlib import Path

from ..components.component import Component
from .description import write
from .documentation import files as documentation
from .embed import embedded_files
from .identity import digest_of, given_values


def contents(component: Component, digest: str) -> dict[str, bytes]:
    """All files of the FMU by path.

    Args:
        component: built; its values are the start values.
        digest: hash of what the FMU is made from; it becomes the GUID.

    Raises:
        ComponentError: the component cannot be embedded.
    """
    import pythonfmu

    wrappers = Path(pythonfmu.__file__).parent / "resources" / "binaries"
    cls = type(component)
    files, module = embedded_files(cls)
    arguments = given_values(component)
    code = {**{name: text.encode() for name, text in files.items()}, "/": f"{module} {cls.__qualname__}".encode()}
    package = f"railcosim_{digest_of(code)[:16]}"
    # The slave module's name must tell apart FMUs that share their equations but not their build arguments.
    slave = f"{package}_{digest_of({'arguments': arguments.encode()})[:8]}_slave"
    archive = {f"resources/{package}/{name}": text.encode() for name, text in files.items()}
    archive[f"resources/{slave}.py"] = _slave_module(package, module, cls.__qualname__, arguments).encode()
    archive["resources/slavemodule.txt"] = slave.encode()
    for library in sorted(wrappers.glob("*/*pythonfmu-export.*")):
        archive[f"binaries/{library.parent.name}/{cls.__name__}{library.suffix}"] = library.read_bytes()
    archive["modelDescription.xml"] = write(component, "python", digest)
    return archive | documentation(component, "python")


def _slave_module(package: str, module: str, name: str, arguments: str) -> str:
    # The wrapper runs this text once at import and again at every instantiation, and each time gives back a reference
    # to the module's namespace that it never took (pythonfmu 0.7). Without the line that takes one, the namespace is
    # freed under the living module: the second instance fails and the process crashes.
    return (
        "import ctypes\n\n"
        f"from {package}.{module} import {name}\n"
        f"from {package}.fmus.pythonfmu_slave import Fmi2Slave\n\n"
        "ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))\n\n\n"
        f"class Slave(Fmi2Slave):\n"
        f"    component = {name}\n"
        f"    arguments = {arguments!r}\n"
    )
