"""Laboratories that the published table leaves plausible, and the experiment in each of them.

Twelve published averages (gestures 1 to 4 with three compensators) do not determine the twin's sixteen free parameters. So
laboratories are drawn from

    p(parameters | averages)  ~  prior x likelihood
    ln likelihood = -1/2 sum over the cells of (ln(ours / published) / standard error)^2

with `ours` the mean of the twin's trials with common random numbers and the standard error that of a published average of three
trials (host/study/twin_table.hpp). The draws come from emcee's affine-invariant ensemble (Foreman-Mackey et al., PASP 125 (2013)
306) with moves by differential evolution. In each laboratory the glove is worn and recorded once, the compensators are fitted to
that one recording, and the gestures are played (host/study/laboratory.hpp).

    python -m flexor.laboratories draw --laboratories 200 --out laboratories.json
    python -m flexor.laboratories run laboratories.json --scenarios --out all/
"""

import argparse
import json
import math
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from . import _flexor

SCHEMA = "flexor-ensemble"
FINGERS = ("thumb", "index", "middle", "ring", "pinky")
LOW, MEDIAN, HIGH = 0.05, 0.5, 0.95
TRUSTED = 50  # autocorrelation times that chains must have for their length to be known (emcee's own rule)


@dataclass(frozen=True)
class Parameter:
    """A free parameter v of the twin with a normal prior of x, cut off at [min, max]; without a deviation flat in x.

    x = v, or ln v where `is_log`; ln p(v) = -((x - m) / s)^2 / 2 with m the median's x and s the deviation.
    """

    name: str
    median: float
    deviation: float | None
    is_log: bool
    min: float
    max: float
    reason: str

    def x(self, value):
        return math.log(value) if self.is_log else value

    def value(self, x):
        """Four digits, as the file has them: what is evaluated is what is written."""
        return float(f"{math.exp(x) if self.is_log else x:.4g}")

    def log_prior(self, x):
        if not self.x(self.min) <= x <= self.x(self.max):
            return -math.inf
        return 0.0 if self.deviation is None else -(((x - self.x(self.median)) / self.deviation) ** 2) / 2

    def draw(self, random):
        """One x of the prior, of which what lies beyond the bounds is drawn again."""
        while True:
            low, high = self.x(self.min), self.x(self.max)
            x = random.uniform(low, high) if self.deviation is None else random.normal(self.x(self.median), self.deviation)
            if low <= x <= high:
                return x


def free_parameters():
    """The sixteen, bends of the strip at the fingers' lower limits first, then at the upper ones.

    A bend's median is the mean of the bends at which either published compensator answers rightly (saturation limit / gain + edge
    of the dead zone); its deviation is the 16 degrees by which these two differ.
    """
    implied = {}
    for name in ("published-w", "published-hw"):
        blocks = json.loads(_flexor.published_model(name))["blocks"]
        at = {(b["type"], b["to"].split()[0]): b for b in blocks}
        for finger in FINGERS:
            edge = at.get(("dead_zone", finger), {"upper": 0})["upper"]
            for end in ("lower", "upper"):
                bend = at["saturation", finger][f"{end}_deg"] / at["lti", finger]["gain"] + edge
                implied.setdefault((end, finger), []).append(bend)
    out = []
    for (end, finger), bends in sorted(implied.items(), key=lambda one: (one[0][0], FINGERS.index(one[0][1]))):
        bend = float(np.mean(bends))
        reason = "the published compensators answer rightly there, and differ by as much"
        out.append(Parameter(f"placement.bend_{end}_deg.{finger}", bend, 16, False, bend - 45, bend + 45, reason))
    for name, median, factor, low, high, reason in (
        ("loop.integral_limit", 60, None, 0.2, 120, "full duties; from a cautious anti-windup to none, the article names none"),
        ("loop.integral_per_deg_s", 0.1, 2.5, 0.002, 0.5, "an integral time of half a second beside the proportional gain, in two of three loops from 0.2 to 1.25 s"),
        ("cloth.slip_deg", 1, 2, 0.2, 6, "cloth on skin gives by half to two degrees"),
        ("cloth.creep_share", 0.03, 2, 0.005, 0.15, "fabric and film creep by some percent of a bend"),
        ("person.rest_s", 15, 3, 0.5, 120, "the first pose is held while somebody starts two cameras: seconds to a minute"),
        ("person.pose_spread_deg", 0.5, 3, 0.05, 5, "a pose is met again to a degree or two; the best published trial leaves a tenth"),
    ):  # fmt: skip
        out.append(Parameter(name, median, math.log(factor) if factor else None, True, low, high, reason))
    return out


