"""Angles for other programs: BIDS, OpenSim (.mot), MATLAB (.mat) and the Lab Streaming Layer.

A log is a file, a Recording or a frame with a time index, with a column NAME_deg or NAME_rad for each joint, as `flexor apply`,
`flexor track` and `flexor posture complete` write them. The joint is NAME. Other columns are left out, standard errors
(NAME_se_deg) too; where NAME_quality is 3, the camera lost the angle, where NAME_status is not 0, the model holds it: NaN. Files are written whole or not at all.
Raises ValueError, one line.

    python -m flexor.export angles.csv --to bids --out dataset/ --subject 01
    python -m flexor.export angles.csv --to mot --out angles.mot        # or mat
    python -m flexor.export ws://127.0.0.1:PORT/TOKEN/socket --to lsl   # the address that flexor live prints
"""
import argparse
import io
import json
import os
import re
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from flexor._core import __version__, core, needed, options_of, write_json, write_text
from flexor._model import Compensator
from flexor._recording import Recording, angles_of, as_recording, read

UNKNOWN_FROM = {"_quality": 3, "_status": 1}  # lost by a camera; held by a model
A_DATE_S = 1e8  # dates are seconds since 1970; no log runs for three years
UNEVEN = 0.15  # of the mean step: clocks are written in whole milliseconds
README = """# Joint angles of a hand

Angles of finger joints, in degrees, as a flex-sensor glove measured them and Flexor exported them. Columns of a motion.tsv are named
in channels.tsv beside it; the last, latency, has the seconds from the first sample on. An angle that is not known is n/a.
"""


def joints_of(log, model=None) -> pd.DataFrame:
    """Joints by name in degrees on strictly rising seconds, of dates since the first; a row with the time of one before is left out.

    model: the document that the angles are of; they become flexion, 0 at the open hand and growing towards the fist.
    """
    log, out = _log(log), {}
    for joint, column in angles_of(log).items():
        is_lost = np.any([log.columns.get(joint + end, np.zeros(len(log))) >= least for end, least in UNKNOWN_FROM.items()], axis=0)
        out[joint] = np.where(is_lost, np.nan, log[column] if log.units[column] == "deg" else np.degrees(log[column]))
    if not out:
        raise ValueError(f"no column is called NAME_deg or NAME_rad; there are {', '.join(log.columns)}")
    if (np.diff(log.t_s) < -1).any():
        raise ValueError("the clock starts again: cut the log there, into a file for each trial")
    begin_s = log.t_s[:1].max(initial=0)
    angles = pd.DataFrame(out if model is None else _flexion(out, model), index=log.t_s - (begin_s if begin_s > A_DATE_S else 0))
    if np.isinf(angles.to_numpy()).any():
        raise ValueError("an angle is infinite")
    return angles[angles.index > np.r_[-np.inf, np.maximum.accumulate(angles.index)[:-1]]]


def _log(given) -> Recording:
    """Of a file the angles alone, whatever its clock does: `joints_of` leaves out what does not rise."""
    if isinstance(given, (str, os.PathLike)):
        return read(given, lambda names: [n for n in names if core.unit_of(n) in ("deg", "rad") or n.endswith(tuple(UNKNOWN_FROM))], repair=False)
    return as_recording(given)


def _flexion(angles: dict, model) -> dict:
    ends = {joint["name"]: joint.get("ends") for joint in Compensator.load(model).document["joints"]}
    for joint in angles:
        if not ends.get(joint):
            raise ValueError(f"{model}: has no ends of a joint {joint}: drop its column, or choose another model")
        open_deg, fist_deg = ends[joint]["open_deg"], ends[joint]["fist_deg"]
        angles[joint] = np.sign(fist_deg - open_deg) * (angles[joint] - open_deg)
    return angles


def _rate_hz(t_s: np.ndarray) -> float:
    """Even where no step differs from the mean by more than UNEVEN, and no sample lies a mean step from its place."""
    if len(t_s) < 2:
        raise ValueError("one row has no sampling rate")
    mean_s = (t_s[-1] - t_s[0]) / (len(t_s) - 1)
    step_s = np.diff(t_s)
    astray_s = np.abs(t_s - t_s[0] - mean_s * np.arange(len(t_s))).max()
    if np.abs(step_s / mean_s - 1).max() > UNEVEN or astray_s > mean_s:
        raise ValueError(f"unevenly sampled, steps of {step_s.min():.4g} to {step_s.max():.4g} s, a sample {astray_s:.3g} s from its "
                         "place at an even rate: BIDS needs a rate (angles of flexor apply have one; else pandas' resample)")
    return 1 / mean_s


