"""How much of the code the tests reach: lines and branches, of Python per room and of the C per file.

``python tests/measure_coverage.py`` runs the quick tests (Python), and those of the step loop and of the C runtime with
both built for gcov (C), prints the tables, and fails where a file has more unreached branches than `uncovered.txt`
grants it. ``--write`` writes that file anew. Its numbers may only fall: a branch that no test can reach is marked where
it stands, with the reason (``# pragma: no cover: it is for Windows``). C is granted nothing: what no test reaches is
marked with ``/* uncovered: the reason */``, which stands for its line, or for the block that the line opens.

What the parts ``python`` and ``c`` find is kept in ``build/coverage`` and told by the part ``report``; without a part
all three are done, from nothing. ``--select`` names the tests for Python: several calls of ``python`` add up, and so
does any other run of tests with the environment that the part ``environment`` prints: continuous integration has its
one run of the quick tier measured by it. Which tests do not count, because they aim at no branch, stands in
``conftest.py``.
"""

import argparse
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[1]
DATA = ROOT / "build" / "coverage"
GRANTED = ROOT / "tests" / "uncovered.txt"
KERNEL = sorted((ROOT / "orchestrator" / "master" / "native").rglob("*.c"))
RUNTIME = sorted((ROOT / "fmus" / "runtime").rglob("*.c"))
LOOP_TESTS = [
    *(
        f"tests/orchestrator/master/test_compiled{name}.py"
        for name in ("", "_blocks", "_coupling", "_fmi1", "_fmi3", "_texts")
    ),
    *("tests/orchestrator/master/test_kernel.py", "tests/orchestrator/master/test_threads.py"),
    *("tests/orchestrator/master/test_varying.py", "tests/orchestrator/master/algebraic"),
    *("tests/orchestrator/master/test_event_loops.py", "tests/orchestrator/fmi/test_foreign.py"),
]
RUNTIME_TESTS = ["tests/fmus/runtime"]
SCARCE = ROOT / "tests" / "scarce.h"
_CHOSEN = "not campaign and (not long or sample)"
"""Of tests of which a sample is in the quick tier, all cases."""
MARK = re.compile(r"/\* uncovered: \w.*\*/")
COMPILER = """#!/bin/sh
exec gcc "$@" -O0 -DALWAYS_INLINE="static inline" --coverage -fprofile-update=atomic \\
    -dumpdir "$(mktemp -d "$COVERAGE_NOTES/XXXXXXXX")/"
"""


@dataclass
class Reached:
    """Of a file: how many lines and branches it has, and how many of them were reached; of C, where not."""

    lines: int = 0
    lines_reached: int = 0
    branches: int = 0
    branches_reached: int = 0
    where: list[int] = field(default_factory=list)

    def __iadd__(self, other: "Reached") -> "Reached":
        self.lines += other.lines
        self.lines_reached += other.lines_reached
        self.branches += other.branches
        self.branches_reached += other.branches_reached
        return self

    @property
    def missing(self) -> int:
        return self.branches - self.branches_reached


def run_tests(arguments: Iterable[str], **environment: str) -> None:
    """A failure here is none of the code's: measured code is slower, and the tests themselves have run before."""
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments]
    print("+", *command[1:], flush=True)
    code = subprocess.run(command, cwd=ROOT, env=os.environ | environment, check=False).returncode
    if code > 1:
        sys.exit(f"the tests could not be run: pytest ends with {code}")


# -------------------------------------------------------------------- Python


def measured() -> dict[str, str]:
    """The environment in which every Python that has coverage installed writes down what it reaches."""
    return {"COVERAGE_PROCESS_START": str(ROOT / "pyproject.toml"), "COVERAGE_FILE": str(DATA / "python")}


def measure_python(tests: list[str]) -> None:
    """Run tests, and what they start in other processes, under coverage."""
    run_tests([*tests, "-n", "2"], **measured())


