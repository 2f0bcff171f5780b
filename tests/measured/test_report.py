"""The report on fits: what it says, what its plots show, and that it is one safe file."""

import json
import re
import shutil
import subprocess
from hashlib import sha256
from html.parser import HTMLParser
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from PIL import Image

from mdfconv.distributions import distribution
from mdfconv.errors import MdfconvError
from mdfconv.measured.checks import Check, Verdict
from mdfconv.measured.figures import draw_analysis
from mdfconv.measured.model import BrdfModel
from mdfconv.measured.panels import COLORS, DiscPanel, panels
from mdfconv.measured.plots import decades, drawn, number, symbols, ticks
from mdfconv.measured.report import check_report_name, report_files
from mdfconv.measured.samples import DirectionalSamples, Samples
from mdfconv.measured.validation import IncidenceFit
from tests.cli.runner import run

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("chrome")
ALPHA, K_D, NOISE = 0.12, 0.3, 0.02
NAN = float("nan")
HOSTILE = "<script>a_b*`|$x\x1b[2J\u202e.csv"
# What a page may not hold as it is.
COMMAND = "mdfconv fit '</script><b>' --report paint.html"


def vector(theta, phi):
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)


def lobe(incident, outgoing, alpha):
    """GGX over 4 cos cos, without masking and Fresnel's factor."""
    half = incident + outgoing
    z = half[:, 2] / np.linalg.norm(half, axis=1)
    density = alpha**2 / (np.pi * (z * z * (alpha * alpha - 1) + 1) ** 2)
    return density / (4 * incident[:, 2] * outgoing[:, 2])


def directions(theta_i, theta_o, phi_o, channels=("R",)):
    """Return samples from degrees; φ_o = 180° is the mirror's side."""
    theta_i, theta_o, phi_o = (np.radians(np.ravel(a)) for a in (theta_i, theta_o, phi_o))
    blank = np.zeros((theta_i.size, len(channels)))
    return DirectionalSamples(vector(theta_i, 0 * theta_i), vector(theta_o, phi_o), blank, channels)


def scan(incidences=(20, 45, 70), step=2.0, channels=("R",)):
    signed = np.arange(-80, 80 + step / 2, step)
    theta_i, theta_o = np.meshgrid(np.array(incidences, float), signed, indexing="ij")
    return directions(theta_i, np.abs(theta_o), np.where(theta_o < 0, 0, 180), channels)


def hemisphere():
    axes = np.array([10.0, 50.0]), np.arange(5.0, 81, 5), np.arange(0.0, 360, 15)
    return directions(*np.meshgrid(*axes, indexing="ij"))


def model(alpha, count):
    """Return a model of so many channels, each of half the albedo of the one before."""

    def values(samples):
        if isinstance(samples, Samples):
            cosine = np.cos(samples.beta)
            shape = 0.02 + 3 * (alpha**2 / (1 + cosine**2 * (alpha**2 - 1))) ** 2
            return np.repeat(shape[:, None], count, axis=1)
        shape = lobe(samples.incident, samples.outgoing, alpha)
        return np.stack([K_D / np.pi / 2**c + 0.04 * shape for c in range(count)], -1)

    return values


def fit(of, alpha, count, **changes):
    f0, k_d = (0.04,) * count, tuple(K_D / 2**c for c in range(count))
    mdf = distribution(of)
    parts = {
        "distribution": mdf, "name": of, "label": mdf.label, "parameter": alpha,
        "parameter_error": 0.01 * alpha, "gamma": None, "gamma_error": None, "second": None,
        "share": None, "errors": {}, "linear": {}, "linear_errors": {}, "fresnel": "dielectric",
        "n": 1.5, "n_error": 0.01, "f0": f0, "f0_error": (0.001,) * count, "diffuse": k_d,
        "diffuse_error": (0.01,) * count, "specular": (1.0,) * count,
        "specular_error": (0.0,) * count, "loss": "log", "error": 0.07, "log_rmse": 0.07,
        "bic": -100.0,
        "validated_error": 0.08, "validated_spread": 0.004, "unknowns": ("alpha", "n"),
        "correlation": np.array([[1, -0.41], [-0.41, 1]]), "at_limit": (),
        "model": model(alpha, count), "albedo": lambda theta: np.full(count, 0.5),
    }  # fmt: skip
    made = SimpleNamespace(**(parts | changes))
    made.record = lambda: {"distribution": made.name, "parameter": made.parameter}
    return made


