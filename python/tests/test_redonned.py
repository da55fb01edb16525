"""A real finger with angles, its sensor moved as a real glove moved from session to session: what `recalibrate` makes of one to three
whole bends without a camera, from open hand to open hand and from fist to fist. Fitted on the first half, bends and score from the second."""
from pathlib import Path

import numpy as np
import pytest

pd = pytest.importorskip("pandas")

import flexor
from flexor import donning

DATA = Path(__file__).parents[2] / "../shared/data"
pytestmark = pytest.mark.skipif(not (DATA / "donning").exists(), reason="needs ../shared/data, which is not part of the repository")
TURN_DEG = 30


class Finger:
    def __init__(self, name: str, sensor: str) -> None:
        log = pd.read_csv(DATA / "glove" / name / "realigned_20hz.csv").dropna(subset=[sensor, "angle_ABC_deg"]).query("adc_gap == 0")
        self.t_s, self.reading, self.angle_deg = (log[column].to_numpy(float) for column in ("t_s", sensor, "angle_ABC_deg"))
        self.half = len(log) // 2
        low, high = np.quantile(self.reading[: self.half], [0.02, 0.98])
        self.middle, self.span = (low + high) / 2, high - low
        both = flexor.Recording({"index_adc": self.reading, "index_deg": self.angle_deg}, time=self.t_s)
        self.model = flexor.identify([(both, both)], {"index": ("index_adc", "index_deg")}, progress=False).compensator

    def log(self, reading, rows=slice(None)) -> flexor.Recording:
        return flexor.Recording({"index_adc": reading[rows]}, time=self.t_s[rows])

    def square_deg2(self, model: flexor.Compensator, reading, track: bool = False) -> float:
        """Mean square error on the second half, but for its first second."""
        out = model.predict(self.log(reading), track=track, progress=False)
        late = out.t_s >= self.t_s[self.half] + 1
        seen = np.searchsorted(self.t_s, out.t_s[late] + 1e-6, "right") - 1
        return float(((out["index_deg"][late] - self.angle_deg[seen]) ** 2).mean())

    def put_on(self, shift: float, gain: float) -> np.ndarray:
        return np.clip(self.middle + gain * (self.reading - self.middle) + shift * self.span, 0, 1023)

    def bends(self, count: int) -> list[np.ndarray]:
        """Rows from a second before a turn of the finger in the second half to a second after the `count`-th of the same kind."""
        turned_s: tuple[list, list] = ([], [])
        way, low, high = 0, self.half, self.half
        for i in range(self.half, len(self.t_s)):
            low = i if self.angle_deg[i] < self.angle_deg[low] else low
            high = i if self.angle_deg[i] > self.angle_deg[high] else high
            falls = way >= 0 and self.angle_deg[i] < self.angle_deg[high] - TURN_DEG
            if falls or (way <= 0 and self.angle_deg[i] > self.angle_deg[low] + TURN_DEG):
                turned_s[int(falls)].append(self.t_s[high if falls else low])
                way, low, high = (-1 if falls else 1), i, i
        return [np.flatnonzero((self.t_s >= begin_s - 1) & (self.t_s <= end_s + 1))
                for kind in turned_s for begin_s, end_s in zip(kind, kind[count:])]


def test_tracking_costs_a_glove_that_was_not_put_on_again_at_most_three_percent():
    for one in (Finger("index_ind2", "adc_A1"), Finger("middle_mid1", "adc_A2")):
        assert one.square_deg2(one.model, one.reading, track=True) <= 1.03**2 * one.square_deg2(one.model, one.reading)


@pytest.mark.long
@pytest.mark.parametrize(("name", "sensor", "most_deg"), [("index_ind2", "adc_A1", (6.8, 3.6, 2.9)), ("middle_mid1", "adc_A2", (7.6, 5, 4.7))])
def test_whole_bends_bring_a_real_finger_back(name, sensor, most_deg):
    one = Finger(name, sensor)
    moves = donning.compare({str(file): pd.read_csv(file) for file in (DATA / "donning").glob("P6*.csv")})
    assert len(moves) >= 27
    now = [one.put_on(shift, np.exp(log_gain)) for shift, log_gain in moves[["shift", "log_gain"]].to_numpy()]
    left = np.array([one.square_deg2(one.model, reading) for reading in now])  # nothing done
    for count, most in enumerate(most_deg, 1):
        mapped, recalibrated = [], []  # the middle of the bends' readings to the first half's; what is tested
        for rows in one.bends(count):
            for reading in now:
                off = one.middle - np.quantile(reading[rows], [0.02, 0.98]).mean()
                mapped.append(one.square_deg2(one.model, reading + off))
                model = flexor.recalibrate(one.model, recording=one.log(reading, rows))[0]
                recalibrated.append(one.square_deg2(model, reading))
        error_deg, of_middle_deg = np.sqrt(np.mean(recalibrated)), np.sqrt(np.mean(mapped))
        worse = np.mean(np.sqrt(np.reshape(recalibrated, (-1, len(now))) / left) > 1.05)
        print(f"{name} {count} bends: {np.sqrt(left.mean()):.2f} deg, middle mapped {of_middle_deg:.2f}, recalibrated {error_deg:.2f}; worse {worse:.1%}")
        assert 0.9 * np.sqrt(one.square_deg2(one.model, one.reading)) < error_deg < most, "too good to be true, or too bad"
        assert worse <= 0.05 and (count == 1 or error_deg < of_middle_deg)
