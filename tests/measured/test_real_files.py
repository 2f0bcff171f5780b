"""What files of laboratories have: wrong heads, blind spots, decimal commas, numbers of Windows."""

import json
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdfconv.errors import MdfconvError
from mdfconv.measured import ReadOptions, Samples, directional_samples, fit, read
from mdfconv.measured.readers.tables import Role, number, role_of
from tests.cli.runner import run
from tests.measured.scans import ggx, rows, vector
from tests.measured.test_readers import fred, zemax

ALPHA, DIFFUSE, SPECULAR = 0.2, 0.1, 0.3


def reflectance(theta_i, theta_o, phi_o):
    """k_d/π + k_s D G / (4 cos cos), angles in radians, φ_i = 0."""
    incident, outgoing = vector(theta_i, 0 * theta_i), vector(theta_o, phi_o)
    return DIFFUSE / np.pi + SPECULAR * ggx(incident, outgoing, ALPHA)


def plane(shadow=7):
    """Return degrees of incidence and of a scan in its plane, and values, 0 around the light."""
    incidence, scan = (a.ravel() for a in np.meshgrid((10.0, 40.0), np.arange(-75.0, 76, 3)))
    away = np.where(scan < 0, 0.0, np.pi)
    values = reflectance(np.radians(incidence), np.radians(np.abs(scan)), away)
    return incidence, scan, np.where(np.abs(scan + incidence) < shadow, 0.0, values)


def fitted(path, *arguments):
    """Return the row of GGX with F = 1, and what was said beside it."""
    words = "fit", path, "--to", "ggx", "--fresnel", "none", "--format", "json"
    status, out, err = run(*words, *arguments)
    assert status == 0, err
    return json.loads(out)[0], err


def assert_found(row):
    assert row["parameter"] == pytest.approx(ALPHA, abs=1e-5)
    assert row["diffuse"][0] == pytest.approx(DIFFUSE, abs=1e-5)
    assert row["specular"][0] == pytest.approx(SPECULAR, abs=1e-5)


def test_a_scan_of_measure_angles_without_the_detectors_shadow(tmp_path):
    incidence, scan, values = plane()
    path = tmp_path / "scan.csv"
    head = "Incident_angle,Measure_angle,550nm\n"
    path.write_text(head + rows(incidence, scan, values, digits=".8g"))
    dark = int(np.count_nonzero(values == 0))
    assert dark > 5
    said = f"{dark} of {values.size} samples are exactly 0, as in the shadow of the detector"
    for loss in ("linear", "log", "cosine", "cube-root"):
        row, err = fitted(path, "--loss", loss)
        assert_found(row)
        assert f"note: {said}, and left out" in err


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("Measure_angle", Role.theta_o),
        ("measured angle", Role.theta_o),
        ("Measurement Angle [deg]", Role.theta_o),
        ("Incident_angle", Role.theta_i),
        ("measured brdf", None),
        ("Measure", None),
    ],
)
def test_roles_of_measured_angles(name, role):
    assert role_of(name) == role


def test_zeros_of_one_angle_are_samples_of_a_linear_loss():
    theta = np.radians(np.arange(0.0, 60, 2))
    lobe = np.maximum(1 - theta, 0.5) - 0.5
    slice_ = Samples(theta, lobe[:, None], ("a",), "ndf")
    used = fit(slice_, ["ggx"], loss="linear").samples
    assert len(used.values) == 30
    assert used.notes == ()
    lit = np.count_nonzero(lobe)
    used = fit(slice_, ["ggx"]).samples
    assert len(used.values) == lit
    assert used.notes[0].startswith(f"{30 - lit} of 30 samples are exactly 0")


def test_a_zero_in_one_channel_leaves_out_the_sample():
    incidence, scan, values = plane(shadow=0)
    values = np.stack([values, values], -1)
    values[3, 1] = 0
    zero, theta = np.zeros_like(scan), np.radians(scan)
    data = directional_samples("s", np.radians(incidence), zero, theta, zero + np.pi, values, "ab")
    used = fit(data, ["ggx"]).samples
    assert len(used.values) == len(values) - 1
    assert any(f"1 of {len(values)} samples are exactly 0" in note for note in used.notes)


