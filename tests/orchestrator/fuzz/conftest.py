"""What the fuzzing shares: examples drawn few or many, and a watch over what an input makes the process do."""

import contextlib
import os
import sys

import pytest


@pytest.fixture(
    params=["quick", pytest.param("long", marks=pytest.mark.long), pytest.param("deep", marks=pytest.mark.campaign)]
)
def explore(request):
    """Try a rule on examples out of strategies: on the same few each time, in the long tier on more; in a campaign on
    many, others each time."""
    from hypothesis import HealthCheck, given, settings
    from hypothesis import strategies as st

    def examine(rule, *strategies, quick, deep):
        @settings(
            max_examples={"quick": quick, "long": deep // 10, "deep": deep}[request.param],
            derandomize=request.param != "deep",
            database=None,
            deadline=60_000,  # ms: the largest scenario takes 0.6 s, and what may not take long takes for ever
            suppress_health_check=list(HealthCheck),
        )
        @given(st.tuples(*strategies))
        def examples(example):
            rule(*example)

        examples()

    return examine


_REACHING_OUT = (
    *("os.system", "os.exec", "os.fork", "os.spawn", "os.posix_spawn", "subprocess.Popen", "pty.spawn"),
    *("os.symlink", "os.link", "os.rename", "socket.connect", "socket.bind", "socket.getaddrinfo", "ctypes.dlopen"),
)


@pytest.fixture(scope="session")
def watched(tmp_path_factory):
    """Watch Python while it runs something: gives a context that fails if code of the input's is run, a process is
    started, the network asked, or a file written outside a folder."""
    seen, base = [], str(tmp_path_factory.getbasetemp())
    watching = False

    def hear(event, arguments):
        if watching and event in ("exec", "open", "os.mkdir", *_REACHING_OUT):
            seen.append((event, arguments))

    def is_harmless(event, arguments, folder):
        if event == "exec":  # what modules are made of when they are imported, but nothing out of a text or our files
            name = arguments[0].co_filename
            made = name.startswith("<frozen") or "networkx.utils" in name  # which writes functions of its own
            return made or (os.path.isabs(name) and not name.startswith(base))
        if event == "open" and not arguments[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT):
            return True
        if event in ("open", "os.mkdir") and isinstance(arguments[0], str | os.PathLike):
            place = os.path.realpath(arguments[0])
            return place == os.devnull or "__pycache__" in place or place.startswith(f"{folder}{os.sep}")
        return event == "open"  # a descriptor that is open already

    sys.addaudithook(hear)  # there is no way to take it back

    @contextlib.contextmanager
    def watch(folder):
        nonlocal watching
        seen.clear()
        watching = True
        try:
            yield
        finally:
            watching = False
        deeds = [
            (event, *map(str, arguments)) for event, arguments in seen if not is_harmless(event, arguments, folder)
        ]
        assert not deeds

    return watch


@pytest.fixture
def confined(monkeypatch, tmp_path):
    """The folder that temporary files come into, below ``tmp_path``."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    return folder
