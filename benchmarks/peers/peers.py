"""One table from one run: time and held-out error of `flexor identify` and of what others would take, on real recordings.

The samples are the program's own (`identify --report` writes samples-1.csv): its clock offset, its grid of 20 Hz with the
last reading held, the first half fitted, the second half scored, pauses included. Everybody has the own finger's sensor alone and
one thread on one core. Run by `script/bench --with-peers`.
"""
import argparse
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

import methods  # noqa: E402
import numpy as np  # noqa: E402

JOINTS = {"index ABC": ("index_ind2", "SensorA1", "∠ABC"), "index BCD": ("index_ind2", "SensorA1", "∠BCD"),
          "middle ABC": ("middle_mid1", "SensorA2", "∠ABC"), "middle BCD": ("middle_mid1", "SensorA2", "∠BCD")}
PEERS = {"SciPy least_squares, the same hw": (methods.fit_scipy, 1), "jax-sysid, median of 5 seeds": (methods.fit_jax_sysid, 5),
         "SysIdentPy, cubic NFIR": (methods.fit_sysidentpy, 1), "scikit-learn ExtraTrees": (methods.fit_extra_trees, 1)}
STILL_DEG = 1  # what identify allows a hold to drift: kMostDrift_deg in host/identify/joint_fit.cpp


@dataclass
class Row:
    """Of one joint; the program's processor time is that of the whole command, a peer's that of the fit."""
    fit_s: float
    cpu_s: float
    command_s: float
    rmse_deg: float
    drift_deg: float


def drift_deg(predict: methods.Predict, fitted: np.ndarray) -> float:
    """The most that the angle moves from one second to a minute after the readings stopped: host/identify/hold.cpp.

    The fitted half is replayed; it stops at 40 instants all over it.
    """
    settle, end, every, worst = round(1 / methods.PERIOD_S), round(60 / methods.PERIOD_S), max(1, len(fitted) // 40), 0.0
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


def peer(fit: Callable[[methods.Data, int], methods.Predict], seeds: int, samples: np.ndarray) -> Row:
    """The median of each figure over the seeds."""
    half = samples[samples["held_out"] == 0]
    data = methods.Data(half["reading"], half["measured_deg"], half["gap"] == 0)
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