@pytest.mark.parametrize("alpha", [0.02, 0.05, 0.1])
def test_zeros_of_rounding_may_be_left_out(alpha):
    """Of a surface without a diffuse part, whose values are stored with two decimals."""
    angles = np.meshgrid(np.radians([0.0, 20, 40]), np.radians(np.arange(-75.0, 76)))
    incidence, scan = (angle.ravel() for angle in angles)
    zero, away = np.zeros_like(scan), np.where(scan < 0, 0.0, np.pi)
    lobe = ggx(vector(incidence, zero), vector(np.abs(scan), away), alpha)
    values = np.round(SPECULAR * lobe, 2)[:, None]
    samples = directional_samples("s", incidence, zero, np.abs(scan), away, values, ("a",))
    best = fit(samples, ["ggx"], fresnel="none", loss="linear").results[0].fits[0]
    assert np.count_nonzero(values == 0) > 80
    assert best.parameter == pytest.approx(alpha, rel=2e-3)
    assert best.linear["specular"][0] == pytest.approx(SPECULAR, rel=3e-3)
    assert abs(best.linear["diffuse"][0]) < 0.005


def test_nothing_but_zeros():
    theta = np.radians(np.arange(0.0, 60, 5))
    dark = directional_samples("s", theta, 0 * theta, theta, 0 * theta, 0 * theta[:, None], ("a",))
    with pytest.raises(
        MdfconvError, match="s: no sample is positive in every channel: there is no lobe to fit"
    ):
        fit(dark, ["ggx"], name="s")


def test_negative_values_are_counted(tmp_path):
    incidence, scan, values = plane()
    values[[5, 60, 61]] = -1e-5
    path = tmp_path / "scan.csv"
    path.write_text("theta_i,theta_o,brdf\n" + rows(incidence, scan, values, digits=".8g"))
    lit = np.count_nonzero(values)
    for loss in ("log", "linear"):
        said = f"3 of {values.size} samples are negative and left out"
        assert said in fitted(path, "--loss", loss)[1]
    assert lit < values.size


def test_more_light_than_falls_on_the_surface_is_noted(tmp_path):
    incidence, scan, values = plane(shadow=0)
    path = tmp_path / "scan.csv"
    # It reflects 40 %.
    for scale, is_noted in ((1, False), (2.2, False), (2.8, True)):
        path.write_text("theta_i,theta_o,brdf\n" + rows(incidence, scan, scale * values))
        assert ("more light than falls on it" in fitted(path)[1]) == is_noted


def mini_diff(names="theta_i,phi_i,theta_s,465nm,525nm", separator=","):
    """Return a file whose VARS leave out φ_s, in radians, φ_i = π, as Mini-Diff writes them."""
    angles = np.meshgrid(np.radians([0.0, 20, 40]), np.radians(np.arange(0.0, 76, 5)), (0.0, np.pi))
    theta_i, theta_s, phi_s = (angle.ravel() for angle in angles)
    values = reflectance(theta_i, theta_s, phi_s + np.pi)
    columns = theta_i, 0 * theta_i + np.pi, theta_s, phi_s, values, 0.5 * values
    head = f"SYSTEM_NAME lab\nNUM_POINTS {values.size}\nVARS {names}\n\n"
    return head + rows(*columns, separator=separator)


@pytest.mark.parametrize("separator", [",", " ", "\t"])
@pytest.mark.parametrize(
    "names", ["theta_i,phi_i,theta_s,465nm,525nm", "theta_i phi_i theta_s R G"]
)
def test_astm_that_leaves_out_an_azimuth(tmp_path, names, separator):
    path = tmp_path / "paint.astm"
    path.write_text(mini_diff(names, separator))
    row, err = fitted(path)
    assert_found(row)
    assert len(row["diffuse"]) == 2
    said = "VARS names 5 of 6 columns: column 4 is taken for the azimuth of the outgoing direction"
    assert f"note: {said}" in err


def test_the_angle_that_is_left_out_has_its_place(tmp_path):
    for names, role in (("theta_i,theta_s,phi_s,a,b", "phi_i"), ("phi_i,theta_s,phi_s,a,b", None)):
        path = tmp_path / "paint.astm"
        path.write_text(mini_diff(names))
        notes = read(path).notes
        place = 2 if role else 1
        assert any(f"VARS names 5 of 6 columns: column {place} is taken" in note for note in notes)


@pytest.mark.parametrize(
    "names",
    [
        "theta_i,phi_i,theta_s,a",
        "a,theta_i,phi_i,theta_s,b",
        "theta_s,phi_i,theta_i,a,b",
        "a,b,c,d,e",
    ],
)
def test_names_that_leave_it_open_are_refused_and_numbers_win(tmp_path, names):
    path = tmp_path / "paint.astm"
    path.write_text(mini_diff(names))
    count = names.count(",") + 1
    said = f"line 3: names {count} columns where 6 are; choose them by number"
    with pytest.raises(MdfconvError, match=said):
        read(path)
    with pytest.raises(MdfconvError, match=said):
        read(path, ReadOptions(theta_i="theta_i", theta_o="3"))
    numbers = ["--theta-i", "1", "--phi-i", "2", "--theta-o", "3", "--phi-o", "4", "--values", "5"]
    row, err = fitted(path, *numbers)
    assert_found(row)
    assert "the names in line 3 are not those of 6 columns: not used" in err