def combine_python() -> None:
    """Add up what the processes of all measured runs so far have written down."""
    coverage = [sys.executable, "-m", "coverage"]
    environment = os.environ | {"COVERAGE_FILE": str(DATA / "python")}
    if any(DATA.glob("python.*")):
        subprocess.run([*coverage, "combine", "--append", "--quiet"], cwd=ROOT, env=environment, check=True)
    target = str(DATA / "covered.json")
    # Files that a test adds to a copy of the checkout are not there.
    subprocess.run(
        [*coverage, "json", "--quiet", "--ignore-errors", "-o", target], cwd=ROOT, env=environment, check=True
    )


def read_python() -> dict[str, Reached]:
    """What was reached, by file."""
    found = {}
    for name, entry in json.loads((DATA / "covered.json").read_text())["files"].items():
        of = entry["summary"]
        counts = of["num_statements"], of["covered_lines"], of["num_branches"], of["covered_branches"]
        found[Path(name).as_posix()] = Reached(*counts)
    return found


# -------------------------------------------------------------------- C


def measure_c() -> None:
    """Run the tests of the step loop and of the C runtime with both compiled for gcov."""
    notes = DATA / "c"
    shutil.rmtree(notes, ignore_errors=True)
    (notes / "kernel").mkdir(parents=True)
    library = notes / "kernel" / "kernel.so"
    command = [
        "gcc",
        "-shared",
        "-fPIC",
        "-O0",
        "-ffp-contract=off",
        "--coverage",
        "-fprofile-update=atomic",
        "-pthread",
        *("-include", str(SCARCE)),
    ]
    command += [f"-I{sysconfig.get_paths()['include']}", "-dumpdir", f"{notes / 'kernel'}/", *map(str, KERNEL)]
    subprocess.run([*command, "-o", str(library)], check=True)
    plugin = str(ROOT / "tests" / "orchestrator" / "master")
    seen = {"KERNEL": str(library), "PYTHONPATH": plugin, "COVERAGE_NOTES": str(notes)}
    run_tests(["-p", "own_kernel", "-n", "2", "-m", _CHOSEN, *LOOP_TESTS], **seen)
    compiler = notes / "cc"
    compiler.write_text(COMPILER)
    compiler.chmod(0o755)
    run_tests(["-n", "2", "-m", _CHOSEN, *RUNTIME_TESTS], CC=str(compiler), COVERAGE_NOTES=str(notes))


@dataclass
class Lines:
    """Of a C file: how often each line was run, and each branch of it, in every build of it added up."""

    counts: dict[int, int] = field(default_factory=lambda: defaultdict(int))
    branches: dict[int, dict[int, list[int]]] = field(default_factory=lambda: defaultdict(dict))

    def add(self, line: dict) -> None:
        number = line["line_number"]
        self.counts[number] += line["count"]
        counts = [branch["count"] for branch in line["branches"]]
        if counts:  # what is constant in a model leaves no branch in its build: builds are told apart by their number
            before = self.branches[number].get(len(counts), [0] * len(counts))
            self.branches[number][len(counts)] = [a + b for a, b in zip(before, counts, strict=True)]

    def reached(self, marked: set[int]) -> Reached:
        """What was reached of the lines that are not marked."""
        found = Reached()
        for number in sorted(self.counts.keys() - marked):
            builds = self.branches[number].values() or [[]]
            best = max(builds, key=lambda counts: (sum(c > 0 for c in counts) / (len(counts) or 1), len(counts)))
            found += Reached(1, self.counts[number] > 0, len(best), sum(count > 0 for count in best))
            if not (self.counts[number] and all(best)):
                found.where.append(number)
        return found


def marked_lines(text: str) -> set[int]:
    """The lines of a C file that are marked as not to be reached: each, or all of the block that it opens."""
    found: set[int] = set()
    depth = 0
    for number, line in enumerate(text.splitlines(), 1):
        code = MARK.sub("", line)
        if depth or code != line:
            found.add(number)
            depth += code.count("{") - code.count("}")
    return found


