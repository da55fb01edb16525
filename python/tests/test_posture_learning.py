"""What is learnt of people whose hands are known."""
import json

import numpy as np
import pytest

pd = pytest.importorskip("pandas")
pytest.importorskip("sklearn")

from flexor import posture_learning as learning


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


def test_what_was_learnt_completes_a_hand(tmp_path):
    flexor = pytest.importorskip("flexor._core") and pytest.importorskip("flexor")
    for one in PEOPLE:
        table(one).to_csv(tmp_path / one.source)
    document = learning.learn([learning.read_recorded(tmp_path / one.source) for one in PEOPLE])
    truth = table(person(5, 3))
    truth.index = pd.Index(0.1 * np.arange(len(truth)), name="t_s")
    inputs = {"thumb": ["thumb_mcp", "thumb_ip"]} | {f: [f"{f}_mcp", f"{f}_pip"] for f in ("index", "middle", "ring", "pinky")}
    sensed = pd.DataFrame({f"{name}_deg": truth[[f"{joint}_deg" for joint in joints]].sum(axis=1) for name, joints in inputs.items()})
    bends = [f"{name}={'+'.join(joints)}" for name, joints in inputs.items()]
    out = flexor.posture.complete(sensed, list(inputs), bends=bends, document=json.dumps(document)).frame
    error_deg = out[truth.columns].to_numpy() - truth.to_numpy()
    assert 6 < np.sqrt((error_deg**2).mean()) < 10.5  # offsets of 6 degrees cannot be seen
