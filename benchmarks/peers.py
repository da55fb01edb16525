"""One table from one run: time and held-out error of `flexor identify` and of what others would take, on real recordings.

The samples are the program's own: its clock offset, its grid of 20 Hz with the last reading held, the first half fitted, the second half scored, pauses left out. Everybody has the own finger's sensor alone and
one thread on one core. Run by `script/bench --with-peers`.

A peer is fit(data, seed) -> predict. A fit sees reading, measured angle and `use` of the first half, at even periods. predict takes
readings from rest and gives an angle for each, from that reading and those before it alone. Settings are constants, the same for
all joints; no fit sees the scored half.
"""
import contextlib
import io
import os
import sys
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

import flexor  # noqa: E402
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
    fit_s: float
    cpu_s: float
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


class Joint:
    """Both logs of a joint, and their samples as `identify` has them."""

    def __init__(self, data: Path, joint: str):
        folder, sensor, angle = JOINTS[joint]
        self.logs = flexor.read(data / folder / "sensor_log.csv"), flexor.read(data / folder / "camera_angles.csv")
        self.map = {"index": (sensor, angle)}
        offset_s = self.identify("line").clock_offset_s
        both = flexor.align(*self.logs, input=sensor, output=angle, rate_hz=1 / PERIOD_S, clock_offset_s=offset_s)[1].frame
        self.use = both.notna().all(axis=1).to_numpy()
        self.reading, self.angle_deg = both.ffill().bfill().iloc[:, :2].to_numpy().T
        half = len(self.use) // 2
        self.fitted = Data(self.reading[:half], self.angle_deg[:half], self.use[:half])

    def identify(self, structure: str) -> flexor.Identification:
        return flexor.identify([self.logs], self.map, rate_hz=1 / PERIOD_S, structure=structure, input_unit="count", threads=1)

    def own(self, structure: str) -> Row:
        used = time.process_time()
        results = self.identify(structure).results
        joint = results["joints"]["index"]
        return Row(results["fit_seconds"], time.process_time() - used, joint["holdout"]["rmse_deg"], joint["hold_drift_deg"])

    def peer(self, fit: Callable[[Data, int], Predict], seeds: int) -> Row:
        """The median of each figure over the seeds."""
        rows, half = [], len(self.fitted.reading)
        for seed in range(seeds):
            start, used = time.perf_counter(), time.process_time()
            predict = fit(self.fitted, seed)
            wall, cpu = time.perf_counter() - start, time.process_time() - used
            error = (predict(self.reading) - self.angle_deg)[half:][self.use[half:]]
            rows.append([wall, cpu, np.sqrt(np.mean(error**2)), drift_deg(predict, self.fitted.reading)])
        return Row(*np.median(rows, axis=0))


def main() -> None:
    data = Path(sys.argv[1])  # with index_ind2 and middle_mid1
    table: dict[str, list[Row]] = {}
    start = time.perf_counter()
    for at, name in enumerate(JOINTS):
        left = f", about {(time.perf_counter() - start) / at * (len(JOINTS) - at):.0f} s left" if at else ""
        print(f"\r\033[Kjoint {at + 1} of {len(JOINTS)}, {name}{left}", end="", file=sys.stderr, flush=True)
        joint = Joint(data, name)
        for structure in ("auto", "hw"):
            table.setdefault(f"flexor, structure {structure}", []).append(joint.own(structure))
        for peer, (fit, seeds) in PEERS.items():
            table.setdefault(peer, []).append(joint.peer(fit, seeds))
    print("\r\033[K", end="", file=sys.stderr)

    print(f"{'':34}{'seconds, mean':^16}{'RMSE on the second half, degrees':^48}{'drift':>8}")
    print(f"{'':34}{'fit':>8}{'CPU':>8}" + "".join(f"{joint:>12}" for joint in JOINTS) + f"{'deg':>8}")
    for name, rows in table.items():
        drift = max(row.drift_deg for row in rows)
        print(f"{name:34}{np.mean([row.fit_s for row in rows]):8.2f}{np.mean([row.cpu_s for row in rows]):8.2f}" +
              "".join(f"{row.rmse_deg:12.2f}" for row in rows) + f"{drift:8.1f}{' *' if drift > STILL_DEG else ''}")
    print(f"* moves by more than {STILL_DEG} degree in a minute while the reading stays; worst joint. CPU: with compilation;\n  of flexor with clocks, "
          "baselines and scores.")


main()