def read_c() -> dict[str, Reached]:
    """What was reached, by file."""
    # The kernel is compiled where it stands; of the runtime a model has a copy, in one folder.
    names = {str(path): path for path in KERNEL} | {path.name: path for path in RUNTIME}
    found: dict[Path, Lines] = defaultdict(Lines)
    for data in sorted((DATA / "c").rglob("*.gcda")):
        command = ["gcov", "--json-format", "--branch-probabilities", "--stdout", str(data)]
        for text in subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines():
            for file in json.loads(text)["files"]:
                path = names.get(file["file"]) or names.get(Path(file["file"]).name)
                for line in file["lines"] if path else ():
                    found[path].add(line)
    marked = {path: marked_lines(path.read_text()) for path in found}
    return {path.relative_to(ROOT).as_posix(): found[path].reached(marked[path]) for path in sorted(found)}


# -------------------------------------------------------------------- what is told


def table(title: str, rows: dict[str, Reached]) -> None:
    total = Reached()
    for row in rows.values():
        total += row
    print(f"\n{title:44} {'lines':>7} {'reached':>8} {'branches':>9} {'reached':>8}")
    for name, row in [*rows.items(), ("all", total)]:
        lines, branches = (f"{100 * a / b if b else 100:7.1f}%" for a, b in (
            (row.lines_reached, row.lines), (row.branches_reached, row.branches)))  # fmt: skip
        print(f"{name:44} {row.lines:7} {lines} {row.branches:9} {branches}")


def room(name: str) -> str:
    """The folder of a file, no deeper than the rooms are: ``orchestrator/fmi``."""
    parts = Path(name).parent.parts
    return "/".join(parts[:2])


def granted() -> dict[str, tuple[int, str]]:
    """How many unreached branches each file may have, and why."""
    lines = GRANTED.read_text().splitlines() if GRANTED.exists() else []
    parts = (line.split(maxsplit=2) for line in lines if line and line[0] != "#")
    return {name: (int(count), " ".join(reason)) for name, count, *reason in parts}


def report(write: bool) -> int:
    """Print the tables; how many files have more unreached branches than they are granted."""
    combine_python()
    python, c = read_python(), read_c()
    rooms: dict[str, Reached] = defaultdict(Reached)
    for name, row in sorted(python.items()):
        rooms[room(name)] += row
    table("Python", rooms)
    table("C", c)
    missing = {name: row.missing for name, row in python.items() if row.missing}
    if write:
        head = (
            "# Branches that no test reaches, by file, and why: see measure_coverage.py. The numbers may only fall.\n"
        )
        reasons = {name: reason for name, (_, reason) in granted().items()}
        lines = (f"{name} {count} {reasons.get(name, '')}".rstrip() for name, count in sorted(missing.items()))
        GRANTED.write_text(head + "\n".join(lines) + "\n")
    allowed = {name: count for name, (count, _) in granted().items()}
    worse = {name: count for name, count in missing.items() if count > allowed.get(name, 0)}
    better = sum(count > missing.get(name, 0) for name, count in allowed.items())
    print(f"\n{sum(missing.values())} branches are reached by no test; {sum(allowed.values())} are granted", end="")
    print(f"; {better} files have fewer than they are granted: --write" if better else "")
    for name, count in sorted(worse.items()):
        print(f"{name}: {count} branches are reached by no test, {allowed.get(name, 0)} are granted")
    unmarked = {name: row.where for name, row in c.items() if row.where}
    for name, where in unmarked.items():
        print(
            f"{name}: no test reaches all of lines {', '.join(map(str, where))}: reach them, or mark them with why not"
        )
    return len(worse) + len(unmarked)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "parts", nargs="*", choices=["environment", "python", "c", "report", []], help="all but the first"
    )
    parser.add_argument("--select", nargs="+", default=["tests"], help="the tests for Python")
    parser.add_argument("--write", action="store_true", help="write tests/uncovered.txt")
    chosen = parser.parse_args()
    if not chosen.parts:
        shutil.rmtree(DATA, ignore_errors=True)
    DATA.mkdir(parents=True, exist_ok=True)
    parts = chosen.parts or ["python", "c", "report"]
    if "environment" in parts:
        print(*(f"{name}={shlex.quote(value)}" for name, value in measured().items()))
    if "python" in parts:
        measure_python(chosen.select)
    if "c" in parts:
        measure_c()
    sys.exit("report" in parts and report(chosen.write) > 0)


if __name__ == "__main__":
    main()
