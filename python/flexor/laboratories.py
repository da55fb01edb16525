"""Laboratories that the published table leaves plausible, and the experiment in each of them.

Twelve published averages (gestures 1 to 4 with three compensators) do not determine the twin's 22 free parameters. So
laboratories are drawn from

    p(parameters | averages)  ~  prior x likelihood
    ln likelihood = -1/2 sum over the cells of (ln(ours / published) / standard error)^2

with `ours` the mean of the twin's trials with common random numbers, and the standard error that of a published average of three
trials. The draws are emcee's (Foreman-Mackey et al., PASP 125 (2013) 306), by stretches and differential
evolution. In each laboratory the glove is worn and recorded once, compensators are fitted to that recording, and the gestures
are played with the published ones and those.

    python -m flexor.laboratories fit
    python -m flexor.laboratories draw --laboratories 200 --out laboratories.json
    python -m flexor.laboratories run laboratories.json --scenarios --out all/
"""

import argparse
import functools
import json
import math
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Callable, NamedTuple, Optional, Sequence

import numpy as np
import pandas as pd

from flexor._core import FINGERS, InputError, Show, __version__, core, filled, needed, options_of, shown, write_json, write_text

SCHEMA = "flexor-ensemble"
PUBLISHED = ("raw", "published-w", "published-hw")
QUANTILES = {"median": 0.5, "low": 0.05, "high": 0.95}
TRUSTED = 50  # autocorrelation times that chains must have for their length to be known (emcee's own rule)


class Prior(NamedTuple):
    """Of each free parameter v of the twin, normal in x = v, or ln v where `is_log`: ln p = -((x - median) / deviation)^2 / 2
    within [min, max], all of x; an infinite deviation is flat."""

    names: list[str]
    is_log: np.ndarray
    median: np.ndarray
    deviation: np.ndarray
    min: np.ndarray
    max: np.ndarray

    def values(self, x: np.ndarray) -> list[float]:
        """Four digits, as the file has them: what is evaluated is what is written."""
        return [float(f"{v:.4g}") for v in np.where(self.is_log, np.exp(x), x)]

    def log_density(self, x: np.ndarray) -> float:
        """Minus infinity also where a sensor bends less with the finger at its upper limit."""
        if ((x < self.min) | (x > self.max)).any() or (x[:5] >= x[5:10]).any():
            return -math.inf
        return float(-(((x - self.median) / self.deviation) ** 2).sum() / 2)

    def draw(self, random: np.random.Generator) -> np.ndarray:
        flat = np.isinf(self.deviation)
        while True:
            x = random.normal(self.median, np.where(flat, 0, self.deviation))
            x = np.where(flat, random.uniform(self.min, self.max), x)
            if math.isfinite(self.log_density(x)):
                return x