def test_numbers_win_in_a_table_too(tmp_path):
    incidence, scan, values = plane()
    path = tmp_path / "scan.txt"
    path.write_text("my scan of 2024\n" + rows(incidence, scan, values))
    with pytest.raises(MdfconvError, match="choose them by number; comments start with"):
        read(path)
    assert_found(fitted(path, "--theta-i", "1", "--theta-o", "2")[0])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1.#INF00", np.inf), ("-1.#INF", -np.inf), ("+1.#inf000", np.inf), ("1.#QNAN0", np.nan),
        ("-1.#IND00", np.nan), ("1.#SNAN", np.nan), ("1.5e-3", 0.0015), ("nan", np.nan),
    ],
)  # fmt: skip
def test_numbers_of_windows(text, value):
    np.testing.assert_equal(number(text), value)


@pytest.mark.parametrize("text", ["1.#", "1.#INFO", "2.#INF00", "1#INF", "#INF", "1.#INF00x", ""])
def test_what_is_no_number(text):
    with pytest.raises(ValueError, match="could not convert"):
        number(text)


@given(st.floats())
def test_every_number_is_read_as_python_reads_it(value):
    np.testing.assert_equal(number(repr(value)), value)


@pytest.mark.parametrize("separator", [",", ";", " "])
def test_rows_of_such_numbers_are_left_out(tmp_path, separator):
    incidence, scan, values = plane()
    lines = rows(incidence, scan, values, separator=separator).splitlines()
    for place, text in ((4, "1.#INF00"), (9, "-1.#IND00"), (70, "1.#QNAN0")):
        lines[place] = separator.join([*lines[place].split(separator)[:2], text])
    path = tmp_path / "scan.csv"
    path.write_text(separator.join(["theta_i", "theta_o", "brdf"]) + "\n" + "\n".join(lines))
    row, err = fitted(path)
    assert_found(row)
    assert f"3 of {values.size} samples are not finite and left out" in err


def test_such_numbers_in_other_forms(tmp_path):
    path = tmp_path / "a.bsdf"
    for content, place in ((fred(), 20), (zemax(), 3)):
        word = re.findall(r"[\d.]{8,}e?[-+\d]*", content)[place]
        path.write_text(content.replace(word, "1.#QNAN0"))
        assert any("not finite and left out" in note for note in read(path).notes)


def comma(content):
    return re.sub(r"(?<=\d)\.(?=\d)", ",", content)


@pytest.mark.parametrize("separator", [";", "\t", " "])
def test_decimal_commas(tmp_path, separator):
    incidence, scan, values = plane()
    path = tmp_path / "scan.csv"
    head = separator.join(["theta_i", "theta_o", "brdf"]) + "\n"
    path.write_text(head + comma(rows(incidence, scan, values, separator=separator)))
    row, err = fitted(path)
    assert_found(row)
    assert "commas are read as decimal points" in err


def test_decimal_commas_in_comments(tmp_path):
    """The angle of incidence of 22.5° is not 22°."""
    scan = np.arange(-70.0, 71, 2.5)
    away = np.where(scan < 0, 0.0, np.pi)
    values = reflectance(np.radians(22.5) + 0 * scan, np.radians(np.abs(scan)), away)
    path = tmp_path / "scan.csv"
    lines = rows(scan, values, separator=";")
    path.write_text("# AOI = 22,5 deg\ntheta_o;brdf\n" + comma(lines))
    row, err = fitted(path)
    assert_found(row)
    assert "the angle of incidence, 22.5 degrees, is from the comment" in err
    # With decimal points a comma separates: of which angle the values are is not said.
    path.write_text("# AOI = 22,45 deg\ntheta_o;brdf\n" + lines)
    with pytest.raises(MdfconvError, match="the incident one is missing; give the angle"):
        read(path)


def test_a_decimal_comma_of_zemax_is_named(tmp_path):
    path = tmp_path / "a.bsdf"
    path.write_text(comma(zemax()))
    with pytest.raises(MdfconvError, match="is no number; its decimal comma has to be a point"):
        read(path)
