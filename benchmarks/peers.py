"""One table from one run: time and held-out error of `flexor identify` and of what others would take, on real recordings.

The samples are the program's own (`identify --report` writes samples-1.csv): its clock offset, its grid of 20 Hz with the
last reading held, the first half fitted, the second half scored, pauses included. Everybody has the own finger's sensor alone and
one thread on one core. Run by `script/bench --with-peers`.

A peer is fit(data, seed) -> predict. A fit sees reading, measured angle and `use` of the first half, at even periods. predict takes
readings from rest and gives an angle for each, from that reading and those before it alone. Settings are constants, the same for
all joints; no fit sees the scored half.
"""
import argparse
import contextlib
import io
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
os.environ["JAX_PLATFORMS"] = "cpu"
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})  # of libraries that start threads all the same, and of the program
warnings.filterwarnings("ignore")

import jax  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402
from jax_sysid.models import Model  # noqa: E402
from sklearn.ensemble import ExtraTreesRegressor  # noqa: E402
from sysidentpy.basis_function import Polynomial  # noqa: E402
from sysidentpy.model_structure_selection import FROLS  # noqa: E402
from sysidentpy.parameter_estimation import LeastSquares  # noqa: E402

Predict = Callable[[np.ndarray], np.ndarray]
PERIOD_S = 0.05
STILL_DEG = 1  # what identify allows a hold to drift: kMostDrift_deg in host/identify/joint_fit.cpp
JOINTS = {"index ABC": ("index_ind2", "SensorA1", "∠ABC"), "index BCD": ("index_ind2", "SensorA1", "∠BCD"),
          "middle ABC": ("middle_mid1", "SensorA2", "∠ABC"), "middle BCD": ("middle_mid1", "SensorA2", "∠BCD")}


@dataclass
class Data:
    reading: np.ndarray
    angle_deg: np.ndarray
    use: np.ndarray  # False in a pause of either log


def fit_jax_sysid(data: Data, seed: int = 0) -> Predict:
    """x[k+1] = A x + B u + V tanh(W [x, u] + b),  y[k] = C x + D u + v tanh(w [x, u] + d) + e: 3 states, 8 units in each.

    Its default of 1000 steps of L-BFGS, penalties of 1e-4; A starts at 0.5 I, the weights at a tenth of normal numbers.
    Bemporad, IEEE Trans. Automatic Control 70 (2025).
    """
    jax.clear_caches()  # each fit pays for its compilation
    states, units = 3, 8
    u0, u1 = data.reading.mean(), data.reading.std()
    y0, y1 = data.angle_deg.mean(), data.angle_deg.std()

    def block(both, linear, out, inner, bias):
        return linear @ both + out @ jnp.tanh(inner @ both + bias)

    random = np.random.default_rng(seed)
    shapes = [(states, states + 1), (states, units), (units, states + 1), (units,),
              (1, states + 1), (1, units), (units, states + 1), (units,), (1,)]
    start = [0.1 * random.standard_normal(shape) for shape in shapes]
    start[0][:, :states] = 0.5 * np.eye(states)
    use = jnp.asarray(data.use)[:, None]
    model = Model(states, 1, 1, state_fcn=lambda x, u, p: block(jnp.hstack([x, u]), *p[:4]),
                  output_fcn=lambda x, u, p: block(jnp.hstack([x, u]), *p[4:8]) + p[8])
    model.init(params=start)
    model.loss(output_loss=lambda yhat, y: jnp.sum(use * (yhat - y) ** 2) / use.sum(), rho_x0=1e-4, rho_th=1e-4)
    model.optimization(adam_epochs=0, lbfgs_epochs=1000, iprint=-1)
    with contextlib.redirect_stdout(io.StringIO()):  # it prints in spite of iprint
        model.fit(((data.angle_deg - y0) / y1)[:, None], ((data.reading - u0) / u1)[:, None])
    return lambda reading: y0 + y1 * np.asarray(model.predict(model.x0, ((reading - u0) / u1)[:, None])[0])[:, 0]


