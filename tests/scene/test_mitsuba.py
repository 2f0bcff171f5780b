"""Mitsuba's scenes: bytes kept, numbers right, nothing resolved, loaded by Mitsuba itself."""

import json
import math
import re
from contextlib import suppress
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from PIL import Image

import mdfconv
from mdfconv.conversion.explanation import remaining_error
from mdfconv.distributions.endpoint import endpoint, endpoints, stored_forms
from mdfconv.fitting.metrics import metric_named
from mdfconv.scene import convert_mitsuba
from tests.cli.runner import run, run_on_terminal

# Of beckmann to ggx in the light of a natural environment, at any roughness.
CONSTANT = 0.7810619641
PHONG, REFLECTED = "blinn-phong:mitsuba-phong", "blinn-phong:reflected"


def scene(*bsdfs, version="3.0.0"):
    return f'<scene version="{version}">\n{"".join(bsdfs)}\n</scene>\n'.encode()


def rough(*properties, kind="roughconductor", extra=""):
    return f'<bsdf type="{kind}"{extra}>{"".join(properties)}</bsdf>'


def number(value, name="alpha"):
    return f'<float name="{name}" value="{value}"/>'


def text(value, name="distribution"):
    return f'<string name="{name}" value="{value}"/>'


def properties(data):
    """Return what an independent parser sees of the BSDFs: type and named values."""
    return [
        (bsdf.get("type"), {child.get("name"): child.get("value") for child in bsdf})
        for bsdf in ElementTree.fromstring(data).iter("bsdf")
    ]


BEFORE = (
    b"\xef\xbb\xbf<?xml version='1.0' encoding='utf-8'?>\r\n"
    b'<scene version="3.0.0">\r\n'
    b'\t<!-- <bsdf type="roughconductor"><float name="alpha" value="0.5"/></bsdf> -->\r\n'
    b'\t<string name="x" value="caf\xc3\xa9"/><![CDATA[<bsdf type="roughconductor"/>]]>\r\n'
    b"\t<?note <bsdf type='roughplastic'/> ?>\r\n"
    b"\t<bsdf type='twosided' id='both'>\r\n"
    b"\t\t<bsdf  type = 'roughconductor' id='gold &amp; > tin' >\r\n"
    b"\t\t\t<float value=' 2e-1 '\r\n\t\t\t\tname='alpha' /> <!-- alpha -->\r\n"
    b"\t\t</bsdf>\r\n"
    b"\t</bsdf>\r\n"
    b'\t<bsdf type="roughdielectric" id="default"/>\r\n'
    b'\t<bsdf type="roughplastic"><string name="distribution" value="Beckmann"/>'
    b'<float name="alpha" value="0&#46;3"/></bsdf>\r\n'
    b"</scene>"
)
AFTER = (
    BEFORE.replace(
        b"tin' >\r\n\t\t\t<float value=' 2e-1 '",
        b"tin' >\r\n\t\t\t<string name='distribution' value='ggx' />"
        b"\r\n\t\t\t<float value=' 0.156212393 '",
    )
    .replace(
        b'id="default"/>',
        b'id="default">\r\n\t\t<string name="distribution" value="ggx"/>\r\n'
        b'\t\t<float name="alpha" value="0.0781061964"/>\r\n\t</bsdf>',
    )
    .replace(b'"Beckmann"', b'"ggx"')
    .replace(b"0&#46;3", b"0.234318589")
)


def test_every_other_byte_is_kept():
    found = convert_mitsuba(BEFORE)
    assert found.data == AFTER
    assert not found.problems
    assert [each.name for each in found.materials] == ["gold & > tin", "default", "roughplastic"]
    assert [each.line for each in found.materials] == [7, 12, 13]
    for each in found.materials:
        assert each.result == pytest.approx(each.value * CONSTANT, rel=1e-9)
    again = convert_mitsuba(AFTER)
    assert again.data == AFTER
    assert not again.problems
    assert all("ggx already" in each.notes for each in again.materials)


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_lines_are_counted_whatever_ends_them(end):
    lines = [
        b"\xef\xbb\xbf<scene version='0.6.0'>",
        b"<!-- \xc3\xa9",
        b"-->",
        b"<bsdf type='roughplastic'",
        b"  id='x'/>",
        b"<bsdf type='roughplastic'><float name='alpha' value='x'/></bsdf>",
        b"<include filename='other.xml'/></scene>",
    ]
    found = convert_mitsuba(end.join(lines))
    assert [each.line for each in found.materials] == [4]
    assert [problem.place for problem in found.problems] == [6]
    assert found.includes == ((7, "other.xml"),)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ('<bsdf type="roughplastic"/>', '<bsdf type="roughplastic">{}{}</bsdf>'),
        (
            '\n  <bsdf type="roughplastic"/>',
            '\n  <bsdf type="roughplastic">\n    {}\n    {}\n  </bsdf>',
        ),
        (
            '\n  <bsdf type="roughplastic" />',
            '\n  <bsdf type="roughplastic">\n    {}\n    {}\n  </bsdf>',
        ),
        (
            '\n\t<bsdf type="roughplastic"></bsdf>',
            '\n\t<bsdf type="roughplastic">\n\t\t{}\n\t\t{}\n\t</bsdf>',
        ),
        (
            '\n <bsdf type="roughplastic">\n </bsdf>',
            '\n <bsdf type="roughplastic">\n  {}\n  {}\n </bsdf>',
        ),
        (
            '<bsdf type="roughplastic">\n <a/></bsdf>',
            '<bsdf type="roughplastic">\n {}\n {}\n <a/></bsdf>',
        ),
    ],
)
def test_properties_are_put_in_with_the_indentation(before, after):
    wanted = after.format(text("ggx"), number("0.0781061964"))
    first = "" if before.startswith(("\n\t", "\n <", "<")) else "\n  <c/>"
    first = "\n <c/>" if before.startswith("\n <") else first
    data = f'<scene version="3.0.0">{first}{before}</scene>'.encode()
    assert convert_mitsuba(data).data == data.replace(before.encode(), wanted.encode())


