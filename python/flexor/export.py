"""Angles for other programs: BIDS, OpenSim (.mot), MATLAB (.mat) and the Lab Streaming Layer.

A frame has a row for each sample, its index the time: seconds, or dates; and a column NAME_deg or NAME_rad for each joint, as
`flexor apply`, `flexor track` and `flexor posture complete` write them. The joint is NAME. Other columns are left out,
standard errors (NAME_se_deg) too; where NAME_quality is 3, the camera lost the angle, and it is NaN. Files are written whole
or not at all. Raises ValueError, one line.

    python -m flexor.export angles.csv --to bids --out dataset/ --subject 01
    python -m flexor.export angles.csv --to mot --out angles.mot        # or mat
    python -m flexor.export ws://127.0.0.1:PORT/TOKEN/socket --to lsl   # the address that flexor live prints
"""
import argparse
import json
import os
import re
import shutil
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from flexor._files import read_table, replacing, run, version

LOST = 3  # a camera's quality
LONGEST_PAUSE_S = 3600
UNEVEN = 0.15  # of the mean step: clocks are written in whole milliseconds
README = """# Joint angles of a hand

Angles of finger joints, in degrees, as a flex-sensor glove measured them and Flexor exported them. Each sample is a row
of a motion.tsv, each joint a column; channels.tsv beside it names the columns, motion.json has the rate. The last
column, latency, has the seconds from the first sample on.

An angle that is not known, as in a pause of the log, is n/a.
"""


def joints_of(frame: pd.DataFrame, names: Mapping[str, str] | None = None, model=None) -> pd.DataFrame:
    """Joints by name in degrees on strictly rising seconds; a row with the time of one before is left out.

    names: what joints are to be called instead. model: the document that the angles are of; they become flexion, 0 at the open
    hand and growing towards the fist.
    """
    out = {}
    for column in frame:
        joint, _, unit = str(column).rpartition("_")
        if unit not in ("deg", "rad") or not joint or joint.endswith("_se"):
            continue
        if joint in out:
            raise ValueError(f"two columns are the joint {joint}: drop one")
        angle = frame[column].astype(float) * (1 if unit == "deg" else 180 / np.pi)
        out[joint] = angle.mask(frame[f"{joint}_quality"] >= LOST) if f"{joint}_quality" in frame else angle
    if not out:
        raise ValueError(f"no column is called NAME_deg or NAME_rad; there are {', '.join(map(str, frame))}")
    angles = _flexion(pd.DataFrame(out), model) if model is not None else pd.DataFrame(out)
    if unknown := set(names or {}) - set(angles):
        raise ValueError(f"no joint {min(unknown)}; there are {', '.join(angles)}")
    angles = angles.rename(columns=names or {})
    if not angles.columns.is_unique:
        raise ValueError(f"two joints are called {angles.columns[angles.columns.duplicated()][0]}")
    if np.isinf(angles.to_numpy()).any():
        raise ValueError("an angle is infinite")
    angles.index = _seconds(frame.index)
    return angles[angles.index > np.r_[-np.inf, np.maximum.accumulate(angles.index)[:-1]]]


def _seconds(index: pd.Index) -> np.ndarray:
    if isinstance(index, pd.DatetimeIndex):
        index = index - index[0]
    if isinstance(index, pd.TimedeltaIndex):
        return index.total_seconds().to_numpy()
    if not pd.api.types.is_float_dtype(index) and index.name != "t_s":
        raise ValueError("the index is no time: seconds called t_s, or dates, are needed")
    t_s = index.to_numpy(dtype=float)
    if not np.isfinite(t_s).all():
        raise ValueError("a time is not a number")
    return t_s


def _flexion(angles: pd.DataFrame, model) -> pd.DataFrame:
    ends = {joint["name"]: joint.get("ends") for joint in json.loads(Path(model).read_text("utf-8"))["joints"]}
    for joint in angles:
        if not ends.get(joint):
            raise ValueError(f"{model}: has no ends of a joint {joint}: drop its column, or choose another model")
        open_deg, fist_deg = ends[joint]["open_deg"], ends[joint]["fist_deg"]
        angles[joint] = np.sign(fist_deg - open_deg) * (angles[joint] - open_deg)
    return angles


