"""What mkdocs does beside turning Markdown into pages: pages made from the code, and formulas as MathML.

Generated are the start page and its neighbours (README.md, CONTRIBUTING.md, SECURITY.md, CHANGELOG.md, whose links are
led into the site), a page for each component (`component_page`), the reference of the command line, and live pages
(`live_pages`).
"""

from __future__ import annotations

import html
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import component_page
import json_page
import notebook_page
import typer
from latex2mathml.converter import convert
from live_pages import live_pages
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from railcosim.components import CATALOGUE
from railcosim.orchestrator.cli.app import app
from typer.main import get_command

ROOT = Path(__file__).parents[1]
NEIGHBOURS = {
    "README.md": "index.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "SECURITY.md": "security.md",
}
_FAMILIES = {
    "trains": "Trains",
    "cruise": "Cooperative cruise",
    "ato": "Automatic train operation",
    "supervision": "Supervision",
    "environment": "Surroundings",
}
_MATH = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)


# ---------------------------------------------------------------- what mkdocs calls


def on_startup(**_: Any) -> None:
    """Give the folders of the checkout the name they are imported by, for whoever reads the source by path."""
    place = ROOT / "build" / "api" / "railcosim"
    place.mkdir(parents=True, exist_ok=True)
    for name in ("components", "fmus", "orchestrator"):
        if not (place / name).is_symlink():
            (place / name).symlink_to(ROOT / name, target_is_directory=True)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages, and the components' to the navigation."""
    pages = {site: (ROOT / name).read_text(encoding="utf-8") for name, site in NEIGHBOURS.items()}
    pages = {site: into_site(text) for site, text in pages.items()}
    pages |= {f"components/{name}.md": component_page.page(cls) for name, cls in CATALOGUE.items()}
    pages |= {"components/index.md": overview(), "reference/command_line.md": command_line()}
    for name, text in pages.items():
        files.append(File.generated(config, name, content=text))
    for name in notebook_page.names():
        notebook = notebook_page.page(name)
        files.append(File.generated(config, f"notebooks/{name}.md", content=notebook.text))
        for picture, content in notebook.pictures.items():
            files.append(File.generated(config, f"notebooks/{picture}", content=content))
    for name, path in live_pages().items():
        files.append(File.generated(config, f"live/{name}.html", abs_src_path=str(path)))
    for section in config.nav or []:
        if "Components" in section:
            section["Components"] = ["components/index.md", *_navigation()]
    return files


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """The page about JSON, with the documents of all commands."""
    return f"{markdown}\n{json_page.tables()}" if page.file.src_uri == "reference/json.md" else markdown


def on_page_content(content: str, **_: Any) -> str:
    """Formulas of a page, from LaTeX to MathML."""
    return _MATH.sub(lambda m: mathml(html.unescape(m[3]), block=m[2] == "["), content)


# ---------------------------------------------------------------- pages


def into_site(text: str) -> str:
    """A page from the root of the repository: its links, led to where the targets are in the site."""
    text = re.sub(r"\]\(docs/", "](", text)
    for name, site in NEIGHBOURS.items():
        text = text.replace(f"]({name}", f"]({site}")
    return text


def mathml(latex: str, *, block: bool = False) -> str:
    """A formula as MathML.

    Raises:
        ValueError: it has a command, or a sign of alignment, that would show as it is written.
    """
    found = convert(latex, display="block" if block else "inline")
    if "\\" in found or "&amp;" in found or "$" in found:
        raise ValueError(f"the formula {latex!r} has a command that cannot be translated")
    return f'<div class="formula">{found}</div>' if block else found


def overview() -> str:
    """All components, by family."""
    lines = ["# Components", "", "What can stand in a scenario, and becomes an FMU by `orchestrate build`."]
    for folder, title in _FAMILIES.items():
        lines += ["", f"## {title}", ""]
        lines += [f"- [{c.__name__}]({c.__name__}.md): {component_page.summary(c)}" for c in _members(folder)]
    return "\n".join(lines)


def _navigation() -> list[dict[str, list[str]]]:
    return [{title: [f"components/{c.__name__}.md" for c in _members(f)]} for f, title in _FAMILIES.items()]


def _members(folder: str) -> list[type[component_page.Component]]:
    return [cls for cls in CATALOGUE.values() if component_page.family(cls) == folder]


def command_line() -> str:
    """The reference of ``orchestrate``, from the declarations that its ``--help`` comes from."""
    group: Any = get_command(app)
    context = typer.Context(group, info_name="orchestrate")
    return "\n".join(["# Command line", "", group.help, *_commands(group, context)])


def _commands(group: Any, context: Any) -> Iterator[str]:
    for name, command in group.commands.items():
        own = typer.Context(command, info_name=name, parent=context)
        usage = " ".join(command.collect_usage_pieces(own))
        yield f"\n## {name}\n\n```text\norchestrate {name} {usage}\n```\n\n{command.help}\n"
        records = [record for parameter in command.params if (record := parameter.get_help_record(own))]
        if records:
            yield "| argument or option | what it does |\n| --- | --- |"
        for names, what in records:
            yield f"| `{names.strip()}` | {html.escape(what, quote=False).replace('|', chr(92) + '|')} |"
        yield ""
