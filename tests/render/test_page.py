"""The interactive page: its numbers, and what a browser makes of it."""

import base64
import html
import json
import re
import shutil
import subprocess
from functools import cache

import numpy as np
import pytest

import mdfconv
from mdfconv.distributions import distribution
from mdfconv.distributions.endpoint import endpoint
from mdfconv.fitting.metrics import list_metrics, metric_named
from mdfconv.light.spectrum import LobeSpectrum
from mdfconv.render.comparison import PictureRule, Scene, compare
from mdfconv.render.comparison_figure import BACKGROUND, displayed_pixels
from mdfconv.render.page import comparison_page, filled, page_data
from mdfconv.render.sphere import Frame
from tests.cli.runner import run

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("chrome")
PAIRS = [("beckmann", "ggx"), ("blinn-phong", "ggx:roughness"), ("beckmann", "blinn-phong:fbx")]
LARGEST = 150_000
SIZE = 400
in_browser = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=PAIRS, ids=" to ".join)
def pair(request):
    return request.param


@cache
def built(source, target, start=None):
    return comparison_page(endpoint(source), endpoint(target), start).decode()


@pytest.fixture(scope="module")
def page(pair):
    return built(*pair)


@pytest.fixture(scope="module")
def data(page):
    return json.loads(re.search(r'id="data">(.*?)</script>', page, re.DOTALL)[1])


def unpacked(text, kind):
    return np.frombuffer(base64.b64decode(text), kind)


def logs_of(table, value):
    """Interpolate the converted ln p as the page does."""
    nodes, logs = unpacked(table["nodes"], "<f8"), unpacked(table["parameter"], "<f4")
    return np.interp(np.log(value), nodes, logs)


def random_parameters(end, count=200):
    generator = np.random.default_rng(5)
    return np.exp(generator.uniform(end["low"], end["high"], count))


def test_page_is_small_and_needs_nothing(page):
    assert len(page.encode()) <= LARGEST
    assert not re.search(
        r"https?:|//[a-z]+\.|\bsrc=|\bhref=|@import|url\(|\bfetch\(|import\(", page
    )
    assert "@data@" not in page
    assert "@title@" not in page


def test_page_is_the_same_twice(page, pair):
    assert comparison_page(*map(endpoint, pair)).decode() == page


def test_every_metric_is_interpolated_well(data, pair):
    assert {table["name"] for table in data["metrics"]} == set(list_metrics())
    assert data["interpolation"] < 5e-4
    values = random_parameters(data["source"])
    for table in data["metrics"]:
        expected = mdfconv.convert(values, pair[0], data["target"]["name"], metric=table["name"])
        ours = np.exp(logs_of(table, values))
        np.testing.assert_allclose(ours, expected, rtol=5e-4)


def test_every_form_is_interpolated_well(data):
    logs = np.log(random_parameters(data["target"]))
    for form in data["forms"][1:]:
        nodes = unpacked(form["nodes"], "<f8")
        expected = endpoint(form["name"]).encode(np.exp(logs))
        ours = np.interp(logs, nodes, unpacked(form["values"], "<f4"))
        both = ~(np.isnan(ours) | np.isnan(expected))
        np.testing.assert_allclose(ours[both], expected[both], rtol=5e-4, atol=1e-5)
        # Beside what cannot be stored a step of the table goes with it.
        assert np.count_nonzero(np.isnan(ours) != np.isnan(expected)) <= 1
        assert both.any()


@pytest.mark.parametrize("side", ["source", "target"])
def test_lobes_are_those_of_the_distributions(data, side):
    end, mdf = data[side], distribution(data[side]["name"])
    levels = unpacked(end["lobes"], "<u2").reshape(-1, end["angles"])
    spectrum = unpacked(end["spectrum"], "<f4").reshape(len(levels), -1)
    parameters = np.exp(np.linspace(end["low"], end["high"], len(levels)))
    u = np.linspace(0, 1, end["angles"])[:-1]
    for row in (0, 7, len(levels) - 1):
        alpha = np.exp(end["alpha"][row])
        beta = np.arctan(alpha * u / (1 - u))
        ours = np.exp(
            end["peak"][row]
            + end["least"]
            + (end["most"] - end["least"]) * levels[row][:-1] / 65535
        )
        least = np.exp(end["peak"][row] + end["least"])
        np.testing.assert_allclose(
            ours, mdf.normalized(beta, parameters[row]), rtol=1e-3, atol=1.01 * least
        )
    expected = LobeSpectrum(40)(mdf, parameters[:, None])[:, : spectrum.shape[1]]
    np.testing.assert_allclose(spectrum, expected, rtol=1e-4, atol=1e-6)


