"""What Python costs: printed, since it depends on the machine (pytest -s)."""

import resource
import time

import numpy as np

import flexor


def test_a_fit(program, files):
    pair = (files / "glove-1.csv", files / "camera-1.csv")
    before_s = of_children_s()
    program("identify", "--pair", *pair, "--rate", 10, "--json")
    command_s = of_children_s() - before_s
    begin = time.process_time()
    flexor.identify([pair], rate_hz=10, progress=False)
    module_s = time.process_time() - begin
    print(f"\nfit, seconds of processors: {module_s:.3f} in the module, {command_s:.3f} in the command: {module_s / command_s:.4f}")


def test_a_streaming_row(found):
    rows = np.full((100, len(found.compensator.inputs)), 40.0)
    found.compensator.step(rows)
    best_s = min(timed(found.compensator, rows) for _ in range(20))
    print(f"\na streaming row of {rows.shape[1]} sensors in batches of 100: {1e6 * best_s:.3f} us")


def of_children_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def timed(compensator, rows, batches=100):
    begin = time.perf_counter()
    for _ in range(batches):
        compensator.step(rows)
    return (time.perf_counter() - begin) / batches / len(rows)