@pytest.mark.parametrize("metric", ["environment", "energy", "display"])
@pytest.mark.parametrize(
    ("distribution", "source", "target"),
    [
        ("beckmann", "beckmann", "ggx"),
        ("ggx", "ggx", "beckmann"),
        ("phong", PHONG, "ggx"),
        ("phong", PHONG, "beckmann"),
        ("as", PHONG, "ggx"),
    ],
)
def test_numbers_are_those_of_convert(distribution, source, target, metric):
    alphas = [0.03, 0.1, 0.4, 0.7]
    data = scene(*(rough(text(distribution), number(a)) for a in alphas), version="0.6.0")
    found = convert_mitsuba(data, target, metric=metric)
    assert not found.problems
    for each, alpha in zip(found.materials, alphas, strict=True):
        (wanted,) = mdfconv.explain([alpha], source, target, metric=metric)
        assert each.value == alpha
        assert each.result == pytest.approx(wanted.result, rel=1e-9)
        assert each.rmse == pytest.approx(wanted.rmse, rel=1e-6)
    written = [values for _, values in properties(found.data)]
    assert [values["distribution"] for values in written] == [target] * 4
    results = [each.result for each in found.materials]
    assert [float(values["alpha"]) for values in written] == pytest.approx(results, rel=1e-8)


@pytest.mark.parametrize("names", [("alpha_u", "alpha_v"), ("alphaU", "alphaV")])
@pytest.mark.parametrize(
    ("distribution", "pair", "source"),
    [
        ("beckmann", (0.1, 0.4), "beckmann"),
        ("as", tuple(2 / a**2 - 2 for a in (0.1, 0.4)), "ashikhmin-shirley"),
    ],
)
def test_axes_are_converted_one_by_one(names, distribution, pair, source):
    data = scene(
        rough(text(distribution), number(0.4, names[1]), number(0.1, names[0])), version="0.6.0"
    )
    found = convert_mitsuba(data)
    (material,) = found.materials
    assert material.value == (0.1, 0.4)
    assert material.result == pytest.approx(
        mdfconv.convert(pair, source, "ggx", metric="environment"), rel=1e-9
    )
    ((_, values),) = properties(found.data)
    assert [float(values[name]) for name in names] == pytest.approx(material.result, rel=1e-8)
    assert material.rmse == max(
        mdfconv.explain(a, PHONG if distribution == "as" else source, "ggx", metric="environment")[
            0
        ].rmse
        for a in material.value
    )


def test_polarized_plastic_is_converted_like_its_kin():
    data = scene(rough(text("beckmann"), number(0.2), kind="pplastic"), rough(kind="pplastic"))
    found = convert_mitsuba(data)
    assert not found.problems
    first, default = (values for _, values in properties(found.data))
    assert first["distribution"] == default["distribution"] == "ggx"
    # Minimum of the squared difference over the sphere of normals, found independently.
    assert float(first["alpha"]) == pytest.approx(0.156212, abs=5e-7)
    assert float(default["alpha"]) == pytest.approx(0.1 * CONSTANT, rel=1e-8)


@pytest.mark.parametrize(
    ("given", "nearest"),
    [
        (number(0.2), [("alpha", 0.2)]),
        ("", [("alpha", 0.1)]),
        (number(0.2, "alphaU") + number(0.3, "alphaV"), [("alpha_u", 0.2), ("alpha_v", 0.3)]),
        (number(0.2, "alpha_u") + number(0.3), [("alpha_u", 0.2), ("alpha_v", 0.3)]),
        (number(0.2, "alphaV"), [("alpha_u", 0.1), ("alpha_v", 0.2)]),
        (number(0.2) + text("ward-duer", "variant"), [("alpha", 0.2)]),
        (number(0.2, "alphaU") + '<ref name="alphaV" id="t"/>', [("alpha_u", 0.2)]),
        (number("x"), []),
    ],
)
@pytest.mark.parametrize("target", ["ggx", "beckmann"])
def test_the_nearest_to_ward_is_named(given, nearest, target):
    data = scene(rough(given, kind="ward"), version="0.6.0")
    found = convert_mitsuba(data, target)
    assert (found.data, found.materials) == (data, ())
    ((_, problem, _),) = found.problems
    factor = CONSTANT if target == "ggx" else 1
    words = [
        f"{name} {alpha:g} is nearest to {target} with alpha {alpha * factor:.6g}"
        for name, alpha in nearest
    ]
    lobe = "the BSDF ward has Ward's lobe, near that of beckmann but not equal"
    assert problem == "; ".join([lobe, *words])


