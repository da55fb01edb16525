"""Many takes of many people to one tidy table."""

from __future__ import annotations

import os
import pathlib
import shutil
from typing import Any, Union

from flexor._core import InputError, JobError, Show, core, filled, pandas, shown


def _run(manifest: pathlib.Path, out: pathlib.Path, options: dict[str, Any], shard: str, threads: int, show: Any) -> Any:
    asked = dict(options, leave_out=core.LeaveOut.person if options["leave_out"] else core.LeaveOut.none, threads=threads)
    return core.cohort(manifest, out, filled(core.Request(), **asked), shard, show)


def cohort(manifest: Union[str, os.PathLike], out: Union[str, os.PathLike], *, client: Any = None, rate_hz: float = 20,
           split: float = 0.5, structure: str = "auto", lead_s: float = 0, fit_all: bool = False, leave_out: str = "",
           threads: int = 0, progress: Show = None) -> Any:
    """The tidy table as a frame: a row a subject, session and joint, as ``flexor identify --manifest`` writes it to ``out``
    beside each model, with the same bytes.

    ``manifest``: a CSV with the columns subject, session, glove, reference, map and covariates (docs/cohort.md). ``leave_out``:
    ``"person"``: each subject is also left out of a fit to all others. ``client``: a ``distributed.Client`` of Dask, whose workers
    see the same folders: each take is a shard of its own there, and a worker that dies costs the takes it was at. Otherwise
    ``threads`` of this process. A run that was cut off goes on; a take that failed is a row with its reason. Raises ``InputError``:
    a manifest or a folder that is wrong; ``JobError``: all takes failed. Ctrl-C stops it.
    """
    manifest, out = pathlib.Path(manifest).absolute(), pathlib.Path(out).absolute()
    options = dict(rate_hz=rate_hz, split=split, structure=structure, lead_s=lead_s, fit_all=fit_all, leave_out=leave_out)
    if leave_out not in ("", "person"):
        raise InputError(f"leave_out is {leave_out!r}: \"person\", or nothing")
    with shown(progress) as show:
        if client is not None and not (out / "cohort.csv").exists():
            _on_cluster(client, manifest, out, options, show)
        takes, failed = _run(manifest, out, options, "", threads, show)
    if takes == len(failed):
        raise JobError(f"all {takes} takes failed: {failed[0]}")
    return pandas().read_csv(out / "cohort.csv", dtype={"subject": str, "session": str})


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