def resampled(angles: pd.DataFrame, rate_hz: float) -> pd.DataFrame:
    """On an even grid, causally: each sample is the mean of the readings since the one before, and without any stays as it was.

    A joint that is not known for 0.3 s, or five samples where that is longer, is NaN from there on.
    """
    t_s, period_s = angles.index.to_numpy(), 1 / rate_hz
    pause = np.diff(t_s, prepend=t_s[0])
    if pause.max() > LONGEST_PAUSE_S:
        raise ValueError(f"nothing for {pause.max():.0f} s before {t_s[pause.argmax()]:.1f} s: export the parts one by one")
    point = np.ceil((t_s - t_s[0]) * rate_hz - 1e-6).astype(int)
    grid = range(point[-1] + 1)
    known_s = angles.notna().mul(t_s, axis=0).where(angles.notna())
    last_s = known_s.groupby(point).max().reindex(grid).ffill()
    out = angles.groupby(point).mean().reindex(grid).ffill()
    out.index = t_s[0] + np.array(grid) * period_s
    return out.where(out.index.to_numpy()[:, None] - last_s.to_numpy() <= max(0.3, 5 * period_s))


def _rate_hz(t_s: np.ndarray) -> float:
    """Even where no step differs from the mean by more than UNEVEN, and no sample lies a mean step from its place."""
    if len(t_s) < 2:
        raise ValueError("one row has no sampling rate: give a rate")
    mean_s = (t_s[-1] - t_s[0]) / (len(t_s) - 1)
    step_s = np.diff(t_s)
    astray_s = np.abs(t_s - t_s[0] - mean_s * np.arange(len(t_s))).max()
    if np.abs(step_s / mean_s - 1).max() > UNEVEN or astray_s > mean_s:
        raise ValueError(f"unevenly sampled, steps of {step_s.min():.4g} to {step_s.max():.4g} s, a sample {astray_s:.3g} s from its "
                         f"place at an even rate: BIDS needs a rate, such as {1 / mean_s:.3g}")
    return 1 / mean_s


def bids(folder, frames, *, subject: str = "01", task: str = "motion", first_run: int | None = None, rate_hz: float | None = None,
         names: Mapping[str, str] | None = None, model=None) -> list[Path]:
    """Adds recordings to a BIDS dataset with motion, a new one or one that is there; returns the files.

    frames: one, or a list, a run each, numbered from first_run (1 where there are several). rate_hz: puts rows onto an even
    grid (`resampled`); unevenly sampled frames are refused without it. A new dataset is there whole or not at all; in one that
    is there nothing changes but for a line in participants.tsv. One export at a time.

    The last column, latency, has the seconds from the first sample on, to the microsecond: the rate alone would lose them.
    Source: BIDS 1.10.0, Motion. MotionChannelCount counts joints (JNTANG) and latency (LATENCY), as its example motion_dualtask does.
    """
    for what, label in (("subject", subject), ("task", task)):
        if not re.fullmatch("[A-Za-z0-9]+", label):
            raise ValueError(f"{what} {label}: BIDS takes letters and digits alone")
    folder, frames = Path(folder), [frames] if isinstance(frames, pd.DataFrame) else list(frames)
    stem = f"sub-{subject}_task-{task}_tracksys-glove"
    count_runs = first_run is not None or len(frames) > 1
    stems = [stem + (f"_run-{(first_run or 1) + i}" if count_runs else "") for i in range(len(frames))]
    motion = folder / f"sub-{subject}" / "motion"
    files = [motion / (name + end) for name in stems for end in ("_motion.tsv", "_motion.json", "_channels.tsv")]
    adds = _is_dataset(folder)
    if there := [file for file in files if file.exists()]:
        raise ValueError(f"{there[0]}: is there already: choose another subject, task or run")
    staging = folder.absolute().parent / f".flexor-export-{os.getpid()}"
    staging.mkdir()
    try:
        made_in = staging / motion.relative_to(folder)
        made_in.mkdir(parents=True)
        made = [_write_run(frame, made_in / name, task, rate_hz, names, model) for frame, name in zip(frames, stems, strict=True)]
        if any(joints != made[0] for joints in made):
            raise ValueError("the recordings have different joints: export each with a task of its own")
        _add_participant(folder / "participants.tsv", staging / "participants.tsv", f"sub-{subject}")
        if adds:
            motion.mkdir(parents=True, exist_ok=True)
            for file in files:
                (made_in / file.name).rename(file)
            (staging / "participants.tsv").rename(folder / "participants.tsv")
        else:
            _write_description(staging)
            staging.rename(folder)
    finally:
        shutil.rmtree(staging, ignore_errors=True)
    return files


