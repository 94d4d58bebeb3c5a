"""The house as the design has it: imports point down, go through what a room offers, and make no circles."""

import ast
from collections import defaultdict
from functools import cache
from pathlib import Path
from typing import NamedTuple

import networkx as nx

ROOT = Path(__file__).parents[1]
PACKAGES = ("components", "fmus", "orchestrator")
"""Each imports itself and those before it."""
ORDER = (
    ("",),  # orchestrator/__init__.py
    ("cli",),
    ("report",),
    ("driving", "study"),
    ("linearization", "comparison", "packing"),
    ("run",),
    ("validation",),
    ("scenario",),
    ("ssp",),
    ("master",),
    ("isolation",),
    ("wiring",),
    ("figures",),
    ("evaluation",),
    ("fmi",),
    ("digests", "leftovers", "system"),
    ("errors",),
    ("bars", "markup", "problems"),
    ("names", "times"),
    ("world",),
)
"""The rooms and root files of the orchestrator; each imports itself and what stands in lines below."""
RANKS = {room: rank for rank, rooms in enumerate(ORDER) for room in rooms}
EXECUTING = {"pickle", "marshal", "shelve", "dill", "cloudpickle", "joblib", "multiprocessing", "runpy"}
"""Modules whose files and messages can name code that is executed when they are read."""
MOST_FILES, MOST_LINES, MOST_TEST_LINES = 15, 400, 500


class Import(NamedTuple):
    """What a module takes from a target, a module or a package: a name in it, or the whole (``""``)."""

    place: str
    module: str
    target: str
    name: str


def code(folder, *suffixes):
    """Every file of code below a folder; what stands in ``resources`` is data, whatever it is."""
    files = sorted(path for suffix in suffixes for path in (ROOT / folder).rglob(f"*.{suffix}"))
    return [path for path in files if not {"dist", "resources"} & set(path.relative_to(ROOT).parts)]


MODULES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for package in PACKAGES
    for path in code(package, "py", "pyi")
}
FOLDERS = {name for name, path in MODULES.items() if path.stem == "__init__"}


@cache
def offered(package):
    """What the ``__all__`` of a package lists."""
    body = ast.parse(MODULES[package].read_text(encoding="utf-8")).body if package in FOLDERS else []
    listed = [x.value for x in body if isinstance(x, ast.Assign) and ast.unparse(x.targets[0]) == "__all__"]
    return {name for names in listed for name in ast.literal_eval(names)}


def taken(node, here):
    """Target and name of each part of an import statement in a package; without ``railcosim.``."""
    if isinstance(node, ast.Import):
        return [(alias.name.removeprefix("railcosim."), "") for alias in node.names]
    folders = here.split(".")
    above = folders[: len(folders) + 1 - node.level] if node.level else []
    base = ".".join([*above, node.module or ""]).removeprefix("railcosim").strip(".")
    parts = [(f"{base}.{alias.name}".strip("."), alias.name) for alias in node.names]
    return [(x, "") if x in MODULES and name not in offered(base) else (base, name) for x, name in parts]


@cache
def imports():
    """What modules of ours take from one another, in functions and for types alone too."""
    return [
        Import(f"{path.relative_to(ROOT)}:{node.lineno}", module, target, name)
        for module, path in MODULES.items()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for target, name in taken(node, module if module in FOLDERS else module.rpartition(".")[0])
        if target in MODULES
    ]


def room(module):
    """The folder of a module of the orchestrator, such as ``fmi.binding``; of a root file its name."""
    folder = module if module in FOLDERS else module.rpartition(".")[0]
    return (module if folder == "orchestrator" else folder).partition(".")[2]


def in_orchestrator():
    """Imports within the orchestrator from one room to another, with the two rooms."""
    inside = [x for x in imports() if {x.module.partition(".")[0], x.target.partition(".")[0]} == {"orchestrator"}]
    pairs = [(x, room(x.module), room(x.target)) for x in inside]
    return [(x, own, other) for x, own, other in pairs if own != other]


def test_packages_import_those_below_them_alone():
    rank = PACKAGES.index
    wrong = [x for x in imports() if rank(x.target.partition(".")[0]) > rank(x.module.partition(".")[0])]
    assert not wrong, "\n".join(f"{x.place}: {x.module} must not import {x.target}" for x in wrong)


def test_rooms_import_those_below_them_alone():
    tops = [(each.place, own.partition(".")[0], other.partition(".")[0]) for each, own, other in in_orchestrator()]
    unknown = {top for _, *pair in tops for top in pair} - RANKS.keys()
    assert not unknown, f"give {', '.join(sorted(unknown))} a place in ORDER, and in the design"
    wrong = [f"{place}: {a} must not import {b}" for place, a, b in tops if a != b and RANKS[a] >= RANKS[b]]
    assert not wrong, "\n".join(wrong)


def test_rooms_are_entered_by_the_door():
    """A room and its sub-room know each other's modules; any other takes what `__all__` lists."""
    wrong = []
    for each, own, other in in_orchestrator():
        if own.startswith(f"{other}.") or other.startswith(f"{own}."):
            continue
        if each.target in FOLDERS and each.name not in offered(each.target):
            wrong.append(f"{each.place}: {other} does not offer {each.name!r} in its __all__")
        elif each.target not in FOLDERS and each.target.count(".") > 1:  # a file at the root has no door
            wrong.append(f"{each.place}: import from {other}, not from {each.target}")
    assert not wrong, "\n".join(wrong)


