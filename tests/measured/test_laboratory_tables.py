"""How laboratories write tables: one incidence, uncertainties, wavelengths, factors, many rows."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdfconv.errors import MdfconvError
from mdfconv.measured import ReadOptions, Samples, directional_samples, read
from mdfconv.measured.readers.tables import Role, TableForm, parse_table, role_of
from mdfconv.measured.samples import MOST_ABOUT, about_of, wavelengths_of
from mdfconv.measured.samples import samples as one_angle_samples
from tests.cli.runner import run
from tests.measured.scans import ggx, rows, tensor_bytes, vector
from tests.measured.test_readers import alta, fred, zemax

INCIDENCE = 45.0
SCAN = np.arange(-80.0, 81, 1)
INCIDENT = np.tile(vector(np.radians(INCIDENCE), np.pi), (SCAN.size, 1))
OUTGOING = vector(np.radians(SCAN), 0 * SCAN)
VALUES = ggx(INCIDENT, OUTGOING, 0.1)
TWO = np.column_stack([np.full(SCAN.size, INCIDENCE), SCAN])


def write(tmp_path, text, name="scan.csv"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def assert_scan(samples, values=VALUES, *, some=slice(None)):
    """The angles between the directions and from the normal are those of the scan."""
    incident, outgoing = INCIDENT[some], OUTGOING[some]
    np.testing.assert_allclose(samples.incident[:, 2], incident[:, 2], atol=1e-12)
    np.testing.assert_allclose(samples.outgoing[:, 2], outgoing[:, 2], atol=1e-12)
    between = np.sum(incident * outgoing, axis=1)
    np.testing.assert_allclose(np.sum(samples.incident * samples.outgoing, axis=1), between)
    np.testing.assert_allclose(samples.values[:, 0], np.asarray(values)[some])


POSITIVE = slice(80, None)


@pytest.mark.parametrize(
    ("header", "options", "some"),
    [
        ("theta_r_deg,brdf", {}, slice(None)),
        ("theta_r_deg,brdf", {}, POSITIVE),
        ("angle,brdf", {}, POSITIVE),
        ("angle,brdf", {}, slice(None)),
        ("", {}, slice(None)),
        ("a,brdf", {"angle": "1"}, slice(None)),
        ("angle,brdf", {"angle_is": "reflected"}, slice(None)),
        ("detector angle,brdf", {"theta_o": "1"}, slice(None)),
        ("beta,brdf", {"angle_is": "reflected"}, slice(None)),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_scan_at_one_incidence(tmp_path, header, options, some, sign):
    if sign < 0 and some is POSITIVE:
        return
    path = write(tmp_path, f"{header}\n{rows(sign * SCAN[some], VALUES[some])}")
    assert_scan(read(path, ReadOptions(incidence=INCIDENCE, **options)), some=some)


def test_the_incidence_of_a_comment(tmp_path):
    text = f"# Al, 633 nm, theta_i = 45 deg\ntheta_r_deg,brdf\n{rows(SCAN, VALUES)}"
    path = write(tmp_path, text)
    assert_scan(read(path))
    assert_scan(read(path, ReadOptions(angle_is="reflected")))
    other = read(path, ReadOptions(incidence=30))
    np.testing.assert_allclose(other.incident[:, 2], np.cos(np.radians(30)))


def test_the_light_that_moves(tmp_path):
    path = write(tmp_path, f"theta_i,brdf\n{rows(SCAN, VALUES)}")
    samples = read(path, ReadOptions(angle_is="incident", incidence=INCIDENCE))
    np.testing.assert_allclose(samples.outgoing[:, 2], INCIDENT[:, 2])
    np.testing.assert_allclose(samples.incident[:, 2], OUTGOING[:, 2], atol=1e-12)
    np.testing.assert_allclose(samples.half[:, 2], (INCIDENT + OUTGOING)[:, 2] / np.linalg.norm(
        INCIDENT + OUTGOING, axis=1))  # fmt: skip


@pytest.mark.parametrize(
    ("name", "sign", "options"),
    [
        ("theta_specular [deg]", 1, {}),
        ("theta_s - theta_i", 1, {}),
        ("angle from specular", 1, {}),
        ("offset", 1, {}),
        ("theta_i-theta_r", -1, {}),
        ("aspecular angle", -1, {}),
        ("a", 1, {"angle_is": "specular"}),
    ],
)
def test_scans_about_the_mirror_direction(tmp_path, name, sign, options):
    from_mirror = sign * (SCAN - INCIDENCE)
    path = write(tmp_path, f"{name},brdf\n{rows(from_mirror, VALUES)}")
    samples = read(path, ReadOptions(incidence=INCIDENCE, **options))
    assert_scan(samples)
    where = "horizon" if sign > 0 else "normal"
    assert any(f"mirror direction, positive towards the {where}" in n for n in samples.notes)
    both = write(tmp_path, f"theta_i,{name},brdf\n{rows(TWO[:, 0], from_mirror, VALUES)}")
    assert_scan(read(both, ReadOptions(**options, angle="2" if options else None)))


def test_an_angle_from_the_mirror_direction_beside_the_outgoing_one(tmp_path):
    text = f"theta_i,theta_r,offset,signal\n{rows(TWO, SCAN - INCIDENCE, VALUES)}"
    samples = read(write(tmp_path, text))
    assert_scan(samples)
    assert samples.channels == ("signal",)
    assert any("not read: column 'offset'" in note for note in samples.notes)


def test_a_narrow_scan_of_degrees_is_not_read_as_radians(tmp_path):
    path = write(tmp_path, "offset,brdf\n" + rows(np.linspace(-1, 1, 21), np.ones(21)))
    with pytest.raises(MdfconvError, match="does not say whether it holds degrees") as caught:
        read(path, ReadOptions(incidence=5))
    assert caught.value.argument == "angle_unit"


ONE = f"angle,brdf\n{rows(SCAN[80:], VALUES[80:])}"
BOTH = f"theta_i,theta_r,brdf\n{rows(TWO, VALUES)}"
FALLING = "{},brdf\n" + rows(SCAN[80:], np.exp(-SCAN[80:] / 10))
REFLECTED = f"theta_r,brdf\n{rows(SCAN, VALUES)}"


@pytest.mark.parametrize(
    ("text", "options", "words", "argument"),
    [
        (REFLECTED, {}, "is the zenith of the outgoing direction, and the incident one is missing; "
         "give the angle of incidence", "incidence"),
        ("offset" + REFLECTED[7:], {}, "from the mirror direction, and the inc", "incidence"),
        (ONE, {}, "no lobe to fit about 0, the values peak at 4[4-9] degrees; if these are "
         "detector angles give the angle of incidence", "incidence"),
        ("angle" + REFLECTED[7:], {}, "degrees -80 is outside 0 to 90.*if these are detector",
         "incidence"),
        (REFLECTED, {"theta_i": "45"}, "no column '45'; there are theta_r, brdf; an angle of "
         "incidence is given by itself", "incidence"),
        (FALLING.format("angle"), {"theta_i": "1"}, "no column of the zenith of both", ""),
        (FALLING.format("angle"), {"phi_o": "1"}, "no column of the zenith of both", ""),
        (FALLING.format("angle"), {"phi_o": "1", "angle_is": "half"}, "of one angle and of two",
         ""),
        (FALLING.format("angle"), {"theta_i": "1", "angle": "1"}, "of one angle and of two", ""),
        (BOTH, {"incidence": 45}, "column 'theta_i' has the angle of incidence", ""),
        (FALLING.format("aoi"), {"incidence": 45}, "column 'aoi' has the angle of incidence", ""),
        (FALLING.format("aoi"), {}, "no column of the zenith of both directions", ""),
        (FALLING.format("theta_h"), {"incidence": 45}, "holds the angle of the half vector", ""),
        (ONE, {"incidence": 45, "angle_is": "half"}, "holds the angle of the half vector", ""),
        (REFLECTED, {"incidence": 90}, "an angle of incidence of 90°", ""),
        (REFLECTED, {"incidence": float("nan")}, "an angle of incidence of nan°", ""),
        (REFLECTED, {"incidence": 45, "unit": "cosine", "angle_is": "specular"}, "in cosines", ""),
        (FALLING.format("angle"), {"wavelength": 500}, "no column of wavelengths", "values"),
        (BOTH, {"uncertainty": ("u",)}, "no column 'u'", ""),
        (BOTH, {"values_are": "percent"}, "unknown kind of values", ""),
        (f"phi_o,offset,brdf\n{rows(0 * SCAN, SCAN, VALUES)}", {"incidence": 30},
         "there are azimuths", ""),
    ],
)  # fmt: skip
def test_what_is_open_or_without_effect_is_refused(tmp_path, text, options, words, argument):
    with pytest.raises(MdfconvError, match=words) as caught:
        read(write(tmp_path, text), ReadOptions(**options))
    assert caught.value.argument == argument


def test_files_without_columns_take_no_incidence(tmp_path):
    for content in (zemax(), fred(), alta("CARTESIAN", np.ones((3, 6)), np.ones(3))):
        for options in ({"incidence": 3}, {"wavelength": 3}, {"uncertainty": ("1",)}):
            with pytest.raises(MdfconvError, match="choose no columns and no unit or angle"):
                read(write(tmp_path, content), ReadOptions(**options))


def test_a_bare_angle_is_that_of_the_half_vector_if_values_fall_off(tmp_path):
    path = write(tmp_path, FALLING.format("angle"))
    assert isinstance(read(path), Samples)
    half = read(write(tmp_path, ONE), ReadOptions(angle_is="half"))
    np.testing.assert_allclose(half.beta, np.radians(SCAN[80:]))
    assert len(set(half.notes)) == len(half.notes)
    # An outlier is no lobe, and so is what begins at its peak.
    values = np.exp(-SCAN[80:] / 10)
    values[[40, 60]] = 5
    assert isinstance(read(write(tmp_path, f"angle,v\n{rows(SCAN[80:], values)}")), Samples)
    assert isinstance(read(write(tmp_path, f"angle,v\n{rows(SCAN[90:], values[10:])}")), Samples)


@pytest.mark.parametrize("way", [["--incidence", "45"], ["--incidence=45", "--angle-is=reflected"]])
@pytest.mark.parametrize("header", ["theta_r_deg,brdf", "angle,brdf"])
def test_on_the_command_line(tmp_path, header, way):
    path = write(tmp_path, f"{header}\n{rows(SCAN, VALUES)}")
    status, _, err = run("fit", path, "--to", "ggx")
    assert status == 2
    assert "give the angle of incidence (--incidence)" in err
    assert err.count("\n") == 1
    words = "--to", "ggx", "--fresnel", "none", "--format", "json"
    status, out, err = run("fit", path, *words, *way)
    assert status == 0, err
    assert json.loads(out)[0]["parameter"] == pytest.approx(0.1, rel=1e-4)
    status, out, err = run("inspect", path)
    assert f"fit {path} --incidence DEG" in " ".join(out.split()).replace("\\ ", "")


def test_numbers_win_over_names_of_other_columns(tmp_path):
    """The names have as many columns, all of them wrong; phi_o is a zenith."""
    angles = np.column_stack([TWO[:, 0], 0 * SCAN + 180, np.abs(SCAN), 0 * SCAN + 180 * (SCAN < 0)])
    path = write(tmp_path, f"value,theta_o,theta_o,phi_i,phi_o\n{rows(angles, VALUES)}")
    numbers = ReadOptions(theta_i="1", phi_i="2", theta_o="3", phi_o="4", values=("5",))
    samples = read(path, numbers)
    assert samples.channels == ("phi_o",)
    assert_scan(samples)
    # Zeniths of 0, seen across azimuths: by names these would be exchanged.
    flat = write(tmp_path, "a,b,c,d,e\n" + rows(0 * SCAN, 0 * SCAN, 0 * SCAN, SCAN, VALUES))
    np.testing.assert_array_equal(read(flat, numbers).outgoing[:, 2], 1)


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("Incidence angle [deg]", Role.theta_i),
        ("Angle_in", Role.theta_i),
        ("Laser angle", Role.theta_i),
        ("Detector angle (deg)", Role.theta_o),
        ("camera_angle", Role.theta_o),
        ("ReflectedAngle", Role.theta_o),
        ("specular reflectance", None),
        ("u_theta_i", None),
        ("phi_o - phi_i", Role.phi),
    ],
)
def test_roles(name, role):
    assert role_of(name) == role


# Uncertainties


@pytest.mark.parametrize(
    "name",
    ["u", "u_brdf", "u(brdf)", "sigma", "std", "stdev", "Uncertainty", "brdf error", "std_dev",
     "standard uncertainty of f_r [1/sr]"],
)  # fmt: skip
def test_a_column_of_uncertainties(tmp_path, name):
    text = f"theta_i,theta_r,brdf,{name}\n{rows(TWO, VALUES, VALUES / 50)}"
    samples = read(write(tmp_path, text))
    np.testing.assert_allclose(samples.uncertainty, samples.values / 50)
    assert samples.channels == ("brdf",)
    assert f"column '{name}' read as the standard uncertainty" in samples.notes
    assert not any("not read" in note for note in samples.notes)
    some = samples.select(samples.values[:, 0] > 0.1)
    np.testing.assert_allclose(some.uncertainty, some.values / 50)


@pytest.mark.parametrize(
    ("names", "options", "factors"),
    [
        ("R,G,u_R,u_G", {}, (3, 4)),
        ("R,G,u_G,u_R", {}, (4, 3)),
        ("R,G,G_std,R_std", {}, (4, 3)),
        ("R,G,std,std", {}, (3, 4)),
        ("465nm,525nm,u(465nm),u(525nm)", {}, (3, 4)),
        ("R,G,sigma,t", {}, (3, 3)),
        ("R,G,a,b", {"uncertainty": ("b",)}, (4, 4)),
        ("R,G,a,b", {"uncertainty": ("6", "5")}, (4, 3)),
        ("a,b,c,d", {"values": ("3", "4"), "uncertainty": ("6",)}, (4, 4)),
        ("R,G,u_B,u_X", {}, None),
        ("R,G,B,u", {"values": ("R", "G"), "uncertainty": ("B", "B")}, (3, 3)),
    ],
)
def test_uncertainties_of_channels(tmp_path, names, options, factors):
    text = f"theta_i,theta_r,{names}\n{rows(TWO, VALUES, 2 * VALUES, 3 * VALUES, 4 * VALUES)}"
    samples = read(write(tmp_path, text), ReadOptions(**options))
    assert samples.values.shape == (SCAN.size, 2)
    if factors is None:
        assert samples.uncertainty is None
        assert any("not read: columns 'u_B', 'u_X'" in note for note in samples.notes)
    else:
        np.testing.assert_allclose(samples.uncertainty, np.outer(VALUES, factors))


@pytest.mark.parametrize(
    ("name", "factor", "words"),
    [
        ("u [%]", 0.01, "relative standard uncertainty, times 0.01"),
        ("rel. uncertainty", 1, "relative standard uncertainty"),
        ("U(brdf) % (k=2)", 0.005, "relative standard uncertainty, times 0.005"),
    ],
)
def test_relative_uncertainties(tmp_path, name, factor, words):
    text = f"theta_i,theta_r,brdf,{name}\n{rows(TWO, -VALUES, np.full(SCAN.size, 3))}"
    samples = read(write(tmp_path, text))
    np.testing.assert_allclose(samples.uncertainty[:, 0], 3 * factor * VALUES)
    assert any(note.endswith(words) for note in samples.notes)


def test_expanded_uncertainties(tmp_path):
    text = f"theta_i,theta_r,brdf,U (k = 2)\n{rows(TWO, VALUES, VALUES)}"
    np.testing.assert_allclose(read(write(tmp_path, text)).uncertainty[:, 0], VALUES / 2)


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_rows_without_a_positive_uncertainty(tmp_path, bad):
    sigma = VALUES / 10
    sigma[[3, 90]] = bad
    text = f"theta_i,theta_r,brdf,u\n{rows(TWO, VALUES, sigma)}"
    samples = read(write(tmp_path, text))
    keep = np.setdiff1d(np.arange(SCAN.size), [3, 90])
    assert_scan(samples, some=keep)
    np.testing.assert_allclose(samples.uncertainty[:, 0], VALUES[keep] / 10)
    said = f"2 of {SCAN.size} samples have no positive uncertainty and are left out"
    assert said in samples.notes
    text = f"theta_i,theta_r,brdf,u\n{rows(TWO, VALUES, np.full(SCAN.size, bad))}"
    samples = read(write(tmp_path, text))
    assert samples.uncertainty is None
    assert "no uncertainty is a positive number: they are not used" in samples.notes
    assert_scan(samples)


def test_uncertainties_of_one_angle_go_with_their_rows(tmp_path):
    beta = np.array([30.0, 10, 20, 0, 40])
    path = write(tmp_path, f"theta_h,D,sigma\n{rows(beta, 9 - beta / 10, beta + 1)}")
    samples = read(path)
    np.testing.assert_allclose(samples.beta, np.radians(np.sort(beta)))
    np.testing.assert_allclose(samples.uncertainty[:, 0], np.sort(beta) + 1)
    np.testing.assert_allclose(samples.select([2, 0]).uncertainty[:, 0], [21, 1])
    assert one_angle_samples(
        path, beta, "degrees", beta[:, None], ("a",), "ndf"
    ).select([1]).uncertainty is None  # fmt: skip


def test_uncertainties_have_the_shape_of_the_values():
    zero = np.zeros(9)
    with pytest.raises(MdfconvError, match="uncertainties of shape"):
        directional_samples(
            "a", zero, zero, zero, zero, np.ones((9, 2)), ("a", "b"), uncertainty=np.ones((9, 1))
        )


# Wavelengths


def spectral(order=None, shift=0.0, header="wavelength_nm,theta_i,theta_r,brdf,u", scale=1.0):
    """Return a row for each wavelength, the values those of the scan, twice and thrice."""
    wavelengths = np.repeat([450.0, 550, 650], SCAN.size)
    angles = np.tile(TWO, (3, 1)) + np.outer(wavelengths == 650, [0, shift])
    values = np.concatenate([VALUES, 2 * VALUES, 3 * VALUES])
    table = np.column_stack([wavelengths * scale, angles, values, values / 10])
    return f"{header}\n{rows(table[order] if order is not None else table)}"


@pytest.mark.parametrize("seed", [None, 1, 2])
def test_a_row_a_wavelength_is_a_channel_each(tmp_path, seed):
    order = None if seed is None else np.random.default_rng(seed).permutation(3 * SCAN.size)
    samples = read(write(tmp_path, spectral(order)))
    assert samples.channels == ("450 nm", "550 nm", "650 nm")
    assert "3 wavelengths, 450 to 650 nm, a channel each" in samples.notes
    np.testing.assert_allclose(samples.values, np.outer(samples.values[:, 0], [1, 2, 3]))
    np.testing.assert_allclose(samples.uncertainty, samples.values / 10)
    angle = np.sign(samples.outgoing[:, 0]) * np.arccos(samples.outgoing[:, 2])
    again = np.argsort(angle)
    assert_scan(samples.select(again if samples.incident[0, 0] < 0 else again[::-1]))
    wide = f"theta_i,theta_r,450nm,550nm,650nm\n{rows(TWO, *(k * VALUES for k in (1, 2, 3)))}"
    np.testing.assert_allclose(
        np.sort(read(write(tmp_path, wide)).values, axis=0), np.sort(samples.values, axis=0)
    )


@pytest.mark.parametrize("header", ["lambda_um", "wavelength [µm]", "wl"])
def test_micrometres(tmp_path, header):
    text = spectral(header=f"{header},theta_i,theta_r,brdf,u", scale=1e-3)
    channels = read(write(tmp_path, text)).channels
    np.testing.assert_allclose(wavelengths_of(channels), [450, 550, 650])


def test_one_wavelength_of_several(tmp_path):
    path = write(tmp_path, spectral(shift=0.5))
    with pytest.raises(MdfconvError, match="the 3 wavelengths do not have the same dir") as caught:
        read(path)
    assert caught.value.argument == "wavelength"
    samples = read(path, ReadOptions(wavelength=550))
    assert samples.channels == ("550 nm",)
    assert_scan(samples, 2 * VALUES)
    np.testing.assert_allclose(samples.uncertainty, samples.values / 10)
    with pytest.raises(MdfconvError, match="no row of 500 nm; there are 450, 550, 650"):
        read(path, ReadOptions(wavelength=500))
    short = write(tmp_path, spectral().rsplit("\n", 1)[0])
    with pytest.raises(MdfconvError, match=f"450 nm has {SCAN.size} rows, 650 nm {SCAN.size - 1}"):
        read(short)


def test_several_values_of_each_wavelength(tmp_path):
    table = np.column_stack([np.repeat([450, 550], 5), np.tile(np.arange(5) * 10, 2),
                             np.arange(10, 0, -1), np.arange(20, 10, -1)])  # fmt: skip
    samples = read(write(tmp_path, "wavelength,theta_h,s,p\n" + rows(table)))
    assert samples.channels == ("s 450 nm", "p 450 nm", "s 550 nm", "p 550 nm")
    np.testing.assert_array_equal(samples.values[0], [10, 20, 5, 15])


def test_rows_without_a_wavelength_are_left_out(tmp_path):
    text = spectral(header="lambda,theta_i,theta_r,brdf,u") + "\nnan,45,10,3,1\n450,45,nan,3,1"
    samples = read(write(tmp_path, text))
    assert any("2 of 485 rows have no angle or wavelength" in note for note in samples.notes)
    assert_scan(samples)


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["465nm", "525 nm", "R_630", "brdf (0.7 µm)", "10600 nm"], [465, 525, 630, 700, 10600]),
        (["450", "550.5"], [450, 550.5]),
        (["465nm", "R"], None),
        (["1", "2"], None),
        (["value"], None),
        ([], None),
    ],
)
def test_wavelengths_of_channels(names, expected):
    found = wavelengths_of(names)
    if expected is None:
        assert found is None
    else:
        np.testing.assert_allclose(found, expected)


# What a file says of itself, and reflectance factors


def test_what_files_say_of_themselves(tmp_path):
    names = "# theta_i theta_r brdf\n"
    text = f"# Sample: paint 7\n# ====\n%  633 nm\n{names}{rows(TWO, VALUES, separator=' ')}"
    assert read(write(tmp_path, text)).about == ("Sample: paint 7", "633 nm")
    astm = "LAB_NAME Some lab\nNUM_POINTS {}\n\nSYSTEM_NAME disc\nVARS theta_i,theta_s,525nm\n{}"
    text = astm.format(SCAN.size, rows(TWO, VALUES))
    assert read(write(tmp_path, text)).about == ("LAB_NAME Some lab", "SYSTEM_NAME disc")
    assert read(write(tmp_path, "# [BEGIN] X\n# Lamp: 650 nm\n" + zemax())).about == (
        "Lamp: 650 nm",
        "a comment",
    )
    assert read(write(tmp_path, "! Lamp: 650 nm\n" + fred())).about == ("Lamp: 650 nm",)
    content = alta("COS_TH", np.cos(np.arange(5.0) / 5)[:, None], np.arange(5.0))
    assert read(write(tmp_path, b"#by hand\n" + content)).about == ("by hand",)
    fields = {"description": np.frombuffer(b"brushed\nsteel", "u1"), "ndf": np.ones((3, 4), "<f4")}
    assert read(write(tmp_path, tensor_bytes(fields))).about == ("brushed", "steel")


@given(st.lists(st.text(max_size=300), max_size=20))
def test_what_is_said_is_short_and_printable(lines):
    about = about_of(lines)
    assert len(about) <= MOST_ABOUT
    assert all(0 < len(line) <= 120 and line.isprintable() for line in about)


@pytest.mark.parametrize("header", ["theta_i,theta_r,brdf,u", "theta_h,x,D,u"])
def test_reflectance_factors(tmp_path, header):
    falling = 9 - np.abs(SCAN) / 10
    first = np.abs(SCAN) if "theta_h" in header else TWO[:, 0]
    path = write(tmp_path, f"{header}\n{rows(first, SCAN, falling, falling / 10)}")
    plain, divided = read(path), read(path, ReadOptions(values_are="factor"))
    np.testing.assert_allclose(divided.values * np.pi, plain.values)
    np.testing.assert_allclose(divided.uncertainty * np.pi, plain.uncertainty)
    assert divided.notes[-1] == "the values are reflectance factors, π f_r, and divided by π"
    np.testing.assert_array_equal(read(path, ReadOptions(values_are="brdf")).values, plain.values)


def test_reflectance_factors_of_other_formats(tmp_path):
    path = write(tmp_path, zemax())
    divided = read(path, ReadOptions(values_are="factor"))
    np.testing.assert_allclose(divided.values * np.pi, read(path).values)
    path = write(tmp_path, tensor_bytes({"ndf": np.ones((3, 4), "<f4")}))
    with pytest.raises(MdfconvError, match="a distribution of normals, not reflectance"):
        read(path, ReadOptions(values_are="factor"))


# Many rows


MANY = np.random.default_rng(5).normal(size=(9000, 3)) * 10.0 ** np.arange(-200, 250, 200)
LINES = [",".join(map(repr, row)) for row in MANY.tolist()]


def table_of(lines):
    return parse_table("a.csv", ["a,b,c", *lines])


@pytest.mark.parametrize("separator", [",", ";", "\t", " ", " , "])
@pytest.mark.parametrize("comma", [False, True])
def test_many_rows_are_read_as_python_reads_them(separator, comma):
    if comma and "," in separator:
        return
    lines = [line.replace(",", separator) for line in LINES]
    if comma:
        lines = [line.replace(".", ",") for line in lines]
    table = parse_table("a.csv", [separator.join("abc"), *lines])
    np.testing.assert_array_equal(table.numbers, MANY)
    assert table.names == ["a", "b", "c"]


@pytest.mark.parametrize(
    ("line", "row"),
    [
        ("1,,3", [1, np.nan, 3]),
        ("nan,-inf,INF", [np.nan, -np.inf, np.inf]),
        ("1.#QNAN0,2,3", [np.nan, 2, 3]),
        ("\"1\",'2',3", [1, 2, 3]),
        ("  1 , 2,\t3  ", [1, 2, 3]),
        ("1_0,2,3", [10, 2, 3]),
        ("# a comment,2,3", None),
        ("   ", None),
        ("", None),
    ],
)
@pytest.mark.parametrize("place", [0, 1, 4095, 4096, 4097, 8999, 9000])
def test_a_line_that_is_not_plain(place, line, row):
    table = table_of([*LINES[:place], line, *LINES[place:]])
    expected = MANY if row is None else np.insert(MANY, place, row, axis=0)
    np.testing.assert_array_equal(table.numbers, expected)
    assert table.comments == (["a comment,2,3"] if line.startswith("#") else [])


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("1,2", "2 columns where 3 go"),
        ("1,2,3,4", "4 columns where 3 go"),
        ("1,x,3", "not numbers: 1,x,3"),
        ("1 2 3", "not numbers"),
        ("1,2-3,4", "not numbers"),
        ("1,+-2,4", "not numbers"),
        ("1,0x10,4", "not numbers"),
        ("e,a,i", "not numbers"),
    ],
)
@pytest.mark.parametrize("place", [1, 5000, 9000])
def test_a_bad_line_among_many_is_named(place, line, words):
    with pytest.raises(MdfconvError, match=rf"^a\.csv, line {place + 2}: {words}"):
        table_of([*LINES[:place], line, *LINES[place:]])


CELLS = st.one_of(
    st.floats().map(repr),
    st.integers().map(str),
    st.sampled_from(["", "nan", "-inf", "1e5", ".5", "5.", "+1", " 2 ", "1e400", "naif", "e", "-"]),
    st.text(alphabet="0123456789+-.eEnaif \t", max_size=5),
)


@given(
    st.lists(st.lists(CELLS, min_size=2, max_size=2), min_size=1, max_size=4),
    st.sampled_from([(",", False), (";", False), (";", True), ("\t", False), (None, False)]),
)
def test_what_is_read_in_blocks_is_what_lines_are_read_as(table, form):
    form = TableForm(*form)
    lines = [(form.separator or " ").join(row) for row in table]
    block = form.plain_numbers(lines)
    if block is not None:
        one_by_one = [form.numbers(line.strip()) for line in lines if line.strip()]
        np.testing.assert_array_equal(block, np.array(one_by_one, float))


def test_many_columns_are_listed_in_short(tmp_path):
    names = [f"c{k}" for k in range(3000)]
    numbers = np.random.default_rng(1).uniform(1, 2, (6, 3000))
    text = ",".join(["theta_i", "theta_r", *names]) + "\n" + rows(np.arange(10, 70, 10),
        np.arange(10, 70, 10), numbers)  # fmt: skip
    samples = read(write(tmp_path, text))
    np.testing.assert_allclose(samples.values, numbers, rtol=1e-11)
    with pytest.raises(MdfconvError, match=r"no column 'x'; there are .* and 2990 more$"):
        read(write(tmp_path, text), ReadOptions(theta_i="x"))