def test_what_is_left_of_other_plugins_is_said():
    data = scene(
        rough(number(0.3), kind="sssbrdf"),
        *(rough(number(0.3, "roughness"), kind=k) for k in ("principled", "mine", "principled")),
        rough(number(0.3), kind="roughdiffuse"),
        rough(number(0.3, "sigmaA"), kind="coating"),
        rough(number(0.3, "reflectance"), kind="diffuse"),
        rough(number(0.3, "specular_roughness"), number(0.3, "coat_roughness"), kind="layers"),
    )
    found = convert_mitsuba(data)
    assert found.data == data
    assert [problem.text for problem in found.problems] == [
        "the BSDF sssbrdf is of no type that is converted: its alpha",
        "the BSDF mine is of no type that is converted: its roughness",
        "the BSDF layers is of no type that is converted: its specular_roughness and "
        "coat_roughness",
    ]
    assert found.notes == (
        (2, "the roughness of principled is that of GGX already"),
        (2, "the roughness of roughdiffuse is Oren-Nayar's, of no microfacet distribution"),
    )


STORED = [
    end.label
    for owner in mdfconv.list_distributions()
    if owner.name != "ashikhmin-shirley"  # which is only one for pairs
    for end in [endpoint(owner.name), *(form for form, _ in stored_forms(owner))]
]


@settings(deadline=None)
@given(st.sampled_from(STORED), st.floats(0, 1), st.sampled_from(["beckmann", "ggx", None]))
def test_a_number_that_an_exporter_stored_is_read_as_what_it_is(name, share, distribution):
    end = endpoint(name)
    low, high = end.distribution.parameter.typical
    parameter = low * (high / low) ** share
    stored = float(end.encode(np.array(parameter)))
    assume(not any(which for which in end.clamped(np.array(stored)).values()))
    assume(not math.isnan(stored))
    named = text(distribution) if distribution else ""
    data = scene(rough(named, number(repr(stored))))
    found = convert_mitsuba(data, source=name)
    assert not found.problems
    ((_, values),) = properties(found.data)
    assert values["distribution"] == "ggx"
    wanted = parameter
    if end.distribution.name != "ggx":
        wanted = mdfconv.convert(parameter, end.distribution.name, "ggx", metric="environment")
    assert float(values["alpha"]) == pytest.approx(wanted, rel=1e-6)
    assert found.materials[0].distribution == name
    (note,) = found.notes
    assert note[1].startswith(f"alpha is taken for {name}")


def test_a_stored_roughness_counts_whatever_the_distribution_says():
    data = scene(
        rough(text("ggx"), number(0.5)),
        "\n",
        rough(text("beckmann"), number(0.5, "alpha_u"), number(0.25, "alpha_v")),
        "\n",
        rough(kind="roughplastic"),
        rough(text("ggx"), number(0)),
        rough(number(0.5), kind="ward"),
        rough(number(50, "exponent"), kind="phong"),
        version="0.6.0",
    )
    found = convert_mitsuba(data, source="ggx:roughness")
    (_, one), (_, two), (_, default), *_ = properties(found.data)
    assert (one["distribution"], one["alpha"]) == ("ggx", "0.25")
    assert (two["distribution"], two["alpha_u"], two["alpha_v"]) == ("ggx", "0.25", "0.0625")
    # Nobody stored it: it is Mitsuba's, and Beckmann's.
    assert float(default["alpha"]) == pytest.approx(0.1 * CONSTANT, rel=1e-8)
    assert found.materials[2].distribution == "beckmann"
    mirror, ward, phong = (problem.text for problem in found.problems)
    assert mirror == "alpha 0 of ggx:roughness is a mirror"
    assert "alpha 0.5 is nearest to ggx with alpha 0.25" in ward
    assert "exponent 50 is nearest to ggx" in phong
    assert found.notes == (
        (2, "alpha is taken for ggx:roughness (α = r²), whatever the distribution says"),
    )
    for source, target, alpha in (("ggx", "ggx", "0.5"), ("beckmann", "ggx", f"{0.5 * CONSTANT}")):
        again = convert_mitsuba(data, target, source=source)
        assert properties(again.data)[0][1]["alpha"].startswith(alpha[:8])
        assert {v.get("distribution") for _, v in properties(again.data)[:2]} == {target}


def test_a_clamped_number_has_no_inverse():
    found = convert_mitsuba(scene(rough(number(0))), source="blinn-phong:obj2gltf")
    assert found.problems[0].text == (
        "alpha 0 of blinn-phong:obj2gltf has no inverse: r = 0 is any N ≥ 1000"
    )