def bids(folder, log, *, subject: str = "01", task: str = "motion", number: int | None = None, model=None) -> list[Path]:
    """Adds a recording to a BIDS dataset with motion, a new one or one that is there; returns the files.

    number: of the run. In a dataset that is there nothing changes but for a line in participants.tsv. The last column, latency,
    has the seconds from the first sample on, to the microsecond: the rate alone would lose them.
    Source: BIDS 1.10.0, Motion. MotionChannelCount counts joints (JNTANG) and latency (LATENCY), as its example motion_dualtask does.
    """
    for what, label in (("subject", subject), ("task", task)):
        if not re.fullmatch("[A-Za-z0-9]+", label):
            raise ValueError(f"{what} {label}: BIDS takes letters and digits alone")
    folder = Path(folder)
    is_new = not folder.exists() or not any(folder.iterdir())
    if not is_new and not (folder / "dataset_description.json").exists():
        raise ValueError(f"{folder}: is no BIDS dataset, which has a dataset_description.json: choose another folder")
    run_part = "" if number is None else f"_run-{number}"
    motion = folder / f"sub-{subject}" / "motion"
    stem = f"{motion}/sub-{subject}_task-{task}_tracksys-glove{run_part}"
    files = [Path(stem + end) for end in ("_motion.tsv", "_motion.json", "_channels.tsv")]
    if there := [file for file in files if file.exists()]:
        raise ValueError(f"{there[0]}: is there already: choose another subject, task or run")
    angles = joints_of(log, model)
    if "latency" in angles:
        raise ValueError("a joint is called latency, as the column of times is: call it otherwise")
    rate_hz = _rate_hz(angles.index.to_numpy())
    try:
        motion.mkdir(parents=True, exist_ok=True)
        _write_run(angles, files, task, rate_hz)
        if is_new:
            (folder / "README.md").write_text(README, "utf-8")
            write_json(folder / "dataset_description.json", {
                "Name": "Joint angles of a hand", "BIDSVersion": "1.10.0", "DatasetType": "raw",
                "GeneratedBy": [{"Name": "Flexor", "Version": __version__}]})
        participants = folder / "participants.tsv"
        lines = participants.read_text("utf-8").splitlines() if participants.exists() else ["participant_id"]
        if f"sub-{subject}" not in [line.split("\t")[0] for line in lines]:
            write_text(participants, "\n".join([*lines, f"sub-{subject}" + "\tn/a" * lines[0].count("\t")]) + "\n")
    except BaseException:
        for file in files:
            file.unlink(missing_ok=True)
        if is_new:
            shutil.rmtree(folder, ignore_errors=True)
        raise
    return files


def _write_run(angles: pd.DataFrame, files: list[Path], task: str, rate_hz: float) -> None:
    angles.columns = angles.columns.str.replace(r"[\x00-\x1f\x7f]", "_", regex=True)
    latency = [f"{t_s:.6f}" for t_s in angles.index - angles.index[0]]
    angles.assign(latency=latency).to_csv(files[0], sep="\t", na_rep="n/a", header=False, index=False)
    count = len(angles.columns)
    write_json(files[1], {
        "TaskName": task, "TaskDescription": "Motion of the fingers of one hand", "SamplingFrequency": rate_hz,
        "TrackingSystemName": "glove", "TrackedPointsCount": count, "MotionChannelCount": count + 1,
        "JNTANGChannelCount": count, "LATENCYChannelCount": 1, "RecordingDuration": len(angles) / rate_hz,
        "MissingValues": "n/a", "SoftwareVersions": f"Flexor {__version__}"})
    rows = [f"{joint}\tn/a\tJNTANG\t{joint}\tdeg" for joint in angles]
    rows = ["name\tcomponent\ttype\ttracked_point\tunits", *rows, "latency\tn/a\tLATENCY\tn/a\ts"]
    files[2].write_text("\n".join(rows) + "\n", "utf-8")


