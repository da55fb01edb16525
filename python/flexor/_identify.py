"""From recordings to compensators."""

import dataclasses
import os
import pathlib
import shutil
from typing import Any, Mapping, Optional, Sequence, Union

from flexor._core import InputError, JobError, Show, core, filled, pandas, run, shown
from flexor._model import Compensator
from flexor._recording import Recording, as_log


@dataclasses.dataclass(frozen=True)
class Identification:
    """A compensator, and what was found on the way to it."""

    compensator: Compensator
    proven: Compensator
    """Fitted to a part: what the figures are of; with ``fit_all`` another than ``compensator``."""
    results: dict[str, Any]
    """What ``flexor identify --json`` prints (docs/json.md)."""
    _covariances: dict[str, Any]

    @property
    def warnings(self) -> list[str]:
        return self.results["warnings"]

    @property
    def clock_offset_s(self) -> float:
        """Reference time minus sensor time, of the first pair."""
        return self.results["pairs"][0]["clock_offset_s"]

    @property
    def verdicts(self) -> dict[str, dict[str, Any]]:
        """Of each joint: better, as good or worse than the best baseline, on data that neither saw."""
        return {name: joint["verdict"] for name, joint in self.results["joints"].items()}

    @property
    def parameters(self) -> Any:
        """What was fitted: a frame over (joint, name) of value, standard error and 95 % interval. Those that the data cannot
        tell have none."""
        rows = {(joint, p["name"]): (p["value"], p["standard_error"], *(p["interval95"] or (None, None)))
                for joint, found in self.results["joints"].items() for p in found["parameters"]}
        pd = pandas()
        index = pd.MultiIndex.from_tuples(list(rows), names=["joint", "name"])
        return pd.DataFrame(list(rows.values()), index=index, columns=["value", "standard_error", "low95", "high95"], dtype=float)

    def covariance(self, joint: str) -> Any:
        """Of a joint's parameters: a square frame; holds for residuals that are neither Gaussian nor white."""
        names = [p["name"] for p in self.results["joints"][joint]["parameters"]]
        return pandas().DataFrame(self._covariances[joint], index=names, columns=names)

    def __repr__(self) -> str:
        return "\n".join(f"{name}: {joint['verdict']['words']}" for name, joint in self.results["joints"].items())