@functools.cache
def prior() -> Prior:
    """The 22: bends of the sensor at the fingers' lower limits, at their upper ones, then the others.

    A bend's median is the mean of those at which the published compensators answer rightly (saturation limit / gain + edge
    of the dead zone); its deviation is the 16 degrees by which these two differ.
    """
    bends: dict[tuple[str, str], list[float]] = {(end, finger): [] for end in ("lower", "upper") for finger in FINGERS}
    for name in ("published-w", "published-hw"):
        blocks = {(b["type"], b["to"].split()[0]): b for b in json.loads(core.named_model(name, 10).model.to_json())["blocks"]}
        for end, finger in bends:
            edge_deg = blocks.get(("dead_zone", finger), {"upper": 0})["upper"]
            limit_deg = blocks["saturation", finger][f"{end}_deg"]
            bends[end, finger].append(limit_deg / blocks["lti", finger]["gain"] + edge_deg)
    bend_deg = np.mean(list(bends.values()), axis=1)
    others = {  # median, factor of one deviation, bounds
        "loop.integral_limit": (60, math.inf, 0.2, 120),  # from a cautious anti-windup to none: the article names none
        # An integral time of half a second beside the proportional gain, in two of three loops from 0.2 to 1.25 s.
        "loop.integral_per_deg_s": (0.1, 2.5, 0.002, 0.5),
        "cloth.slip_deg": (1, 2, 0.2, 6),  # cloth on skin gives by half to two degrees
        "cloth.creep_share": (0.03, 2, 0.005, 0.15),  # fabric and film creep by some percent of a bend
        # Four joints of a real glove: beside a bow, which a divider makes too, 2.5 to 4.4 degrees of a sine; within bursts 0.26 to 0.40
        # of noise; 0.18 to 0.31 from 3.5 to 5.5 Hz; 0.2 to 1.3 degrees a minute.
        "cloth.knuckle_deg": (3, 1.3, 1, 6),
        "sensor.noise_deg": (0.32, 1.2, 0.1, 1),
        "sensor.flutter_deg": (0.22, 1.3, 0.05, 1),
        "sensor.drift_deg_per_min": (0.7, 2, 0.05, 5),
        "cloth.neighbour_share": (0.05, 3, 0.002, 0.4),  # cloth between two fingers hands on some percent of a bend
        "cloth.thumb_share": (0.05, 3, 0.002, 0.4),
        "person.rest_s": (15, 3, 0.5, 120),  # the first pose is held while somebody starts two cameras: seconds to a minute
        "person.pose_spread_deg": (0.5, 3, 0.05, 5),  # a pose is met again to a degree or two; the best published trial leaves a tenth
    }
    median, factor, low, high = np.log(list(others.values())).T
    return Prior([f"placement.bend_{end}_deg.{finger}" for end, finger in bends] + list(others), np.arange(10 + len(others)) >= 10,
                 np.r_[bend_deg, median], np.r_[np.full(10, 16.0), factor], np.r_[bend_deg - 45, low], np.r_[bend_deg + 45, high])


def _parameters(values: list[float], changes: Sequence[str] = ()) -> Any:
    return core.parameters("", [*(f"{name}={value}" for name, value in zip(prior().names, values)), *changes])


@functools.cache
def published() -> list[dict[str, Any]]:
    """The article's averages and their trials, gesture by gesture, in each PUBLISHED."""
    return [{"gesture": gesture, "compensator": name, "error_deg_s": core.published_error_deg_s(gesture, name),
             "trials_deg_s": core.published_trials_deg_s(gesture, name)} for gesture in range(1, 7) for name in PUBLISHED]


@functools.cache
def standard_errors() -> dict[str, float]:
    """Of a published average, relative, by compensator: standard deviation of its three trials / average / sqrt(3), root mean
    square over gestures 1 to 4, since three trials say little of one cell's spread. 0.28, 0.49 and 0.62."""
    trials = np.reshape([cell["trials_deg_s"] for cell in published()], (6, len(PUBLISHED), 3))[:4]
    return dict(zip(PUBLISHED, np.sqrt((trials.var(axis=2, ddof=1) / 3 / trials.mean(axis=2) ** 2).mean(axis=0)).tolist()))


def _table(parameters: Any, trials: int, seed: int) -> list[float]:
    plan = filled(core.Plan(), parameters=parameters, compensators=[core.named_model(name, 10) for name in PUBLISHED], trials=trials,
                  seed=seed, threads=1)
    return [cell["total_error_deg_s"]["mean"] for cell in core.experiment(plan, "1-4", 10, "", None)["cells"]]


def log_likelihood(parameters: Any, trials: int, seed: int) -> float:
    """Of the published averages of gestures 1 to 4, beside the twin's."""
    ours = _table(parameters, trials, seed)
    return -sum((math.log(one / cell["error_deg_s"]) / standard_errors()[cell["compensator"]]) ** 2
                for one, cell in zip(ours, published())) / 2