def test_texels_are_what_the_exporter_stored(tmp_path):
    texels = np.array([[0, 51, 128, 255]], np.uint8)
    Image.fromarray(texels).save(tmp_path / "wood.png")
    (tmp_path / "a.xml").write_bytes(scene(rough(text("ggx"), texture("wood.png"))))
    status, out, err = run(
        "mitsuba", "a.xml", "-o", "b.xml", "--textures", "--from", "ggx:roughness",
        "--format", "json", cwd=tmp_path,
    )  # fmt: skip
    assert status == 0
    note = "alpha is taken for ggx:roughness (α = r²), whatever the distribution says"
    assert f"note: a.xml, line 2: {note}" in err
    got = np.asarray(Image.open(tmp_path / "wood_ggx.png"))[0].tolist()
    # 255 (v/255)² by hand.
    assert got == [0, 10, 64, 255]
    (record,) = json.loads(out)
    assert (record["from"], record["target"]) == ("ggx:roughness", "ggx")
    assert record["textures"][0]["distribution"] == "ggx:roughness"
    assert record["notes"] == [{"line": 2, "note": note}]


def test_nested_and_referenced_bsdfs_are_converted_once():
    inner = rough(number(0.2), extra=' id="a"')
    data = scene(
        inner,
        f'<shape type="sphere">{rough(number(0.2), kind="roughcoating")}</shape>',
        '<shape type="sphere"><ref id="a"/></shape>',
        f'<bsdf type="blendbsdf"><ref id="a"/><bsdf type="mask">{rough(number(0.2))}</bsdf></bsdf>',
        '<bsdf type="roughdiffuse"><float name="alpha" value="0.2"/></bsdf>',
    )
    found = convert_mitsuba(data)
    assert not found.problems
    assert len(found.materials) == 3
    assert found.data.count(b'"0.156212393"') == 3
    assert b'<bsdf type="roughdiffuse"><float name="alpha" value="0.2"/></bsdf>' in found.data


def test_defaults_of_parameters_are_changed_where_they_are_only_alphas():
    default = '<default name="a" value="0.2"/><default name="ab" value="0.9"/>'
    data = scene(
        default, rough(number("$a")), rough(number("$a", "alpha_u"), number(" $a ", "alpha_v"))
    )
    found = convert_mitsuba(data)
    assert not found.problems
    assert b'<default name="a" value="0.156212393"/>' in found.data
    assert b'<default name="ab" value="0.9"/>' in found.data
    assert found.data.count(b"$a") == 3
    assert found.materials[0].notes == ("parameter a: convert what -D gives it, too",)


@pytest.mark.parametrize(
    "other",
    [
        '<shape type="sphere"><float name="radius" value="$a"/></shape>',
        '<shape type="ply"><string name="filename" value="x$a.ply"/></shape>',
        rough(text("ggx"), number("$a")),
        rough(number("$a"), text("phong")),
        rough(number("$a", "alpha_u"), number("x", "alpha_v")),
        rough(number("$a", "alpha_u"), number("$b", "alpha_v")),
        '<bsdf type="phong"><float name="exponent" value="$a"/></bsdf>',
        '<include filename="other.xml"/>',
    ],
)
def test_shared_parameters_are_left(other):
    default = '<default name="a" value="0.2"/><default name="b" value="0.2"/>'
    more = '<float name="b" value="$b"/>'
    data = scene(default, rough(number("$a")), other, more, version="0.6.0")
    found = convert_mitsuba(data)
    assert found.data == data
    assert "the parameter a" in found.problems[0][1]
    assert not [each for each in found.materials if each.distribution != "ggx"]


@pytest.mark.parametrize(
    ("bsdf", "message"),
    [
        (rough(number("x")), "alpha 'x' is not a number"),
        (rough(number("")), "alpha '' is not a number"),
        (rough(number("0,2")), "alpha '0,2' is not a number"),
        (rough(number("nan")), "alpha 'nan' is not a number"),
        (rough(number("0.2f")), "alpha '0.2f' is not a number"),
        (rough('<float name="alpha"/>'), "alpha '' is not a number"),
        (rough(number("0")), "alpha 0 of beckmann is a mirror"),
        (rough(number("-0.2")), "alpha -0.2 of beckmann is out of range"),
        (rough(number("1e999")), "alpha inf of beckmann is out of range"),
        (rough(text("phong"), number("1.5")), "alpha 1.5 of phong is out of range"),
        (rough(number("$q")), "alpha is the parameter q, which has no default in this file"),
        (rough(number("1$q")), "alpha '1$q' is not a number"),
        (rough(text("beckman")), "distribution 'beckman' is none of beckmann, ggx, phong, as"),
        (rough(text("$d")), "distribution '$d' is none of beckmann, ggx, phong, as"),
        (rough(number(0.1), number(0.2)), "alpha is given twice"),
        (rough(number(0.1, "alphaU"), number(0.2, "alpha_u")), "alpha_u is given twice"),
        (rough(number(0.1, "alpha_u")), "alpha_u: neither alpha alone nor alpha_u and alpha_v"),
        (
            rough(number(0.1), number(0.2, "alpha_u")),
            "alpha and alpha_u: neither alpha alone nor alpha_u and alpha_v",
        ),
        (rough('<integer name="alpha" value="1"/>'), "alpha is a integer, not a float"),
        (rough('<ref name="alpha" id="t"/>'), "alpha refers to 't', which is no texture"),
        (
            '<bsdf type="phong"><float name="exponent" value="100"/></bsdf>',
            "the BSDF phong has no microfacets; exponent 100 is nearest to ggx with alpha "
            + f"{mdfconv.convert(100, REFLECTED, 'ggx', metric='environment'):.6g}",
        ),
        ('<bsdf type="phong"/>', "exponent 30 is nearest to ggx with alpha 0.0991757"),
        (
            '<bsdf type="phong"><texture name="exponent" type="bitmap"/></bsdf>',
            "the BSDF phong has no microfacets",
        ),
    ],
)
def test_what_cannot_be_converted_is_left(bsdf, message):
    data = scene("\n", bsdf, rough(number(0.2)), version="0.6.0")
    found = convert_mitsuba(data)
    ((line, problem, _),) = found.problems
    assert line == 3
    assert message in problem
    assert bsdf.encode() in found.data
    assert len(found.materials) == 1