def identify(pairs: Sequence[tuple[Any, Any]], map: Optional[Mapping[str, tuple[Union[str, Sequence[str]], str]]] = None, *,
             rate_hz: float = 20, split: float = 0.5, structure: str = "auto", lead_s: float = 0,
             clock_offset_s: Optional[float] = None, fit_all: bool = False, leave_out: str = "", input_unit: str = "",
             output_unit: str = "", reference_error_deg: Mapping[str, float] = {},
             ends_deg: Mapping[str, tuple[float, float]] = {}, initial: Optional[Compensator] = None,
             refit: Optional[Compensator] = None, time_limit_s: Optional[float] = None, threads: int = 0,
             progress: Show = None) -> Identification:
    """A compensator that is proven on data it never saw, as ``flexor identify`` finds it.

    ``pairs``: a glove's recording and measured angles each (recordings, frames with a time index, or files); both may be the
    same one, whose clock they then share.
    ``map``: joints from sensors, ``{"index": ("SensorA1", "index_deg"), "thumb": (["SensorA0", "SensorA1"], "thumb_deg")}``, the
    own sensor first; left out: by the columns' names.
    ``rate_hz``: of the compensator. ``split``: the share of each recording, from its start, that is fitted; the rest is held out.
    ``structure``: auto, line, hw, ... as ``flexor identify --help`` says. ``lead_s``: how far ahead of the readings angles are.
    ``leave_out``: take or block: each in turn is left out of a fit to all the rest. ``reference_error_deg``: of the measured
    angles themselves, by joint. ``ends_deg``: angles at the open hand and at the fist, by joint. ``initial``: its parameters are
    a start more. ``refit``: only its gains and dead zones are fitted. ``time_limit_s``: after it the best so far is taken.
    Raises ``InputError``: recordings or map are wrong; ``JobError``: they determine nothing. Ctrl-C stops it.
    """
    if leave_out and leave_out not in ("take", "block"):
        raise InputError(f'leave_out "{leave_out}": take or block')

    def files_of(number: str, sensor: Any, reference: Any) -> Any:
        glove = as_log(sensor, f"glove{number}")
        return core.PairFiles(glove, glove if reference is sensor else as_log(reference, f"reference{number}"))

    pairs = list(pairs)
    for one in pairs:
        if not isinstance(one, (tuple, list)) or len(one) != 2:
            raise InputError(f"pairs: a list of (glove, reference), not of {type(one).__name__}")
    for joint, of in (map or {}).items():
        if not isinstance(of, (tuple, list)) or len(of) != 2 or of[0] is None or not isinstance(of[1], str):
            raise InputError(f'map: {joint!r} is {of!r:.60}: a sensor or several and an angle, ("SensorA1", "index_deg")')
    name = core.joint_name
    request = filled(
        core.Request(),
        pairs=[files_of(f" {i}" if len(pairs) > 1 else "", *pair) for i, pair in enumerate(pairs, 1)],
        map=[core.JointMap(name(joint), [one] if isinstance(one, str) else list(one), angle) for joint, (one, angle) in (map or {}).items()],
        rate_hz=rate_hz, split=split, structure=structure, lead_s=lead_s, clock_offset_s=clock_offset_s, fit_all=fit_all,
        leave_out=core.LeaveOut[leave_out or "none"], input_unit=input_unit, output_unit=output_unit, ends=_ends(ends_deg),
        reference_error_deg={name(joint): error_deg for joint, error_deg in reference_error_deg.items()}, threads=threads,
        initial=(refit or initial) and (refit or initial)._core, refit=refit is not None)
    results, model, proven, covariances = run(core.identify, request, time_limit_s, progress=progress)
    return Identification(Compensator(model), Compensator(proven), results, covariances)


def _ends(ends_deg: Mapping[str, tuple[float, float]]) -> dict[str, Any]:
    return {core.joint_name(joint): core.Ends(*ends) for joint, ends in ends_deg.items()}


def align(sensor: Any, reference: Any, *, input: str = "", output: str = "", rate_hz: float = 20,
          clock_offset_s: Optional[float] = None, output_unit: str = "", progress: Show = None) -> tuple[dict[str, Any], Recording]:
    """The clock offset of two logs of one motion, from their signals alone: what ``flexor align --json`` prints, and both on the
    sensor's clock. ``input``, ``output``: their columns, where they have several. Raises ``InputError`` and ``JobError``."""
    files = core.SourceFiles(as_log(sensor, "sensor"), as_log(reference, "reference"), input, output, output_unit)
    results, parts = run(core.align, files, rate_hz, clock_offset_s, progress=progress)
    return results, Recording._of(parts)


def recalibrate(compensator: Compensator, *, recording: Any = None, poses: Sequence[str] = (), poses_recording: Any = None,
                pair: Optional[tuple[Any, Any]] = None, map: Optional[Mapping[str, str]] = None, inputs: Sequence[str] = (),
                progress: Show = None) -> tuple[Compensator, dict[str, Any]]:
    """The compensator of a glove that was put on again, and what ``flexor recalibrate --json`` prints.

    Evidence, all that there is: ``recording`` of ordinary motion; ``poses`` (``["open", "fist"]``) as they are held in
    ``poses_recording``; a ``pair`` of glove and camera, with ``map`` from joints to the camera's columns.
    The compensator is the same one where nothing was applied (``"applied"``). Raises ``InputError``.
    """
    if recording is None and poses_recording is None and pair is None:
        raise InputError("no evidence: recording, poses with poses_recording, or pair")
    sensor, reference = pair or (None, None)
    request = filled(
        core.RecalibrationFiles(), model=compensator._core, recording=as_log(recording), poses=list(poses), poses_log=as_log(poses_recording),
        pair_sensor=as_log(sensor), pair_camera=as_log(reference), inputs=list(inputs),
        map=",".join(f"{joint}={column}" for joint, column in (map or {}).items()))
    results, model = run(core.recalibrate, request, progress=progress)
    return (Compensator(model) if results["applied"] else compensator), results