def _is_dataset(folder: Path) -> bool:
    if not folder.exists() or not any(folder.iterdir()):
        return False
    if (folder / "dataset_description.json").exists():
        return True
    raise ValueError(f"{folder}: is there already and is no BIDS dataset (dataset_description.json is missing): choose another folder")


def _write_run(frame: pd.DataFrame, stem: Path, task: str, rate_hz: float | None, names, model) -> list[str]:
    angles = joints_of(frame, names, model)
    if "latency" in angles:
        raise ValueError("a joint is called latency, as the column of times is: call it otherwise")
    angles.columns = [re.sub(r"[\x00-\x1f\x7f]", "_", joint) for joint in angles]
    angles = resampled(angles, rate_hz) if rate_hz else angles
    rate = rate_hz or _rate_hz(angles.index.to_numpy())
    latency = [f"{t_s:.6f}" for t_s in angles.index - angles.index[0]]
    angles.assign(latency=latency).to_csv(f"{stem}_motion.tsv", sep="\t", na_rep="n/a", header=False, index=False)
    channels = "".join(f"{joint}\tn/a\tJNTANG\t{joint}\tdeg\n" for joint in angles)
    header, latency = "name\tcomponent\ttype\ttracked_point\tunits\n", "latency\tn/a\tLATENCY\tn/a\ts\n"
    Path(f"{stem}_channels.tsv").write_text(header + channels + latency, "utf-8")
    count = len(angles.columns)
    sidecar = {"TaskName": task, "TaskDescription": "Motion of the fingers of one hand", "SamplingFrequency": rate,
               "TrackingSystemName": "glove", "TrackedPointsCount": count, "MotionChannelCount": count + 1,
               "JNTANGChannelCount": count, "LATENCYChannelCount": 1, "RecordingDuration": len(angles) / rate,
               "MissingValues": "n/a", "SoftwareVersions": f"Flexor {version()}"}
    if rate_hz:
        sidecar["SamplingNote"] = ("Uneven readings were put onto an even grid: each sample is the mean of the readings since the one "
                                   "before, and without any it stays as it was.")
    Path(f"{stem}_motion.json").write_text(json.dumps(sidecar, indent=2) + "\n", "utf-8")
    return list(angles)


def _write_description(folder: Path) -> None:
    description = {"Name": "Joint angles of a hand", "BIDSVersion": "1.10.0", "DatasetType": "raw",
                   "GeneratedBy": [{"Name": "Flexor", "Version": version()}]}
    (folder / "README.md").write_text(README, "utf-8")
    (folder / "dataset_description.json").write_text(json.dumps(description, indent=2) + "\n", "utf-8")


def _add_participant(path: Path, out: Path, subject: str) -> None:
    """A line for the subject, where it has none."""
    text = path.read_text("utf-8") if path.exists() else "participant_id\n"
    lines = text.splitlines()
    if subject not in [line.split("\t")[0] for line in lines]:
        lines.append(subject + "\tn/a" * lines[0].count("\t"))
    out.write_text("\n".join(lines) + "\n", "utf-8")


def mot(path, frame: pd.DataFrame, *, names: Mapping[str, str] | None = None, model=None) -> int:
    """An OpenSim motion in degrees; returns its rows. A joint's name is a coordinate's: blanks in it become underscores.

    A row with an angle that is not known is left out: OpenSim's Storage reads no further than such a row.
    """
    angles = joints_of(frame, names, model).dropna()
    if angles.empty:
        raise ValueError("no row with all its angles")
    angles.columns = [re.sub(r"[\x00-\x20\x7f]", "_", joint) for joint in angles]
    if "time" in angles or not angles.columns.is_unique:
        raise ValueError(f"a .mot file cannot have the columns time, {', '.join(angles)}: call a joint otherwise")
    name = re.sub(r"[\x00-\x20\x7f]", "_", Path(path).stem)
    with replacing(path) as file, open(file, "w", encoding="utf-8") as out:
        out.write(f"{name}\nversion=1\nnRows={len(angles)}\nnColumns={1 + len(angles.columns)}\ninDegrees=yes\nendheader\n")
        angles.to_csv(out, sep="\t", index_label="time")
    return len(angles)


