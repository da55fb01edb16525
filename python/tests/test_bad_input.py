"""What people hand over, and what they read then: one line that names the place and the mend."""

import functools
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import flexor

pandas = pytest.importorskip("pandas")


def refusal(work, kind=flexor.InputError):
    with pytest.raises(kind) as caught:
        work()
    text = str(caught.value)
    assert "\n" not in text
    return text


def frame(**columns):
    return pandas.DataFrame(columns or {"index_adc": [500.0, 510.0, 530.0]}, index=pandas.Index([0.0, 0.1, 0.2], name="t_s"))


@pytest.mark.parametrize("index, seconds", [
    (pandas.date_range("2026-05-01 12:00", periods=3, freq="100ms"), 0.1),
    (pandas.date_range("2026-05-01 12:00", periods=3, freq="100ms", tz="Asia/Tokyo"), 0.1),
    (pandas.to_timedelta([0, 100, 200], unit="ms"), 0.1),
    (pandas.Index([0, 100, 200], name="time_ms"), 0.1),
    (pandas.RangeIndex(0, 300, 100, name="t_ms"), 0.1),
    (pandas.Index([0.0, 0.1, 0.2]), 0.1),
])
def test_times_in_any_spelling(index, seconds):
    assert np.allclose(np.diff(flexor.Recording(frame().set_axis(index)).t_s), seconds)


ANGLES = {"index_deg": [1.0, 2.0, 3.0]}


@pytest.mark.parametrize("work, text", [
    (lambda: flexor.Recording(frame().reset_index()), 'no time index: Recording(..., time="t_s")'),
    (lambda: flexor.Recording({"a": [1, 2]}), "nothing says the time"),
    (lambda: flexor.Recording(frame().set_axis([0, 100, 200])), "time_unit"),
    (lambda: flexor.Recording(frame().set_axis([0.0, 20.0, 40.0])), "steps of 20, and nothing says of what"),
    (lambda: flexor.Recording(frame().set_axis([0.0, np.nan, 0.2])), "row 2 has no time"),
    (lambda: flexor.Recording(frame().set_axis(pandas.to_datetime(["2026-05-01", "2026-05-02", None]))), "row 3 has no time"),
    (lambda: flexor.Recording(frame().set_axis(["a", "b", "c"])), "numbers, dates or durations"),
    (lambda: flexor.Recording(frame(), rate_hz=50), "which?"),
    (lambda: flexor.Recording(frame(), units="furlong"), "unknown unit"),
    (lambda: flexor.Recording(frame(**ANGLES), units={"index_deg": "rad"}), "which?"),
    (lambda: flexor.Recording(frame(), units={"indx": "V"}), "no column"),
    (lambda: flexor.Recording(frame(flex=[1, "lost", 3])), "mixes numbers with text: row 2 is 'lost'"),
    (lambda: flexor.Recording(pandas.concat([frame(), frame()], axis=1)), "occurs twice"),
    (lambda: flexor.Recording(frame(note=["a", "b", "c"])), "no column of numbers"),
    (lambda: flexor.Recording({"a": [1.0, 2.0]}, time=[0.0, 0.1, 0.2]), "has 2 values"),
    (lambda: flexor.Compensator("{}"), "model"),
    (lambda: flexor.merge([], "out"), "no folders"),
    (lambda: flexor.experiment("1", trials=1, shard="2/2"), "folder of its own"),
    (lambda: flexor.judge([1, np.nan, 3], {"line": [1, 2, 3]}, 0.05), "finite"),
    (lambda: flexor.judge([1, 2, 3], {"line": [1, 2]}, 0.05), "errors of line"),
    (lambda: flexor.judge([1, 2, 3], {"line": [1, 2, 3]}, 0), "period_s=0"),
    (lambda: flexor.judge([1, 2, 3], {}, np.inf), "period_s=inf"),
    (lambda: flexor.judge([1, 2, 3], [1, 2, 3], 0.05), "a mapping"),
    (lambda: flexor.Recording({"a": [1.0, 2.0]}, rate_hz=np.inf), "positive and finite"),
    (lambda: flexor.judge([1.0], {}, 0.05), "two finite numbers"),
    (lambda: flexor.judge(np.ones((4, 2)), {}, 0.05), "two finite numbers"),
    (lambda: flexor.judge([1.0] * 9, {}, 0.05, [1, 2, 3, 4]), "rising to all 9"),
    (lambda: flexor.judge([1.0] * 9, {}, 0.05, [3, 2, 5, 9]), "rising to all 9"),
    (lambda: flexor.twin(rate_hz="fast"), "does not take these"),
])
def test_a_recording_that_is_none(work, text):
    assert text in refusal(work)


