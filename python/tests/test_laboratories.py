"""Laboratories: the prior, known densities, and that a laboratory, a run and a summary are what they say."""

import json

import numpy as np
import pytest

pytest.importorskip("emcee")
pytest.importorskip("pandas")

import flexor
from flexor import laboratories

SHIPPED = [1.0, 25.0, 25.0, 25.0, 25.0, 40.0, 80.0, 80.0, 80.0, 80.0, 60.0, 0.1, 1.0, 0.03, 2.0, 0.5, 1.0, 1.0, 0.05, 0.05, 15.0, 0.5]
QUICK = {"gestures": "1", "trials": 1}


def ensemble(*rows):
    parameters = [{"name": name, "autocorrelation_steps": 20.0, "effective": 300.0} for name in laboratories.prior().names]
    return {"schema": "flexor-ensemble", "schema_version": 2, "seed": 7, "kept": 400, "acceptance": 0.2, "parameters": parameters,
            "laboratories": [list(row) for row in rows]}


def test_the_prior():
    prior, random = laboratories.prior(), np.random.default_rng(1)
    x = np.array([prior.draw(random) for _ in range(2000)])
    assert (prior.min <= x).all() and (x <= prior.max).all() and (x[:, :5] < x[:, 5:10]).all()
    normal = np.isfinite(prior.deviation)
    assert (abs(np.median(x, axis=0) - prior.median) / prior.deviation < 0.15)[normal].all()
    assert prior.log_density(prior.median + np.eye(22)[3] * prior.deviation[3]) == pytest.approx(-0.5)
    assert prior.log_density(prior.median + np.eye(22)[3] * 46) == -np.inf
    laboratories._parameters(prior.values(prior.median))  # the twin has them


def test_a_known_density_is_recovered():
    """In as many dimensions: a wrong factor in a move, such as that of emcee's DESnookerMove, shows in few of them not at all."""
    mean, deviation = np.linspace(-2, 2, 16), 3.0
    start = mean + deviation * np.random.default_rng(1).normal(size=(64, 16))
    draws, tau, acceptance = laboratories.sample(lambda x: -(((x - mean) / deviation) ** 2).sum() / 2, start, 1500, progress=False)
    assert draws.shape == (1000, 64, 16) and 0.1 < acceptance < 0.9
    error = np.sqrt(tau / (1000 * 64))
    assert (abs(draws.mean((0, 1)) - mean) < 4 * deviation * error).all()
    assert draws.std((0, 1)) / deviation == pytest.approx(1, abs=5 * error.max())
    assert (draws.std((0, 1)) / deviation).mean() == pytest.approx(1, abs=0.02)


def test_draws_do_not_depend_on_threads():
    one, three = (laboratories.sample(lambda x: -(x**2).sum(), np.random.default_rng(1).normal(size=(8, 2)), 30, threads=n, progress=False)[0]
                  for n in (1, 3))
    assert np.array_equal(one, three)


def test_the_shipped_parameters_are_plausible():
    likely, scattered = (laboratories.log_likelihood(laboratories.core.parameters("", changes), 16, 7) for changes in ([], ["person.pose_spread_deg=5"]))
    assert -4 < likely < 0 and scattered < likely


def test_a_cell_counts_by_the_standard_error_of_its_trials(monkeypatch):
    assert list(laboratories.standard_errors().values()) == pytest.approx([0.277, 0.494, 0.619], abs=0.001)
    table = [cell["error_deg_s"] for cell in laboratories.published()[:12]]
    table[5] *= np.exp(2 * laboratories.standard_errors()["published-hw"])
    monkeypatch.setattr(laboratories, "_table", lambda *_: table)
    assert laboratories.log_likelihood(None, 16, 7) == pytest.approx(-2)


def test_a_drawn_document_is_read_again(tmp_path):
    drawn = laboratories.draw(3, walkers=44, steps=3, starts=44, trials=1, progress=False)
    (tmp_path / "l.json").write_text(json.dumps(drawn))
    assert laboratories.load(tmp_path / "l.json") == drawn and len(drawn["laboratories"]) == 3
    assert "--steps" in laboratories.doubt(drawn)
    with pytest.raises(flexor.InputError, match="leave 88 draws"):
        laboratories.draw(89, walkers=44, steps=3)


