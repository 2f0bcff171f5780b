"""Templates and their figures, and commands that pages quote: each gives the page's own numbers."""

import csv
import re
import shlex
from pathlib import Path

import pytest
import typer

from mdfconv.cli import app
from mdfconv.studies import pages
from mdfconv.studies.pages import fill
from tests.cli.runner import run

GROUP = typer.main.get_command(app)
REPORTS = Path(__file__).parents[2] / "reports"


@pytest.fixture
def template(tmp_path, monkeypatch):
    (tmp_path / "pages").mkdir()
    (tmp_path / "pages" / "one.md").write_text(
        "# One\n\n{error:.1%} of {{x}}, {row[n]}.\n\n{table}\n"
    )
    monkeypatch.setattr(pages, "files", lambda package: tmp_path)


def test_fill(template):
    text = fill("one", error=0.0123, row={"n": 2, "m": 3}, table="| a |")
    assert text == "# One\n\n1.2% of {x}, 2.\n\n| a |"


@pytest.mark.parametrize(
    ("figures", "words"),
    [
        ({"error": 0.01, "table": ""}, r"missing \['row'\], without use \[\]"),
        (
            {"error": 0.01, "row": {"n": 1}, "table": "", "median": 1},
            r"missing \[\], without use \['median'\]",
        ),
    ],
)
def test_figures_and_template_go_together(template, figures, words):
    with pytest.raises(ValueError, match=words):
        fill("one", **figures)


NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?%?(?![\w.]*\w)")
# They take minutes, or their digits are those of one machine.
TOO_LONG = ("report", "bench", "stability")


def quoted():
    """Return page and command line for each command that a page quotes, or the index for it."""
    pairs = []
    for path in sorted(REPORTS.glob("*.md")):
        text = " ".join(path.read_text().split())
        pairs += [(path.name, line) for line in re.findall(r"`(mdfconv [^`]+)`", text)]
    index = (REPORTS / "README.md").read_text()
    rows = re.findall(r"\(([\w-]+\.md)\).*\| `(mdfconv .*)` \|$", index, re.M)
    pairs = [pair for pair in pairs if pair[0] != "README.md"] + rows
    return [pair for pair in dict.fromkeys(pairs) if _gives_numbers(*pair[1].split()[1:])]


def _gives_numbers(command, *arguments):
    """Return whether a line is one to run; the bare name of a command with arguments is none."""
    needed = any(one.required for one in GROUP.get_command(None, command).params)
    return command not in TOO_LONG and (bool(arguments) or not needed)


def same(value, shown):
    """Return whether a page shows a number, rounded; one digit has to be all of it."""
    mantissa = re.sub(r"e.*|[^\d]", "", shown).lstrip("0")
    number = float(shown.rstrip("%")) / (100 if shown.endswith("%") else 1)
    rounded = float(f"{value:.{len(mantissa) - 1}e}") if len(mantissa) > 1 else value
    return rounded == pytest.approx(number, rel=1e-12)


def printed_rows(out, page):
    """Return the numbers of each line, of a table those in columns that the page has, too."""
    lines = out.splitlines()
    if "," in lines[0] and " " not in lines[0]:
        rows = csv.DictReader(lines)
        lines = [" ".join(row[name] for name in row if name in page) for row in rows]
    return [[float(text.rstrip("%")) for text in NUMBER.findall(line)] for line in lines]


def on_page(out, page):
    shown = set(NUMBER.findall(page))
    return any(
        row and all(any(same(value, text) for text in shown) for value in row)
        for row in printed_rows(out, page)
    )


@pytest.mark.slow
@pytest.mark.parametrize(("name", "line"), quoted())
def test_a_quoted_command_gives_the_numbers_of_its_page(name, line, tmp_path):
    status, out, err = run(*shlex.split(line)[1:], cwd=tmp_path)
    assert status == 0, err
    assert on_page(out, (REPORTS / name).read_text())


def test_commands_are_quoted():
    assert len(quoted()) > 10
    assert {"importers.md", "table2.md", "fresnel.md"} <= {name for name, _ in quoted()}


@pytest.mark.parametrize(
    ("out", "agrees"),
    [
        ("0.3314878059\n", True),
        ("0.4074382976\n", False),
        ("error,other\n0.02009,7\n", True),
        ("error,other\n0.0211,7\n", False),
        ("no number\n", False),
    ],
)
def test_numbers_are_compared_as_shown(out, agrees):
    assert on_page(out, "The right one is 0.3315; the worst error is 2.01%, with 1 of 7.") is agrees


def test_each_fit_is_best_at_what_it_preserves():
    """As pictures.md says, of every distribution on both surfaces."""
    lines = (REPORTS / "pictures.md").read_text().splitlines()
    names, _, *rows = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in lines if line[:1] == "|"
    ]
    groups = {}
    for row in [dict(zip(names, cells, strict=True)) for cells in rows]:
        groups.setdefault((row["figure"], row["distribution"]), []).append(row)
    assert len(groups) == 10
    for group in groups.values():
        for error, conversion in (("rmse_linear", "energy"), ("rmse_displayed", "display")):
            best = min(group, key=lambda row, error=error: float(row[error]))
            assert best["conversion"].startswith(f"fit {conversion}")
