"""The pages are tests: what README.md and docs/**/*.md show is done in a fresh folder, and what they print is compared.

In a ``console`` block the lines after ``$`` are run, and what follows one is what it prints, as doctest compares it:
``...`` stands for anything, white space counts once. A command must succeed, and say nothing where nothing is shown. A
``python`` or ``toml`` block that begins with a comment naming a file becomes that file; another ``python`` is executed.
In a ``diff`` block that names a file, lines with ``+`` come after the line above them. The blocks of a page share a
folder; that of a page with the remark ``in a checkout`` is a copy of ours, and its package is the one that is run.
"""

import doctest
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import get_args

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [
    *(ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "SECURITY")),
    *sorted((ROOT / "docs").rglob("*.md")),
]
MADE = ("components/", "live/", "notebooks/", "reference/command_line.md")
"""Pages of the site that docs/generate.py makes; tests/docs has them."""
BLOCK = re.compile(r"^```(console|python|toml|diff)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# ([\w/-]+\.(?:pyi?|toml))\n")
CHECKOUT = "<!-- in a checkout -->"
PACKAGES = ("components", "fmus", "models", "orchestrator")
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def blocks(page: Path) -> list[tuple[int, str, str]]:
    """Line, kind and content of every block that is run."""
    text = page.read_text(encoding="utf-8")
    found = [(text.count("\n", 0, m.start()) + 1, m[1], m[2]) for m in BLOCK.finditer(text)]
    return [(line, kind, content) for line, kind, content in found if kind != "toml" or FILE.match(content)]


