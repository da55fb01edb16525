"""Learns from recordings of all 23 joints, one for each person, how the joints of a hand go together: the document that
`flexor posture complete` reads (host/posture/posture.hpp).

    python -m flexor.posture_learning anna.csv ben.csv cleo.csv --out posture.json

A person is typical hands, how long each was held, and the resting pose. Typical hands are the centres of k-means (Lloyd 1982;
scikit-learn); the resting pose is the mean of the first REST_S of each trial; a trial begins where the clock starts again.
DIP follows PIP by a curve, straight between knots every 10 degrees: least squares with a prior that it does not bend.
Angles are degrees, flexion of the fingers is negative.
"""
import argparse
import hashlib
from collections import namedtuple
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from flexor._core import FINGERS, __version__, core, needed, options_of, write_json
from flexor._recording import read

JOINTS = [f"thumb_{joint}" for joint in ("rot", "mcp", "ip", "abd")]
JOINTS += [f"{finger}_{joint}" for finger in FINGERS[1:] for joint in ("mcp", "pip", "dip", "abd")]
JOINTS += ["palm_arch", "wrist_pitch", "wrist_yaw"]
COUPLINGS = [(f"{finger}_dip", f"{finger}_pip") for finger in FINGERS[1:]]
REST_S = 0.25
PAUSE_S = 0.5  # a longer step is a pause of the log
CELLS = 80
KNOT_DEG = np.arange(-140.0, 41, 10)
STRAIGHT = 1e-4  # weight of squared second differences of a curve, beside a mean square error: bends it only where nobody was
MARGIN_DEG = 10  # beyond what people of the recordings did, and the spread of people about the Academy's ranges
# How far fingers flex and extend in healthy adults: active ranges, American Academy of Orthopaedic Surgeons (1965).
ANATOMY_DEG = {"mcp": (90, 45), "pip": (100, 0), "dip": (90, 0)}

Recorded = namedtuple("Recorded", ["source", "digest", "t_s", "hands_deg"])  # one person's file; rows x 23, in the order of JOINTS


def read_recorded(path) -> Recorded:
    """Needs NAME_deg of all JOINTS, none missing. Raises ValueError, one line."""
    log = read(path, [f"{joint}_deg" for joint in JOINTS], repair=False)
    hands_deg = np.column_stack(list(log.columns.values()))
    rows, wrong = np.nonzero(~(np.abs(hands_deg) <= 360))
    if len(rows):
        raise ValueError(f"{path}: row {rows[0] + 2}: column \"{JOINTS[wrong[0]]}_deg\": {hands_deg[rows[0], wrong[0]]:g} is no angle of a "
                         "joint; take the row out")
    return Recorded(Path(path).name, "sha256:" + hashlib.sha256(Path(path).read_bytes()).hexdigest(), log.t_s, hands_deg)


def standard_error(errors: np.ndarray, shares: np.ndarray) -> float:
    """The se for which the share of errors within se plus that within 1.96 se is 0.683 + 0.95, as of normal ones: what one
    interval covers too much the other covers too little. A root mean square would be drawn by the few largest errors."""
    size = np.r_[errors, errors / 1.96]
    order = np.argsort(size)
    covered = np.cumsum(np.r_[shares, shares][order])
    return size[order][np.searchsorted(covered, (0.683 + 0.95) * shares.sum())]


