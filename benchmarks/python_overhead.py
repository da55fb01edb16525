"""What Python costs on a fit and on a row of a stream. Prints both; ratios count.

    PYTHONPATH=python:build/release/python/package build/python/bin/python benchmarks/python_overhead.py build/release/flexor
"""
import resource
import subprocess
import sys
import tempfile
import time

import flexor
import numpy as np


def of_children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def row_s(compensator: flexor.Compensator, rows: np.ndarray, batches: int = 100) -> float:
    begin = time.perf_counter()
    for _ in range(batches):
        compensator.step(rows)
    return (time.perf_counter() - begin) / batches / len(rows)


def main(program: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        logs = f"{folder}/logs"
        subprocess.run([program, "twin", "record", "--out", logs], check=True, capture_output=True)
        pair = (f"{logs}/glove-1.csv", f"{logs}/camera-1.csv")
        before_s = of_children_s()
        subprocess.run([program, "identify", "--pair", *pair, "--rate", "10", "--json"], check=True, capture_output=True)
        command_s = of_children_s() - before_s
        begin_s = time.process_time()
        found = flexor.identify([pair], rate_hz=10, progress=False)
        module_s = time.process_time() - begin_s
    print(f"fit, seconds of processors: {module_s:.3f} in the module, {command_s:.3f} in the command: {module_s / command_s:.4f}")
    rows = np.full((100, len(found.compensator.inputs)), 40.0)
    best_s = min(row_s(found.compensator, rows) for _ in range(20))
    print(f"a streaming row of {rows.shape[1]} sensors in batches of 100: {1e6 * best_s:.3f} us")


if __name__ == "__main__":
    main(sys.argv[1])