def log_prior(x, parameters):
    """Sum over the parameters; minus infinity where a strip bends less with the finger at its upper limit."""
    if any(x[i] >= x[i + len(FINGERS)] for i in range(len(FINGERS))):
        return -math.inf
    return sum(p.log_prior(v) for p, v in zip(parameters, x))


def assignments(values, parameters=None):
    """`name=value` of each parameter, as `flexor experiment --set` takes them."""
    return [f"{p.name}={v}" for p, v in zip(parameters or free_parameters(), values)]


def draw(laboratories=200, *, walkers=64, steps=600, trials=8, seed=7, gestures=4, threads=None, log_density=None, progress=None):
    """Draws laboratories: a dict that `save` writes and `run` takes.

    walkers, steps: of emcee; the first third of the steps warms up. trials: of each cell in an evaluation. gestures: the first so
    many count. threads: None for as many as the machine has. log_density(x): in place of prior and likelihood, for tests.
    progress(step, of) may raise to stop. The same seed gives the same laboratories whatever the threads.
    Raises ValueError for more laboratories than kept draws.
    """
    import emcee

    parameters = free_parameters()
    warm_up = steps // 3
    kept = steps - warm_up
    if not 1 <= laboratories <= kept * walkers:
        raise ValueError(f"{steps} steps of {walkers} walkers leave {kept * walkers} draws for {laboratories} laboratories")

    def density(x):
        prior = log_prior(x, parameters)
        if not math.isfinite(prior):
            return -math.inf
        values = [p.value(v) for p, v in zip(parameters, x)]
        return prior + _flexor.table_log_likelihood(assignments(values, parameters), gestures, trials, seed)

    density = log_density or density
    random = np.random.default_rng(seed)
    start = []
    while len(start) < walkers:
        x = np.array([p.draw(random) for p in parameters])
        if math.isfinite(density(x)):
            start.append(x)
    moves = [(emcee.moves.DEMove(), 0.8), (emcee.moves.DESnookerMove(), 0.2)]
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        sampler = emcee.EnsembleSampler(walkers, len(parameters), density, pool=pool, moves=moves)
        state = emcee.State(np.array(start), random_state=np.random.RandomState(seed).get_state())
        for step, _ in enumerate(sampler.sample(state, iterations=steps), 1):
            if progress:
                progress(step, steps)
    chain = sampler.get_chain(discard=warm_up)  # step, walker, parameter
    tau = sampler.get_autocorr_time(discard=warm_up, tol=0)
    flat = chain.swapaxes(0, 1).reshape(-1, len(parameters))
    at = (2 * np.arange(laboratories) + 1) * len(flat) // (2 * laboratories)
    rows = [[p.value(v) for p, v in zip(parameters, flat[k])] for k in at]
    described = []
    for i, p in enumerate(parameters):
        low, median, high = (p.value(v) for v in np.quantile(flat[:, i], (LOW, MEDIAN, HIGH)))
        prior = {"median": p.median, "deviation": p.deviation, "of": "logarithm" if p.is_log else "value", "min": p.min, "max": p.max}
        described.append({
            "name": p.name,
            "prior": prior | {"reason": p.reason},
            "posterior": {"median": median, "low": low, "high": high},
            "autocorrelation_steps": float(tau[i]),
            "effective": float(len(flat) / tau[i]),
        })  # fmt: skip
    return {"schema": SCHEMA, "schema_version": 2, "written_by": f"flexor {_flexor.version}", "seed": seed, "walkers": walkers,
            "warm_up": warm_up, "kept": kept, "trials": trials, "acceptance": float(np.mean(sampler.acceptance_fraction)),
            "parameters": described, "laboratories": rows}  # fmt: skip


def doubt(ensemble):
    """Why the laboratories may not be a sample of those that are plausible, or an empty text."""
    tau = max(p["autocorrelation_steps"] for p in ensemble["parameters"])
    if ensemble["kept"] >= TRUSTED * tau:
        return ""
    return (f"the longest autocorrelation time is {tau:.0f} steps, and only {ensemble['kept']} were kept: draw with --steps "
            f"{math.ceil(1.5 * TRUSTED * tau)}")  # fmt: skip


def save(ensemble, path):
    part = Path(f"{path}.part")
    part.write_text(json.dumps(ensemble, indent=1) + "\n", encoding="utf-8")
    part.replace(path)


def load(path):
    """Raises ValueError naming file and cause."""
    ensemble = json.loads(Path(path).read_text(encoding="utf-8"))
    if ensemble.get("schema") != SCHEMA or ensemble.get("schema_version") != 2:
        raise ValueError(f"{path}: no {SCHEMA} of version 2: draw it again")
    names = [p["name"] for p in ensemble["parameters"]]
    if names != [p.name for p in free_parameters()]:
        raise ValueError(f"{path}: its parameters are not the free ones of this version: draw it again")
    for number, row in enumerate(ensemble["laboratories"]):
        if len(row) != len(names) or not all(isinstance(v, (int, float)) for v in row):
            raise ValueError(f"{path}: laboratory {number} is not one number for each parameter")
    return ensemble


