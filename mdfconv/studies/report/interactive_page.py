"""Beckmann and GGX side by side, with sliders."""

from __future__ import annotations

from mdfconv.distributions.endpoint import endpoints
from mdfconv.render.comparison import REFERENCE
from mdfconv.render.page import filled, page_data
from mdfconv.scene.shininess import ROUGHNESS
from mdfconv.studies.report.artefact import Artefact


def interactive_page() -> Artefact:
    """Return the page that compares the paper's reference with what most renderers have."""
    data = page_data(*endpoints(REFERENCE, ROUGHNESS))
    return Artefact(
        {"comparison.html": filled(data)},
        "GGX in place of Beckmann, to judge by eye: a page for a browser",
        f"the numbers of `convert` within {100 * data['interpolation']:.1g} %",
        f"mdfconv compare --to {ROUGHNESS} --html comparison.html",
    )