def mat(path, frame: pd.DataFrame, *, names: Mapping[str, str] | None = None, model=None) -> int:
    """A .mat file (level 5) with t_s (rows x 1), angle_deg (rows x joints) and joints, a cell array of names; returns its rows."""
    from scipy.io import savemat

    angles = joints_of(frame, names, model)
    with replacing(path) as file, open(file, "wb") as out:
        savemat(out, {"t_s": angles.index.to_numpy()[:, None], "angle_deg": angles.to_numpy(),
                      "joints": np.array(list(angles), dtype=object)[None, :]}, do_compression=True)
    return len(angles)


def lsl(source, *, stream: str = "Flexor") -> int:
    """Streams angles of type MoCap through the Lab Streaming Layer; returns the samples once the source ends.

    source: a frame, which is played in its own time, or the address of `flexor live`'s socket, ws://127.0.0.1:PORT/TOKEN/socket.
    """
    import pylsl

    outlet, count = None, 0
    for names, angles in _played(source) if isinstance(source, pd.DataFrame) else _live(source):
        if outlet is None:
            info = pylsl.StreamInfo(stream, "MoCap", len(names), 0, "double64", "flexor")
            info.set_channel_labels(names)
            outlet = pylsl.StreamOutlet(info)
        outlet.push_sample(angles)
        count += 1
    return count


def _played(frame: pd.DataFrame) -> Iterator[tuple[list[str], list[float]]]:
    angles = joints_of(frame)
    begin = time.monotonic() - angles.index[0]
    for t_s, row in zip(angles.index, angles.to_numpy().tolist(), strict=True):
        time.sleep(max(0, begin + t_s - time.monotonic()))
        yield list(angles), row


def _live(address: str) -> Iterator[tuple[list[str], list[float]]]:
    from websockets.sync.client import connect

    with connect(address, max_size=None) as socket:
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


def _job(o: argparse.Namespace) -> None:
    if o.to == "lsl":
        return print(f"{lsl(o.files[0] if o.files[0].startswith('ws://') else read_table(o.files[0]))} samples")
    if not o.out:
        raise ValueError("--out is needed")
    if o.to != "bids" and len(o.files) > 1:
        raise ValueError(f"--to {o.to} takes one recording: export them one by one")
    frames = [read_table(file) for file in o.files]
    if o.columns:
        frames = [frame[[c for c in frame if c in o.columns or c.endswith("_quality")]] for frame in frames]
    names = dict(pair.split("=", 1) for pair in o.names)
    if o.to == "bids":
        print(*bids(o.out, frames, subject=o.subject, task=o.task, first_run=o.run, rate_hz=o.rate, names=names, model=o.model), sep="\n")
    else:
        rows = {"mot": mot, "mat": mat}[o.to](o.out, frames[0], names=names, model=o.model)
        print(f"{o.out}: {rows} of {len(frames[0])} rows")


def main() -> None:
    parser = argparse.ArgumentParser("flexor.export", description="Angles for BIDS, OpenSim, MATLAB and the Lab Streaming Layer.")
    parser.add_argument("files", nargs="+", help="CSV of flexor apply, track or posture complete; for lsl also flexor live's address")
    parser.add_argument("--to", required=True, choices=("bids", "mot", "mat", "lsl"))
    parser.add_argument("--out", help="file, or folder of the dataset")
    parser.add_argument("--columns", type=lambda text: text.split(","), help="which columns (default: all NAME_deg and NAME_rad)")
    parser.add_argument("--names", type=lambda text: text.split(","), default=[], help="OLD=NEW,...: call joints otherwise")
    parser.add_argument("--model", help="the model that the angles are of: written as flexion, 0 at the open hand")
    parser.add_argument("--rate", type=float, help="bids: put the rows onto an even grid of so many a second")
    parser.add_argument("--subject", default="01", help="bids: letters and digits")
    parser.add_argument("--task", default="motion", help="bids: letters and digits")
    parser.add_argument("--run", type=int, help="bids: number of the first recording")
    run(parser, _job)


if __name__ == "__main__":
    main()