def test_a_laboratory_is_what_it_is_alone(tmp_path):
    two = ensemble(SHIPPED, SHIPPED)
    rows = laboratories.run(two, threads=2, progress=False, out=tmp_path, **QUICK)
    assert rows[1] == laboratories.play(SHIPPED, 1, **QUICK) != rows[0]
    journal = tmp_path / "laboratories.jsonl"
    text = journal.read_text()
    journal.write_text(text[:-20])  # cut off in the second's line
    assert laboratories.run(two, progress=False, out=tmp_path, **QUICK) == rows and journal.read_text() == text
    with pytest.raises(flexor.InputError, match="another run"):
        laboratories.run(two, out=tmp_path, gestures="2")
    held = laboratories.core.FolderLock(tmp_path)
    with pytest.raises(flexor.InputError, match="another run works in this folder"):
        laboratories.run(two, out=tmp_path, **QUICK)
    del held
    (tmp_path / "run.json").unlink()
    with pytest.raises(flexor.InputError, match="another run"):
        laboratories.run(two, out=tmp_path, **QUICK)


@pytest.mark.long
def test_dask_loses_two_workers(tmp_path, dying_cluster):
    client, progress = dying_cluster
    eight = ensemble(*[SHIPPED] * 8)
    laboratories.run(eight, out=tmp_path / "whole", progress=False, **QUICK)
    laboratories.run(eight, out=tmp_path / "out", client=client, progress=progress, **QUICK)
    assert (tmp_path / "out/laboratories.jsonl").read_bytes() == (tmp_path / "whole/laboratories.jsonl").read_bytes()


def test_a_scenario_changes_what_is_played():
    cells = laboratories.frame([laboratories.play(SHIPPED, 0, scenarios=True, **QUICK)])
    assert cells.scenario.nunique() == 9
    plain = laboratories.play(SHIPPED, 0, **QUICK)["cells"]
    assert cells[cells.scenario == ""].error_deg_s.tolist() == [cell["error_deg_s"] for cell in plain]
    fitted = cells[cells.compensator == "identified"].error_deg_s
    assert (fitted.iloc[1:] != fitted.iloc[0]).all()


def test_a_summary_has_the_quantiles():
    def row(hw, own):
        cells = [{"scenario": "", "gesture": 1, "compensator": name, "error_deg_s": value}
                 for name, value in (("published-hw", hw), ("identified", own))]
        return {"cells": cells, "lead_s": None, "shapes": [{"gesture": 2, "value_deg": own, "agrees": own < 3}]}

    result = laboratories.summary([row(10, k) for k in range(1, 22)], ensemble(*[SHIPPED] * 21))
    assert result["cells"][1]["total_error_deg_s"] == {"median": 11, "low": 2, "high": 20}
    assert result["headlines"][1]["mean_ratio_to"]["published-hw"] == pytest.approx({"median": 1.1, "low": 0.2, "high": 2})
    assert result["headlines"][1]["share_of_laboratories_below"]["published-hw"] == pytest.approx(9 / 21)
    assert result["shapes"][0]["share_of_laboratories_that_agree"] == pytest.approx(2 / 21)
    assert result["log_rms"]["gestures_1_to_4"] is None and result["ensemble"]["least_effective"] == 300
    assert "1.10 (0.20 to 2.00), 43 %" in laboratories.text(result)


@pytest.mark.parametrize("broken", ["", "[]", "{}", json.dumps(ensemble([1.0])), json.dumps(ensemble(["a"] * 16)),
                                    json.dumps(ensemble(SHIPPED) | {"schema_version": 1})])
def test_nonsense_is_refused_in_a_line(tmp_path, broken):
    (tmp_path / "l.json").write_text(broken)
    with pytest.raises(flexor.InputError, match="l.json: [^\n]*$"):
        laboratories.load(tmp_path / "l.json")