def test_phong_is_of_the_older_version():
    data = scene(rough(text("phong")), version="3.5.0")
    ((_, problem, _),) = convert_mitsuba(data).problems
    assert problem == "distribution 'phong' is one of Mitsuba 0.6, not of 3"


def test_rougher_than_ggx_can_be_is_its_roughest():
    found = convert_mitsuba(scene(rough(number(1.27)), rough(number(2))))
    assert found.materials[0].result == pytest.approx(1.27 * CONSTANT, rel=1e-9)
    assert found.materials[1].result == 1
    assert found.materials[1].rmse > found.materials[0].rmse


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "line 1"),
        (b"<scene>", "line 1"),
        (b"<scene>\n<bsdf>\n</scene>", "not well-formed XML, line 3: mismatched tag"),
        (b"<scene/>x", "line 1"),
        (b'<scene a="1" a="2"/>', "duplicate attribute"),
        (b"<scene>\xff</scene>", "not well-formed"),
        (scene().decode().encode("utf-16"), "not in UTF-8"),
        (scene().decode().encode("utf-16-le"), "not in UTF-8"),
        (scene().decode().encode("utf-32"), "not in UTF-8"),
        (b'<?xml version="1.0" encoding="ISO-8859-1"?><scene/>', "in ISO-8859-1, not in UTF-8"),
        (b'<!DOCTYPE s [<!ENTITY a "b">]><s/>', "declares the entity a"),
        (b'<!DOCTYPE s [<!ENTITY % a "b">]><s/>', "declares the entity a"),
        (b'<!DOCTYPE s SYSTEM "s.dtd"><s/>', "stands in another file, which is not read"),
        (b"<s>&unknown;</s>", "undefined entity"),
        (b"<s>" * 100_000 + b"</s>" * 100_000, "nested more than 1000 levels deep"),
    ],
)
def test_what_is_not_read_is_refused_in_one_line(data, message):
    with pytest.raises(mdfconv.MdfconvError) as caught:
        convert_mitsuba(data)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_entities_are_refused_before_they_are_used():
    lines = [f'<!ENTITY e{n} "{f"&e{n - 1};" * 10 if n else "x"}">' for n in range(30)]
    bomb = f"<!DOCTYPE s [{''.join(lines)}]><s>&e29;</s>".encode()
    with pytest.raises(mdfconv.MdfconvError, match="declares the entity e0"):
        convert_mitsuba(bomb)


