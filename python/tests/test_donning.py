"""What changed between sessions: known shifts and gains come back, what cannot be compared is refused, one real glove over months."""
import json
import runpy
from pathlib import Path

import numpy as np
import pytest

pd = pytest.importorskip("pandas")

from flexor import donning

DATA = Path(__file__).parents[2] / "../shared/data/donning"


def worn(shift: float = 0, gain: float = 1, seed: int = 1, cycles: int = 12) -> np.ndarray:
    """Whole bends, 300 to 620 counts at gain 1 about the middle, with noise of one count."""
    random = np.random.default_rng(seed)
    bend = (1 - np.cos(np.linspace(0, 2 * np.pi * cycles, 100 * cycles))) / 2 - 0.5
    return 460 + shift + 320 * gain * bend + random.normal(size=len(bend))


def sessions(**columns) -> dict[str, pd.DataFrame]:
    """Of each column readings in each session."""
    count = len(next(iter(columns.values())))
    return {f"s{i}": pd.DataFrame({name: values[i] for name, values in columns.items()}) for i in range(count)}


def three(*shifts: float, seed: int = 1) -> list[np.ndarray]:
    return [worn(shift, seed=seed + i) for i, shift in enumerate(shifts)]


def test_where_a_sensor_lies_and_reaches():
    changes = donning.compare(sessions(index_count=[worn(), worn(64, seed=2), worn(64, 1.2, seed=3)]))
    a, b, c = (changes.loc[name, "index_count"] for name in ("s0", "s1", "s2"))
    assert b["shift"] - a["shift"] == pytest.approx(64 / 341, abs=0.02)  # the mean span is 341
    assert c["log_gain"] - a["log_gain"] == pytest.approx(np.log(1.2), abs=0.02)
    assert a["shift_low"] < a["shift"] < a["shift_high"]
    assert a["shape"] < 0.02
    assert a["noise"] == pytest.approx(1 / 341, abs=0.0005)


@pytest.mark.parametrize(("other", "alike"), [((-60, 0, 60), (4 * 0.8 + 2 * 0.95) / 6), ((60, 0, -60), 4 * 0.8 / 6),
                                              ((60, -120, 60), 4 * 0.8 / 6)])
def test_how_alike_the_shifts_of_sensors_are(other, alike):
    """Together, against each other, and each on its own: two sessions' worth of evidence beside the shipped prior."""
    changes = donning.compare(sessions(index=three(-60, 0, 60), middle=three(*other, seed=11)))
    assert donning.prior(changes)["alike"] == pytest.approx(alike, abs=0.02)


def test_what_cannot_be_compared_is_refused():
    sound = three(0, 60, 75)
    for columns, what in ((sound[:2], "in 2 session.s., at least 3"), ([*sound[:2], sound[2] * 5 / 1023], "s2: index spans"),
                          ([*sound[:2], np.full(900, 5.0)], "s2: index stands still"), ([*sound[:2], sound[2][:20]], "s2: 20 row"),
                          ([*sound[:2], np.full(900, np.nan)], "index: it was read in 2 session")):
        with pytest.raises(ValueError, match=what):
            donning.compare(sessions(index=columns))
    with pytest.raises(ValueError, match="called like a finger"):
        donning.compare(sessions(sensor=sound))
    with pytest.raises(ValueError, match="s2: no column index"):
        donning.compare(sessions(index=sound) | {"s2": pd.DataFrame({"middle": sound[2]})})


def test_the_document_is_what_recalibrate_reads():
    four = [*three(0, 60, 75), worn(20, seed=9)]
    whole = donning.compare(sessions(index=four))
    holes = donning.compare(sessions(index=four, middle=[four[0], four[1], np.full(1200, np.nan), four[3]]))
    assert list(holes.loc["s2"].index) == ["index"], "a sensor that was not read leaves the others"
    np.testing.assert_allclose(holes.xs("index", level="sensor")["shift"], whole["shift"])
    prior = json.loads(json.dumps(donning.prior(holes)))
    assert list(prior) == ["schema", "schema_version", *donning.SHIPPED]
    assert (prior["schema"], prior["sessions"]) == ("flexor-donning-prior", 4)


@pytest.mark.parametrize(("wearer", "shift_sd", "log_gain_sd", "alike"), [("P6", 0.1364, 0.1090, 0.8186), ("P2", 0.1124, 0.1186, 0.8455)])
def test_a_real_glove_over_months(wearer, shift_sd, log_gain_sd, alike):
    if not DATA.exists():
        pytest.skip("needs ../shared/data/donning, which is not part of the repository")
    prior = donning.prior(donning.compare({file.stem: pd.read_csv(file) for file in sorted(DATA.glob(f"{wearer}_*.csv"))}))
    assert (prior["shift_sd"], prior["log_gain_sd"], prior["alike"]) == pytest.approx((2**0.5 * shift_sd, 2**0.5 * log_gain_sd, alike), abs=2e-4)


def test_the_command_reads_readings_alone(tmp_path, monkeypatch):
    """Whatever else a log has, and whatever its clock does: only the order of rows counts."""
    files = [tmp_path / f"s{i}.csv" for i in range(3)]
    for file, readings in zip(files, three(0, 60, 75)):
        t_s = np.r_[0.01 * np.arange(600), 3 + 0.01 * np.arange(600)]
        pd.DataFrame({"t_s": t_s, "index": readings, "pose": ["1"] * 600 + ["1-2"] * 600}).to_csv(file, index=False)
    monkeypatch.setattr("sys.argv", ["flexor.donning", *map(str, files), "--out", str(tmp_path / "prior.json")])
    runpy.run_path(donning.__file__, run_name="__main__")
    frames = {str(file): pd.read_csv(file) for file in files}
    assert json.loads((tmp_path / "prior.json").read_text()) == donning.prior(donning.compare(frames))
