"""What `explain` says beside the result."""

import numpy as np

import mdfconv


def test_cautions():
    inside, outside, turned = mdfconv.explain([0.4, 0.8, 0.9], "beckmann", "ggx")
    assert inside.cautions == ()
    assert inside.notes == (
        "keeps the shape of the lobe, approximately",
        "by C = 1.2 m_B − 0.56 m_B³ (Table 4)",
    )
    assert "outside the paper's sweep" in outside.cautions[0]
    assert len(outside.cautions) == 1
    assert "turns around" in turned.cautions[1]
    assert mdfconv.explain(0.9, "beckmann", "ggx", "peak")[0].cautions == ()
    assert mdfconv.explain(2, "blinn-phong", "ggx:roughness")[0].cautions


def test_routes():
    assert mdfconv.explain(50, "sawicki", "ggx:roughness")[0].route == (
        "N = (N_DS − 0.3)/1.174 (eq. 15)",
        "C = 1.697/√(N+4.5) (Table 4)",
        "α = r²",
    )
    assert mdfconv.explain(0.2, "schlick", "smoothie")[0].route == (
        "schlick has beckmann's m_B",
        "C = 1.2 m_B − 0.56 m_B³ (Table 4)",
        "α_s = 2α/√(1−α²), exact",
    )
    same = mdfconv.explain(0.25, "ggx", "ggx:roughness", "ward")[0]
    assert same.route == ("α = r²",)
    assert same.max_error == 0
    assert same.notes == ("exact: the same form", "by α = r²")
    assert mdfconv.explain(0.6, "ggx", "smoothie")[0].cautions == ()


def test_pairs_report_the_worse_axis():
    both = mdfconv.explain((100, 20), "ashikhmin-shirley", "ggx")[0]
    axes = mdfconv.explain([100, 20], "blinn-phong", "ggx")
    assert both.result == tuple(axis.result for axis in axes)
    assert both.rmse == max(axis.rmse for axis in axes)
    assert both.value == (100.0, 20.0)


def test_many_values_without_errors():
    found = mdfconv.explain(np.linspace(0.01, 0.4, 1000), "beckmann", "ggx", errors=False)
    assert len(found) == 1000
    assert np.isnan(found[0].rmse)
    assert len(mdfconv.explain(np.linspace(0.01, 0.4, 600), "beckmann", "ggx")) == 600
    assert mdfconv.explain([], "beckmann", "ggx") == []