def test_an_external_entity_is_not_read(tmp_path):
    (tmp_path / "secret").write_text("secret words")
    (tmp_path / "a.xml").write_text(
        f'<!DOCTYPE s [<!ENTITY e SYSTEM "{(tmp_path / "secret").as_uri()}">]><s>&e;</s>'
    )
    status, out, err = run("mitsuba", "a.xml", "-o", "b.xml", cwd=tmp_path)
    assert (status, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert "secret" not in err
    assert not (tmp_path / "b.xml").exists()


def test_defaults_of_a_document_type_are_no_attributes():
    data = (
        b'<!DOCTYPE s [<!ATTLIST bsdf type CDATA "roughconductor">]><s version="3.0.0"><bsdf/></s>'
    )
    assert convert_mitsuba(data).data == data


WORDS = st.sampled_from(
    [
        '<bsdf type="roughconductor">', "<bsdf type='roughplastic'/>", "</bsdf>", "<scene>",
        "</scene>", '<float name="alpha" value="0.2"/>', "<float name='alpha' value='$a'/>",
        '<default name="a" value="0.3"/>', '<string name="distribution" value="phong"/>',
        '<texture name="alpha" type="bitmap"/>', "<!-- x -->", "<![CDATA[<]]>", "\r\n", "\t",
        "&amp;",
        '<float name="alpha_u" value=" .5 "/>', '<float value=">" name="alpha_v"  />', "\xe9", "\r",
    ]
)  # fmt: skip
TREES = st.recursive(
    st.lists(
        WORDS.filter(lambda word: not word.startswith(('<bsdf type="', "</", "<scene"))), max_size=6
    ).map("".join),
    lambda inner: st.builds(
        lambda kind, body, quote: f"<bsdf type={quote}{kind}{quote}>{body}</bsdf>",
        st.sampled_from(["roughconductor", "roughplastic", "twosided", "phong"]),
        st.lists(inner, max_size=4).map("".join),
        st.sampled_from("'\""),
    ),
    max_leaves=12,
)


@settings(deadline=None)
@given(
    st.one_of(st.binary(max_size=200), st.lists(WORDS, max_size=30).map("".join).map(str.encode))
)
def test_byte_soup_is_refused_or_kept(data):
    with suppress(mdfconv.MdfconvError):
        found = convert_mitsuba(data)
        assert found.materials or found.data == data


@settings(deadline=None)
@given(TREES, st.sampled_from(["ggx", "beckmann"]))
def test_no_foreign_byte_changes(tree, target):
    data = f"<scene version='0.6.0'>{tree}</scene>".encode()
    found = convert_mitsuba(data, target)
    assert_only_values_changed(data, found.data)
    if not [each for each in found.materials if each.distribution != target]:
        assert found.data == data
    again = convert_mitsuba(found.data, target)
    assert again.data == found.data
    assert len(again.materials) == len(found.materials)


def assert_only_values_changed(before, after):
    """What is no number, no name of a distribution and no new property is the same, in order."""
    inserted = rb"<(?:string name=.distribution.|float name=.alpha.) value=.[\w.-]+. *?/>"

    def skeleton(data):
        data = re.sub(inserted, b"", data)
        data = re.sub(rb"value=(['\"])[^'\"]*\1", b"value", data)
        data = re.sub(rb"(<bsdf [^>]*?) */>", rb"\1></bsdf>", data)
        return re.sub(rb"\s+", b"", data)

    assert skeleton(after) == skeleton(before)


def texture(file="wood.png", setting='<boolean name="raw" value="true"/>', extra='name="alpha"'):
    return f'<texture type="bitmap" {extra}>{text(file, "filename")}{setting}</texture>'


GAMMA = '<float name="gamma" value="1.0"/>'


@pytest.mark.parametrize(
    ("version", "setting", "file", "message"),
    [
        ("3.0.0", '<boolean name="raw" value="true"/>', "wood.png", ""),
        ("3.0.0", "", "wood.png", 'sRGB, as it is without raw="true"'),
        ("3.0.0", '<boolean name="raw" value="false"/>', "wood.png", "takes wood.png for sRGB"),
        ("3.0.0", GAMMA, "wood.png", "takes wood.png for sRGB"),
        ("0.6.0", GAMMA, "wood.png", ""),
        ("0.6.0", "", "wood.png", 'sRGB, as it is without gamma="1"'),
        ("0.6.0", '<float name="gamma" value="-1"/>', "wood.png", "takes wood.png for sRGB"),
        ("3.0.0", "", "wood.exr", ""),
    ],
)
def test_bitmaps_are_converted_where_their_texels_are_the_alphas(version, setting, file, message):
    data = scene(rough(texture(file, setting)), version=version)
    asked = []
    found = convert_mitsuba(data, texture=lambda *words: asked.append(words) or "a'b & c.png")
    if message:
        assert message in found.problems[0][1]
        assert found.data == data
        assert not asked
    else:
        assert asked == [(file, "beckmann")]
        assert not found.problems
        ((_, values),) = properties(found.data)
        assert values["distribution"] == "ggx"
        names = [each.get("value") for each in ElementTree.fromstring(found.data).iter("string")]
        assert "a'b & c.png" in names
        assert math.isnan(found.materials[0].result)
        assert found.textures[0].file == file
    alone = convert_mitsuba(data)
    assert alone.data == data
    assert len(alone.problems) == 1


@pytest.mark.parametrize(
    ("others", "left"),
    [
        ((), 0),
        ((rough('<ref name="alpha" id="t"/>', kind="roughplastic"),), 0),
        ((rough('<ref name="reflectance" id="t"/>', kind="diffuse"),), 1),
        ((rough('<ref name="alpha" id="t"/>', text("ggx")),), 1),
        (('<alias id="t" as="u"/>',), 1),
        (('<include filename="x.xml"/>',), 1),
        ((rough('<ref name="alpha_u" id="t"/>', number("x", "alpha_v")),), 2),
    ],
)
def test_referenced_textures_are_exchanged_for_all_or_none(others, left):
    data = scene(
        texture(extra='id="t"'), rough('<ref name="alpha" id="t"/>'), *others, version="3.0.0"
    )
    found = convert_mitsuba(data, texture=lambda *_: "new.png")
    assert len(found.problems) == left
    assert (found.data == data) == bool(left)
    assert found.data.count(b"new.png") == (not left)


def test_a_nested_texture_with_an_id_is_used_where_it_stands():
    nested = f'<bsdf type="diffuse">{texture(extra=chr(39).join(("id=", "t", "")))}</bsdf>'
    data = scene(nested, rough('<ref name="alpha" id="t"/>'))
    found = convert_mitsuba(data, texture=lambda *_: "new.png")
    assert found.data == data
    assert "the texture t" in found.problems[0][1]


def test_textures_are_converted_beside_the_result(tmp_path):
    (tmp_path / "maps").mkdir()
    (tmp_path / "out").mkdir()
    texels = np.array([[0, 25, 128, 255]], np.uint8)
    Image.fromarray(texels).save(tmp_path / "maps" / "wood.png")
    data = scene(
        rough(texture("maps/wood.png")),
        rough(texture("maps\\wood.png")),
        "\n",
        rough(texture("none.png")),
        rough('<texture type="checkerboard" name="alpha"/>'),
    )
    (tmp_path / "a.xml").write_bytes(data)
    status, out, err = run(
        "mitsuba", "a.xml", "-o", "out", "--textures", "--format", "json", cwd=tmp_path
    )
    assert status == 1
    assert "a.xml:3: cannot read none.png" in err
    assert "a texture of type checkerboard" in err
    assert (tmp_path / "out" / "a.xml").read_bytes().count(b'"wood_ggx.png"') == 2
    got = np.asarray(Image.open(tmp_path / "out" / "wood_ggx.png"))[0]
    assert np.abs(got - texels[0] * CONSTANT).max() <= 0.5 + 1e-6
    (record,) = json.loads(out)
    assert record["textures"][0]["result"] == "wood_ggx.png"
    assert record["materials"][0]["result"] is None
    status, _, err = run("mitsuba", "a.xml", "-o", "out/b.xml", "--textures", cwd=tmp_path)
    assert status == 2
    assert "wood_ggx.png exists" in err
    assert not (tmp_path / "out" / "b.xml").exists()


def test_bitmaps_of_one_name_are_not_mixed_up(tmp_path):
    for folder, texel in (("a", 50), ("b", 200)):
        (tmp_path / folder).mkdir()
        Image.fromarray(np.full((1, 1), texel, np.uint8)).save(tmp_path / folder / "x.png")
    data = scene(rough(texture("a/x.png")), rough(texture("b/x.png")))
    (tmp_path / "a.xml").write_bytes(data)
    assert run("mitsuba", "a.xml", "-o", "b.xml", "--textures", cwd=tmp_path)[0] == 0
    written = (tmp_path / "b.xml").read_bytes()
    for name, texel in (("x_ggx.png", 50), ("x_ggx_2.png", 200)):
        assert written.count(b'"%s"' % name.encode()) == 1
        assert np.asarray(Image.open(tmp_path / name))[0, 0] == round(texel * CONSTANT)


def kept_error(alpha):
    """Return the error of ggx with Beckmann's α: the one that remains, at another result."""
    source, target = endpoints("beckmann", "ggx")
    pair = source.distribution, np.array([alpha]), target.distribution, np.array([alpha])
    (error,), _ = remaining_error(*pair, metric_named("environment"))
    return error


def test_command(tmp_path):
    (tmp_path / "a.xml").write_bytes(BEFORE)
    status, out, err = run("mitsuba", "a.xml", "-o", "b.xml", cwd=tmp_path)
    assert (status, out) == (0, "")
    assert (tmp_path / "b.xml").read_bytes() == AFTER
    assert (tmp_path / "a.xml").read_bytes() == BEFORE
    assert "gold & > tin" in err
    words = "mitsuba", "a.xml", "-o", "c.xml", "--format", "json", "--compare"
    status, out, _ = run(*words, cwd=tmp_path)
    (record,) = json.loads(out)
    assert [row["value"] for row in record["materials"]] == [0.2, 0.1, 0.3]
    for row in record["materials"]:
        assert row["result"] == pytest.approx(row["value"] * CONSTANT, rel=1e-9)
        assert row["rmse_unchanged"] > 1.3 * row["rmse"]
        assert row["rmse_unchanged"] == pytest.approx(kept_error(row["value"]), rel=1e-4)


def test_several_files_in_place_keep_the_originals(tmp_path):
    for name in ("a.xml", "b.xml"):
        (tmp_path / name).write_bytes(BEFORE)
    # Each file and its backup.
    for done, count in (("wrote", 4), ("nothing to change in", 2)):
        status, _, err = run("mitsuba", "--in-place", "*.xml", cwd=tmp_path)
        assert status == 0
        assert err.count(f"mdfconv: {done} ") == count
    assert {path.name for path in tmp_path.iterdir()} == {
        f"{x}.xml{end}" for x in "ab" for end in ("", ".bak")
    }
    assert (tmp_path / "a.xml").read_bytes() == AFTER
    assert (tmp_path / "b.xml.bak").read_bytes() == BEFORE


def test_a_dry_run_reports_and_writes_nothing(tmp_path):
    (tmp_path / "a.xml").write_bytes(BEFORE)
    status, out, err = run("mitsuba", "a.xml", "--dry-run", "--format", "json", cwd=tmp_path)
    assert status == 0
    assert [row["result"] for row in json.loads(out)[0]["materials"]] == pytest.approx(
        [alpha * CONSTANT for alpha in (0.2, 0.1, 0.3)], rel=1e-9
    )
    assert "nothing is written in a dry run" in err
    assert [path.name for path in tmp_path.iterdir()] == ["a.xml"]


def test_includes_are_told_about_and_not_read(tmp_path):
    (tmp_path / "a.xml").write_bytes(scene(rough(number(0.2)), '<include filename="none.xml"/>'))
    status, _, err = run("mitsuba", "a.xml", "-o", "b.xml", cwd=tmp_path)
    assert status == 0
    assert "a.xml:2: none.xml is included, and is not read" in err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--to", "phong"], "Mitsuba knows ggx and beckmann (0.6 also phong and as)"),
        (["--to", "gtr"], "Mitsuba knows ggx and beckmann (0.6 also phong and as)"),
        (["--metric", "lihgt"], "unknown metric"),
        (["--from", "ggx:rufness"], "unknown encoding of ggx 'rufness'"),
        (["--from", "ashikhmin-shirley"], "ashikhmin-shirley"),
        (["--from", "blinn-phong:vtk-gltf"], "as in blinn-phong:vtk-gltf:0.5"),
        (["bad.xml"], "bad.xml: not well-formed XML, line 1"),
    ],
)
def test_mistakes(words, message, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "a.xml").write_bytes(BEFORE)
    (tmp_path / "bad.xml").write_text("<scene>")
    status, out, err = run("mitsuba", "a.xml", *words, "-o", "out", cwd=tmp_path)
    assert (status, out) == (2, "")
    assert message in err
    assert len(err.splitlines()) == 1
    assert not list((tmp_path / "out").iterdir())


