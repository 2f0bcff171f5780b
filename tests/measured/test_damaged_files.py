"""Files of arbitrary bytes, and damaged ones of every format: an error, or samples that hold."""

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mdfconv.errors import MdfconvError
from mdfconv.measured.readers import READERS, Reader, ReadOptions, Source, read
from mdfconv.measured.samples import DirectionalSamples
from tests.measured.scans import grid, measured, merl_bytes, rows, tensor_bytes
from tests.measured.test_readers import alta, fred, klems, zemax

ANGLES = grid((30, 60), range(0, 80, 20), range(0, 360, 90))
VALUES = measured(ANGLES)[2]
TABLE = rows(ANGLES, VALUES, digits=".4g")
NINE = rows(range(9), range(9), range(9))
SPECTRA = rows([400, 500] * 6, np.arange(12) // 2 * 9, range(12), range(12))
FILES = {
    "table": f"theta_i,phi_i,theta_o,phi_o,brdf\n{TABLE}".encode(),
    "comment": f"# phi_i theta_i phi_o theta_o brdf\n{TABLE}".replace(",", " ").encode(),
    "utf-16": f"θi;φi;θo;φo;f_r\n{TABLE}".replace(",", ";").replace(".", ",").encode("utf-16"),
    "one angle": b"# theta_i = 30 deg\nn,theta,R\n" + rows(range(9), range(9), range(9)).encode(),
    "one incidence": f"# theta_i = 30 deg\ntheta_r,R,u\n{NINE}".encode(),
    "wavelengths": f"wl,offset,R,u [%]\n{SPECTRA}".encode(),
    "astm": f"NUM_POINTS 32\nVARS theta_i,phi_i,theta_s,phi_s,Red\n{TABLE}".encode(),
    "mini-diff": f"NUM_POINTS 32\nVARS theta_i,phi_i,theta_s,Red\n{TABLE}".encode(),
    "zemax": zemax().encode(),
    "fred": fred().encode(),
    "klems": klems().encode(),
    "alta": alta("ISOTROPIC_TL_TV_PROJ_DPHI", np.radians(ANGLES[:, [0, 2, 3]]), VALUES),
    "alta binary": alta("SPHERICAL_TL_PL_TV_PV", np.radians(ANGLES), VALUES, binary="little"),
    "alta vectors": alta("CARTESIAN", np.ones((9, 6)), np.arange(9.0), "X", binary="big"),
    "merl": merl_bytes((3, 2, 2)),
    "rgl": tensor_bytes({"phi_i": np.zeros(1, "<f4"), "ndf": np.ones((3, 4), "<f4")}),
}
SETTINGS = settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
# What parsers stumble over.
PIECES = st.sampled_from(
    [
        *(b"nan", b"inf", b"1.#INF00", b"-1.#IND", b"-1e308", b"1e309", b"9" * 30),
        *(b"\0", b"\xff", b'"', b",", b"\n", b"#", b"-"),
    ]
)


def check_message(message):
    assert message
    assert len(message.splitlines()) == 1


def check(path, options=None):
    check_result(lambda: read(path, options))


def check_result(reading):
    """Read something; whatever comes back has to be what it promises to be."""
    try:
        samples = reading()
    except MdfconvError as error:
        check_message(str(error))
        return
    assert np.isfinite(samples.values).all()
    assert samples.values.shape[1] == len(samples.channels)
    if samples.uncertainty is not None:
        assert samples.uncertainty.shape == samples.values.shape
        assert ((samples.uncertainty > 0) & np.isfinite(samples.uncertainty)).all()
    assert all(len(line) <= 120 and line.isprintable() for line in samples.about)
    if isinstance(samples, DirectionalSamples):
        for vectors in (samples.incident, samples.outgoing):
            np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1, atol=1e-9)
            assert (vectors[:, 2] > 0).all()
    else:
        assert ((samples.beta >= 0) & (samples.beta <= np.pi / 2)).all()


def test_signalling_nan_of_a_tensor_file_does_not_warn(tmp_path):
    ndf = np.array([[1, 1, 0x7F810000, 1]], "<u4").view("<f4")
    path = tmp_path / "a.bsdf"
    path.write_bytes(tensor_bytes({"ndf": ndf}))
    check(path)


