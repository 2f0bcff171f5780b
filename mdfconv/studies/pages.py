"""Pages of the report: templates in Markdown, filled with figures that have names.

A template is ``pages/NAME.md``: a conclusion, prose, tables. ``{error:.1%}`` in it stands for the
figure ``error``, with Python's rules of format; a table is the figure ``{table}``.
"""

from __future__ import annotations

from importlib.resources import files
from string import Formatter


def fill(name: str, **figures: object) -> str:
    """Return a template with its figures, each of which it has to use.

    Raises
    ------
    ValueError
        If the template and the figures do not go together.
    """
    template = files("mdfconv.studies").joinpath("pages", f"{name}.md").read_text(encoding="utf-8")
    # An element is asked for as ``figure[element]``.
    used = {field.partition("[")[0] for _, field, _, _ in Formatter().parse(template) if field}
    if used != figures.keys():
        missing, spare = sorted(used - figures.keys()), sorted(figures.keys() - used)
        raise ValueError(f"pages/{name}.md: figures missing {missing}, without use {spare}")
    return template.rstrip("\n").format_map(figures)
