"""Every reader against a file of its form, written from directions that are known."""

import sys
from io import BytesIO, TextIOWrapper

import numpy as np
import pytest

from mdfconv.errors import MdfconvError
from mdfconv.measured.readers import ReadOptions, list_readers, read
from mdfconv.measured.samples import (
    DirectionalSamples,
    Samples,
    directional_samples,
)
from mdfconv.measured.samples import (
    samples as one_angle_samples,
)
from tests.cli.runner import run
from tests.measured.scans import (
    ggx,
    grid,
    measured,
    merl_bytes,
    rows,
    rusinkiewicz,
    tensor_bytes,
    vector,
)

ANGLES = grid()
INCIDENT, OUTGOING, VALUES = measured(ANGLES)
THETA_I, PHI_I, THETA_O, PHI_O = ANGLES.T


def write(tmp_path, content, name="data.txt"):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def assert_same(samples, incident, outgoing, values):
    """Up to a turn of the surface about its normal, and the order of the rows."""
    assert isinstance(samples, DirectionalSamples)
    np.testing.assert_allclose(
        np.linalg.norm(samples.incident, axis=1), np.ones(len(samples.incident)), atol=1e-12
    )
    ours = invariants(samples.incident, samples.outgoing, samples.values)
    theirs = invariants(incident, outgoing, np.reshape(values, (len(incident), -1)))
    np.testing.assert_allclose(ours, theirs, atol=1e-6)


def invariants(incident, outgoing, values):
    """Cosines of both directions and between them, and the values, in order."""
    table = np.column_stack(
        [incident[:, 2], outgoing[:, 2], np.sum(incident * outgoing, axis=1), values]
    )
    return table[np.lexsort(np.round(table, 7).T)]


def test_every_format_is_listed():
    listed = ["MERL", "RGL", "ALTA", "Zemax", "FRED", "ASTM E1392", "text"]
    assert [name for name in list_readers() if name in listed] == listed
    assert list_readers()[-1] == "text", "it takes every text: what is particular comes before it"


# Tables


HEADERS = [
    ("theta_i,phi_i,theta_o,phi_o,brdf", ","),
    ("theta_in [deg]\tphi_in [deg]\ttheta_out [deg]\tphi_out [deg]\tvalue", "\t"),
    ("incident_zenith;incident_azimuth;view_zenith;view_azimuth;f_r", ";"),
    ("θi φi θo φo BRDF", " "),
    ("ThetaI PhiI ThetaO PhiO bsdf", " "),
    ('"theta_l","phi_l","theta_v","phi_v","R"', ","),
    ("theta_i,phi_i,theta_s,phi_s,550nm\ndeg,deg,deg,deg,1/sr", ","),
    ("% made by hand\n! and again\n// thrice\ntheta_i,phi_i,theta_o,phi_o,f", ","),
    ("# phi_in     theta_in     phi_out     theta_out     brdf\n# theta phi", None),
]


@pytest.mark.parametrize(("header", "separator"), HEADERS[:-1])
def test_tables_by_their_names(tmp_path, header, separator):
    text = f"{header}\n{rows(ANGLES, VALUES, separator=separator)}\n"
    samples = read(write(tmp_path, text))
    assert_same(samples, INCIDENT, OUTGOING, VALUES)
    np.testing.assert_allclose(samples.incident, INCIDENT, atol=1e-12)
    assert not any("turned" in note for note in samples.notes)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-be"])
def test_encodings(tmp_path, encoding):
    mark = "\ufeff" if encoding == "utf-16-be" else ""
    text = f"{mark}θi;φi;θo;φo;f_r\r\n" + rows(ANGLES, VALUES, separator=";").replace("\n", "\r\n")
    assert_same(read(write(tmp_path, text.encode(encoding))), INCIDENT, OUTGOING, VALUES)


@pytest.mark.parametrize("separator", [";", "\t", " "])
def test_decimal_commas(tmp_path, separator):
    header = separator.join(["theta_i", "phi_i", "theta_o", "phi_o", "brdf"])
    text = rows(ANGLES, VALUES, separator=separator, digits=".9f").replace(".", ",")
    samples = read(write(tmp_path, f"{header}\n{text}"))
    assert_same(samples, INCIDENT, OUTGOING, np.round(VALUES, 9))
    assert "commas are read as decimal points" in samples.notes