def fit_sysidentpy(data: Data, seed: int = 0) -> Predict:
    """y[k] = sum of theta_i times products of up to three of u[k] .. u[k-9]: terms by FROLS, their number by Akaike's criterion.

    The library takes one unbroken series, so pauses of a log are fitted, too. Lacerda et al., JOSS 5 (2020) 2384.
    """
    u0, u1 = data.reading.mean(), data.reading.std()

    def ahead(reading: np.ndarray) -> np.ndarray:  # its lags start at 1; the present reading is allowed
        return ((np.r_[reading[1:], reading[-1]] - u0) / u1)[:, None]

    model = FROLS(model_type="NFIR", xlag=list(range(1, 11)), ylag=1, order_selection=True, info_criteria="aic",
                  estimator=LeastSquares(), basis_function=Polynomial(degree=3))
    model.fit(X=ahead(data.reading), y=data.angle_deg[:, None])
    return lambda reading: model.predict(X=ahead(reading), y=np.zeros((len(reading), 1)), steps_ahead=1)[:, 0]


def fit_extra_trees(data: Data, seed: int = 0) -> Predict:
    """y[k] = the mean of 100 trees over u[k - l], l = 0, 1, 2, 4 .. 128, 200 samples (10 s).

    Geurts, Ernst, Wehenkel, Machine Learning 63 (2006) 3.
    """
    lags = np.r_[0, 2 ** np.arange(8), round(10 / PERIOD_S)]

    def lagged(reading: np.ndarray) -> np.ndarray:
        return reading[np.maximum(np.arange(len(reading))[:, None] - lags, 0)]

    forest = ExtraTreesRegressor(n_estimators=100, n_jobs=1, random_state=seed)
    forest.fit(lagged(data.reading)[data.use], data.angle_deg[data.use])
    return lambda reading: forest.predict(lagged(reading))


PEERS = {"jax-sysid, median of 5 seeds": (fit_jax_sysid, 5),
         "SysIdentPy, cubic NFIR": (fit_sysidentpy, 1), "scikit-learn ExtraTrees": (fit_extra_trees, 1)}


@dataclass
class Row:
    """Of one joint; the program's processor time is that of the whole command, a peer's that of the fit."""
    fit_s: float
    cpu_s: float
    command_s: float
    rmse_deg: float
    drift_deg: float