@pytest.mark.parametrize("work, text", [
    (lambda glove, camera: flexor.identify((glove, camera)), "pairs: a list of (glove, reference)"),
    (lambda glove, camera: flexor.identify([(glove, camera)], {"index": "index_deg"}), "a sensor or several and an angle"),
    (lambda glove, camera: flexor.identify(zip([glove], [camera]), {"index": ([], "index_deg")}), "index: the map names no sensor of it"),
    (lambda glove, camera: flexor.identify([(glove, camera)], rate_hz="20"), "rate_hz: '20' is of a kind"),
    (lambda glove, camera: flexor.align(glove.frame, camera), "sensor: which column? give input; there are: thumb_alpha_deg"),
    (lambda glove, camera: flexor.align(glove, camera, input="index_alpha_deg"), "camera: which column? give output"),
    (lambda glove, camera: flexor.identify([(glove, frame())]), 'reference: column "index_adc" is in count'),
])
def test_arguments_that_are_wrong(donning, work, text):
    assert text in refusal(lambda: work(donning.glove, donning.camera))


def test_columns_of_all_kinds():
    assert flexor.Recording(frame(), units="count").units == {"index_adc": "count"}
    assert flexor.Recording(frame(**ANGLES).set_axis(pandas.RangeIndex(1, 4, name="frame")), rate_hz=50).units == {"index_deg": "deg"}
    log = flexor.Recording(frame(flex=[1, 2, 3], note=["a", None, "c"], on=[True, False, True]))
    numpy_objects = np.array([1, None, 3], dtype=object)
    assert list(log.columns) == ["flex", "on"] and "note" in log.warnings[0]
    nullable = flexor.Recording(frame(flex=pandas.array([1, None, 3], dtype="Int64"), old=numpy_objects))
    assert np.isnan(nullable["flex"][1]) and np.isnan(nullable["old"][1])
    assert np.isnan(flexor.Recording({"a": np.ma.array([1, 2], mask=[0, 1])}, rate_hz=1)["a"][1])


def test_readings_in_another_unit(found, donning):
    volts = {f"{name}": donning.glove[name] / 100 for name in found.compensator.inputs}
    log = flexor.Recording({name.replace("deg", "V"): values for name, values in volts.items()}, time=donning.glove.t_s)
    text = refusal(lambda: found.compensator.predict(log, inputs=list(log.columns)))
    assert "is in V" in text and "takes deg" in text


def test_missing_readings_are_left_out_with_a_warning(donning, found):
    values = donning.glove["index_alpha_deg"].copy()
    values[100:110] = np.nan
    log = flexor.Recording({**donning.glove.columns, "index_alpha_deg": values}, time=donning.glove.t_s)
    with_holes = flexor.identify([(log, donning.camera)], rate_hz=10, structure="line", progress=False)
    assert any(f"10 of {len(log)} rows have no" in warning for warning in with_holes.warnings)
    values[5] = np.inf
    broken = flexor.Recording({**donning.glove.columns, "index_alpha_deg": values}, time=donning.glove.t_s)
    assert "row 6" in refusal(lambda: found.compensator.predict(broken))