def test_radians_by_their_range(tmp_path):
    header = "theta_i,phi_i,theta_o,phi_o,brdf"
    samples = read(write(tmp_path, f"{header}\n{rows(np.radians(ANGLES), VALUES)}"))
    assert_same(samples, INCIDENT, OUTGOING, VALUES)
    assert any("read in radians" in note for note in samples.notes)
    told = read(
        write(tmp_path, f"{header}\n{rows(ANGLES / 100, VALUES)}"), ReadOptions(unit="degree")
    )
    np.testing.assert_allclose(told.incident, vector(*np.radians(ANGLES.T[:2] / 100)), atol=1e-12)


def test_zeniths_that_are_called_phi(tmp_path):
    scan = np.arange(-85, 86, 2.5)
    tables = [
        np.column_stack([np.full_like(scan, angle), np.full_like(scan, 180.0), scan, 0 * scan])
        for angle in (10.0, 40.0, 70.0)
    ]
    angles = np.concatenate(tables)
    incident, outgoing, values = measured(angles)
    text = "# a scan\n# phi_in     theta_in     phi_out     theta_out     brdf\n"
    samples = read(write(tmp_path, text + rows(angles, values, separator="     ")))
    assert_same(samples, incident, outgoing, values)
    assert any("against their names" in note for note in samples.notes)
    assert any("names of the columns are taken from the comment" in note for note in samples.notes)
    # Two-sided scans: a negative zenith is on the other side.
    assert samples.outgoing[:, 2].min() > 0
    best = np.argmax(np.where(samples.incident[:, 2] > 0.9, samples.values[:, 0], 0))
    assert samples.half[best, 2] == pytest.approx(1)


def test_names_are_believed_where_the_ranges_allow(tmp_path):
    text = "phi_i,theta_i,phi_o,theta_o,brdf\n" + rows(ANGLES[:, [1, 0, 3, 2]], VALUES)
    samples = read(write(tmp_path, text))
    assert_same(samples, INCIDENT, OUTGOING, VALUES)
    assert not any("against their names" in note for note in samples.notes)


def test_azimuth_of_the_lights_travel_is_turned(tmp_path):
    angles = ANGLES + np.array([0, 180, 0, 0])
    text = "theta_i,phi_i,theta_o,phi_o,brdf\n" + rows(angles, VALUES)
    samples = read(write(tmp_path, text))
    assert_same(samples, INCIDENT, OUTGOING, VALUES)
    assert any("is turned by 180°" in note for note in samples.notes)


def test_a_uniform_surface_does_not_tell_the_side(tmp_path):
    text = "theta_i,phi_i,theta_o,phi_o,brdf\n" + rows(ANGLES, np.full(len(ANGLES), 0.3))
    samples = read(write(tmp_path, text))
    np.testing.assert_allclose(samples.incident, INCIDENT, atol=1e-12)
    assert any("do not tell on which side" in note for note in samples.notes)


@pytest.mark.parametrize(
    ("header", "columns", "turn", "words"),
    [
        ("theta_i,theta_o,phi,brdf", [0, 2, 3], 0, "difference of the two"),
        ("theta_i,theta_o,dphi,brdf", [0, 2, 3], 0, "difference of the two"),
        ("theta_i,theta_o,delta phi,brdf", [0, 2, 3], 180, "difference of the two"),
        ("theta_i,theta_o,phi_o,brdf", [0, 2, 3], 180, "no azimuth of the incident direction"),
        ("theta_i,theta,phi,brdf", [0, 2, 3], 0, "taken for the zenith of the outgoing"),
    ],
)
def test_one_azimuth(tmp_path, header, columns, turn, words):
    angles = ANGLES + np.array([0, 0, 0, turn])
    samples = read(write(tmp_path, f"{header}\n{rows(angles[:, columns], VALUES)}"))
    assert_same(samples, INCIDENT, OUTGOING, VALUES)
    assert any(words in note for note in samples.notes)
    assert any("turned" in note for note in samples.notes) == bool(turn)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_scan_in_the_plane_of_incidence(tmp_path, sign):
    scan = np.arange(-80, 81, 4.0)
    angles = np.column_stack([np.full_like(scan, 30), 0 * scan, scan, np.full_like(scan, 180)])
    incident, outgoing, values = measured(angles)
    text = "# angle of incidence: 30 deg\n# sample 12\ntheta_r,brdf\n"
    samples = read(write(tmp_path, text + rows(sign * scan, values)))
    assert_same(samples, incident, outgoing, values)
    assert any("the angle of incidence, 30 degrees, is from" in note for note in samples.notes)
    assert any("plane of incidence" in note for note in samples.notes)