def result_of(samples, fits=None, incidences=(), seed=1, **changes):
    """Return a result whose samples are those of the first fit, with noise."""
    count = len(samples.channels)
    fits = fits or [fit("ggx", ALPHA, count), fit("beckmann", 2 * ALPHA, count, bic=20.0)]
    noise = NOISE * np.random.default_rng(seed).standard_normal((len(samples.values), count))
    samples.values[:] = fits[0].model(samples) * np.exp(noise)
    alone = [
        IncidenceFit(angle, 50, ALPHA * (1 + 0.1 * k), 0.01) for k, angle in enumerate(incidences)
    ]
    checks = [
        Check("energy", True, "reflects 47 % at 0°"),
        Check("incidences", False, "α falls with θ_i"),
        Check("outliers", None, "5 of 459 count less"),
    ]
    parts = {
        "samples": samples, "fits": fits, "error": 0.07, "recommended": fits[0], "noise": NOISE,
        "weights": np.ones(len(samples.values)), "by_incidence": alone,
        "choices": [SimpleNamespace(what="as it is", fit=fits[0]),
                    SimpleNamespace(what="θ ≤ 60°", fit=fit("ggx", 1.1 * ALPHA, count))],
        "verdict": Verdict("usable", "A glossy dielectric over a diffuse base."), "checks": checks,
    }  # fmt: skip
    return Result(**(parts | changes))


class Result(SimpleNamespace):
    """As `ChannelFits`."""

    @property
    def log_ratio(self):
        return np.log(self.recommended.model(self.samples) / self.samples.values)

    def records(self):
        return [fit.record() | {"recommended": fit is self.recommended} for fit in self.fits]


def analysis_of(*results, name="paint.csv", about=("Gonio & Co, 633 nm",), **options):
    samples = SimpleNamespace(about=about, channels=results[0].samples.channels)
    return SimpleNamespace(
        name=name, samples=samples, results=list(results), settings=BrdfModel(**options),
        notes=("3 of 462 samples are left out",),
    )  # fmt: skip


def plain_report(path="paint.html", **rest):
    analysis = analysis_of(result_of(scan(), incidences=(20, 45, 70)), **rest)
    return report_files([analysis], COMMAND, Path(path), ["ab" * 32])


EMPTY = {"meta", "br", "path", "rect", "circle", "img"}


class Page(HTMLParser):
    """What a page asks for from elsewhere, its text, and whether each element is closed."""

    def __init__(self, text):
        super().__init__()
        self.sources, self.words, self.open, self.tags = [], [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        named = dict(attributes)
        self.tags.append((tag, named))
        self.sources += [named[name] for name in ("src", "href") if name in named]
        if tag not in EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in EMPTY:
            assert self.open.pop() == tag

    def handle_data(self, data):
        if not {"style", "script"} & set(self.open):
            self.words.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())


def page_of(files):
    (content,) = files.values()
    return Page(content.decode())


def data_of(files):
    (content,) = files.values()
    kind = '<script type="application/json" id="mdfconv-fit">'
    return json.loads(content.decode().partition(kind)[2].partition("</script>")[0])


def test_the_page_says_what_the_fit_says():
    text = page_of(plain_report()).text
    for part in (
        "paint.csv", "Gonio & Co, 633 nm", "⚠ Usable.", "A glossy dielectric over a diffuse base.",
        # √0.12 with half the relative error of α, and the digits that it supports.
        "r = 0.3464 ± 0.0017", "α = 0.1200 ± 0.0012", "F₀ = 0.0400 ± 0.0010", "n = 1.500 ± 0.010",
        "diffuse albedo 0.300 ± 0.010", "jackknife over 3 angles of incidence",
        "The choices below move α from 0.1200 to 0.1320", "Energy reflects 47 % at 0°",
        "✓", "– Outliers", "ΔBIC",
        "7 %", "8.0 ± 0.4 %", "120", "3 of 462 samples are left out", "ab" * 32, COMMAND, "−0.41",
    ):  # fmt: skip
        assert part in text, part