def copy_checkout(folder: Path) -> None:
    """What a contributor has: the packages, importable by their name from ``lib``, the site's sources, the settings."""
    for name in (*PACKAGES, "docs"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "dist"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    (folder / "lib" / "railcosim").mkdir(parents=True)
    for name in PACKAGES:
        (folder / "lib" / "railcosim" / name).symlink_to(folder / name)


def write_file(folder: Path, kind: str, content: str) -> None:
    """A block that names a file: the whole of it, or lines to add to it."""
    name, _, body = content.removeprefix("# ").partition("\n")
    text = add_lines((folder / name).read_text(encoding="utf-8"), body) if kind == "diff" else content
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8")


def add_lines(text: str, change: str) -> str:
    """Lines of a change with ``+`` come after the line above them, and at the end where there is none."""
    lines, place = text.splitlines(), len(text.splitlines())
    for line in change.splitlines():
        if line.startswith("+"):
            lines.insert(place, line[1:])
            place += 1
        else:
            assert lines.count(line[1:]) == 1, f"the file has no such line, or several: {line[1:]!r}"
            place = lines.index(line[1:]) + 1
    return "\n".join(lines) + "\n"


def commands(block: str) -> list[tuple[str, str]]:
    """The commands of a console block, each with what it prints."""
    parts = re.split(r"^\$ ((?:.*\\\n)*.*)\n", block, flags=re.MULTILINE)
    assert not parts[0].strip(), f"begin a console block with '$ ': {parts[0]!r}"
    return list(zip(parts[1::2], parts[2::2], strict=True))


def environment(folder: Path) -> dict[str, str]:
    """This Python and its ``orchestrate`` come first, and the copy of a checkout, where there is one."""
    (folder / "bin").mkdir(exist_ok=True)
    script = folder / "bin" / "orchestrate"
    script.write_text(f"#!{sys.executable}\nfrom railcosim.orchestrator.cli.app import main\nmain()\n")
    script.chmod(0o755)
    if not (folder / "bin" / "python").exists():
        (folder / "bin" / "python").write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n')
        (folder / "bin" / "python").chmod(0o755)
    found = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST_")} | {"COLUMNS": "100"}
    copied = {"PYTHONPATH": str(folder / "lib")} if (folder / "lib").exists() else {}
    return found | copied | {"PATH": f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}"}


def execute(arguments: list[str], folder: Path) -> tuple[int, str]:
    """Run a command; exit code, and what it prints on both streams."""
    both = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    done = subprocess.run(arguments, cwd=folder, env=environment(folder), timeout=300, check=False, **both)
    return done.returncode, done.stdout


def run_page(page: Path, folder: Path) -> None:
    """Do what a page says."""
    if CHECKOUT in page.read_text(encoding="utf-8"):
        copy_checkout(folder)
    for line, kind, content in blocks(page):
        place = f"{page.name}:{line}"
        if FILE.match(content):
            write_file(folder, kind, content)
        elif kind == "python":
            code, got = execute([sys.executable, "-c", content], folder)
            assert code == 0, f"{place}: {got}"
        else:
            for command, wanted in commands(content):
                code, got = execute(["bash", "-c", command], folder)
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


def test_the_component_that_a_page_adds_gets_a_page_with_equations_and_figure(tmp_path: Path) -> None:
    copy_checkout(tmp_path)
    for _, kind, content in blocks(ROOT / "docs" / "architecture.md"):
        if FILE.match(content):
            write_file(tmp_path, kind, content)
    show = "import component_page as made; print(made.page(made.CATALOGUE['Headwind']))"
    code, text = execute([sys.executable, "-c", f"import sys; sys.path.insert(0, 'docs'); {show}"], tmp_path)
    assert code == 0, text
    assert "<svg" in text
    assert "The force per mass of a wind of 10 m/s" in text
    assert "$a = -c_2" in text
    assert "| `wind` | m/s | 10 |  | yes | wind against the train; negative from behind |" in text


def test_own_controller_keeps_its_promise_of_less_than_forty_lines() -> None:
    page = ROOT / "docs" / "own_controller.md"
    code = [content for _, kind, content in blocks(page) if kind == "python"]
    lines = [line for content in code for line in content.splitlines() if line.strip() and not line.startswith("# ")]
    assert f"in {len(lines)} lines of code" in page.read_text(encoding="utf-8")
    assert len(lines) < 40


def test_the_page_on_components_explains_every_declaration_method_and_key_of_a_line() -> None:
    from railcosim.components import declarations
    from railcosim.components.component import Method
    from railcosim.components.environment.track import SECTIONS

    text = (ROOT / "docs" / "write_a_component.md").read_text(encoding="utf-8")
    abstract = {"Declaration", "Variable"}
    kinds = [x for x in vars(declarations).values() if isinstance(x, type) and issubclass(x, declarations.Declaration)]
    rows = re.findall(r"^\| `(\w+)", text, re.MULTILINE)
    keys = [column.name for column in SECTIONS.columns]
    wanted = [*(kind.__name__ for kind in kinds if kind.__name__ not in abstract), *get_args(Method), *keys]
    assert sorted(rows) == sorted(wanted)


def test_the_page_on_lines_and_trains_explains_every_key() -> None:
    from railcosim.components.environment.track import LINE
    from railcosim.components.trains.rolling_stock import TRAIN

    text = (ROOT / "docs" / "lines_and_trains.md").read_text(encoding="utf-8")
    tables = [text[text.index(title) :].partition("\n## ")[0] for title in ("## A line", "## A train")]
    for table, kind in zip(tables, (LINE, TRAIN), strict=True):
        cells = re.findall(r"^\| (`[^|]*)\|", table, re.MULTILINE)
        assert sorted(re.findall(r"`(\w+)`", " ".join(cells))) == sorted(column.name for column in kind.columns)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_and_pictures_of_a_page_exist(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    targets = [target.partition("#")[0] for target in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in target]
    targets = [target for target in targets if target and not target.startswith(MADE)]
    missing = [target for target in targets if not (page.parent / target).exists()]
    assert missing == []


def test_pages_that_code_refers_to_exist() -> None:
    files = [path for folder in (*PACKAGES, "tests", "benchmarks") for path in (ROOT / folder).rglob("*.*")]
    texts = {path: path.read_text(encoding="utf-8") for path in files if path.suffix in (".py", ".c", ".h", ".toml")}
    cited = {(path.name, page) for path, text in texts.items() for page in re.findall(r"\bdocs/[\w/]+\.md\b", text)}
    assert len(cited) > 15
    assert [(name, page) for name, page in cited if not (ROOT / page).is_file()] == []


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