def play(values, number, *, gestures="1-6", trials=16, seed=1, glove_seed=1001, rate_hz=10.0, scenarios=False):
    """The experiment in one laboratory: {"cells": [...], "lead_s", "shapes": [...]} (host/study/laboratory.hpp)."""
    return json.loads(_flexor.play_laboratory(assignments(values), number, gestures, trials, seed, glove_seed, rate_hz, scenarios))


def run(ensemble, *, out=None, threads=None, client=None, progress=None, **settings):
    """The experiment in every laboratory: rows (`play`), in their order.

    With a folder `out` each laboratory is a line of laboratories.jsonl as soon as its turn comes, and a run that was cut off goes on
    there. `client`, a dask.distributed Client, plays them on its workers; otherwise threads of this process do.
    Raises ValueError for a folder of another run.
    """
    laboratories = ensemble["laboratories"]
    rows, journal = [], None
    if out:
        rows, journal = _resume(Path(out), {"laboratories": laboratories, "settings": settings, "version": _flexor.version})
    pool = ThreadPoolExecutor(threads or os.cpu_count())
    try:
        submit = client.submit if client else pool.submit
        todo = [submit(play, laboratories[k], k, **settings) for k in range(len(rows), len(laboratories))]
        for future in todo:
            rows.append(future.result())
            if journal:
                journal.write(json.dumps(rows[-1]) + "\n")
                journal.flush()
            if progress:
                progress(len(rows), len(laboratories))
    finally:
        pool.shutdown(cancel_futures=True)
        if journal:
            journal.close()
    return rows


def _resume(folder, identity):
    """Rows whose line is whole, and the journal open behind them."""
    folder.mkdir(parents=True, exist_ok=True)
    mark, path = folder / "run.json", folder / "laboratories.jsonl"
    text = json.dumps(identity, sort_keys=True)
    if mark.exists() and mark.read_text(encoding="utf-8") != text:
        raise ValueError(f"{folder} holds another run: give another folder, or remove it")
    mark.write_text(text, encoding="utf-8")
    whole = path.read_text(encoding="utf-8").rpartition("\n")[0] if path.exists() else ""
    rows = [json.loads(line) for line in whole.splitlines()]
    with open(path, "w", encoding="utf-8") as again:
        again.writelines(line + "\n" for line in whole.splitlines())
    return rows, open(path, "a", encoding="utf-8")


def frame(rows):
    """All cells as a tidy DataFrame: laboratory, scenario ("" is ordinary use), gesture, compensator, error_deg_s."""
    return pd.DataFrame([{"laboratory": k, **cell} for k, row in enumerate(rows) for cell in row["cells"]])


def _interval(values):
    low, median, high = np.quantile(np.asarray(values, float), (LOW, MEDIAN, HIGH))
    return {"median": float(median), "low": float(low), "high": float(high)}


def _headlines(cells):
    """Of each compensator to each other: the geometric mean of their errors' ratio over the gestures, laboratory by laboratory."""
    mean = np.log(cells.pivot_table(index="laboratory", columns=["compensator", "gesture"], values="error_deg_s", sort=False))
    mean = mean.T.groupby(level="compensator", sort=False).mean().T
    out = []
    for one in mean:
        ratios = {to: np.exp(mean[one] - mean[to]) for to in mean if to != one}
        out.append({"compensator": one, "mean_ratio_to": {to: _interval(r) for to, r in ratios.items()},
                    "share_of_laboratories_below": {to: float((r < 1).mean()) for to, r in ratios.items()}})  # fmt: skip
    return out


def _log_rms(cells, published, gestures):
    known = [c for c in published if c["gesture"] in gestures]
    of = cells.set_index(["gesture", "compensator", "laboratory"])["error_deg_s"]
    logs = [np.log(of[c["gesture"], c["compensator"]] / c["error_deg_s"]) for c in known if (c["gesture"], c["compensator"]) in of]
    return _interval(np.sqrt(np.mean(np.square(logs), axis=0))) if len(logs) == len(known) else None


