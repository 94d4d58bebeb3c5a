"""Live models without a compiler for them: what is compiled for a page is made up, all else is as it is."""

import zipfile

import pytest
from railcosim.fmus.build import build
from railcosim.orchestrator.report.live import making


@pytest.fixture
def compiled(monkeypatch, tmp_path):
    """What FMUs were asked for; each has a module that holds its file's name."""
    asked = []

    def make(reference, arguments, *, kind, platforms):
        asked.append((reference, arguments, kind, platforms))
        native = build(reference, arguments, kind=kind)
        target = tmp_path / f"wasm{len(asked)}" / native.name
        target.parent.mkdir()
        target.write_bytes(native.read_bytes())
        with zipfile.ZipFile(target, "a") as archive:
            archive.writestr(f"binaries/wasm32-wasi/{native.stem}.wasm", f"module of {native.stem}")
        return target

    monkeypatch.setattr(making, "build", make)
    return asked