def sample(log_density: Callable[[np.ndarray], float], start: np.ndarray, steps: int, *, seed: int = 7, threads: int = 0,
           progress: Show = None) -> tuple[np.ndarray, np.ndarray, float]:
    """Draws of a density from walkers that start at the rows of `start`: (steps that are left after a third of warming up x walkers
    x parameters), each parameter's autocorrelation time in steps, share of moves that were accepted. One seed gives the same
    draws whatever the threads; 0: as many as the machine has."""
    emcee = needed("emcee")
    # Stretching brings in those that started far out. Not DESnookerMove: half its exponent is missing, and spreads come out too small.
    moves = [(emcee.moves.StretchMove(), 0.5), (emcee.moves.DEMove(), 0.5)]
    state = emcee.State(start, random_state=np.random.RandomState(seed).get_state())
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool, shown(progress) as show:
        sampler = emcee.EnsembleSampler(*start.shape, log_density, pool=pool, moves=moves)
        for step, _ in enumerate(sampler.sample(state, iterations=steps), 1):
            if show:
                show(step, steps, "steps")
    chain = sampler.get_chain(discard=steps // 3)
    moves_at_all = (chain != chain[0]).any(axis=(0, 2))
    tau = np.full(start.shape[1], float(len(chain)))  # of a walker that never moved, as long as all that is there
    if moves_at_all.any():
        share = moves_at_all.mean()
        tau = share * emcee.autocorr.integrated_time(chain[:, moves_at_all], tol=0) + (1 - share) * tau
    return chain, tau, sampler.acceptance_fraction.mean()


def draw(laboratories: int = 200, *, walkers: int = 64, steps: int = 600, starts: int = 1280, trials: int = 8, seed: int = 7,
         threads: int = 0, progress: Show = None) -> dict[str, Any]:
    """A document of laboratories, which `run` takes. starts: draws of the prior, of which the likeliest begin: far out a walker takes
    long to come in. trials: of each cell in an evaluation of the table. Raises InputError: more laboratories than draws."""
    draws = (steps - steps // 3) * walkers
    if not 1 <= laboratories <= draws:
        raise InputError(f"{steps} steps of {walkers} walkers leave {draws} draws for {laboratories} laboratories")
    if walkers < (least := 2 * len(prior().names)):
        raise InputError(f"{walkers} walkers are too few for as many parameters: at least {least}")
    of, _ = prior(), needed("emcee")  # which is missed before the hour

    def log_density(x: np.ndarray) -> float:
        before = of.log_density(x)
        return before if math.isinf(before) else before + log_likelihood(_parameters(of.values(x)), trials, seed)

    random = np.random.default_rng(seed)
    begins = np.array([of.draw(random) for _ in range(max(walkers, starts))])
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        order = np.argsort(list(pool.map(log_density, begins)), kind="stable")
    start = begins[order[-walkers:]]
    chain, tau, acceptance = sample(log_density, start, steps, seed=seed, threads=threads, progress=progress)
    flat = chain.swapaxes(0, 1).reshape(-1, len(of.names))
    rows = flat[(2 * np.arange(laboratories) + 1) * len(flat) // (2 * laboratories)]
    quantiles = {name: of.values(np.quantile(flat, share, axis=0)) for name, share in QUANTILES.items()}
    parameters = [{"name": name, **{key: values[i] for key, values in quantiles.items()}, "autocorrelation_steps": float(tau[i]),
                   "effective": float(len(flat) / tau[i])} for i, name in enumerate(of.names)]
    return {"schema": SCHEMA, "schema_version": 2, "written_by": f"flexor {__version__}", "seed": seed, "walkers": walkers,
            "kept": len(chain), "trials": trials, "acceptance": float(acceptance), "parameters": parameters,
            "laboratories": [of.values(row) for row in rows]}


def doubt(ensemble: dict[str, Any]) -> str:
    """Why the laboratories may not be a sample of those that are plausible, or an empty text."""
    tau = max(p["autocorrelation_steps"] for p in ensemble["parameters"])
    if ensemble["kept"] >= TRUSTED * tau:
        return ""
    return f"the longest autocorrelation time is {tau:.0f} steps, and only {ensemble['kept']} were kept: " \
           f"draw with --steps {math.ceil(1.5 * TRUSTED * tau)}"


def fit(*, evaluations: int = 4000, trials: int = 8, seed: int = 1, progress: Show = None) -> dict[str, float]:
    """The likeliest laboratory where each published average counts alike, within 0.35 of its logarithm: the twin's own parameters
    are these. By Sbplx (Rowan, 1990) of NLopt from the prior's median; it needs no derivatives, which a simulation has not."""
    nlopt, of = needed("nlopt"), prior()
    ln_published = np.log([cell["error_deg_s"] for cell in published()[: 4 * len(PUBLISHED)]])
    optimizer = nlopt.opt(nlopt.LN_SBPLX, len(of.names))
    with shown(progress) as show:
        def cost(share: np.ndarray, _: np.ndarray) -> float:
            if show:
                show(optimizer.get_numevals(), evaluations, "evaluations")
            x = of.min + (of.max - of.min) * share
            before = of.log_density(np.clip(x, of.min, of.max))
            if math.isinf(before):
                return 1e6
            return ((np.log(_table(_parameters(of.values(x)), trials, seed)) - ln_published) ** 2).sum() / 0.35**2 - 2 * before

        optimizer.set_min_objective(cost)
        optimizer.set_lower_bounds(0)
        optimizer.set_upper_bounds(1)
        optimizer.set_initial_step(0.2)
        optimizer.set_xtol_abs(1e-4)
        optimizer.set_maxeval(evaluations)
        share = optimizer.optimize((of.median - of.min) / (of.max - of.min))
    return dict(zip(of.names, of.values(of.min + (of.max - of.min) * share)))


def load(path: Any) -> dict[str, Any]:
    """Raises InputError, one line with file and cause."""
    try:
        ensemble = json.loads(Path(path).read_text("utf-8"))
        of = ensemble["schema"], ensemble["schema_version"], [p["name"] for p in ensemble["parameters"]]
        rows = np.asarray(ensemble["laboratories"], float)
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: is no document of laboratories: {error!r}") from error
    if of != (SCHEMA, 2, prior().names):
        raise InputError(f"{path}: is of another version: draw the laboratories again")
    if rows.ndim != 2 or rows.shape[1] != len(of[2]) or not np.isfinite(rows).all():
        raise InputError(f"{path}: a laboratory is not one number for each parameter")
    return ensemble


def play(values: list[float], number: int, *, gestures: str = "1-6", trials: int = 16, seed: int = 1, glove_seed: int = 1001,
         rate_hz: float = 10, scenarios: bool = False) -> dict[str, Any]:
    """The experiment in one laboratory, `number` of its random numbers: {"cells": [{"scenario", "gesture", "compensator",
    "error_deg_s"}], "lead_s", "shapes"}. The scenario of ordinary use is "", in which the glove is recorded for all of them; the lead is
    what is predicted, none where the lag lies outside the search."""
    fitted, lead_s = core.fit_glove(_parameters(values), rate_hz, core.seed_of(glove_seed, number))
    compensators = [core.named_model(name, rate_hz) for name in PUBLISHED] + fitted
    found = {}
    for name, changes in [("", []), *((one.name, one.set) for one in core.changed_scenarios() if scenarios)]:
        plan = filled(core.Plan(), parameters=_parameters(values, changes), compensators=compensators, trials=trials, threads=1,
                      seed=core.seed_of(seed, number))
        found[name] = core.experiment(plan, gestures, rate_hz, "", None)
    cells = [{"scenario": name, "gesture": cell["gesture"], "compensator": cell["compensator"],
              "error_deg_s": cell["total_error_deg_s"]["mean"]} for name, one in found.items() for cell in one["cells"]]
    return {"cells": cells, "lead_s": lead_s, "shapes": found[""]["shapes"]}


def run(ensemble: dict[str, Any], *, out: Any = None, threads: int = 0, client: Any = None, progress: Show = None,
        **settings: Any) -> list[dict[str, Any]]:
    """`play` with `settings` in every laboratory, in their order.

    out: a folder, in which each laboratory is a line of laboratories.jsonl as soon as its turn comes; a run that was cut off goes on
    there. client: a distributed.Client of Dask, whose workers play; else threads of this process. Raises InputError: the folder
    has another run, or somebody works there.
    """
    laboratories = ensemble["laboratories"]
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool, shown(progress) as show:
        held, rows, todo = None if out is None else core.FolderLock(out), [], []
        try:
            if out is not None:
                rows = _rows_of(Path(out), {"laboratories": laboratories, "settings": settings, "version": __version__})
            todo = [(client or pool).submit(play, laboratories[k], k, **settings) for k in range(len(rows), len(laboratories))]
            for future in todo:
                rows.append(future.result())
                if out is not None:
                    with open(Path(out) / "laboratories.jsonl", "a", encoding="utf-8") as journal:
                        journal.write(json.dumps(rows[-1]) + "\n")
                if show:
                    show(len(rows), len(laboratories), "laboratories")
        finally:
            for future in todo:
                future.cancel()
            del held
    return rows


def _rows_of(folder: Path, identity: dict[str, Any]) -> list[dict[str, Any]]:
    """Rows whose line is whole; the others leave the file."""
    mark, journal = folder / "run.json", folder / "laboratories.jsonl"
    if (json.loads(mark.read_text("utf-8")) if mark.exists() else None if journal.exists() else identity) != identity:
        raise InputError(f"{folder} has another run: another folder, or remove it")
    write_text(mark, json.dumps(identity))
    whole = journal.read_text("utf-8").rpartition("\n")[0].splitlines() if journal.exists() else []
    write_text(journal, "".join(line + "\n" for line in whole))
    return [json.loads(line) for line in whole]


def frame(rows: list[dict[str, Any]]) -> pd.DataFrame:
    """All cells, a row each: laboratory, scenario ("" is ordinary use), gesture, compensator, error_deg_s."""
    return pd.DataFrame([{"laboratory": k, **cell} for k, row in enumerate(rows) for cell in row["cells"]])


def _interval(values: Any) -> dict[str, float]:
    return {name: float(np.quantile(np.asarray(values, float), at)) for name, at in QUANTILES.items()}


def _headlines(cells: pd.DataFrame) -> list[dict[str, Any]]:
    """Of each compensator to each other: the geometric mean of their errors' ratio over the gestures, laboratory by laboratory."""
    logs = cells.assign(log=np.log(cells.error_deg_s)).groupby(["compensator", "laboratory"], sort=False)["log"].mean().unstack(0)
    out = []
    for one in logs:
        ratios = {to: np.exp(logs[one] - logs[to]) for to in logs if to != one}
        out.append({"compensator": one, "mean_ratio_to": {to: _interval(ratio) for to, ratio in ratios.items()},
                    "share_of_laboratories_below": {to: float((ratio < 1).mean()) for to, ratio in ratios.items()}})
    return out


def _log_rms(cells: pd.DataFrame, first: int, last: int) -> Optional[dict[str, float]]:
    """Distance from the published averages; none where a gesture was not played."""
    table = pd.DataFrame(published()).query("@first <= gesture <= @last")
    both = table.merge(cells, on=["gesture", "compensator"], suffixes=("_published", ""))
    if both.groupby(["gesture", "compensator"]).ngroups < len(table):
        return None
    squares = np.log(both.error_deg_s / both.error_deg_s_published) ** 2
    return _interval(np.sqrt(squares.groupby(both.laboratory).mean()))


def summary(rows: list[dict[str, Any]], ensemble: dict[str, Any]) -> dict[str, Any]:
    """Every figure a median with `low` and `high`, the 5 and 95 % quantiles over laboratories: cells, headlines, scenarios,
    distance from the published table, shapes, lead, and how the laboratories were drawn."""
    by_scenario = dict(list(frame(rows).groupby("scenario", sort=False)))
    cells = by_scenario.pop("")
    errors = {key: one.error_deg_s.to_numpy() for key, one in cells.groupby(["gesture", "compensator"], sort=False)}
    table = [{"gesture": gesture, "compensator": name, "total_error_deg_s": _interval(values),
              "ratio_to_published_hw": _interval(values / errors[gesture, "published-hw"])} for (gesture, name), values in errors.items()]
    shapes = [{"gesture": of[0]["gesture"], "value_deg": _interval([one["value_deg"] for one in of]),
               "share_of_laboratories_that_agree": float(np.mean([one["agrees"] for one in of]))}
              for of in zip(*(row["shapes"] for row in rows))]
    leads_s = [row["lead_s"] for row in rows if row["lead_s"] is not None]
    drawn = pd.DataFrame(ensemble["parameters"])
    return {
        "laboratories": len(rows), "cells": table, "headlines": _headlines(cells),
        "scenarios": [{"name": name, "headlines": _headlines(one)} for name, one in by_scenario.items()],
        "log_rms": {"gestures_1_to_4": _log_rms(cells, 1, 4), "gestures_5_and_6": _log_rms(cells, 5, 6)},
        "lead_s": _interval(leads_s) if leads_s else None, "shapes": shapes,
        "ensemble": {"seed": ensemble["seed"], "doubt": doubt(ensemble), "acceptance": ensemble["acceptance"],
                     "autocorrelation_steps": float(drawn.autocorrelation_steps.max()), "least_effective": float(drawn.effective.min())},
        "version": __version__,
    }


def text(result: dict[str, Any]) -> str:
    """The headlines: each compensator to published-hw and to the line with a lead, median (5 to 95 %), share below 1."""
    lines = [f"{'':24}{'to published-hw':>28}{'to line-lead':>28}"]
    for one in [{"headlines": result["headlines"]}, *result["scenarios"]]:
        lines += [one["name"]] if "name" in one else []
        for of in one["headlines"]:
            ratios = {to: f"{r['median']:.2f} ({r['low']:.2f} to {r['high']:.2f}), {100 * of['share_of_laboratories_below'][to]:.0f} %"
                      for to, r in of["mean_ratio_to"].items()}
            lines.append(f"{of['compensator']:24}{ratios.get('published-hw', ''):>28}{ratios.get('line-lead', ''):>28}")
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser("flexor.laboratories", description=(__doc__ or "").partition("\n")[0])
    tasks = parser.add_subparsers(dest="task", required=True)
    tasks.add_parser("fit", help="the likeliest one, for --set of flexor experiment; minutes")
    drawing = tasks.add_parser("draw", help="laboratories that the published averages leave plausible")
    drawing.add_argument("--laboratories", type=int, default=200)
    drawing.add_argument("--steps", type=int, default=600, help="of each of 64 walkers; a third of them warms up")
    drawing.add_argument("--seed", type=int, default=7)
    playing = tasks.add_parser("run", help="the experiment in each of them; goes on where a run was cut off")
    playing.add_argument("file", help="the document that draw wrote")
    playing.add_argument("--gestures", default="1-6")
    playing.add_argument("--trials", type=int, default=16)
    playing.add_argument("--scenarios", action="store_true", help="also with half-open poses, the glove put on again, and so on")
    for one in (drawing, playing):
        one.add_argument("--out", required=True, help="the document; of run a folder: laboratories.jsonl, results.json")
        one.add_argument("--threads", type=int, default=0, help="0: as many as the machine has")
    with options_of(parser) as o:
        if o.task == "fit":
            print("\n".join(f"{name}={value:g}" for name, value in fit().items()))
        elif o.task == "draw":
            core.require_writable(o.out)
            ensemble = draw(o.laboratories, steps=o.steps, seed=o.seed, threads=o.threads)
            write_json(o.out, ensemble, indent=1)
            print(f"{o.out}: {o.laboratories} laboratories")
            if doubt(ensemble):
                print(f"warning: {doubt(ensemble)}", file=sys.stderr)
        else:
            ensemble = load(o.file)
            rows = run(ensemble, out=o.out, threads=o.threads, gestures=o.gestures, trials=o.trials, scenarios=o.scenarios)
            result = summary(rows, ensemble)
            write_json(Path(o.out) / "results.json", result)
            print(text(result))