def test_arrays_are_not_copied():
    values = np.arange(5.0)
    values.flags.writeable = False
    log = flexor.Recording({"index_adc": values}, rate_hz=10)
    assert np.shares_memory(log["index_adc"], values)
    held = pandas.DataFrame(np.asfortranarray(np.ones((4, 2))), columns=["a", "b"], index=np.arange(4) / 10.0)
    assert np.shares_memory(flexor.Recording(held)["a"], held["a"].to_numpy())
    assert not np.shares_memory(flexor.Recording({"a": np.arange(10.0)[::2]}, rate_hz=1)["a"], values)


def test_what_does_not_fit_the_model(found, donning):
    assert "no column" in refusal(lambda: found.compensator.predict(flexor.Recording({"a": [1.0, 2.0]}, rate_hz=10)))
    assert "rows of 2 readings" in refusal(lambda: found.compensator.step(np.ones((3, 2))))
    assert "two" in refusal(lambda: flexor.identify([(flexor.Recording({"index_adc": [1.0]}, rate_hz=1), donning.camera)],
                                                    {"index": ("index_adc", "index_deg")}))
    assert "arithmetic" in refusal(lambda: flexor.Compensator(found.compensator.text, arithmetic="decimal"))


def test_rows_of_a_frame_go_by_name_and_what_is_masked_is_missing(found, donning):
    frame = donning.glove.frame[found.compensator.inputs[::-1]]
    first = found.compensator.step(frame[:1])
    found.compensator.reset()
    assert np.array_equal(first, found.compensator.step(frame.iloc[0]))
    masked = np.ma.array(frame[found.compensator.inputs][:1], mask=True)
    assert (found.compensator.step(masked)[1] == 3).all()
    assert "numbers" in refusal(lambda: found.compensator.step([["1"] * 5]))


def test_what_the_data_do_not_determine_is_a_job_error(donning, found):
    noise = np.random.default_rng(1).normal(size=len(donning.glove))
    log = flexor.Recording({"index_adc": noise}, time=donning.glove.t_s)
    refusal(lambda: flexor.identify([(log, donning.camera)], {"index": ("index_adc", "index_deg")}), flexor.JobError)
    backwards = flexor.Recording(donning.glove.columns, time=donning.glove.t_s[::-1])
    refusal(lambda: found.compensator.predict(backwards))


def test_readings_that_the_model_hardly_knows(found, donning):
    twelve_bits = flexor.Recording({name: 8 * values + 2000 for name, values in donning.glove.columns.items()}, time=donning.glove.t_s)
    assert "lie outside of the model's range" in refusal(lambda: found.compensator.predict(twelve_bits), flexor.JobError)


def predicted(found, glove):
    return found.compensator.predict(glove, progress=False)["index_deg"]


def test_processes_that_were_forked_and_threads(found, donning):
    expected = predicted(found, donning.glove)
    with multiprocessing.get_context("fork").Pool(2) as processes, ThreadPoolExecutor(4) as threads:
        for pool in (processes, threads):
            for angles in pool.map(functools.partial(predicted, found), [donning.glove] * 4):
                assert np.array_equal(angles, expected)
    assert pickle.loads(pickle.dumps(found.compensator)) == found.compensator


def test_a_subinterpreter_is_refused():
    code = """
try:
    import _interpreters as interpreters
except ImportError:
    import _xxsubinterpreters as interpreters
interpreters.run_string(interpreters.create(), 'import flexor._core')
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "does not support loading in sub" in done.stderr or "while initializing the extension" in done.stderr, done


def test_progress_that_raises_stops_the_job(donning):
    class Enough(Exception):
        pass

    def enough(done, of, what):
        raise Enough

    with pytest.raises(Enough):
        flexor.identify([(donning.glove, donning.camera)], rate_hz=10, progress=enough)


def test_an_interrupt_stops_a_search_soon(donning):
    steps = []

    def interrupt(done, of, what):
        if not steps:
            threading.Timer(0.05, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        steps.append((done, of))

    with pytest.raises(KeyboardInterrupt):
        flexor.identify([(donning.glove, donning.camera)], rate_hz=10, threads=1, progress=interrupt)
    assert steps[-1][0] < steps[-1][1]