def test_two_angles_of_incidence_in_comments_are_not_believed(tmp_path):
    text = "# theta_i = 10\n# theta_i = 20\ntheta_o [deg],brdf\n"
    path = write(tmp_path, text + rows(np.arange(10.0), np.arange(10.0)))
    with pytest.raises(MdfconvError, match="outgoing direction, and the incident one is missing"):
        read(path)
    samples = read(path, ReadOptions(incidence=20))
    np.testing.assert_allclose(np.degrees(np.arccos(samples.incident[:, 2])), 20)


def test_columns_that_the_user_names(tmp_path):
    text = "a,b,c,d,e,f\n" + rows(VALUES / 2, ANGLES, VALUES)
    options = ReadOptions(theta_i="b", phi_i="3", theta_o="d", phi_o="e", values=("f",))
    assert_same(read(write(tmp_path, text), options), INCIDENT, OUTGOING, VALUES)
    with pytest.raises(MdfconvError, match="zenith of both directions; name both; there are a, b"):
        read(write(tmp_path, text), ReadOptions(theta_i="b"))


def test_channels_and_what_is_not_read(tmp_path):
    index = np.arange(1, len(ANGLES) + 1)
    text = "index,theta_i,phi_i,theta_o,phi_o,R,G,B,temperature\n" + rows(
        index, ANGLES, VALUES, 2 * VALUES, 3 * VALUES, VALUES / 100
    )
    samples = read(write(tmp_path, text))
    assert samples.channels == ("R", "G", "B")
    assert_same(samples, INCIDENT, OUTGOING, np.outer(VALUES, [1, 2, 3]))
    assert "column 'index' counts the rows and is passed over" in samples.notes
    assert any("not read: column 'temperature'" in note for note in samples.notes)


@pytest.mark.parametrize("shape", [(400, 2), (400,), (399, 1)])
def test_values_have_a_column_for_each_channel_and_a_row_for_each_angle(shape):
    zero, values = np.zeros(400), np.ones(shape)
    with pytest.raises(MdfconvError, match=r"a\.txt: values of shape .* 400 angles"):
        directional_samples("a.txt", zero, zero, zero, zero, values, ("value",))
    with pytest.raises(MdfconvError, match="values of shape"):
        one_angle_samples("a.txt", zero, "radians", values, ("value",), "ndf")


# Tables of one angle


BETA = np.arange(0, 80, 2.0)


def test_an_index_is_not_an_angle(tmp_path):
    text = "n,beta_deg,v\n" + rows(np.arange(BETA.size), BETA, np.cos(np.radians(BETA)))
    samples = read(write(tmp_path, text))
    np.testing.assert_allclose(np.degrees(samples.beta), BETA, atol=1e-12)
    assert samples.channels == ("v",)
    unnamed = rows(np.arange(BETA.size), BETA, np.cos(np.radians(BETA)))
    with pytest.raises(MdfconvError, match="column 1 counts") as caught:
        read(write(tmp_path, unnamed))
    assert caught.value.argument == "angle"
    chosen = read(write(tmp_path, unnamed), ReadOptions(angle="2", values=("3",)))
    np.testing.assert_allclose(np.degrees(chosen.beta), BETA, atol=1e-12)


@pytest.mark.parametrize(
    "header", ["temperature,pressure,signal", "theta_h,theta_d,brdf", "angle,beta,brdf"]
)
def test_columns_that_may_be_anything(tmp_path, header):
    with pytest.raises(MdfconvError, match=r"called an angle; there are .*choose the column"):
        read(write(tmp_path, f"{header}\n{rows(BETA, BETA, BETA)}"))