def summary(rows, ensemble):
    """Every figure a median with `low` and `high`, the 5 and 95 % quantiles over laboratories: cells, headlines, scenarios,
    distance from the published table, shapes, lead, and how the laboratories were drawn."""
    every = frame(rows)
    cells = every[every.scenario == ""]
    published = json.loads(_flexor.published_table())
    known = {(c["gesture"], c["compensator"]): c["error_deg_s"] for c in published}
    hw = cells[cells.compensator == "published-hw"].set_index(["gesture", "laboratory"])["error_deg_s"]
    table = []
    for (gesture, compensator), cell in cells.groupby(["gesture", "compensator"], sort=False):
        errors = cell.set_index(["gesture", "laboratory"])["error_deg_s"]
        table.append({"gesture": gesture, "compensator": compensator, "total_error_deg_s": _interval(errors),
                      "published_deg_s": known.get((gesture, compensator)),
                      "ratio_to_published_hw": _interval(errors / hw.loc[[gesture]])})  # fmt: skip
    shapes = []
    for k, shape in enumerate(rows[0]["shapes"]):
        values = [row["shapes"][k] for row in rows]
        shape = {key: v for key, v in shape.items() if key not in ("value_deg", "agrees", "where")}
        shapes.append(shape | {"value_deg": _interval([v["value_deg"] for v in values]),
                               "share_of_laboratories_that_agree": float(np.mean([v["agrees"] for v in values]))})  # fmt: skip
    leads = [row["lead_s"] for row in rows if row["lead_s"] is not None]
    changed = every[every.scenario != ""].groupby("scenario", sort=False)
    drawn = ensemble["parameters"]
    return {
        "laboratories": len(rows),
        "cells": table,
        "headlines": _headlines(cells),
        "scenarios": [{"name": name, "headlines": _headlines(one)} for name, one in changed],
        "log_rms": {"gestures_1_to_4": _log_rms(cells, published, range(1, 5)), "gestures_5_and_6": _log_rms(cells, published, (5, 6))},
        "lead_s": _interval(leads) if leads else None,
        "shapes": shapes,
        "ensemble": {"seed": ensemble["seed"], "doubt": doubt(ensemble), "acceptance": ensemble["acceptance"],
                     "longest_autocorrelation_steps": max(p["autocorrelation_steps"] for p in drawn),
                     "least_effective": min(p["effective"] for p in drawn)},
        "version": _flexor.version,
    }  # fmt: skip


def table(result):
    """The headlines as text: each compensator to published-hw and to the line with a lead, median (5 to 95 %), share below 1."""
    lines = [f"{'':<24}{'to published-hw':>32}{'to line-lead':>32}"]
    for title, headlines in [("", result["headlines"])] + [(s["name"], s["headlines"]) for s in result["scenarios"]]:
        lines += [title] if title else []
        for one in headlines:
            cells = []
            for to in ("published-hw", "line-lead"):
                r, below = one["mean_ratio_to"].get(to), one["share_of_laboratories_below"].get(to)
                cells.append(f"{r['median']:.2f} ({r['low']:.2f} to {r['high']:.2f}), {100 * below:.0f} %" if r else "-")
            lines.append(f"{one['compensator']:<24}{cells[0]:>32}{cells[1]:>32}")
    return "\n".join(lines)


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m flexor.laboratories", description=__doc__.split("\n")[0])
    tasks = parser.add_subparsers(dest="task", required=True)
    drawing = tasks.add_parser("draw", help="laboratories that the published averages leave plausible")
    drawing.add_argument("--laboratories", type=int, default=200)
    drawing.add_argument("--steps", type=int, default=600, help="of each of 64 walkers; a third of them warms up")
    drawing.add_argument("--seed", type=int, default=7)
    drawing.add_argument("--out", required=True)
    playing = tasks.add_parser("run", help="the experiment in each of them; goes on where a run was cut off")
    playing.add_argument("laboratories")
    playing.add_argument("--gestures", default="1-6")
    playing.add_argument("--trials", type=int, default=16)
    playing.add_argument("--scenarios", action="store_true", help="also with half-open poses, the glove put on again, and so on")
    playing.add_argument("--out", required=True, help="folder: laboratories.jsonl, results.json")
    for one in (drawing, playing):
        one.add_argument("--threads", type=int, help="default: as many as the machine has")
    o = parser.parse_args(arguments)
    from .progress import bar

    try:
        if o.task == "draw":
            ensemble = draw(o.laboratories, steps=o.steps, seed=o.seed, threads=o.threads, progress=bar("steps"))
            save(ensemble, o.out)
            print(doubt(ensemble), file=sys.stderr)
            return 0
        ensemble = load(o.laboratories)
        rows = run(ensemble, out=o.out, threads=o.threads, progress=bar("laboratories"),
                   gestures=o.gestures, trials=o.trials, scenarios=o.scenarios)  # fmt: skip
    except (ValueError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    result = summary(rows, ensemble)
    save(result, Path(o.out) / "results.json")
    print(table(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