def test_doors_offer_what_they_import():
    for package in (name for name in FOLDERS if MODULES[name].suffix == ".pyi"):
        body = ast.parse(MODULES[package].read_text(encoding="utf-8")).body
        names = [x.asname or x.name for node in body if isinstance(node, ast.ImportFrom) for x in node.names]
        assert sorted(names) == sorted(offered(package)), f"{package}: __all__ and the imports differ"
        assert MODULES[package].with_suffix(".py").read_text(encoding="utf-8").endswith("\nhang_door(__name__)\n")


def test_nothing_is_read_that_can_execute_something_by_being_read():
    wrong = []
    for package in PACKAGES:
        for path in code(package, "py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                names = [x.name for x in node.names] if isinstance(node, ast.Import) else []
                names += [node.module or ""] if isinstance(node, ast.ImportFrom) and not node.level else []
                found = {name.partition(".")[0] for name in names} & EXECUTING
                wrong += [f"{path.relative_to(ROOT)}:{node.lineno}: {name}" for name in found]
    assert not wrong, "\n".join(wrong)


def test_no_circles():
    graph = nx.DiGraph([(x.module, x.target) for x in imports() if x.module != x.target])
    circles = [sorted(found) for found in nx.strongly_connected_components(graph) if len(found) > 1]
    assert not circles, "\n".join("these import each other: " + ", ".join(circle) for circle in circles)


def test_files_are_short_and_folders_small():
    wrong = []
    folders = defaultdict(int)
    for folder, most in [*((name, MOST_LINES) for name in (*PACKAGES, "benchmarks")), ("tests", MOST_TEST_LINES)]:
        for path in code(folder, "py", "c", "h"):
            lines = len(path.read_text(encoding="utf-8").splitlines())
            wrong += [f"{path.relative_to(ROOT)} has {lines} lines, over {most}"] if lines > most else []
            folders[path.parent.relative_to(ROOT)] += path.parts[len(ROOT.parts)] in PACKAGES
    wrong += [f"{x} has {count} files, over {MOST_FILES}" for x, count in folders.items() if count > MOST_FILES]
    assert not wrong, "\n".join(wrong)


WORLD = {
    *("time", "subprocess", "socket", "tempfile", "shutil", "filelock", "multiprocessing", "asyncio", "select"),
    *("mmap", "datetime", "fcntl"),
}
"""Modules whose functions `orchestrator/world.py` gives to all others; types and constants of theirs may be named."""
OS = {
    *("open", "read", "write", "close", "pipe", "replace", "rename", "remove", "unlink", "mkdir", "makedirs", "rmdir"),
    *("fsync", "truncate", "ftruncate", "listdir", "scandir", "walk", "stat", "link", "symlink", "chmod", "utime"),
    *("fork", "kill", "killpg", "waitpid", "wait", "system", "popen", "_exit", "sendfile", "times", "posix_spawn"),
}
FILES = {
    *("open", "read_text", "read_bytes", "write_text", "write_bytes", "mkdir", "unlink", "rmdir", "chmod", "touch"),
    *("stat", "iterdir", "glob", "rglob", "rename", "symlink_to", "hardlink_to", "sendall", "recv", "recv_into"),
}
EXEMPT = {
    "cli/streams.py": {"select.select"},  # the standard streams, which somebody else has opened
    "fmi/archive.py": {"tempfile.gettempdir"},  # asks, and changes nothing
    "fmi/members.py": {"archive.open"},  # a member of an archive that is open
    "ssp/package.py": {"archive.open"},  # the same
    "run/ending/interruption.py": {"socket.socketpair", "far.recv"},  # from the process to itself
    "run/directory.py": {"socket.gethostname"},  # asks, and changes nothing
    "isolation/guard.py": {
        "select.select",
        "fcntl.fcntl",
    },  # a process of its own, which waits for descriptors of its own
    "isolation/launch.py": {"socket.socket"},  # one that leads nowhere
    "isolation/host.py": {"socket.socket"},  # an open one that was inherited
}


def goes_past_the_seam(call, names):
    """Whether a call is one of those that stand in `orchestrator/world.py`, made past it."""
    text = ast.unparse(call.func)
    owner, _, name = text.rpartition(".")
    module = names.get(owner or name, "")
    if module == "os":
        return name in OS
    if module in WORLD:
        return True
    is_path_replace = name == "replace" and len(call.args) == 1 and owner and not call.keywords
    return text == "open" or (owner != "world" and (name in FILES or is_path_replace))


def test_the_world_is_met_through_the_seam():
    wrong = []
    for path in code("orchestrator", "py"):
        place = path.relative_to(ROOT / "orchestrator").as_posix()
        nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
        names = {x.asname or x.name: x.name for node in nodes if isinstance(node, ast.Import) for x in node.names}
        for node in nodes:
            if isinstance(node, ast.ImportFrom) and not node.level and node.module in WORLD | {"os"}:
                names |= {x.asname or x.name: node.module for x in node.names}
            if isinstance(node, ast.ImportFrom) and node.level and (node.module or "").endswith("world"):
                wrong.append(f"{place}:{node.lineno}: import world itself: a fault in it would not be met")
        wrong += [
            f"{place}:{node.lineno}: {ast.unparse(node.func)} goes past orchestrator/world.py"
            for node in nodes
            if isinstance(node, ast.Call) and place != "world.py" and goes_past_the_seam(node, names)
            if ast.unparse(node.func) not in EXEMPT.get(place, ())
        ]
    assert not wrong, "\n".join(wrong)