@pytest.mark.parametrize("meaning", ["half", "reflected", "incident"])
def test_what_the_angle_is(tmp_path, meaning):
    scan = BETA if meaning == "half" else np.concatenate([-BETA[:0:-1], BETA])
    text = "theta_deg,brdf\n" + rows(scan, np.exp(-np.abs(scan) / 20))
    samples = read(write(tmp_path, text), ReadOptions(angle_is=meaning))
    if meaning == "half":
        assert isinstance(samples, Samples)
        assert any("between normal and half vector" in note for note in samples.notes)
        return
    moving, still = samples.outgoing, samples.incident
    if meaning == "incident":
        moving, still = still, moving
    np.testing.assert_allclose(still, np.tile([0, 0, 1], (scan.size, 1)))
    np.testing.assert_allclose(moving, vector(np.radians(scan), 0 * scan), atol=1e-12)
    assert any(f"that of the {meaning} direction" in note for note in samples.notes)


# Zemax and FRED


INCIDENCES = [10.0, 40.0, 70.0]
AZIMUTHS = np.arange(0, 181, 15.0)
RADIALS = np.array([0, 3, 10, 25, 50, 80.0])


def scatter():
    """Return for every incidence the outgoing vectors, shape (azimuths, radials, 3)."""
    outgoing = []
    for incidence in np.radians(INCIDENCES):
        azimuth, radial = np.meshgrid(np.radians(AZIMUTHS), np.radians(RADIALS), indexing="ij")
        # The law of cosines of the triangle normal, mirror direction, outgoing direction.
        cosine = np.cos(incidence) * np.cos(radial) + np.sin(incidence) * np.sin(radial) * np.cos(
            azimuth
        )
        x = (np.cos(radial) - cosine * np.cos(incidence)) / np.sin(incidence)
        y = np.sin(radial) * np.sin(azimuth)
        outgoing.append(np.stack([x, y, cosine], -1))
    return np.array(outgoing)


def zemax(channels=("Monochrome",), kind="BRDF", rotations=(0,)):
    head = ["# a comment", "Source\tMeasured", "Symmetry\tPlaneSymmetrical"]
    head += [f"SpectralContent\t{'XYZ' if len(channels) > 1 else 'Monochrome'}"]
    head += [f"ScatterType\t{kind}"]
    for name, angles in (
        ("SampleRotation", rotations),
        ("AngleOfIncidence", INCIDENCES),
        ("ScatterAzimuth", AZIMUTHS),
        ("ScatterRadial", RADIALS),
    ):
        head += [f"{name}\t{len(angles)}", "\t".join(f"{angle:g}" for angle in angles)]
    incident = vector(np.radians(INCIDENCES), np.pi)
    for number, channel in enumerate(channels):
        head += ["", channel, "DataBegin"]
        for _ in rotations:
            for direction, outgoing in zip(incident, scatter(), strict=True):
                above = outgoing[..., 2] > 1e-9
                with np.errstate(all="ignore"):
                    values = np.where(above, ggx(direction, outgoing) * (number + 1), 0)
                head += ["TIS 0.1", rows(*values.T, separator="\t", digits=".10e")]
        head += ["DataEnd"]
    return "\n".join(head) + "\n"


def fred(settings="angles=deg bsdf=value scale=1", factor=1.0, unit=1.0):
    lines = ["type bsdf_data", f"format {settings}"]
    for number, outgoing in enumerate(scatter()):
        lines.append(f"{INCIDENCES[number] * unit:.12g}\t0")
        direction = vector(np.radians(INCIDENCES[number]), np.pi)
        # At the specular direction all azimuths are one.
        some = np.concatenate([outgoing[:1, 0], outgoing[:, 1:].reshape(-1, 3)])
        some = some[some[:, 2] > 1e-9]
        theta = np.degrees(np.arccos(some[:, 2]))
        phi = np.degrees(np.arctan2(some[:, 1], some[:, 0]))
        lines.append(rows(theta * unit, phi * unit, ggx(direction, some) / factor, separator="\t"))
    return "\n".join(lines) + "\n"


def test_zemax_and_fred_are_one_measurement(tmp_path):
    ours = read(write(tmp_path, zemax(), "a.bsdf"))
    theirs = read(write(tmp_path, fred()))
    assert len(ours.values) > 150
    assert ours.channels == theirs.channels == ("value",)
    assert_same(ours, theirs.incident, theirs.outgoing, theirs.values)
    np.testing.assert_allclose(ours.values[:, 0], ggx(ours.incident, ours.outgoing), rtol=1e-6)
    assert any("without a measurement" in note for note in ours.notes)
    for angle in INCIDENCES:
        of_angle = np.isclose(ours.incident[:, 2], np.cos(np.radians(angle)))
        assert ours.half[of_angle, 2].max() == pytest.approx(1)