def from_poses(recording: Any, *, rate_hz: float = 20, joints: Sequence[str] = (),
               ends_deg: Mapping[str, tuple[float, float]] = {}) -> tuple[Compensator, list[str]]:
    """A straight line for each sensor from held poses, for a glove without a camera: the open hand for three seconds, a fist, and
    both again. And which sensors were left out. ``joints``: of the columns in their order, if not by name."""
    model, warnings = core.from_poses(as_log(recording), rate_hz, _ends(ends_deg), list(joints))
    return Compensator(model), warnings


def _run(manifest: pathlib.Path, out: pathlib.Path, options: dict[str, Any], shard: str, threads: int, show: Any) -> Any:
    return core.cohort(manifest, out, filled(core.Request(), **options, threads=threads), shard, show)


def cohort(manifest: Union[str, os.PathLike], out: Union[str, os.PathLike], *, client: Any = None, rate_hz: float = 20,
           split: float = 0.5, structure: str = "auto", lead_s: float = 0, clock_offset_s: Optional[float] = None, fit_all: bool = False,
           leave_out: str = "", threads: int = 0, progress: Show = None) -> Any:
    """The tidy table as a frame: a row a subject, session and joint, as ``flexor identify --manifest`` writes it to ``out``
    beside each model, with the same bytes.

    ``manifest``: a CSV with the columns subject, session, glove, reference, map and covariates (docs/cohort.md). ``leave_out``:
    ``"person"``: each subject is also left out of a fit to all others. ``client``: a ``distributed.Client`` of Dask, whose workers
    see the same folders: each take is a shard of its own there, and a worker that dies costs the takes it was at. Otherwise
    ``threads`` of this process. A run that was cut off goes on; a take that failed is a row with its reason. Raises ``InputError``:
    a manifest or a folder that is wrong; ``JobError``: all takes failed. Ctrl-C stops it.
    """
    manifest, out = pathlib.Path(manifest).absolute(), pathlib.Path(out).absolute()
    if leave_out not in ("", "person"):
        raise InputError(f"leave_out is {leave_out!r}: \"person\", or nothing")
    options = dict(rate_hz=rate_hz, split=split, structure=structure, lead_s=lead_s, clock_offset_s=clock_offset_s, fit_all=fit_all,
                   leave_out=core.LeaveOut[leave_out or "none"])
    with shown(progress) as show:
        if client is not None and not (out / "cohort.csv").exists():
            _on_cluster(client, manifest, out, options, show)
        takes, failed = _run(manifest, out, options, "", threads, show)
    if takes == len(failed):
        raise JobError(f"all {takes} takes failed: {failed[0]}")
    return pandas().read_csv(out / "cohort.csv", dtype={"subject": str, "session": str}, keep_default_na=False, na_values=[""])


def _on_cluster(client: Any, manifest: pathlib.Path, out: pathlib.Path, options: dict[str, Any], show: Any) -> None:
    from distributed import as_completed

    count = min(1000, core.cohort_takes(manifest))
    shards = out.with_name(out.name + ".shards")  # stays where it is cut off: the same call goes on there
    futures = [client.submit(_run, manifest, shards / str(i), options, f"{i}/{count}", 1, None, pure=False, retries=3)
               for i in range(1, count + 1)]
    try:
        for done, future in enumerate(as_completed(futures), 1):
            future.result()
            if show:
                show(done, count, "takes")
    finally:
        client.cancel(futures)
    core.merge_cohort([shards / str(i) for i in range(1, count + 1)], out)
    shutil.rmtree(shards)