def test_the_page_is_one_file_that_asks_for_nothing():
    page = page_of(plain_report())
    assert page.sources == []
    scripts = [named for tag, named in page.tags if tag == "script"]
    assert scripts == [{"type": "application/json", "id": "mdfconv-fit"}]
    styles = [named["style"] for _, named in page.tags if "style" in named]
    assert not any("url" in style for style in styles)
    assert any("default-src 'none'" in named.get("content", "") for _, named in page.tags)


def test_the_recommended_candidate_is_bold():
    fits = [fit("beckmann", 0.2, 1), fit("ggx", ALPHA, 1, bic=-130.0)]
    files = plain_report()
    result = result_of(scan(), fits=fits, recommended=fits[1])
    files = report_files([analysis_of(result)], COMMAND, Path("a.html"), [""])
    (content,) = files.values()
    rows = re.findall(r'<tr class="bold">.*?</tr>', content.decode())
    assert any("ggx" in row and "beckmann" not in row for row in rows)
    text = Page(content.decode()).text
    assert "Recommended is ggx: the simplest shape" in text
    # Of the larger BIC.
    assert re.search(r"beckmann .*? 30 ", text)


def test_records_are_embedded_for_machines():
    data = data_of(plain_report())
    assert data["command"] == COMMAND
    (file,) = data["files"]
    assert file["sha256"] == "ab" * 32
    (result,) = file["results"]
    assert [row["recommended"] for row in result["fits"]] == [True, False]
    assert result["verdict"]["grade"] == "usable"
    assert [check["passed"] for check in result["checks"]] == [True, False, None]
    assert [one["angle"] for one in result["by_incidence"]] == [20, 45, 70]
    assert result["choices"][1]["parameter"] == pytest.approx(1.1 * ALPHA)
    assert result["correlation"] == [[1, -0.41], [-0.41, 1]]


@pytest.mark.parametrize("suffix", ["html", "md"])
def test_hostile_names_are_text(suffix):
    about = (HOSTILE, "</script>", "name \udcff that is no UTF-8")
    result = result_of(scan(channels=("G", HOSTILE)), incidences=(20, 45, 70))
    analysis = analysis_of(result, name=HOSTILE, about=about)
    files = report_files([analysis], HOSTILE, Path(f"paint.{suffix}"), ["ab" * 32])
    text = files[Path(f"paint.{suffix}")].decode()
    assert "\x1b" not in text
    assert "\u202e" not in text
    if suffix == "md":
        assert r"\<script\>a\_b\*\`\|$x\\x1b\[2J\\u202e.csv" in text
        return
    page = page_of(files)
    assert r"<script>a_b*`|$x\x1b[2J\u202e.csv" in page.text
    assert data_of(files)["files"][0]["file"] == HOSTILE
    assert data_of(files)["files"][0]["about"][2] == about[2]
    assert sum(tag == "script" for tag, _ in page.tags) == 1


def test_markdown_has_the_same_order_and_its_picture(tmp_path):
    files = plain_report(tmp_path / "paint.md")
    text = files[tmp_path / "paint.md"].decode()
    headings = re.findall(r"^##? (.*)", re.sub(r"```.*?```", "", text, flags=re.S), re.M)
    page = plain_report()[Path("paint.html")].decode()
    assert headings == re.findall(r"<h[12]>(.*)</h[12]>", page)
    (name,) = re.findall(r"!\[.*?\]\((.*?)\)", text)
    picture = tmp_path / name
    picture.write_bytes(files[picture])
    with Image.open(picture) as opened:
        assert opened.size[0] > 1500
    # Fences hold what is typed, and nothing leaves a gap.
    assert f"```\n{COMMAND}\n```" in text
    assert "\n\n\n" not in text
    assert text.count("```") % 2 == 0