def drift_deg(predict: Predict, fitted: np.ndarray) -> float:
    """The most that the angle moves from one second to a minute after the readings stopped: host/identify/hold.cpp.

    The fitted half is replayed; it stops at 40 instants all over it.
    """
    settle, end, every, worst = round(1 / PERIOD_S), round(60 / PERIOD_S), max(1, len(fitted) // 40), 0.0
    for k in range(every // 2, len(fitted), every):
        held = np.r_[fitted[: k + 1], np.full(len(fitted) + end - k, fitted[k])]  # one length: compiled once
        angle = predict(held)[k + 1 : k + 2 + end]
        worst = max(worst, np.abs(angle[settle:] - angle[settle]).max())
    return worst


class Program:
    """`flexor` on one joint, and what it writes."""

    def __init__(self, program: Path, data: Path, joint: str):
        folder, sensor, angle = JOINTS[joint]
        logs, self.program = data / folder, program
        self.identify = ["identify", "--sensor", f"{logs}/sensor_log.csv", "--reference", f"{logs}/camera_angles.csv",
                         "--map", f"index={sensor}:{angle}", "--input-unit", "count"]

    def run(self, *options: str) -> tuple[str, float, float]:
        """Standard output, processor time, wall time."""
        used, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        done = subprocess.run([self.program, *options], capture_output=True, text=True)
        wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
        if done.returncode:
            sys.exit(f"peers: flexor {' '.join(options)}: {done.stderr.strip()}")
        return done.stdout, after.ru_utime - used.ru_utime + after.ru_stime - used.ru_stime, wall

    def samples(self) -> np.ndarray:
        with tempfile.TemporaryDirectory() as folder:
            result = json.loads(self.run(*self.identify, "--json", "--report", folder)[0])
            samples = np.genfromtxt(Path(folder) / "samples-1.csv", delimiter=",", names=True)
        if abs(result["joints"]["index"]["holdout"]["rmse_deg"] - rmse_deg(samples["estimated_deg"], samples)) > 1e-6:
            sys.exit("peers: identify scored other samples than it wrote")
        return samples

    def fit(self, structure: str) -> Row:
        output, cpu, wall = self.run(*self.identify, "--structure", structure, "--json")
        result = json.loads(output)
        joint = result["joints"]["index"]
        return Row(result["fit_seconds"], cpu, wall, joint["holdout"]["rmse_deg"], joint["hold_drift_deg"])


def rmse_deg(angle: np.ndarray, samples: np.ndarray) -> float:
    return float(np.sqrt(np.mean((angle - samples["measured_deg"])[samples["held_out"] == 1] ** 2)))


def peer(fit: Callable[[Data, int], Predict], seeds: int, samples: np.ndarray) -> Row:
    """The median of each figure over the seeds."""
    half = samples[samples["held_out"] == 0]
    data = Data(half["reading"], half["measured_deg"], half["gap"] == 0)
    rows = []
    for seed in range(seeds):
        start, used = time.perf_counter(), time.process_time()
        predict = fit(data, seed)
        wall, cpu = time.perf_counter() - start, time.process_time() - used
        rows.append([wall, cpu, np.nan, rmse_deg(predict(samples["reading"]), samples), drift_deg(predict, data.reading)])
    return Row(*np.median(rows, axis=0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program", type=Path)
    parser.add_argument("data", type=Path, help="with index_ind2 and middle_mid1")
    options = parser.parse_args()
    table: dict[str, list[Row]] = {}
    start, a_joint_s = time.perf_counter(), None
    for at, joint in enumerate(JOINTS):
        program = Program(options.program.resolve(), options.data, joint)
        samples = program.samples()
        jobs: dict[str, Callable[[], Row]] = {"flexor, structure auto": lambda: program.fit("auto"),
                                              "flexor, structure hw": lambda: program.fit("hw")}
        jobs |= {name: lambda fit=fit, seeds=seeds: peer(fit, seeds, samples) for name, (fit, seeds) in PEERS.items()}
        for name, job in jobs.items():
            gone = time.perf_counter() - start
            left = f", about {max(1, a_joint_s * len(JOINTS) - gone):.0f} s left" if a_joint_s else ""
            print(f"\r\033[Kjoint {at + 1} of {len(JOINTS)}, {joint}: {name}{left}", end="", file=sys.stderr, flush=True)
            table.setdefault(name, []).append(job())
        a_joint_s = (time.perf_counter() - start) / (at + 1)
    print("\r\033[K", end="", file=sys.stderr)

    print(f"{'':34}{'seconds, mean of the joints':^24}{'RMSE on the second half, degrees':^47}{'drift':>8}")
    print(f"{'':34}{'fit':>8}{'CPU':>8}{'command':>9}" + "".join(f"{joint:>12}" for joint in JOINTS) + f"{'deg':>8}")
    for name, rows in table.items():
        fit, cpu, command = (np.mean([getattr(row, what) for row in rows]) for what in ("fit_s", "cpu_s", "command_s"))
        drift = max(row.drift_deg for row in rows)
        print(f"{name:34}{fit:8.2f}{cpu:8.2f}{'' if np.isnan(command) else f'{command:.2f}':>9}" +
              "".join(f"{row.rmse_deg:12.2f}" for row in rows) + f"{drift:8.1f}{' *' if drift > STILL_DEG else ''}")
    print(f"* moves by more than {STILL_DEG} degree in a minute while the reading stays; worst joint. CPU: of the fit, with "
          "compilation;\n  of flexor the whole command: reading, clocks, fit, baselines, scores.")


main()