def test_zemax_with_three_channels_and_rotations(tmp_path):
    channels = ("TristimulusX", "TristimulusY", "TristimulusZ")
    samples = read(write(tmp_path, zemax(channels, rotations=(0, 90)), "a.bsdf"))
    assert samples.channels == ("X", "Y", "Z")
    one = ggx(samples.incident, samples.outgoing)
    np.testing.assert_allclose(samples.values, np.outer(one, [1, 2, 3]), rtol=1e-6)
    azimuths = np.degrees(np.arctan2(samples.incident[:, 1], samples.incident[:, 0])) % 360
    np.testing.assert_allclose(np.unique(np.round(azimuths, 6)), [180, 270])


def test_freds_settings(tmp_path):
    text = fred("angles=rad bsdf=value scale=0.5", 0.5, np.pi / 180)
    plain = read(write(tmp_path, fred(), "plain.txt"))
    assert_same(read(write(tmp_path, text)), plain.incident, plain.outgoing, plain.values)


# Klems


RINGS = [(0, 1), (20, 4), (50, 8)]


def klems(blocks=(("Transmission Front", 3), ("Reflection Front", 1)), wavelength="Visible"):
    """A BSDF of WINDOW, the values of each block so many times those of GGX; φ_i as of travel."""
    patches = np.array([(theta, 360 * k / count) for theta, count in RINGS for k in range(count)])
    theta, phi = np.radians(patches).T
    incident, outgoing = vector(theta, phi + np.pi), vector(theta, phi)
    matrix = ggx(incident[None, :], outgoing[:, None])
    rings = "".join(
        f"<AngleBasisBlock><Theta>{theta}</Theta><nPhis>{count}</nPhis></AngleBasisBlock>"
        for theta, count in RINGS
    )
    data = "".join(
        f"""<WavelengthData><Wavelength unit="Integral">{wavelength}</Wavelength>
        <WavelengthDataBlock><WavelengthDataDirection>{name}</WavelengthDataDirection>
        <ColumnAngleBasis>rings</ColumnAngleBasis><RowAngleBasis>rings</RowAngleBasis>
        <ScatteringData>{rows(factor * matrix, separator=", ")}</ScatteringData>
        </WavelengthDataBlock></WavelengthData>""".replace("\n", ",\n").replace(">,", ">")
        for name, factor in blocks
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
    <!-- by hand --><WindowElement xmlns="http://windows.lbl.gov"><Optical><Layer>
    <Material><Name>Shade</Name></Material><DataDefinition>
    <IncidentDataStructure>Columns</IncidentDataStructure><AngleBasis>
    <AngleBasisName>rings</AngleBasisName>{rings}</AngleBasis></DataDefinition>
    {data}</Layer></Optical></WindowElement>"""


def test_klems(tmp_path):
    samples = read(write(tmp_path, klems(), "a.xml"))
    np.testing.assert_allclose(samples.values[:, 0], ggx(samples.incident, samples.outgoing))
    assert samples.values.shape == (13 * 13, 1)
    assert samples.about == ("Name: Shade",)
    assert "Reflection Front, Visible is read, at the centres of the patches" in samples.notes
    zeniths = np.degrees(np.arccos(samples.incident[:, 2]))
    np.testing.assert_allclose(np.unique(np.round(zeniths, 6)), [0, 20, 50])
    # What is wrong with a block that is not read does not matter.
    other = klems().replace("ScatteringData>", "ScatteringData>x ", 1)
    assert len(read(write(tmp_path, other)).values) == 169
    back = read(write(tmp_path, klems([("Reflection Back", 2)], "0.55")))
    np.testing.assert_allclose(back.values, 2 * samples.values)
    assert any("Reflection Back, 0.55 is read" in note for note in back.notes)


ENTITY = '?>\n<!DOCTYPE a [<!ENTITY b "c">]>'


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (klems([("Transmission Front", 1)]), "no block of reflection; it has Transmission Front"),
        (klems([]), "no block of reflection; it has nothing"),
        (klems().replace("Columns", "TensorTree4"), "'TensorTree4'; only Columns"),
        (klems().replace("<Theta>20", "<Theta>-20"), "a ring of 4 patches at -20°"),
        (klems().replace("<nPhis>8", "<nPhis>7"), "169 numbers of .* 12 × 12 patches"),
        (klems().replace("<nPhis>8", "<nPhis>x"), "as Klems: ValueError"),
        (klems().replace("<nPhis>8", "<nPhis>99999999999"), "a ring of 99999999999"),
        (klems().replace("Name>rings", "Name>other"), "no basis of angles 'rings'"),
        (klems()[:-30], "not well-formed XML: "),
        (klems().replace("?>", ENTITY, 1), "with a document type"),
    ],
)
def test_klems_that_is_not_read(tmp_path, content, words):
    with pytest.raises(MdfconvError, match=words) as caught:
        read(write(tmp_path, content))
    assert "\n" not in str(caught.value)


# ALTA


def alta(parametrization, inputs, values, output="INV_STERADIAN", binary=None):
    values = np.reshape(values, (len(inputs), -1))
    head = f"#DIM {inputs.shape[1]} {values.shape[1]}\n#PARAM_IN {parametrization}\n"
    head += f"#PARAM_OUT {output}\n"
    table = np.column_stack([inputs, values])
    if binary is None:
        return (head + rows(table, separator="\t", digits=".17g")).encode()
    order = {"little": "<f8", "big": ">f8"}[binary]
    head += "#FORMAT binary\n#VERSION 0\n#PRECISION ieee754-double\n"
    head += f"#SAMPLE_COUNT {len(table)}\n#ENDIAN {binary}\n#BEGIN_STREAM\n"
    return head.encode() + table.astype(order).tobytes() + b"\n#END_STREAM\n"


def projected():
    theta, phi = np.radians(ANGLES[:, 2]), np.radians(ANGLES[:, 3])
    columns = [np.radians(THETA_I), theta * np.cos(phi), theta * np.sin(phi)]
    return np.column_stack(columns)


def half_and_difference():
    generator = np.random.default_rng(3)
    theta_h, phi_h = generator.uniform(0, 0.7, 200), generator.uniform(0, 6, 200)
    theta_d, phi_d = generator.uniform(0, 0.7, 200), generator.uniform(0, 6, 200)
    first, second = rusinkiewicz(theta_h, phi_h, theta_d, phi_d)
    return np.column_stack([theta_h, phi_h, theta_d, phi_d]), second, first


@pytest.mark.parametrize("binary", [None, "little", "big"])
@pytest.mark.parametrize(
    ("parametrization", "inputs"),
    [
        ("ISOTROPIC_TL_TV_PROJ_DPHI", projected()),
        ("SPHERICAL_TL_PL_TV_PV", np.radians(ANGLES)),
        ("ISOTROPIC_TV_TL_DPHI", np.radians(ANGLES[:, [2, 0, 3]])),
        ("CARTESIAN", np.column_stack([OUTGOING, INCIDENT])),
    ],
)
def test_alta(tmp_path, parametrization, inputs, binary):
    samples = read(write(tmp_path, alta(parametrization, inputs, VALUES, binary=binary)))
    assert_same(samples, INCIDENT, OUTGOING, VALUES)
    assert samples.channels == ("1",)


def test_alta_of_half_and_difference_vectors(tmp_path):
    inputs, incident, outgoing = half_and_difference()
    values = np.outer(ggx(incident, outgoing), [1, 2, 3])
    samples = read(write(tmp_path, alta("RUSIN_TH_PH_TD_PD", inputs, values, "RGB_COLOR")))
    assert samples.channels == ("R", "G", "B")
    assert_same(samples, incident, outgoing, values)
    samples = read(write(tmp_path, alta("RUSIN_TH_TD_PD", inputs[:, [0, 2, 3]], values)))
    assert_same(samples, incident, outgoing, values)


def test_alta_with_the_cosine_in_the_values(tmp_path):
    weighted = VALUES * OUTGOING[:, 2]
    content = alta(
        "SPHERICAL_TL_PL_TV_PV", np.radians(ANGLES), weighted, "INV_STERADIAN_COSINE_FACTOR"
    )
    samples = read(write(tmp_path, content))
    assert_same(samples, INCIDENT, OUTGOING, VALUES)
    assert any("cosine of the view" in note for note in samples.notes)


def test_alta_of_one_angle_in_binary(tmp_path):
    beta = np.radians(BETA)
    content = alta("COS_TH", np.cos(beta)[:, None], np.exp(-beta), binary="little")
    samples = read(write(tmp_path, content))
    np.testing.assert_allclose(samples.beta, beta, atol=1e-7)
    np.testing.assert_allclose(samples.values[:, 0], np.exp(-beta))
    assert samples.quantity == "brdf"


# ASTM


@pytest.mark.parametrize("mark", ["", ":"])
@pytest.mark.parametrize("unit", ["radians", "degrees"])
def test_astm(tmp_path, mark, unit):
    angles = np.radians(ANGLES) if unit == "radians" else ANGLES
    values = np.outer(VALUES, [1, 2, 3])
    text = (
        f"BRDF{mark} measured, by hand\nCONTACT{mark} nobody\nNUM_POINTS{mark} {len(angles)}\n"
        f"VARS{mark} theta_i,phi_i,theta_s,phi_s,Red,Green,Blue\r\n" + rows(angles, values)
    )
    samples = read(write(tmp_path, text, "a.astm"))
    assert samples.channels == ("Red", "Green", "Blue")
    assert_same(samples, INCIDENT, OUTGOING, values)
    with pytest.raises(MdfconvError, match="576 rows where NUM_POINTS says 1"):
        read(write(tmp_path, text.replace("NUM_POINTS", "NUM_POINTS 1", 1), "b.astm"))


# MERL and RGL


def test_merl_as_a_whole(tmp_path):
    content = merl_bytes()
    path = write(tmp_path, content, "a.binary")
    samples = read(path, ReadOptions(cells=600))
    assert 300 < len(samples.values) <= 600
    np.testing.assert_allclose(
        samples.values, np.outer(ggx(samples.incident, samples.outgoing), np.ones(3)), rtol=1e-9
    )
    assert min(samples.incident[:, 2].min(), samples.outgoing[:, 2].min()) > 0
    again = read(path, ReadOptions(cells=600))
    np.testing.assert_array_equal(samples.values, again.values)
    # As many of every θ_h.
    theta_h = np.round(np.arccos(np.clip(samples.half[:, 2], -1, 1)), 6)
    _, counts = np.unique(theta_h, return_counts=True)
    assert counts.max() <= 50
    assert any("by chance and as many of every θ_h" in note for note in samples.notes)
    everything = read(path, ReadOptions(cells=10**6))
    cells = np.frombuffer(content, "<f8", offset=12).reshape(3, -1)
    assert 0.3 * (cells[0] >= 0).sum() < len(everything.values) <= (cells[0] >= 0).sum()


def test_merl_without_its_name(tmp_path):
    path = write(tmp_path, merl_bytes(), "unnamed")
    ours, theirs = read(path), read(write(tmp_path, merl_bytes(), "named.binary"))
    assert isinstance(ours, Samples)
    np.testing.assert_array_equal(ours.values, theirs.values)
    path = write(tmp_path, np.array([1, 1, 1], "<i4").tobytes() + b"\xff" * 24, "none.binary")
    with pytest.raises(MdfconvError, match="no finite"):
        read(path, ReadOptions(cells=20000))


def density(theta):
    return 1 / (np.pi * 0.09 * (np.cos(theta) ** 2 + np.sin(theta) ** 2 / 0.09) ** 2)


@pytest.mark.parametrize("azimuths", [1, 2, 33])
def test_rgl(tmp_path, azimuths):
    theta = np.linspace(0, 1, 64) ** 2 * np.pi / 2
    phi = np.linspace(-np.pi, np.pi, azimuths)
    around = 1 + (0.5 * np.cos(phi) if azimuths > 2 else 0 * phi)
    fields = {
        "description": np.frombuffer(b"by hand", "u1"),
        "phi_i": np.zeros(8 if azimuths > 2 else 1, "<f4"),
        "ndf": np.outer(around, density(theta)).astype("<f4"),
    }
    samples = read(write(tmp_path, tensor_bytes(fields), "a.bsdf"))
    assert (samples.quantity, samples.channels) == ("ndf", ("ndf",))
    np.testing.assert_allclose(samples.beta, theta, atol=1e-6)
    np.testing.assert_allclose(samples.values[:, 0], density(theta), rtol=1e-5)
    assert any("anisotropic" in note for note in samples.notes) == (azimuths > 2)


# Standard input, and what is refused


def test_standard_input(monkeypatch):
    text = "theta_i,phi_i,theta_o,phi_o,brdf\n" + rows(ANGLES, VALUES)
    monkeypatch.setattr(sys, "stdin", TextIOWrapper(BytesIO(text.encode())))
    assert_same(read("-"), INCIDENT, OUTGOING, VALUES)
    beta = rows(BETA, np.exp(-BETA / 20))
    status, _, err = run("fit", "-", "--to", "ggx", stdin=beta)
    assert status == 0, err
    monkeypatch.setattr(sys, "stdin", TextIOWrapper(BytesIO(b"")))
    with pytest.raises(MdfconvError, match="standard input: no numeric rows"):
        read("-")


TABLE = "theta_i,phi_i,theta_o,phi_o,brdf\n" + rows(ANGLES, VALUES)


@pytest.mark.parametrize(
    ("content", "options", "words"),
    [
        (zemax(), {"values": ("1",)}, "choose no columns and no unit"),
        (fred(), {"unit": "degrees"}, "choose no columns and no unit"),
        (merl_bytes(), {"angle": "1"}, "choose no columns and no unit"),
        (alta("COS_TH", np.ones((3, 1)), np.ones(3)), {"theta_i": "1"}, "choose no columns"),
        (tensor_bytes({"a": np.zeros(2, "<f4")}), {"angle": "1"}, "choose no columns"),
        (tensor_bytes({"a": np.zeros(2, "<f4")}), {}, "no table 'ndf'.*there are a"),
        (tensor_bytes({"ndf": np.zeros((2, 2), "<f4")})[:-1], {}, "truncated"),
        (tensor_bytes({"ndf": np.zeros((2, 2), "<f4")})[:30], {}, "truncated"),
        (b"tensor_file\0\2\0\0\0\0\0", {}, "version 2.0"),
        (zemax(kind="BTDF"), {}, "line 5: ScatterType BTDF: only BRDF"),
        (zemax()[:-400], {}, "truncated"),
        (zemax().replace("TIS", "TOS", 1), {}, "'TOS' where TIS goes"),
        (zemax().replace("ScatterRadial\t6", "ScatterRadial\t-6"), {}, "line 12: .*no count"),
        (fred().replace("value scale", "log scale"), {}, "line 2: .*bsdf=value are read"),
        (fred().replace("10\t0\n", "", 1), {}, "line 3: 3 numbers before an incidence"),
        ("type bsdf_data\n", {}, "no rows"),
        ("#DIM a b\n1 2", {}, "dimension 'a b'"),
        ("#DIM 3 1\n#PARAM_IN SCHLICK_VK\n1 2 3 4", {}, "known: COS_TH"),
        (alta("CARTESIAN", np.ones((3, 6)), np.ones(3), binary="big")[:-50], {}, "truncated"),
        (TABLE, {"unit": "cosine"}, "directions in cosines"),
        (TABLE, {"unit": "gons"}, "unknown angle unit"),
        (TABLE, {"angle_is": "quarter"}, "unknown angle 'quarter'; known: half"),
        (TABLE, {"theta_i": "nothing"}, "no column 'nothing'; there are theta_i"),
        (TABLE, {"values": ("9",)}, "no column '9'"),
        (TABLE.replace("phi_i", "theta_in"), {}, "both the zenith of the incident"),
        (TABLE.replace("brdf", "brdf,a"), {}, "names 6 columns where 5 are"),
        ("theta_i,theta_o,wavelength,brdf\n1,2,450,3\n2,3,550,4", {}, "2 wavelengths"),
        ("theta_i,theta_o,brdf\n95,2,3\n100,3,4", {}, "no finite sample above the horizon"),
        ("theta_i,theta_o\n5,2\n10,3", {}, "columns are not enough"),
        ("a,b\nc,d\n1,2", {}, "line 2: not numbers: c,d"),
        ("VARS theta_i,phi_i,theta_s,phi_s,Y\n", {}, "no numeric rows"),
    ],
)
def test_refused(tmp_path, content, options, words):
    with pytest.raises(MdfconvError, match=words) as caught:
        read(write(tmp_path, content), ReadOptions(**options))
    assert "\n" not in str(caught.value)
    assert str(tmp_path) in str(caught.value) or "unknown" in str(caught.value)
