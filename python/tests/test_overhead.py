"""What Python costs: printed, since it depends on the machine (pytest -s)."""

import json
import time

import numpy as np

import flexor


def test_a_fit(program, files):
    pair = (files / "glove-1.csv", files / "camera-1.csv")
    command = json.loads(program("identify", "--pair", *pair, "--rate", 10, "--json"))
    begin = time.perf_counter()
    found = flexor.identify([pair], rate_hz=10, progress=False)
    whole_s = time.perf_counter() - begin
    print(f"\nfit: {found.results['fit_seconds']:.3f} s in the module, {command['fit_seconds']:.3f} s in the command; "
          f"the call {whole_s:.3f} s")


def test_a_streaming_row(found):
    rows = np.full((100, len(found.compensator.inputs)), 40.0)
    found.compensator.step(rows)
    best_s = min(timed(found.compensator, rows) for _ in range(20))
    print(f"\na streaming row of {rows.shape[1]} sensors in batches of 100: {1e6 * best_s:.3f} us")


def timed(compensator, rows, batches=100):
    begin = time.perf_counter()
    for _ in range(batches):
        compensator.step(rows)
    return (time.perf_counter() - begin) / batches / len(rows)
