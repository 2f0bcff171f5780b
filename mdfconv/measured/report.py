"""The report on fits to measurements: one page of HTML, or Markdown with its pictures.

`report.html` and `report.md` have the fixed texts, and `mdfconv.measured.contents` what a fit says.
"""

from __future__ import annotations

import html
import json
import os
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any, ClassVar
from urllib.parse import quote

from mdfconv import __version__
from mdfconv.errors import MdfconvError
from mdfconv.measured.analysis import Analysis
from mdfconv.measured.checks import Check
from mdfconv.measured.contents import (
    GRADE_MARKS,
    Contents,
    ReportTable,
    contents_of,
    overview,
    record,
)
from mdfconv.measured.figures import draw_panels
from mdfconv.measured.panels import AnyPanel, DiscPanel
from mdfconv.measured.plots import HEIGHT, LOW_HEIGHT, TALL_HEIGHT, drawn, plain, sketch, symbols
from mdfconv.output.files import file_bytes
from mdfconv.output.records import json_text, markdown_text

# Of a check that passed, failed, or could not be made; and its class in the page.
_CHECK_MARKS = {True: ("✓", "passed"), False: ("⚠", "failed"), None: ("–", "open")}
# What stands between the parts of a template.
_PARTS = re.compile(r"<!-- .* -->\n")
# What Markdown takes for more than text.
_MARKUP = re.compile(r"([\\`*_\[\]<>|#~&])")


def report_files(
    analyses: Sequence[Analysis], command: str, path: Path, hashes: Sequence[str]
) -> dict[Path, bytes]:
    """Return the files of the report on fits: one of HTML, or of Markdown with pictures beside it.

    Parameters
    ----------
    analyses : sequence of Analysis
        The fits to each file.
    command : str
        The line that makes the report.
    path : Path
        Where the report goes; its suffix chooses the form.
    hashes : sequence of str
        The SHA-256 of each file, in hexadecimal; empty where it is not known.

    Raises
    ------
    MdfconvError
        As `check_report_name`.
    """
    check_report_name(path)
    form = _FORMS[path.suffix.lower()](path)
    pairs = list(zip(analyses, hashes, strict=True))
    articles = [
        contents_of(analysis, result, command, digest)
        for analysis, digest in pairs
        for result in analysis.results
    ]
    records = [record(analysis, digest) for analysis, digest in pairs]
    data = {"mdfconv": __version__, "command": command, "files": records}
    return {path: file_bytes(form.page(articles, data)), **form.pictures}


def check_report_name(path: Path) -> None:
    """Raise `MdfconvError` if a report's name ends in neither ``.html`` nor ``.md``."""
    if path.suffix.lower() not in _FORMS:
        raise MdfconvError(f"a report is an .html or a .md file, not {path.name}")


def _plain_lines(text: str) -> str:
    return "\n".join(map(plain, text.split("\n")))


class _Form(ABC):
    """How the parts of a report are written."""

    template: ClassVar[str]

    def __init__(self, path: Path) -> None:
        self.path = path
        self.pictures: dict[Path, bytes] = {}

    def parts(self) -> list[Template]:
        """Return the parts of the template."""
        text = files(__package__).joinpath(self.template).read_text(encoding="utf-8")
        return [Template(part.rstrip("\n")) for part in _PARTS.split(text)]

    def article(self, template: Template, number: int, contents: Contents) -> str:
        """Return the part of the report on one result."""
        verdict = contents.result.verdict
        return template.substitute(
            anchor=_anchor(number),
            title=self.text(contents.title),
            about=self.text(" · ".join(contents.about)),
            grade=verdict.grade,
            mark=GRADE_MARKS[verdict.grade],
            word=verdict.grade.capitalize(),
            sentence=self.text(verdict.sentence),
            numbers=self.numbers(contents),
            precision=self.text(contents.precision),
            plots=self.plots(contents, number),
            legend=self.text(contents.legend),
            checks=self.checks(contents),
            choices=self.table(contents.choices),
            candidates=self.table(contents.candidates),
            why=self.text(contents.why),
            spectrum=self.folded("The numbers of each channel", contents.spectrum),
            snippets=self.snippets(contents),
            formula=contents.formula,
            method=self.terms(contents),
            command=self.code(contents.command),
            version=__version__,
            correlation=self.folded("Correlation of the parameters", contents.correlation),
        )

    @abstractmethod
    def page(self, articles: Sequence[Contents], data: Mapping[str, Any]) -> str:
        """Return the whole report; the data are for machines."""

    @abstractmethod
    def text(self, text: str) -> str:
        """Return text that is nothing but text."""

    @abstractmethod
    def numbers(self, contents: Contents) -> str:
        """Return the numbers of the verdict."""

    @abstractmethod
    def plots(self, contents: Contents, number: int) -> str:
        """Return the plots of a result, whose number in the report is given."""

    @abstractmethod
    def checks(self, contents: Contents) -> str:
        """Return the checks, each with a mark."""

    @abstractmethod
    def table(self, table: ReportTable) -> str:
        """Return a table."""

    @abstractmethod
    def folded(self, summary: str, table: ReportTable | None) -> str:
        """Return a table that the reader unfolds; nothing without a table."""

    @abstractmethod
    def snippets(self, contents: Contents) -> str:
        """Return the materials to paste."""

    @abstractmethod
    def code(self, text: str) -> str:
        """Return text as it is typed."""

    @abstractmethod
    def terms(self, contents: Contents) -> str:
        """Return how the fit was made."""


