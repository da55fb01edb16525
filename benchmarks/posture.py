"""How well `flexor posture complete` tells the hands of people whom the document never saw: each of five is estimated by a document
of the other four. Prints a line for each figure: key, value, unit (docs/posture.md).

    PYTHONPATH=python:build/release/python/package build/python/bin/python benchmarks/posture.py ../shared/data/hands
"""
import json
import sys
from pathlib import Path

import flexor
import numpy as np
import pandas as pd
from flexor import posture_learning as learning

BENDS = {"thumb": ["thumb_mcp", "thumb_ip"]} | {f: [f"{f}_mcp", f"{f}_pip"] for f in ("index", "middle", "ring", "pinky")}
TEN = {joint: [joint] for joints in BENDS.values() for joint in joints}
WAYS = (("bends", BENDS, "nothing"), ("bends_rest", BENDS, "rest"), ("bends_first", BENDS, "first"), ("bends_hand", BENDS, "pieces"),
        ("joints_rest", TEN, "rest"))


class Stranger:
    """A person of the recordings, with a document of the others."""

    def __init__(self, recorded: learning.Recorded, others: list[learning.Recorded]):
        self.recorded, self.document = recorded, json.dumps(learning.learn(others))
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
        step_s = np.full(3, 0.15)
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
        bends = [f"{name}={'+'.join(joints)}" for name, joints in inputs.items() if len(joints) > 1]
        out = flexor.posture.complete(frame, list(inputs), bends=bends, rest_s=rest_s, document=self.document, progress=False).frame
        out = out.iloc[len(prefix):][scored]
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


def main(folder: Path) -> None:
    people = [learning.read_recorded(folder / f"subject{i}.csv") for i in range(1, 6)]
    strangers = [Stranger(one, [other for other in people if other is not one]) for one in people]
    for key, inputs, shown in WAYS:
        figures = [stranger.errors(inputs, shown) for stranger in strangers]
        rmse_deg, within_68, within_95, refused = (np.mean([np.mean(one[i]) for one in figures]) for i in range(4))
        print(f"posture.{key}.rmse {rmse_deg:.3f} deg\nposture.{key}.within_68 {100 * within_68:.2f} %\n"
              f"posture.{key}.within_95 {100 * within_95:.2f} %\nposture.{key}.refused {100 * refused:.3f} %", flush=True)
    ridge = ridge_rmse_deg(people)
    print(f"posture.ridge.rmse {ridge.mean():.3f} deg")
    for finger, name in enumerate(BENDS):
        own = slice(4 * finger, 4 * finger + 4)
        rmse_deg = np.mean([stranger.errors(BENDS, "rest", lost=name)[0] for stranger in strangers], axis=0)
        print(f"posture.lost.{name} {rmse_deg[own].mean() / ridge[own].mean():.3f} 1", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
