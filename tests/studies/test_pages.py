"""Templates and their figures."""

import pytest

from mdfconv.studies import pages
from mdfconv.studies.pages import fill


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