def _title(check: Check) -> str:
    return check.name[:1].upper() + check.name[1:]


def _anchor(number: int) -> str:
    return f"fit-{number + 1}"


class _HtmlForm(_Form):
    template = "report.html"

    def page(self, articles: Sequence[Contents], data: Mapping[str, Any]) -> str:
        page, several, each = self.parts()
        written = [self.article(each, *numbered) for numbered in enumerate(articles)]
        title = articles[0].title
        if len(articles) > 1:
            title = f"{len(articles)} fits"
            first = several.substitute(title=title, overview=self._overview(articles))
            written.insert(0, first)
        # In ASCII, and no text of it is taken for a tag.
        embedded = json.dumps(json.loads(json_text(data))).replace("<", "\\u003c")
        return page.substitute(
            title=self._escaped(title), articles="\n".join(written), data=embedded
        )

    def text(self, text: str) -> str:
        return symbols(text)

    def _escaped(self, text: str) -> str:
        return html.escape(plain(text))

    def _overview(self, articles: Sequence[Contents]) -> str:
        table = overview(articles)
        links = [
            f'{sketch(article.plots[0])}<a href="#{_anchor(number)}">{self.text(article.title)}</a>'
            for number, article in enumerate(articles)
        ]
        return self._table(table, links)

    def numbers(self, contents: Contents) -> str:
        lines = []
        for number in contents.numbers:
            label, detail = self.text(number.label), self.text(number.detail)
            shown = f"{label} <b>{self.text(number.text)}</b>"
            if detail:
                shown += f" <small>({detail})</small>"
            if number.swatch:
                shown += f' <span class="swatch" style="background: {number.swatch}"></span>'
            lines.append(f"<li>{shown}</li>")
        return "\n".join(lines)

    def plots(self, contents: Contents, number: int) -> str:
        # Residuals, and each incidence alone, find room beside data and fit.
        is_beside = len(contents.result.by_incidence) > 1
        heights = [TALL_HEIGHT, LOW_HEIGHT, LOW_HEIGHT] if is_beside else []
        heights += [HEIGHT] * (len(contents.plots) - len(heights))
        return "\n".join(map(self._figure, contents.plots, heights))

    def _figure(self, panel: AnyPanel, height: int) -> str:
        """Return a plot with its caption."""
        remark = f" ({self.text(panel.remark)})" if panel.remark else ""
        kind = "wide" if isinstance(panel, DiscPanel) else "tall" if height == TALL_HEIGHT else ""
        return (
            f'<figure class="{kind}"><figcaption><b>{self.text(panel.title)}</b>{remark}'
            f"</figcaption>\n{drawn(panel, height)}</figure>"
        )

    def checks(self, contents: Contents) -> str:
        rows = []
        for check in contents.result.checks:
            mark, kind = _CHECK_MARKS[check.passed]
            rows.append(
                f'<tr><td class="mark {kind}">{mark}</td><th scope="row">{self.text(_title(check))}'
                f"</th><td>{self.text(check.text)}</td></tr>"
            )
        body = "\n".join(rows)
        return f'<table class="checks"><tbody>\n{body}\n</tbody></table>'

    def table(self, table: ReportTable) -> str:
        return self._table(table, [self._lines(row[0]) for row in table.rows])

    def _table(self, table: ReportTable, first: Sequence[str]) -> str:
        head = "".join(f'<th scope="col">{self.text(name)}</th>' for name in table.columns)
        rows = []
        for place, (title, row) in enumerate(zip(first, table.rows, strict=True)):
            cells = "".join(f"<td>{self._lines(cell)}</td>" for cell in row[1:])
            kind = ' class="bold"' if place == table.bold else ""
            rows.append(f'<tr{kind}><th scope="row">{title}</th>{cells}</tr>')
        body = "\n".join(rows)
        return (
            f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>\n'
            f"{body}\n</tbody></table></div>"
        )

    def _lines(self, text: str) -> str:
        return "<br>".join(map(self.text, text.split("\n")))

    def folded(self, summary: str, table: ReportTable | None) -> str:
        if table is None:
            return ""
        return f"<details><summary>{summary}</summary>\n{self.table(table)}\n</details>"

    def snippets(self, contents: Contents) -> str:
        return "\n".join(
            f'<section class="snippet"><h3>{self.text(snippet.title)}</h3>\n'
            f"{self.code(snippet.text) if snippet.text else ''}\n"
            f'<p class="small">{self.text(snippet.note)}</p></section>'
            for snippet in contents.snippets
        )

    def code(self, text: str) -> str:
        return f"<pre>{html.escape(_plain_lines(text))}</pre>"

    def terms(self, contents: Contents) -> str:
        return "\n".join(
            f"<dt>{self.text(term)}</dt><dd>{self.text(text)}</dd>"
            for term, text in contents.method
        )