def test_the_table_fits_80_columns(tmp_path):
    (tmp_path / "in.xml").write_bytes(
        scene(rough(number(0.2)), rough(number(0.123456), kind="roughdielectric"), rough())
    )
    words = "mitsuba", tmp_path / "in.xml", "-o"
    for name, more in (("a.xml", []), ("b.xml", ["--compare"])):
        status, out = run_on_terminal(*words, tmp_path / name, *more, COLUMNS="80")
        assert status == 0
        for cell in ("roughdielectric", "0.123456", "0.0964268", "default α"):
            assert cell in out
        rows = [line for line in out.splitlines() if line.startswith("  rough")]
        assert len(rows) == 3
        assert all(len(row.rstrip()) <= 80 for row in rows)


def test_many_different_numbers_have_the_errors_of_each():
    alphas = np.linspace(0.02, 1.5, 9001)
    found = convert_mitsuba(scene(*(rough(number(f"{a:.9f}")) for a in alphas))).materials
    for each in found[::900]:
        (wanted,) = mdfconv.explain([each.value], "beckmann", "ggx", metric="environment")
        assert each.rmse == pytest.approx(wanted.rmse, rel=1e-5)
        assert each.result == pytest.approx(wanted.result, rel=1e-9)


def directions(*angles):
    """Return unit vectors for pairs of polar angle and azimuth."""
    return [(np.sin(b) * np.cos(p), np.sin(b) * np.sin(p), np.cos(b)) for b, p in angles]