def codebook(hands_deg: np.ndarray, total_s: float, cells: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres (cells x 23), the seconds of each, and the variance about them (23); each row stands for the same time.

    The first centres are rows evenly spaced over the recording, so that little is left to chance; k-means++ spends cells on rare
    hands, and errors are then claimed that are too small (90 instead of 92 % within two standard errors, docs/posture.md). Their
    order is drawn, since the first cells stand for what was shown of a person where errors are scaled (host/posture/regression.hpp).
    """
    distinct = hands_deg[np.sort(np.unique(hands_deg, axis=0, return_index=True)[1])]
    cells = min(cells, len(distinct))
    first = np.random.default_rng(seed).permutation((np.arange(cells) + 0.5) * len(distinct) / cells).astype(int)
    found = needed("sklearn.cluster").KMeans(cells, init=distinct[first], n_init=1).fit(hands_deg)
    seconds = np.bincount(found.labels_, minlength=cells) * total_s / len(hands_deg)
    within_deg2 = ((hands_deg - found.cluster_centers_[found.labels_]) ** 2).mean(axis=0)
    return found.cluster_centers_, seconds, within_deg2


def rest_deg(person: Recorded) -> np.ndarray:
    begins = np.r_[True, np.diff(person.t_s) < 0]
    since_s = person.t_s - person.t_s[begins][np.cumsum(begins) - 1]
    return person.hands_deg[since_s <= REST_S].mean(axis=0)


def coupled_curve(people: Sequence[Recorded], joint: str, follows: str) -> tuple[np.ndarray, float]:
    """Values at KNOT_DEG, every person counting the same, and the standard error of curves on the people left out of them."""
    # rows x knots: what each knot's value counts at an angle; level beyond the ends
    hats = [np.array([np.interp(person.hands_deg[:, JOINTS.index(follows)], KNOT_DEG, hat) for hat in np.eye(len(KNOT_DEG))]).T
            for person in people]
    angles = [person.hands_deg[:, JOINTS.index(joint)] for person in people]
    bend = np.sqrt(STRAIGHT) * np.diff(np.eye(len(KNOT_DEG)), 2, axis=0)

    def fit(which: list[int]) -> np.ndarray:
        rows = [hats[i] / np.sqrt(len(hats[i])) for i in which] + [bend]
        values = [angles[i] / np.sqrt(len(angles[i])) for i in which] + [np.zeros(len(bend))]
        return np.linalg.lstsq(np.concatenate(rows), np.concatenate(values))[0]

    everybody = range(len(people))
    errors = [np.abs(hats[i] @ fit([j for j in everybody if j != i]) - angles[i]) for i in everybody]
    shares = [np.full(len(error), 1 / len(error)) for error in errors]
    return fit(list(everybody)), standard_error(np.concatenate(errors), np.concatenate(shares))


def limits_deg(people: Sequence[Recorded]) -> tuple[np.ndarray, np.ndarray]:
    """The wider of what is known of hands and what these people did: gloves differ in what they call 0."""
    low = np.min([person.hands_deg.min(axis=0) for person in people], axis=0)
    high = np.max([person.hands_deg.max(axis=0) for person in people], axis=0)
    for j, joint in enumerate(JOINTS):
        finger, _, part = joint.partition("_")
        if part in ANATOMY_DEG and finger != "thumb":
            flexion_deg, extension_deg = ANATOMY_DEG[part]
            low[j], high[j] = min(low[j], -flexion_deg), max(high[j], extension_deg)
    return low - MARGIN_DEG, high + MARGIN_DEG


def learn(people: Sequence[Recorded], seed: int = 1) -> dict:
    """The document. Raises ValueError for fewer than three people, or one of them twice."""
    if len(people) < 3:
        raise ValueError(f"{len(people)} recording(s): what holds for others needs three people or more")
    for i, person in enumerate(people):
        if person.digest in [other.digest for other in people[:i]]:
            raise ValueError(f"{person.source}: the same recording twice; give each person once")
    low_deg, high_deg = limits_deg(people)
    out = {"kind": "posture", "schema": 1, "written_by": __version__, "seed": seed, "joints": JOINTS,
           "low_deg": _rounded(low_deg), "high_deg": _rounded(high_deg), "curves": [], "people": []}
    for joint, follows in COUPLINGS:
        value_deg, sd_deg = coupled_curve(people, joint, follows)
        out["curves"].append({"joint": joint, "follows": follows, "knot_deg": _rounded(KNOT_DEG), "value_deg": _rounded(value_deg),
                              "sd_deg": round(sd_deg, 2)})
    for person in people:
        step_s = np.diff(person.t_s)
        total_s = step_s[(step_s > 0) & (step_s <= PAUSE_S)].sum()
        if total_s < 1:
            raise ValueError(f"{person.source}: less than a second of motion; record more")
        centre_deg, seconds, within_deg2 = codebook(person.hands_deg, total_s, CELLS, seed)
        cells = [_rounded([held_s, *hand]) for held_s, hand in zip(seconds, centre_deg, strict=True) if held_s >= 0.005]
        out["people"].append({"source": person.source, "digest": person.digest, "rows": len(person.t_s),
                              "rest_deg": _rounded(rest_deg(person)), "within_deg2": _rounded(within_deg2), "cells": cells})
    return out


def _rounded(values) -> list[float]:
    """Hundredths of a degree or a second: far below what any sensor tells, and short."""
    return (np.round(values, 2) + 0.0).tolist()


if __name__ == "__main__":
    parser = argparse.ArgumentParser("flexor.posture_learning", description="How the 23 joints of a hand go together, from recordings.")
    parser.add_argument("files", nargs="+", help="CSV: t_s and NAME_deg of all 23 joints; three people or more, a file each")
    parser.add_argument("--out", required=True, help="the posture document")
    parser.add_argument("--seed", type=int, default=1, help="of the order of typical hands")
    with options_of(parser) as o:
        core.require_writable(o.out)
        document = learn([read_recorded(file) for file in o.files], o.seed)
        write_json(o.out, document, separators=(",", ":"))
        print(f"{'person':20}{'rows':>7}{'seconds':>9}{'cells':>7}")
        for person in document["people"]:
            print(f"{person['source']:20}{person['rows']:7}{sum(cell[0] for cell in person['cells']):9.1f}{len(person['cells']):7}")
        for curve in document["curves"]:
            print(f"{curve['joint']:12}follows {curve['follows']:12} within {curve['sd_deg']:.2f} deg, standard error on people left out")
        print(f"written {o.out}")