def test_several_files_have_an_overview():
    first, second = (
        analysis_of(result_of(scan(), incidences=(20, 45, 70)), name=name)
        for name in ("a & b.csv", "c.csv")
    )
    third = analysis_of(result_of(scan(channels=("R",))), result_of(scan(channels=("G",))))
    files = report_files([first, second, third], COMMAND, Path("x.html"), ["aa", "bb", "cc"])
    page = page_of(files)
    anchors = [named["id"] for tag, named in page.tags if tag == "article" and "id" in named]
    assert [source.removeprefix("#") for source in page.sources] == anchors
    assert len(anchors) == 4
    for part in ("4 fits", "a & b.csv", "paint.csv, channel R", "paint.csv, channel G"):
        assert part in page.text
    assert [file["sha256"] for file in data_of(files)["files"]] == ["aa", "bb", "cc"]
    markdown = report_files([first, second], COMMAND, Path("x.md"), ["aa", "bb"])
    assert len(markdown) == 3
    assert "# 2 fits" in markdown[Path("x.md")].decode()


LAYOUT = """<iframe src="page.html" style="border: 0; width: 360px; height: 900px"></iframe>
<pre id="answer"></pre>
<script>onload = () => {
  const page = frames[0].document, sides = (box) => [box.left, box.right];
  const parts = "h1, p, dd, .verdict, .numbers, figure, .scroll, pre, svg";
  const boxes = [...page.querySelectorAll(parts)]
    .filter((element) => element.tagName !== "svg" || !element.closest(".scroll"))
    .map((element) => sides(element.getBoundingClientRect()));
  const fonts = [...page.querySelectorAll("figure svg text")].map((text) =>
    parseFloat(getComputedStyle(text).fontSize) * text.ownerSVGElement.clientWidth
      / text.ownerSVGElement.viewBox.baseVal.width);
  document.getElementById("answer").textContent = JSON.stringify({
    across: page.documentElement.scrollWidth, boxes, fonts });
};</script>
"""


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")
def test_the_page_fits_a_telephone(tmp_path):
    name = "a-name-that-is-longer-than-the-telephone-is-wide" * 3
    names = tuple(f"{wave} nm" for wave in range(400, 700, 25))
    results = [
        result_of(scan(), incidences=(20, 45, 70)), result_of(hemisphere()),
        result_of(scan(channels=("R", "G", "B"))), result_of(scan(channels=names)),
    ]  # fmt: skip
    analyses = [analysis_of(result, name=name) for result in results]
    files = report_files(analyses, f"mdfconv fit {name}", Path("x.html"), ["ab" * 32] * 4)
    (tmp_path / "page.html").write_bytes(files[Path("x.html")])
    (tmp_path / "frame.html").write_text(LAYOUT)
    finished = subprocess.run(
        [
            CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu",
            "--allow-file-access-from-files", f"--user-data-dir={tmp_path / 'profile'}",
            "--virtual-time-budget=5000", "--dump-dom", (tmp_path / "frame.html").as_uri(),
        ],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    layout = json.loads(re.search(r'<pre id="answer">(.*?)</pre>', finished.stdout)[1])
    assert layout["across"] <= 360
    assert len(layout["boxes"]) > 50
    assert all(left >= 0 and right <= 360 for left, right in layout["boxes"])
    assert min(layout["fonts"]) >= 9
    # All but subscripts.
    assert np.quantile(layout["fonts"], 0.05) >= 11


def test_three_colours_have_swatches():
    result = result_of(scan(channels=("R", "G", "B")))
    page = page_of(report_files([analysis_of(result)], "x", Path("a.html"), [""]))
    (style,) = [named["style"] for _, named in page.tags if "style" in named]
    # 0.3, 0.15 and 0.075 by the sRGB standard: 1.055 x^(1/2.4) − 0.055.
    levels = [round(255 * (1.055 * x ** (1 / 2.4) - 0.055)) for x in (0.3, 0.15, 0.075)]
    assert style == "background: #" + "".join(f"{level:02x}" for level in levels)
    assert "R: 0.300 ± 0.010, G: 0.150 ± 0.010, B: 0.075 ± 0.010" in page.text


def test_many_channels_have_a_table_and_plots_over_the_wavelength():
    names = tuple(f"{wave} nm" for wave in range(400, 700, 25))
    f0 = tuple(np.linspace(0.5, 0.9, 12).tolist())
    metal = fit("ggx", ALPHA, 12, fresnel="metal", f0=f0, n=None, n_error=None)
    result = result_of(scan(channels=names), fits=[metal])
    shown = list(panels(result))
    assert [panel.x_label for panel in shown[-2:]] == ["wavelength λ (nm)"] * 2
    np.testing.assert_allclose(shown[-1].curves[1].y, f0)
    np.testing.assert_array_equal(shown[-2].curves[0].x, np.arange(400, 700, 25))
    np.testing.assert_allclose(shown[-2].curves[0].y, K_D / 2.0 ** np.arange(12))
    page = page_of(report_files([analysis_of(result)], "x", Path("a.html"), [""]))
    assert "12 channels, 400 nm to 675 nm" in page.text
    # A row each, in a table that is folded; a range elsewhere.
    assert re.search(r"400 nm 0\.300 ± 0\.010 0\.5000 ± 0\.0010 425 nm", page.text)
    assert "diffuse albedo 0.000146 to 0.3" in page.text


def test_one_angle():
    beta = np.radians(np.arange(0.0, 80))
    samples = Samples(beta, np.zeros((80, 1)), ("value",), "ndf")
    parts = {"fresnel": None, "n": None, "n_error": None, "f0": None, "f0_error": None,
             "diffuse": None, "diffuse_error": None, "specular": None, "specular_error": None,
             "linear": {"offset": (0.02,), "scale": (3.0,)},
             "linear_errors": {"offset": (0.001,), "scale": (0.05,)}}  # fmt: skip
    fits = [fit("ggx", ALPHA, 1, **parts), fit("beckmann", 0.2, 1, **parts)]
    result = result_of(samples, fits=fits, choices=[])
    page = page_of(report_files([analysis_of(result)], "x", Path("a.html"), [""]))
    assert "offset 0.0200 ± 0.0010" in page.text
    assert "scale 3.00 ± 0.05" in page.text
    assert "F₀" not in page.text
    data, residuals = panels(result)
    assert data.x_label.startswith("β")
    assert data.logarithmic
    wanted = np.log(fits[0].model(samples) / samples.values)[:, 0]
    np.testing.assert_allclose(residuals.curves[0].y, np.clip(wanted, *residuals.y_range))


def test_two_lobes():
    parts = {"name": "ggx+ggx", "label": "two GGX lobes", "second": 0.2, "share": 0.75,
             "errors": {"second": 0.01, "share": 0.02}}  # fmt: skip
    fits = [fit("ggx", 0.014, 1, **parts), fit("ggx", ALPHA, 1)]
    page = page_of(
        report_files([analysis_of(result_of(scan(), fits=fits))], "x", Path("a.html"), [""])
    )
    numbers = "two GGX lobes α = 0.01400 ± 0.00014 (75 %), α = 0.200 ± 0.010 (25 %)"
    assert numbers in page.text


def test_numbers_that_are_not_known():
    """NaN errors, one candidate, no noise, no correlation, no choices."""
    only = fit("gtr", 0.1, 1, gamma=2.5, gamma_error=NAN, parameter_error=NAN, validated_error=NAN,
               validated_spread=NAN, f0_error=(NAN,), diffuse_error=None, n=1.5, n_error=None,
               fresnel="ior:1.5", unknowns=("alpha",), correlation=np.ones((1, 1)))  # fmt: skip
    alone = [
        IncidenceFit(20, 50, NAN, NAN),
        IncidenceFit(45, 50, 0.1, NAN),
        IncidenceFit(70, 50, 0.1, 9.0),
    ]
    result = result_of(scan(), fits=[only], noise=NAN, by_incidence=alone, choices=[])
    analysis = analysis_of(result)
    for suffix in ("html", "md"):
        files = report_files([analysis], "x", Path(f"a.{suffix}"), [""])
        text = files[Path(f"a.{suffix}")].decode()
        text = Page(text).text if suffix == "html" else text
        assert "the only candidate" in text
        assert "nan" not in text
        assert "γ = 2.50" in text
    incidence = list(panels(result))[2]
    assert "1 do not determine it" in incidence.remark
    assert incidence.y_range[1] < 1


@pytest.mark.parametrize(
    ("of_fit", "options", "error", "loss"),
    [
        ("log", {}, "7.0 % 8.0 ± 0.4 %", "differences of logarithms, with Huber"),
        ("linear", {"loss": "linear"}, "0.0700 0.080 ± 0.004", "differences of values, with Huber"),
        (
            "sigma",
            {"noise": 0.02, "robust": False},
            "0.0700 σ 0.080 ± 0.004 σ",
            "standard deviations Solver",
        ),
    ],
)
def test_errors_have_the_unit_of_the_loss(of_fit, options, error, loss):
    fits = [fit(name, ALPHA, 1, loss=of_fit) for name in ("ggx", "beckmann")]
    analysis = analysis_of(result_of(scan(), fits), **options)
    text = page_of(report_files([analysis], "x", Path("a.html"), [""])).text
    assert error in text
    assert loss in text


def test_only_pages_and_markdown_are_reports():
    for name in ("a.html", "a.HTM", "a.md"):
        check_report_name(Path(name))
    with pytest.raises(MdfconvError, match=r"an \.html or a \.md file, not x\.pdf"):
        check_report_name(Path("x.pdf"))


def panel_curves(panel, kind):
    return [curve for curve in panel.curves if curve.kind == kind]


def test_lines_are_those_of_the_recommended_fit():
    fits = [fit("beckmann", 0.5, 1), fit("ggx", ALPHA, 1)]
    result = result_of(scan(step=10), fits=fits, recommended=fits[1])
    panel = next(iter(panels(result)))
    for kind, alpha in (("line", ALPHA), ("dotted", 0.5)):
        for curve, incidence in zip(panel_curves(panel, kind), (20, 45, 70), strict=True):
            turn = np.where(curve.x < 0, 0, 180)
            fine = directions(np.full(curve.x.size, incidence), np.abs(curve.x), turn)
            np.testing.assert_allclose(curve.y, model(alpha, 1)(fine)[:, 0], rtol=1e-9)
            assert np.diff(curve.x).max() <= 0.25 + 1e-9


def test_a_narrow_peak_is_not_clipped():
    narrow = [fit("ggx", 0.001, 1)]
    panel = next(iter(panels(result_of(scan(step=10), fits=narrow))))
    for curve, incidence in zip(panel_curves(panel, "line"), (20, 45, 70), strict=True):
        peak = model(0.001, 1)(directions([incidence], [incidence], [180]))[0, 0]
        assert curve.y.max() >= peak * (1 - 1e-9)
        assert panel.y_range[1] >= curve.y.max()
        assert curve.label == f"{incidence}°"


def test_dots_are_the_data():
    result = result_of(scan())
    data, residuals = list(panels(result))[:2]
    signed = np.arange(-80, 81, 2.0)
    for place in range(3):
        rows = slice(place * signed.size, (place + 1) * signed.size)
        dots = panel_curves(data, "dots")[place]
        np.testing.assert_allclose(dots.x, signed, atol=1e-9)
        np.testing.assert_allclose(dots.y, result.samples.values[rows, 0])
        left = np.log(result.recommended.model(result.samples) / result.samples.values)[rows, 0]
        shown = residuals.curves[place].y
        np.testing.assert_allclose(shown, np.clip(left, *residuals.y_range))
    assert residuals.band == (-2 * NOISE, 2 * NOISE)


def test_outliers_stand_at_the_end_of_the_axis():
    result = result_of(scan())
    result.samples.values[5] *= 1000
    residuals = list(panels(result))[1]
    assert "1 beyond the axis" in residuals.remark
    assert residuals.y_range[1] < 0.2
    lowest = min(curve.y.min() for curve in residuals.curves)
    assert lowest == residuals.y_range[0]


def test_many_incidences_and_samples_are_thinned():
    result = result_of(scan(np.linspace(2, 78, 19), step=0.1))
    data = next(iter(panels(result)))
    lines = panel_curves(data, "line")
    assert len(lines) == COLORS
    assert "8 of 19 angles of incidence" in data.remark
    assert {lines[0].label, lines[-1].label} == {"2°", "78°"}
    assert sum(curve.x.size for curve in panel_curves(data, "dots")) <= 1500
    assert len(drawn(data)) < 60_000


def test_a_hemisphere_has_discs():
    result = result_of(hemisphere())
    (panel,) = [panel for panel in panels(result) if isinstance(panel, DiscPanel)]
    assert [disc.label for disc in panel.discs] == ["θ_i 10°", "θ_i 50°"]
    first = panel.discs[0]
    # The mirror's side is right: φ_o = 180°; θ_o grows outwards.
    right = np.argmax(first.x)
    assert first.x[right] == pytest.approx(80 / 90)
    assert first.y[right] == pytest.approx(0, abs=1e-9)
    assert first.mirror == pytest.approx(10 / 90)
    assert np.hypot(first.x, first.y).max() <= 1
    text = drawn(panel)
    assert text.count("<svg") == 3
    assert sum(len(disc.x) for disc in panel.discs) == text.count("h0")


def test_a_hemisphere_with_light_along_the_normal_has_discs_and_scans():
    """There every plane is that of incidence."""
    axes = np.array([0.0, 30.0]), np.arange(5.0, 81, 5), np.arange(0.0, 360, 15)
    result = result_of(directions(*np.meshgrid(*axes, indexing="ij")))
    data, _, discs = panels(result)
    assert data.x_label.startswith("θ_o")
    assert [disc.label for disc in discs.discs] == ["θ_i 0°", "θ_i 30°"]
    # All around, and not on a line.
    assert np.ptp(discs.discs[0].y) == pytest.approx(2 * 80 / 90)
    line = data.curves[0]
    assert line.x.min() == pytest.approx(-80)


def test_random_directions_are_drawn_over_the_half_vector():
    rng = np.random.default_rng(2)
    theta_i, theta_o = rng.uniform(0, 80, (2, 3000))
    result = result_of(directions(theta_i, theta_o, rng.uniform(0, 360, 3000)))
    data, residuals = list(panels(result))[:2]
    assert data.x_label == residuals.x_label
    assert data.x_label.startswith("β")
    assert sum(curve.x.size for curve in data.curves) <= 1500


def test_labels_do_not_cover_each_other():
    result = result_of(scan((10, 12, 14, 16)))
    text = drawn(next(iter(panels(result))))
    label = r'<text x="([\d.]+)" y="([\d.-]+)" text-anchor="middle" class="label [^"]+">([^<]+)<'
    found = [(float(x), float(y), shown) for x, y, shown in re.findall(label, text)]
    assert len(found) == 4
    for (x, y, shown), (a, b, other) in combinations(found, 2):
        # A letter of a 12-pixel font is at most 8 pixels wide.
        assert abs(x - a) >= 3.5 * (len(shown) + len(other)) or abs(y - b) >= 11


def test_a_drawn_line_keeps_its_shape():
    result = result_of(scan((45,)))
    panel = next(iter(panels(result)))
    (line,) = panel_curves(panel, "line")
    path = re.search(r'class="line c0" d="M([^"]+)"', drawn(panel))[1]
    x, y = np.array([point.split() for point in path.split("L")], float).T
    # Where the frame is: 46 to 350 across, 20 to 220 − 34 down.
    to_x = np.interp(line.x, panel.x_range, (46, 350))
    to_y = np.interp(np.log(line.y), np.log(panel.y_range), (186, 20))
    assert x.size < line.x.size / 3
    # Pixels: the tolerance and the rounding, along a slope of at most 10.
    assert np.abs(np.interp(to_x, x, y) - to_y).max() < 2.5


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6), st.integers(4, 9))
def test_ticks_are_few_round_and_inside(low, width, most):
    # Of nearer ends a float does not tell the steps.
    assume(width > 1e-4 * abs(low))
    high = low + width
    marks = ticks(low, high, most)
    assert 1 <= marks.size <= most
    slack = 1e-9 * max(abs(low), abs(high), width)
    assert marks.min() >= low - slack
    assert marks.max() <= high + slack
    if marks.size > 1:
        step = marks[1] - marks[0]
        mantissa = step / 10 ** np.floor(np.log10(1.0001 * step))
        assert min(abs(mantissa - one) for one in (1, 2, 5)) < 1e-3


