"""Standard errors and what is shown of a hand, on real recordings that no fit saw."""
import json
from pathlib import Path

import numpy as np
import pytest

import flexor

pd = pytest.importorskip("pandas")

DATA = Path(__file__).parents[2] / "../shared/data"


@pytest.mark.skipif(not (DATA / "glove").exists(), reason="needs ../shared/data/glove, which is not part of the repository")
def test_intervals_cover_another_part_of_the_motion():
    """Of the errors on the half that was not fitted, each way: 68 of 100 within one standard error, 95 within 1.96."""
    within = []
    for finger, sensor in (("index_ind2", "adc_A1"), ("middle_mid1", "adc_A2")):
        log = pd.read_csv(DATA / "glove" / finger / "realigned_20hz.csv", index_col="t_s").dropna(subset=[sensor])
        half = len(log) // 2
        for order in (np.arange(len(log)), np.roll(np.arange(len(log)), half)):
            one = log.iloc[order].set_index(log.index)
            pairs = {joint: (sensor, f"angle_{joint}_deg") for joint in ("ABC", "BCD")}
            model = flexor.identify([(one, one)], pairs, progress=False).compensator
            out = model.predict(one, intervals=True, progress=False).frame.reindex(one.index, method="nearest").iloc[half:]
            for joint, (_, angle) in pairs.items():
                errors = (out[f"{joint}_deg"] - one[angle].iloc[half:]).abs() / out[f"{joint}_se_deg"]
                within.append([(errors <= 1).mean(), (errors <= 1.96).mean()])
    within_68, within_95 = np.mean(within, axis=0)
    assert 0.62 < within_68 < 0.74, within
    assert 0.91 < within_95 < 0.98, within


@pytest.mark.long
@pytest.mark.skipif(not (DATA / "hands").exists(), reason="needs ../shared/data/hands, which is not part of the repository")
def test_what_is_shown_of_a_stranger_never_harms():
    """Five people, each by a document of the other four, after nothing and after their first seconds."""
    pytest.importorskip("sklearn")
    from flexor import posture_learning as learning

    people = [learning.read_recorded(DATA / f"hands/subject{i}.csv") for i in range(1, 6)]
    bends = {"thumb": ["thumb_mcp", "thumb_ip"]} | {f: [f"{f}_mcp", f"{f}_pip"] for f in ("index", "middle", "ring", "pinky")}
    columns = [f"{joint}_deg" for joint in learning.JOINTS]
    after_deg = []
    for one in people:
        document = json.dumps(learning.learn([other for other in people if other is not one]))
        step_s = np.diff(one.t_s, prepend=0)
        t_s = np.cumsum(np.where((step_s > 0) & (step_s < 0.5), step_s, 0.0625))
        frame = pd.DataFrame(one.hands_deg, columns=columns, index=pd.Index(t_s, name="t_s"))
        for name, joints in bends.items():
            frame[f"{name}_deg"] = frame[[f"{joint}_deg" for joint in joints]].sum(axis=1)
        after_deg.append([])
        for shown_s in (0, 0.25, 1, 10):
            out = flexor.posture.complete(frame, list(bends), bends=[f"{name}={'+'.join(joints)}" for name, joints in bends.items()],
                                          rest_s=shown_s, document=document, progress=False).frame
            errors = out[columns].to_numpy() - one.hands_deg
            after_deg[-1].append(np.sqrt((errors[t_s - t_s[0] > 10] ** 2).mean(axis=0)).mean())
    after_deg = np.array(after_deg)
    assert np.all(after_deg[:, 1:] < 1.01 * after_deg[:, :1]), after_deg
    assert 10.4 < after_deg[:, 3].mean() < 11.1 < 12 < after_deg[:, 0].mean(), after_deg
