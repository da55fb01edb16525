"""What is learnt of people whose hands are known, and what `flexor posture complete` makes of it on people whom it never saw."""
import os
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from flexor import posture_learning as learning

ROOT = Path(__file__).parents[2]
PROGRAM = Path(os.environ.get("FLEXOR_PROGRAM", ROOT / "build/release/flexor"))
HANDS = ROOT / "../shared/data/hands"


def person(seed: int, trials: int = 30) -> learning.Recorded:
    """Trials of three seconds at 10 Hz, half a second at rest, then a held posture; DIP is PIP squared over -150; one degree of noise."""
    random = np.random.default_rng(seed)
    offset, gain = 6 * random.normal(size=23), 1 + 0.1 * random.normal(size=23)
    finger = np.minimum(np.arange(23) // 4, 4)
    hands = []
    for _ in range(trials):
        bends = 0.6 * random.uniform() + 0.4 * random.uniform(size=5)
        hand = np.where(np.arange(30) < 5, 0, 1)[:, None] * (gain * bends[finger] * -60) + offset
        for joint, follows in learning.COUPLINGS:
            hand[:, learning.JOINTS.index(joint)] = hand[:, learning.JOINTS.index(follows)] ** 2 / -150
        hands.append(hand + random.normal(size=hand.shape))
    return learning.Recorded(f"person{seed}.csv", f"seed{seed}", np.tile(0.1 * np.arange(30), trials), np.concatenate(hands))


def table(recorded: learning.Recorded) -> pd.DataFrame:
    return pd.DataFrame(recorded.hands_deg, columns=[f"{joint}_deg" for joint in learning.JOINTS], index=pd.Index(recorded.t_s, name="t_s"))


PEOPLE = [person(seed) for seed in (1, 2, 3)]


def test_dip_follows_pip():
    for curve in learning.learn(PEOPLE)["curves"]:
        for angle_deg in (-50, -20):
            assert np.interp(angle_deg, curve["knot_deg"], curve["value_deg"]) == pytest.approx(angle_deg**2 / -150, abs=1.5)
        assert 0.9 < curve["sd_deg"] < 2  # the noise of DIP, and of PIP through the slope


def test_rest_is_the_start_of_each_trial():
    at_rest = PEOPLE[0].t_s <= learning.REST_S
    np.testing.assert_allclose(learning.rest_deg(PEOPLE[0]), PEOPLE[0].hands_deg[at_rest].mean(axis=0))
    np.testing.assert_allclose(learning.learn(PEOPLE)["people"][0]["rest_deg"], PEOPLE[0].hands_deg[at_rest].mean(axis=0), atol=0.006)


def test_typical_hands_are_the_centres_of_what_is_there():
    hands = np.where(np.arange(60) < 20, -50, 30 + 0.1 * (np.arange(60) % 2))[:, None] * np.ones(23)
    centre_deg, seconds, within_deg2 = learning.codebook(hands, 30, 4, 3)
    assert seconds.sum() == pytest.approx(30)
    np.testing.assert_allclose(centre_deg.T @ seconds / 30, hands.mean(axis=0))
    assert within_deg2.max() < 0.003
    assert learning.learn(PEOPLE, 3) == learning.learn(PEOPLE, 3)


def test_standard_errors_cover_what_they_claim():
    errors = np.abs(np.random.default_rng(3).normal(0, 2, 20000))
    assert learning.standard_error(errors, np.full(20000, 0.5)) == pytest.approx(2, abs=0.05)
    errors[:400] = 1e6  # a few wild ones draw it little
    assert learning.standard_error(errors, np.full(20000, 0.5)) == pytest.approx(2.08, abs=0.06)


def test_too_few_people_are_refused():
    for people, what in ((PEOPLE[:2], "three people"), ([*PEOPLE[:2], PEOPLE[0]], "person1.csv: the same recording twice")):
        with pytest.raises(ValueError, match=what):
            learning.learn(people)


@pytest.mark.parametrize(("wrong", "what"), [(9999, 'row 7: column "thumb_rot_deg": 9999 is no angle'),
                                             (np.nan, 'row 7: column "thumb_rot_deg": nan is no angle'),
                                             (None, 'no column "thumb_rot_deg"')])
def test_a_file_that_is_no_recording_is_refused(tmp_path, wrong, what):
    frame = table(PEOPLE[0])
    if wrong is None:
        frame = frame.drop(columns="thumb_rot_deg")
    else:
        frame.iloc[5, 0] = wrong
    frame.to_csv(tmp_path / "glitch.csv")
    with pytest.raises(ValueError, match=f"glitch.csv: {what}"):
        learning.read_recorded(tmp_path / "glitch.csv")


BENDS = {"thumb": ["thumb_mcp", "thumb_ip"]} | {f: [f"{f}_mcp", f"{f}_pip"] for f in ("index", "middle", "ring", "pinky")}

def complete(document: Path, frame: pd.DataFrame, inputs: dict[str, list[str]], rest_s: float, folder: Path) -> pd.DataFrame:
    """inputs: joints that each sums."""
    bends = [f"{name}={'+'.join(joints)}" for name, joints in inputs.items() if len(joints) > 1]
    frame.to_csv(folder / "in.csv", float_format="%.4f")
    subprocess.run([PROGRAM, "posture", "complete", document, folder / "in.csv", "--from", ",".join(inputs), "--rest", f"{rest_s:.6f}",
                    *(["--bends", ",".join(bends)] if bends else []), "--out", folder / "out.csv"],
                   check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=300)
    return pd.read_csv(folder / "out.csv")


def test_the_program_reads_what_was_learnt(tmp_path):
    if not PROGRAM.exists():
        pytest.skip("flexor is not built")
    for one in PEOPLE:
        table(one).to_csv(tmp_path / one.source)
    learning.write(tmp_path / "p.json", learning.learn([learning.read_recorded(tmp_path / one.source) for one in PEOPLE]))
    truth = table(person(5, 3))
    out = complete(tmp_path / "p.json", truth, BENDS, 0, tmp_path)
    error_deg = out[truth.columns].to_numpy() - truth.to_numpy()
    assert 6 < np.sqrt((error_deg**2).mean()) < 10.5  # offsets of 6 degrees are not to be told


TEN = {joint: [joint] for joints in BENDS.values() for joint in joints}


class Stranger:
    """A person of the recordings, with a document of the others."""

    def __init__(self, recorded: learning.Recorded, others: list[learning.Recorded], folder: Path):
        self.recorded, self.folder, self.document = recorded, folder, folder / f"without_{recorded.source}.json"
        learning.write(self.document, learning.learn(others))
        begins = np.r_[True, np.diff(recorded.t_s) < 0]
        self.trial = np.cumsum(begins) - 1
        self.since_s = recorded.t_s - recorded.t_s[begins][self.trial]

    def errors(self, inputs, shown: str, lost: str | None = None) -> tuple[np.ndarray, ...]:
        """Per joint rmse_deg; within one and two standard errors; share of readings that were refused.

        What is shown stands before the recording: three rows of the resting pose, for each shown angle is the middle one of three,
        and the sixth second of every other trial, no row of which is scored.
        """
        hands, prefix = self.recorded.hands_deg, np.empty((0, 23))
        rests = (self.since_s <= learning.REST_S) & ((self.trial == 0) | (shown != "first"))
        of_shown = (self.trial % 2 == 0) & (shown == "pieces")
        step_s = np.full(3, 1e-3)
        if shown != "nothing":
            piece = of_shown & (self.since_s >= 5) & (self.since_s < 6)
            prefix = np.concatenate([np.tile(hands[rests].mean(axis=0), (3, 1)), hands[piece]])
            step_s = np.r_[step_s, np.diff(self.recorded.t_s, prepend=0)[piece]]
        scored = ~of_shown if shown == "nothing" else ~rests & ~of_shown
        t_s = np.cumsum(np.r_[step_s[: len(prefix)], np.full(len(hands), 1e-2)])
        frame = pd.DataFrame(np.concatenate([prefix, hands]), columns=[f"{joint}_deg" for joint in learning.JOINTS],
                             index=pd.Index(t_s, name="t_s"))
        for name, joints in inputs.items():
            frame[f"{name}_deg"] = np.nan if name == lost else frame[[f"{joint}_deg" for joint in joints]].sum(axis=1)
        rest_s = t_s[len(prefix)] - t_s[0] - 5e-3 if len(prefix) else 0
        out = complete(self.document, frame, inputs, rest_s, self.folder).iloc[len(prefix):][scored]
        error_deg = np.abs(out[[f"{joint}_deg" for joint in learning.JOINTS]].to_numpy() - hands[scored])
        se_deg = out[[f"{joint}_se_deg" for joint in learning.JOINTS]].to_numpy()
        told = [joint not in inputs for joint in learning.JOINTS]
        refused = (out[[f"{name}_quality" for name in inputs]] != 0).to_numpy().mean()
        return (np.sqrt((error_deg**2).mean(axis=0)), (error_deg <= se_deg)[:, told].mean(), (error_deg <= 1.96 * se_deg)[:, told].mean(),
                refused)


def ridge_rmse_deg(people: list[learning.Recorded]) -> np.ndarray:
    """Per joint, from five bends, mean over people left out; a hundredth of the bends' variance as penalty."""
    sums = np.array([[joint in joints for joint in learning.JOINTS] for joints in BENDS.values()], dtype=float)
    rmse = []
    for one in people:
        others = np.concatenate([other.hands_deg for other in people if other is not one])
        mean, covariance = others.mean(axis=0), np.cov(others.T, bias=True)
        inputs = sums @ covariance @ sums.T
        away = one.hands_deg - mean
        slope = np.linalg.solve(inputs + 0.01 * np.diag(np.diag(inputs)), sums @ covariance)
        rmse.append(np.sqrt(((away - away @ sums.T @ slope) ** 2).mean(axis=0)))
    return np.mean(rmse, axis=0)


@pytest.fixture(scope="module")
def strangers(tmp_path_factory):
    if not (HANDS.exists() and PROGRAM.exists()):
        pytest.skip("needs ../shared/data/hands, which is not part of the repository, and flexor built")
    if not os.environ.get("FLEXOR_LONG"):
        pytest.skip("minutes: FLEXOR_LONG=1")
    people = [learning.read_recorded(HANDS / f"subject{i}.csv") for i in range(1, 6)]
    return [Stranger(one, [other for other in people if other is not one], tmp_path_factory.mktemp("hands")) for one in people]


@pytest.mark.parametrize(("key", "inputs", "shown", "least_deg", "most_deg"), [
    ("bends", BENDS, "nothing", 11, 12.4), ("bends_rest", BENDS, "rest", 11, 11.5), ("bends_first", BENDS, "first", 10, 11.5),
    ("bends_hand", BENDS, "pieces", 8, 9), ("joints_rest", TEN, "rest", 3, 3.9)])
def test_people_whom_it_never_saw(strangers, key, inputs, shown, least_deg, most_deg):
    figures = [stranger.errors(inputs, shown) for stranger in strangers]
    rmse_deg, within_68, within_95, refused = (np.mean([np.mean(one[i]) for one in figures]) for i in range(4))
    print(f"\nposture.{key}.rmse {rmse_deg:.3f} deg\nposture.{key}.within_68 {100 * within_68:.2f} %\n"
          f"posture.{key}.within_95 {100 * within_95:.2f} %\nposture.{key}.refused {100 * refused:.3f} %")
    assert least_deg < rmse_deg < most_deg
    assert 0.64 < within_68 < 0.74
    assert 0.92 < within_95 < 0.97
    assert refused < 0.002, "nothing is wrong with these readings"


def test_a_lost_finger_comes_from_the_others(strangers):
    ridge = ridge_rmse_deg([stranger.recorded for stranger in strangers])
    print(f"\nposture.ridge.rmse {ridge.mean():.3f} deg")
    for finger, name in enumerate(BENDS):
        own = slice(4 * finger, 4 * finger + 4)
        rmse_deg = np.mean([stranger.errors(BENDS, "rest", lost=name)[0] for stranger in strangers], axis=0)
        ratio = rmse_deg[own].mean() / ridge[own].mean()
        print(f"posture.lost.{name} {ratio:.3f} 1")
        assert 0.6 < ratio < 1.3, name