@pytest.mark.parametrize(
    ("low", "high", "wanted"),
    [
        (0.03, 30, [0.1, 1, 10]),
        (0.7, 12, [1, 2, 5, 10]),
        (1e-6, 1e6, [1e-6, 1e-4, 1e-2, 1, 100, 1e4, 1e6]),
        (0.15, 1.2, [0.2, 0.5, 1]),
        (3.1, 3.4, [3.1, 3.15, 3.2, 3.25, 3.3, 3.35, 3.4]),
    ],
)
def test_decades(low, high, wanted):
    np.testing.assert_allclose(decades(low, high, 8), wanted)


def test_texts_of_ticks():
    shown = [number(value) for value in (0, -0.0, -20, 0.001, 1e-5, 1e4, 2e-7)]
    assert shown == ["0", "0", "−20", "0.001", "10⁻⁵", "10⁴", "2·10⁻⁷"]


def test_symbols_are_set():
    assert symbols("f_r of θ_i, k_d & C_TR; a_b") == (
        "f<sub>r</sub> of θ<sub>i</sub>, k<sub>d</sub> &amp; C<sub>TR</sub>; a_b"
    )


def test_a_picture_of_an_analysis(tmp_path):
    results = result_of(scan(), incidences=(20, 45)), result_of(hemisphere())
    for place, result in enumerate(results):
        picture = tmp_path / f"{place}.png"
        picture.write_bytes(draw_analysis(analysis_of(result, name="$a_b$ \\x\x1b 涂料")))
        with Image.open(picture) as opened:
            assert opened.size[0] > 1500