HOSTILE = "</script><script>document.title='broken'</script><!--"


def hostile_page():
    data = page_data(endpoint("beckmann"), endpoint("ggx"))
    data["title"] = data["source"]["label"] = data["target"]["label"] = HOSTILE
    data["metrics"][0]["keeps"] = HOSTILE
    data["lights"][0]["label"] = data["forms"][0]["name"] = HOSTILE
    return filled(data).decode(), data


def test_text_is_no_tag():
    page, data = hostile_page()
    assert page.lower().count("<script") == page.lower().count("</script") == 2
    assert html.escape(HOSTILE) in page
    assert json.loads(re.search(r'id="data">(.*?)</script>', page, re.DOTALL)[1]) == data


def opened(tmp_path, page, script, size="1000,1400"):
    """Open a page with a script at its end; return what the script has, and the console."""
    path = tmp_path / "page.html"
    answer = (
        "addEventListener('load', () => document.body.append(Object.assign("
        "document.createElement('pre'), "
        f"{{id: 'answer', textContent: JSON.stringify((() => {{{script}}})())}})));"
    )
    path.write_text(page.replace("</body>", f"<script>{answer}</script></body>"))
    finished = subprocess.run(
        [
            CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr",
            f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={size}",
            "--virtual-time-budget=5000", "--dump-dom", path.as_uri(),
        ],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    console = [line for line in finished.stderr.splitlines() if "CONSOLE" in line]
    text = re.search(r'<pre id="answer">(.*?)</pre>', finished.stdout, re.DOTALL)
    assert text, console
    return json.loads(html.unescape(text[1])), console


MOVE = """
const seen = [];
for (let k = 0; k < 20; k++) {
  byId("slider").value = 50 * k + 13;
  byId("slider").dispatchEvent(new Event("input"));
  for (const table of data.metrics.keys()) {
    byId("metric").selectedIndex = table;
    byId("metric").dispatchEvent(new Event("change"));
    seen.push([byId("command").textContent, byId("number").textContent, byId("value").value]);
  }
}
paint();
return {seen, requests: performance.getEntriesByType("resource").map((entry) => entry.name)};
"""


@pytest.mark.filterwarnings("ignore:.* clamps")
@in_browser
def test_numbers_in_a_browser_are_those_of_the_command(page, pair, tmp_path):
    answer, console = opened(tmp_path, page, MOVE)
    assert console == []
    assert answer["requests"] == []
    assert len(answer["seen"]) == 20 * len(list_metrics())
    for command, shown, value in answer["seen"]:
        program, verb, number, _, source, _, target, _, metric = command.split()
        assert (program, verb, source, target) == ("mdfconv", "convert", *pair)
        assert number == value
        expected = mdfconv.convert(float(number), source, target, metric=metric)
        assert float(shown.split(" = ")[1]) == pytest.approx(expected, rel=1e-3, abs=1e-5)


COPY = """
const copied = [];
const clipboard = {writeText: async (text) => copied.push(text)};
Object.defineProperty(navigator, "clipboard", {value: clipboard});
byId("copy-number").click();
byId("copy-command").click();
return [copied, [state.number, byId("command").textContent]];
"""


@in_browser
def test_buttons_copy_what_they_name(page, tmp_path):
    (copied, shown), console = opened(tmp_path, page, COPY)
    assert copied == shown
    assert console == []


@in_browser
def test_line_of_the_page_is_a_command(tmp_path):
    page = built("blinn-phong", "ggx:roughness", 64.0)
    answer, _ = opened(tmp_path, page, "return [byId('command').textContent, state.number];")
    status, out, _ = run(*answer[0].split()[1:])
    assert status == 0
    assert answer[1] == f"{float(out):.4g}"


def show(light, m_b):
    return f"""
byId("light").selectedIndex = {light};
byId("value").value = {m_b};
byId("value").dispatchEvent(new Event("input"));
paint();
const image = splitContext.getImageData(0, 0, SIZE, SIZE).data;
return Array.from({{length: SIZE * SIZE}}, (_, k) => image[4 * k]);
"""


@in_browser
@pytest.mark.parametrize(
    ("number", "light", "m_b"),
    [(0, "directional", 0.05), (0, "directional", 0.2), (0, "directional", 0.75), (1, "area", 0.3)],
)
def test_halves_are_the_pictures_of_compare(number, light, m_b, tmp_path):
    page = built("beckmann", "ggx")
    ours, _ = opened(tmp_path, page, show(number, m_b))
    ours = np.reshape(ours, (SIZE, SIZE))
    rule = PictureRule("fit", metric_named("environment"))
    pictures = compare(m_b, [rule], Scene(light=light, size=SIZE), targets=["ggx"])
    background = (1 - Frame(SIZE).normals()[1].reshape(SIZE, SIZE)) * BACKGROUND
    source, target = (
        displayed_pixels(rendering.image + background)[..., 0].astype(int)
        for rendering in (pictures.reference, pictures.rows[rule.label][0])
    )
    assert np.ptp(ours) > 200
    half = SIZE // 2
    assert np.abs(ours - source)[:, :half].max() <= 2
    assert np.abs(ours - target[:, ::-1])[:, half:].max() <= 2


@in_browser
def test_environment_is_neither_black_nor_white(tmp_path):
    page = built("beckmann", "ggx")
    levels, console = opened(tmp_path, page, show(2, 0.1))
    assert console == []
    inside = np.array(levels)[Frame(SIZE).normals()[1] == 1]
    assert 20 < inside.mean() < 200
    assert np.ptp(inside) > 80


@in_browser
def test_text_is_shown_as_text(tmp_path):
    page, _ = hostile_page()
    answer, console = opened(
        tmp_path,
        page,
        "return [document.title, byId('title').textContent, byId('metric').options[0].text,"
        "document.scripts.length];",
    )
    assert answer[0] == answer[1] == HOSTILE
    assert answer[2].endswith(HOSTILE)
    assert answer[3] == 3
    assert console == []


@in_browser
def test_phone_shows_no_horizontal_scroll_bar(tmp_path):
    # A window has a least width, a frame has none.
    page = html.escape(built("blinn-phong", "ggx:roughness"))
    frame = f'<body><iframe width="360" height="800" srcdoc="{page}"></iframe></body>'
    script = """
const { contentDocument, contentWindow } = document.querySelector("iframe");
const { documentElement, body } = contentDocument;
return [contentWindow.innerWidth, documentElement.clientWidth,
  Math.max(documentElement.scrollWidth, body.scrollWidth),
  contentDocument.querySelector("canvas").clientWidth];
"""
    (window, inside, widest, canvas), _ = opened(tmp_path, frame, script)
    assert window == 360
    assert widest <= inside
    assert canvas > 250


@in_browser
def test_every_control_has_a_name(tmp_path):
    script = """
const named = (control) => control.labels?.length || control.textContent.trim();
const controls = [...document.querySelectorAll("input, select, button")];
const pictures = [...document.querySelectorAll("canvas, svg")];
return [controls.filter((one) => !named(one)).length, controls.length,
  pictures.every((one) => one.getAttribute("aria-label")), byId("number").ariaLive];
"""
    answer, _ = opened(tmp_path, built("beckmann", "ggx"), script)
    assert answer == [0, 9, True, "polite"]


def test_command_writes_the_page_alone(tmp_path):
    status, _, err = run(
        "compare", "--from", "blinn-phong", "--to", "ggx:roughness", "--html", "page.html",
        cwd=tmp_path,
    )  # fmt: skip
    assert (status, err) == (0, "mdfconv: wrote page.html\n")
    assert [path.name for path in tmp_path.iterdir()] == ["page.html"]
    assert b"ggx in place of blinn-phong" in (tmp_path / "page.html").read_bytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("3", "--html", "page.html"), "from 0.01 to 0.8"),
        (("--from", "ggx:roughness", "2", "--html", "page.html"), "0 < r ≤ 1"),
        (("--to", "gx", "--html", "page.html"), "did you mean ggx"),
        (("--html", "no/folder/page.html"), "not an existing directory"),
    ],
)
def test_command_says_what_is_wrong(options, message, tmp_path):
    status, _, err = run("compare", *options, cwd=tmp_path)
    assert status == 2
    assert message in err
    assert list(tmp_path.iterdir()) == []
