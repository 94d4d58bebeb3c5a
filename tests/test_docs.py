"""The pages are tests: what README.md and docs/*.md show is done in a fresh folder, and what they print is compared.

In a ``console`` block the lines after ``$`` are run, and what follows one is what it prints, as doctest compares it:
``...`` stands for anything, white space counts once. A command must succeed, and say nothing where nothing is shown. A
``python`` block that begins with a comment naming a file becomes that file; any other is executed. The blocks of a page
share a folder.
"""

import doctest
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```(console|python)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# ([\w-]+\.py)\n")
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def blocks(page: Path) -> list[tuple[int, str, str]]:
    """Line, kind and content of every block that is run."""
    text = page.read_text(encoding="utf-8")
    return [(text.count("\n", 0, m.start()) + 1, m[1], m[2]) for m in BLOCK.finditer(text)]


def commands(block: str) -> list[tuple[str, str]]:
    """The commands of a console block, each with what it prints."""
    parts = re.split(r"^\$ ((?:.*\\\n)*.*)\n", block, flags=re.MULTILINE)
    assert not parts[0].strip(), f"begin a console block with '$ ': {parts[0]!r}"
    return list(zip(parts[1::2], parts[2::2], strict=True))


def execute(command: str, folder: Path) -> tuple[int, str]:
    """Run a shell command with this Python and its ``orchestrate``; exit code, and what it prints on both streams."""
    (folder / "bin").mkdir(exist_ok=True)
    script = folder / "bin" / "orchestrate"
    script.write_text(f"#!{sys.executable}\nfrom railcosim.orchestrator.cli.app import main\nmain()\n")
    script.chmod(0o755)
    if not (folder / "bin" / "python").exists():
        (folder / "bin" / "python").write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n')
        (folder / "bin" / "python").chmod(0o755)
    path = f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}"
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST_")} | {
        "PATH": path,
        "COLUMNS": "100",
    }
    both = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment, timeout=120, check=False, **both)
    return done.returncode, done.stdout


def run_page(page: Path, folder: Path) -> None:
    """Do what a page says."""
    for line, kind, content in blocks(page):
        place = f"{page.name}:{line}"
        file = FILE.match(content) if kind == "python" else None
        if file:
            (folder / file[1]).write_text(content, encoding="utf-8")
        elif kind == "python":
            done = subprocess.run(
                [sys.executable, "-c", content], cwd=folder, capture_output=True, text=True, timeout=120, check=False
            )
            assert done.returncode == 0, f"{place}: {done.stderr}"
        else:
            for command, wanted in commands(content):
                code, got = execute(command, folder)
                assert code == 0, f"{place}: {command} ends with {code}: {got}"
                same = doctest.OutputChecker().check_output(wanted, got, FLAGS)
                assert same, f"{place}: {command} prints\n{got}\nand not\n{wanted}"


@pytest.mark.skipif(sys.platform == "win32", reason="the pages speak to a POSIX shell")
@pytest.mark.long
@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page)], ids=lambda page: page.name)
def test_what_a_page_shows_is_what_happens(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, session_cache: Path
) -> None:
    monkeypatch.setenv("RAILCOSIM_CACHE", str(session_cache))
    folder = tmp_path / "work"
    folder.mkdir()
    run_page(page, folder)


@pytest.mark.skipif(sys.platform == "win32", reason="the pages speak to a POSIX shell")
@pytest.mark.parametrize(
    "wrong",
    [
        "```console\n$ echo one\ntwo\n```\n",
        "```console\n$ false\n```\n",
        "```console\n$ echo one\n```\n",
        "```console\n$ echo one \\\n  two\none\n```\n",
        "```console\nno command\n```\n",
        "```python\nraise ValueError\n```\n",
    ],
)
def test_a_page_that_is_wrong_is_found_out(wrong: str, tmp_path: Path) -> None:
    (tmp_path / "page.md").write_text(f"# A page\n\n{wrong}")
    with pytest.raises(AssertionError):
        run_page(tmp_path / "page.md", tmp_path)


def test_own_controller_keeps_its_promise_of_less_than_forty_lines() -> None:
    page = ROOT / "docs" / "own_controller.md"
    code = [content for _, kind, content in blocks(page) if kind == "python"]
    lines = [line for content in code for line in content.splitlines() if line.strip() and not line.startswith("# ")]
    assert f"in {len(lines)} lines of code" in page.read_text(encoding="utf-8")
    assert len(lines) < 40


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_and_pictures_of_a_page_exist(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    targets = [target.partition("#")[0] for target in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in target]
    missing = [target for target in targets if target and not (page.parent / target).exists()]
    assert missing == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_a_page_mentions_is_one_of_orchestrate(page: Path) -> None:
    """`orchestrate new ...` in running text and tables: the command exists, and so do its options."""
    from railcosim.orchestrator.cli.app import app
    from typer.main import get_command

    known = get_command(app).commands  # type: ignore[attr-defined]
    for mention in re.findall(r"`(orchestrate [^`\n]+)`", page.read_text(encoding="utf-8")):
        _, name, *rest = mention.split()
        assert name in known or name.startswith("-"), mention
        options = {option for parameter in known[name].params for option in parameter.opts} if name in known else set()
        assert all(word.partition("=")[0] in {*options, "--help"} for word in rest if re.match(r"-[a-z-]", word)), (
            mention
        )