def write_scan(path, alpha=ALPHA):
    """Write a scan without masking and Fresnel's factor, as text."""
    samples = scan()
    values = model(alpha, 1)(samples)[:, 0]
    signed = np.tile(np.arange(-80, 81, 2.0), 3)
    rows = zip(np.repeat((20, 45, 70), signed.size // 3), signed, values, strict=True)
    lines = [f"{angle},{other},{value:.9g}" for angle, other, value in rows]
    path.write_text("# Gonio 7\ntheta_i_deg,theta_r_deg,brdf\n" + "\n".join(lines) + "\n")
    return path


OPTIONS = "--to", "ggx", "--masking", "none", "--fresnel", "none"


def test_reports_of_the_command(tmp_path):
    paths = [
        write_scan(tmp_path / f"{name}.csv", alpha) for name, alpha in (("a", 0.1), ("b", 0.3))
    ]
    words = *OPTIONS, "--report", "both.html"
    status, _, err = run("fit", "a.csv", "b.csv", *words, cwd=tmp_path)
    assert status == 0, err
    page = Page((tmp_path / "both.html").read_text())
    data = data_of({"": (tmp_path / "both.html").read_bytes()})
    for path, file, alpha in zip(paths, data["files"], (0.1, 0.3), strict=True):
        assert file["file"] == path.name
        assert file["sha256"] == sha256(path.read_bytes()).hexdigest()
        (result,) = file["results"]
        (row,) = result["fits"]
        assert row["parameter"] == pytest.approx(alpha, rel=1e-4)
        assert row["diffuse"] == pytest.approx([K_D], rel=1e-3)
        assert [one["angle"] for one in result["by_incidence"]] == pytest.approx([20, 45, 70])
        assert result["verdict"]["grade"] == "good"
    assert data["command"].endswith("--report both.html")
    for part in ("2 fits", "Gonio 7", "✓ Good.", "Recommended is ggx: the only candidate."):
        assert part in page.text


def test_a_report_of_standard_input_and_a_picture(tmp_path):
    content = write_scan(tmp_path / "a.csv").read_bytes()
    words = *OPTIONS, "--report", "x.md", "--png", "x.png"
    status, _, err = run("fit", "-", *words, stdin=content, cwd=tmp_path)
    assert status == 0, err
    assert "SHA-256" not in (tmp_path / "x.md").read_text()
    assert {"x.md", "x.png", "x-plots-1.png"} <= {path.name for path in tmp_path.iterdir()}