class _MarkdownForm(_Form):
    template = "report.md"

    def page(self, articles: Sequence[Contents], data: Mapping[str, Any]) -> str:
        (each,) = self.parts()
        written = [self.article(each, *numbered) for numbered in enumerate(articles)]
        if len(articles) > 1:
            written.insert(0, f"# {len(articles)} fits\n\n{self.table(overview(articles))}")
        return "\n\n".join(written)

    def text(self, text: str) -> str:
        return _MARKUP.sub(r"\\\1", plain(text))

    def numbers(self, contents: Contents) -> str:
        lines = []
        for number in contents.numbers:
            label = f"{self.text(number.label)} " if number.label else ""
            detail = f" ({self.text(number.detail)})" if number.detail else ""
            lines.append(f"- {label}**{self.text(number.text)}**{detail}")
        return "\n".join(lines)

    def plots(self, contents: Contents, number: int) -> str:
        picture = self.path.with_name(f"{self.path.stem}-plots-{number + 1}.png")
        self.pictures[picture] = draw_panels(contents.plots)
        return f"![Data, fit and residuals]({quote(os.fsencode(picture.name))})"

    def checks(self, contents: Contents) -> str:
        rows = [
            [_CHECK_MARKS[check.passed][0], _title(check), check.text]
            for check in contents.result.checks
        ]
        return self.table(ReportTable(["", "check", "result"], rows))

    def table(self, table: ReportTable) -> str:
        columns = [self.text(name) for name in table.columns]
        rows = []
        for place, row in enumerate(table.rows):
            cells = ["<br>".join(map(self.text, cell.split("\n"))) for cell in row]
            if place == table.bold:
                cells = [f"**{cell}**" if cell else "" for cell in cells]
            rows.append(dict(zip(columns, cells, strict=True)))
        return markdown_text(columns, rows)

    def folded(self, summary: str, table: ReportTable | None) -> str:
        return "" if table is None else f"\n\n**{summary}**\n\n{self.table(table)}"

    def snippets(self, contents: Contents) -> str:
        parts = []
        for snippet in contents.snippets:
            parts.append(f"### {self.text(snippet.title)}")
            parts += [self.code(snippet.text)] if snippet.text else []
            parts += [self.text(snippet.note)] if snippet.note else []
        return "\n\n".join(parts)

    def terms(self, contents: Contents) -> str:
        lines = (f"- {self.text(term)}: {self.text(text)}" for term, text in contents.method)
        return "\n".join(lines)

    def code(self, text: str) -> str:
        # Between fences that are longer than what is in it.
        longest = max(map(len, re.findall("`+", text)), default=0)
        fence = "`" * max(longest + 1, 3)
        return f"{fence}\n{_plain_lines(text)}\n{fence}"


_FORMS: dict[str, type[_Form]] = {
    ".html": _HtmlForm,
    ".htm": _HtmlForm,
    ".md": _MarkdownForm,
}
