"""What changed between sessions of one glove: of each sensor in each session, against the mean of all of them.

    python -m flexor.donning monday.csv tuesday.csv wednesday.csv --out prior.json

A session is a log of much motion; sessions are compared by five quantiles of their readings (SHARES), and only the order of rows
counts. Lengths are shares of a sensor's span, which is that of the sessions' mean quantiles. `prior.json` is how the donnings
of this glove differ, for `flexor recalibrate --prior` (host/identify/recalibrate.hpp).
"""
import argparse
from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd

from flexor._core import FINGERS, options_of, write_json
from flexor._recording import read

SHARES = np.array([0.02, 0.1, 0.5, 0.9, 0.98])
LEAST_SESSIONS = 3
PARTS = 10  # of a session, which are drawn again for its intervals
RESAMPLES = 200
LEAST_ROWS = 10 * PARTS
OTHER_UNIT = 10  # put on again a glove reaches a few times as far at most
GENERAL_WEIGHT = 4  # sessions that the shipped correlation counts as
MOST_ALIKE = 0.95  # heavy tails leave room for a sensor that moved alone
# host/identify/recalibrate.cpp: somewhat narrower than nine sessions of one three-finger glove, docs/donning.md.
SHIPPED = {"sessions": 9, "shift_sd": 0.18, "log_gain_sd": 0.13, "motion_sd": 0.05, "reach_sd": 0.08, "density_sd": 0.1, "alike": 0.8}


def compare(sessions: Mapping[str, pd.DataFrame], sensors: list[str] | None = None, seed: int = 1) -> pd.DataFrame:
    """A row for each session and sensor that was read in it (index `session`, `sensor`).

    shift: of the middle of its readings; log_gain: of the distance of their ends, a logarithm; each with `_low` and `_high`, 95 %
    of sessions made of tenths of this one. shape: root mean square that both leave, over the quantiles. noise: standard deviation of
    a reading. sensors: columns, by default those that are called like fingers. `seed` of the resampling.
    Raises ValueError: fewer than three sessions, fewer than 100 rows, a sensor that stands still, or spans ten times as much as
    in most sessions, or a tenth.
    """
    sensors = sensors or _like_fingers(next(iter(sessions.values())))
    if not sensors:
        raise ValueError("no column is called like a finger: name the sensors")
    for name, frame in sessions.items():
        if missing := [sensor for sensor in sensors if sensor not in frame]:
            raise ValueError(f"{name}: no column {missing[0]}")
        if len(frame) < LEAST_ROWS:
            raise ValueError(f"{name}: {len(frame)} row(s): at least {LEAST_ROWS} are needed")
    random = np.random.default_rng(seed)
    rows = {}
    for sensor in sensors:
        readings = {name: pd.to_numeric(frame[sensor]).dropna().to_numpy() for name, frame in sessions.items()
                    if 2 * frame[sensor].count() >= len(frame)}  # else it was not plugged in
        if len(readings) < LEAST_SESSIONS:
            raise ValueError(f"{sensor}: it was read in {len(readings)} session(s), at least {LEAST_SESSIONS} are needed to compare")
        quantiles = {name: np.quantile(u, SHARES) for name, u in readings.items()}
        usual = np.median([_span(q) for q in quantiles.values()])
        for name, q in quantiles.items():
            if _span(q) <= 0:
                raise ValueError(f"{name}: {sensor} stands still: leave it out")
            if not usual / OTHER_UNIT < _span(q) < usual * OTHER_UNIT:
                raise ValueError(f"{name}: {sensor} spans {_span(q):.3g}, in most sessions {usual:.3g}: another unit, or hardly moved?")
        mean = np.mean(list(quantiles.values()), axis=0)
        for name, u in readings.items():
            rows[name, sensor] = _change(u, quantiles[name], mean, random)
    changes = pd.DataFrame.from_dict(rows, orient="index").rename_axis(["session", "sensor"])
    return changes.loc[[key for name in sessions for sensor in sensors if (key := (name, sensor)) in rows]]


def _like_fingers(columns: Iterable[str]) -> list[str]:
    return [column for column in columns if str(column).split("_")[0] in FINGERS]