def shadowing(alphas, vector):
    """Smith's G1 of GGX, Walter et al. 2007; with two axes Heitz 2014."""
    x, y, z = vector
    projected = (alphas[0] * x) ** 2 + (alphas[-1] * y) ** 2
    return 2 / (1 + np.sqrt(1 + projected / z**2))


def reflected(alphas, inward, outward):
    """Return what a perfectly reflecting rough conductor gives, times the cosine."""
    half = np.add(inward, outward) / np.linalg.norm(np.add(inward, outward))
    beta, phi = np.arccos(half[2]), np.arctan2(half[1], half[0])
    alpha = alphas[0] if len(alphas) == 1 else tuple(alphas)
    ggx = mdfconv.distribution("ggx")
    lobe = ggx.normalized(beta, alpha) if len(alphas) == 1 else ggx.normalized(beta, alpha, phi=phi)
    return lobe * shadowing(alphas, inward) * shadowing(alphas, outward) / (4 * inward[2])


def test_mitsuba_loads_the_scene_and_evaluates_the_converted_lobes():
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    shapes = [
        f'<shape type="sphere">{bsdf}</shape>'
        for bsdf in (
            rough(number(0.2)),
            rough(number(0.1, "alpha_u"), number(0.4, "alpha_v")),
            rough(),
            f'<bsdf type="twosided">{rough(text("beckmann"), number(0.5))}</bsdf>',
        )
    ]
    found = convert_mitsuba(scene(*shapes))
    loaded = mitsuba.load_string(found.data.decode()).shapes()
    wanted = [
        each.result if isinstance(each.result, tuple) else (each.result,)
        for each in found.materials
    ]
    assert len(loaded) == len(wanted) == 4
    vectors = directions((0, 0), (0.3, 0.2), (0.6, 2), (0.8, 4), (1.2, 5))
    for shape, alphas in zip(loaded, wanted, strict=True):
        bsdf = shape.bsdf()
        for inward in vectors:
            interaction = mitsuba.SurfaceInteraction3f()
            interaction.wi = inward
            for outward in vectors:
                value = bsdf.eval(mitsuba.BSDFContext(), interaction, outward)
                assert list(value) == pytest.approx(
                    [reflected(alphas, inward, outward)] * 3, rel=1e-3
                )