def mot(path, log, *, model=None) -> int:
    """An OpenSim motion in degrees; returns its rows. A joint's name is a coordinate's: blanks in it become underscores.

    A row with an angle that is not known is left out: OpenSim's Storage reads no further than such a row.
    """
    angles = joints_of(log, model).dropna()
    if angles.empty:
        raise ValueError("no row with all its angles")
    angles.columns = angles.columns.str.replace(r"[\x00-\x20\x7f]", "_", regex=True)
    if "time" in angles or not angles.columns.is_unique:
        raise ValueError(f"a .mot file cannot have the columns time, {', '.join(angles)}: call a joint otherwise")
    header = f"Flexor\nversion=1\nnRows={len(angles)}\nnColumns={1 + len(angles.columns)}\ninDegrees=yes\nendheader\n"
    write_text(path, header + angles.to_csv(sep="\t", index_label="time"))
    return len(angles)


def mat(path, log, *, model=None) -> int:
    """A .mat file (level 5) with t_s (rows x 1), angle_deg (rows x joints) and joints, a cell array of names; returns its rows."""
    savemat, out = needed("scipy.io").savemat, io.BytesIO()
    angles = joints_of(log, model)
    savemat(out, {"t_s": angles.index.to_numpy()[:, None], "angle_deg": angles.to_numpy(),
                  "joints": np.array(list(angles), dtype=object)[None, :]}, do_compression=True)
    core.write_file(path, out.getvalue())
    return len(angles)


def lsl(source, *, stream: str = "Flexor") -> int:
    """Streams angles of type MoCap through the Lab Streaming Layer; returns the samples once the source ends.

    source: a log, which is played in its own time, or the address of `flexor live`'s socket, ws://127.0.0.1:PORT/TOKEN/socket.
    """
    pylsl, outlet, count = needed("pylsl"), None, 0
    for names, angles in _live(source) if isinstance(source, str) and source.startswith("ws://") else _played(source):
        if outlet is None:
            info = pylsl.StreamInfo(stream, "MoCap", len(names), 0, "double64", "flexor")
            info.set_channel_labels(names)
            outlet = pylsl.StreamOutlet(info)
        outlet.push_sample(angles)
        count += 1
    return count


def _played(log) -> Iterator[tuple[list[str], list[float]]]:
    angles = joints_of(log)
    begin = time.monotonic() - angles.index[0]
    for t_s, row in zip(angles.index, angles.to_numpy().tolist(), strict=True):
        time.sleep(max(0, begin + t_s - time.monotonic()))
        yield list(angles), row


def _live(address: str) -> Iterator[tuple[list[str], list[float]]]:
    with needed("websockets.sync.client").connect(address, max_size=None) as socket:
        yield from live_samples(socket)


def live_samples(messages) -> Iterator[tuple[list[str], list[float]]]:
    """Names and angles from the messages of `flexor live` (apps/live/SOCKET.md): a state names the fingers, samples are kind 1."""
    names: list[str] = []
    for message in messages:
        if isinstance(message, str):
            names = [finger["name"] for finger in json.loads(message).get("fingers", [])] or names
        elif message[0] == 1 and names:
            channels = message[1]
            row = np.dtype([("t_s", "<f8"), ("raw", "<f4", channels), ("angle_deg", "<f4", channels)])
            for angles in np.frombuffer(message, row, int.from_bytes(message[2:4], "little"), 4)["angle_deg"]:
                yield names, np.atleast_1d(angles).tolist()


if __name__ == "__main__":
    parser = argparse.ArgumentParser("flexor.export", description="Angles for BIDS, OpenSim, MATLAB and the Lab Streaming Layer.")
    parser.add_argument("file", help="CSV of flexor apply, track or posture complete; for lsl also flexor live's address")
    parser.add_argument("--to", required=True, choices=("bids", "mot", "mat", "lsl"))
    parser.add_argument("--out", help="file, or folder of the dataset")
    parser.add_argument("--model", help="the model that the angles are of: written as flexion, 0 at the open hand")
    parser.add_argument("--subject", default="01", help="bids: letters and digits")
    parser.add_argument("--task", default="motion", help="bids: letters and digits")
    parser.add_argument("--run", type=int, help="bids: number of the recording, where there are several")
    with options_of(parser) as o:
        if o.to == "lsl":
            print(f"{lsl(o.file)} samples")
        elif not o.out:
            raise ValueError("--out is needed")
        elif o.to == "bids":
            print(*bids(o.out, o.file, subject=o.subject, task=o.task, number=o.run, model=o.model), sep="\n")
        else:
            log = _log(o.file)
            print(f"{o.out}: {(mot if o.to == 'mot' else mat)(o.out, log, model=o.model)} of {len(log)} rows")