def _span(quantiles: np.ndarray) -> np.ndarray:
    return quantiles[-1] - quantiles[0]


def _middle(quantiles: np.ndarray) -> np.ndarray:
    return (quantiles[-1] + quantiles[0]) / 2


def _change(readings: np.ndarray, quantiles: np.ndarray, mean: np.ndarray, random: np.random.Generator) -> dict[str, float]:
    parts = np.array_split(readings, PARTS)
    drawn = [np.concatenate([parts[p] for p in random.integers(PARTS, size=PARTS)]) for _ in range(RESAMPLES)]
    again = np.array([np.quantile(u, SHARES) for u in drawn]).T
    again = np.column_stack([quantiles, again[:, _span(again) > 0]])  # the session itself first
    out = {}
    for what, values in (("shift", (_middle(again) - _middle(mean)) / _span(mean)), ("log_gain", np.log(_span(again) / _span(mean)))):
        low, high = np.quantile(values[1:], [0.025, 0.975])
        out |= {what: values[0], f"{what}_low": low, f"{what}_high": high}
    left = (quantiles - _middle(quantiles)) / _span(quantiles) - (mean - _middle(mean)) / _span(mean)
    # What a reading is off the line through its neighbours; of white noise sqrt(3/2) times its deviation, 1/1.4826 of that the median.
    off = np.abs(readings[1:-1] - (readings[:-2] + readings[2:]) / 2)
    noise = 1.4826 * np.median(off) / np.sqrt(1.5) / _span(mean)
    return out | {"shape": np.sqrt((left**2).mean()), "noise": noise}


def prior(changes: pd.DataFrame) -> dict:
    """How two donnings differ, as today and the one that a model was made in: standard deviations, all sensors together, and how the shifts of two sensors
    correlate, over all pairs, drawn towards the shipped value. What sessions do not tell is shipped."""
    freedom = changes.groupby("sensor")["shift"].count().sub(1).sum()
    away = changes.groupby("sensor")[["shift", "log_gain"]].transform(lambda values: values - values.mean())
    deviation = np.sqrt(2 * (away**2).sum() / freedom).clip(lower=1e-3)
    sessions = changes.index.get_level_values("session").nunique()
    own = (changes["shift"] ** 2).groupby("session").sum()
    products = (changes["shift"].groupby("session").sum() ** 2 - own).sum()  # of all pairs, each in both orders
    squares = (own * (changes["shift"].groupby("session").count() - 1)).sum()  # what they would be, were all alike
    alike = SHIPPED["alike"]
    if squares > 0:
        here = np.clip(products / squares, 0, MOST_ALIKE)
        alike = (GENERAL_WEIGHT * alike + (sessions - 1) * here) / (GENERAL_WEIGHT + sessions - 1)
    return {"schema": "flexor-donning-prior", "schema_version": 1, **SHIPPED, "sessions": int(sessions),
            "shift_sd": float(deviation["shift"]), "log_gain_sd": float(deviation["log_gain"]), "alike": float(alike)}


if __name__ == "__main__":
    parser = argparse.ArgumentParser("flexor.donning", description="What changed between sessions of one glove.")
    parser.add_argument("files", nargs="+", help="logs, one for each time that the glove was put on")
    parser.add_argument("--sensors", type=lambda text: text.split(","), help="columns (default: those that are called like fingers)")
    parser.add_argument("--out", help="write how the donnings differ, for flexor recalibrate --prior")
    with options_of(parser) as o:
        sessions = {file: read(file, o.sensors or _like_fingers, repair=False).frame for file in o.files}
        if len(sessions) < len(o.files):
            raise ValueError("a session is there twice: give each once")
        changes = compare(sessions, o.sensors)
        found = prior(changes)
        print((100 * changes).to_string(float_format="{:.1f}".format))
        print(f"\npercent of a sensor's span; from one session to another: shift {100 * found['shift_sd']:.1f} %, gain "
              f"{100 * found['log_gain_sd']:.1f} % (standard deviations); shifts of two sensors correlate by {found['alike']:.2f}")
        if o.out:
            write_json(o.out, found)