@SETTINGS
@given(content=st.binary(max_size=300), name=st.sampled_from(["a.txt", "a.bsdf", "a.binary"]))
def test_arbitrary_bytes(tmp_path, content, name):
    path = tmp_path / name
    path.write_bytes(content)
    check(path)


@SETTINGS
@given(text=st.text(alphabet="0123456789.,;-+eE \t\n#%\"'abθφ_", max_size=120))
def test_arbitrary_tables(tmp_path, text):
    path = tmp_path / "a.txt"
    path.write_text(text, encoding="utf-8")
    check(path)
    check(path, ReadOptions(theta_i="1", theta_o="2", values=("3",)))
    check(path, ReadOptions(angle="1", unit="cosine", angle_is="reflected"))
    check(path, ReadOptions(incidence=30, uncertainty=("2",), values_are="factor"))
    check(path, ReadOptions(angle_is="specular", incidence=30, unit="degrees", wavelength=1))


@pytest.mark.parametrize("form", FILES)
def test_whole_files_are_read(tmp_path, form):
    path = tmp_path / "a.txt"
    path.write_bytes(FILES[form])
    if form not in ("one angle", "wavelengths"):
        assert len(read(path).values) > 1 or form == "merl"
    check(path)
    if form == "wavelengths":
        assert read(path, ReadOptions(incidence=30)).channels == ("400 nm", "500 nm")


@pytest.mark.parametrize("form", FILES)
@SETTINGS
@given(data=st.data())
def test_damaged(tmp_path, form, data):
    content = FILES[form]
    place = data.draw(st.integers(0, len(content)))
    end = data.draw(st.integers(place, min(len(content), place + 40)))
    damage = data.draw(st.one_of(st.none(), st.binary(max_size=8), PIECES))
    path = tmp_path / "a.txt"
    path.write_bytes(
        content[:place] if damage is None else content[:place] + damage + content[end:]
    )
    check(path, ReadOptions(incidence=30) if form == "wavelengths" else None)


@SETTINGS
@given(place=st.integers(0, 43), byte=st.integers(0, 255))
def test_damaged_merl_as_a_whole(tmp_path, place, byte):
    content = bytearray(FILES["merl"])
    content[place] = byte
    path = tmp_path / "a.binary"
    path.write_bytes(content)
    try:
        samples = read(path, ReadOptions(cells=10))
    except MdfconvError as error:
        check_message(str(error))
        return
    assert np.isfinite(samples.values).all()


def of_format(reader):
    """Return the files above that a reader of the registry is the first to recognize."""
    return [
        content
        for content in FILES.values()
        if next(r for r in READERS if r.recognizes("a.txt", content[:65536])) is reader
    ]


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
def test_every_reader_of_what_is_cut_off_or_garbage(reader):
    own = of_format(reader)
    assert own, f"a file of the format {reader.name} belongs into FILES"
    rng = np.random.default_rng(7)
    damaged = [b"", bytes(range(256)), rng.bytes(300), *FILES.values()]
    for content in own:
        damaged += [content[:end] for end in np.linspace(0, len(content), 40).astype(int)]
        for place in np.linspace(0, min(len(content), 400), 40).astype(int):
            damaged.append(content[:place] + rng.bytes(8) + content[place + 8 :])
    for content in damaged:
        source = Source(Path("a.txt"), content)
        check_result(lambda source=source: reader.samples(source, ReadOptions()))


@pytest.mark.parametrize(
    "error",
    [KeyError("ndf"), IndexError("of 3"), ValueError("no\nnumber"), struct.error("short"),
     UnicodeDecodeError("utf-8", b"a", 0, 1, "bad")],
)  # fmt: skip
def test_what_a_reader_does_not_foresee_is_an_error_of_the_file(error):
    def fail(source, options):
        raise error

    reader = Reader("goniometer", lambda name, head: True, fail)
    with pytest.raises(MdfconvError, match=r"cannot read a\.txt as goniometer: ") as caught:
        reader.samples(Source(Path("a.txt"), b""), ReadOptions())
    check_message(str(caught.value))
    assert caught.value.__cause__ is error
