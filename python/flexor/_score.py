"""How far estimated angles are from measured ones, and whether that is good."""

from typing import Any, Mapping, Optional, Sequence

import numpy as np

from flexor._core import InputError, core
from flexor._recording import as_log, as_recording


def score(measured: Any, estimated: Any, columns: Optional[Mapping[str, str]] = None) -> dict[str, dict[str, Any]]:
    """Figures of each joint, as ``flexor score --json`` prints them: rmse_deg, max_abs_deg, r2, best_lag_s, ...

    Both on one clock. ``columns``: from the measured one's to the estimate's, where they are not called alike (NAME_deg).
    Raises ``InputError``: no common column, no second in common; ``JobError``: the angle never changes.

    >>> import numpy as np
    >>> from flexor import Recording
    >>> angle = 40 + 30 * np.sin(np.arange(200) / 10)
    >>> truth = Recording({"index_deg": angle}, rate_hz=20)
    >>> round(score(truth, Recording({"index_deg": angle + 2}, rate_hz=20))["index"]["rmse_deg"], 6)
    2.0
    """
    reference, estimate = as_recording(measured, "measured"), as_recording(estimated, "estimated")
    if columns is None:
        columns = {name: name for name in reference.columns
                   if name in estimate.columns and name.endswith("_deg") and not name.endswith("_se_deg")}
    if not columns:
        raise InputError(f"no angle of one name: {reference.source} has {', '.join(reference.columns)}; "
                         f"{estimate.source} has {', '.join(estimate.columns)}")
    return {one.removesuffix("_deg"): core.score(as_log(reference), one, as_log(estimate), other) for one, other in columns.items()}


def judge(error_deg: Sequence[float], baseline_error_deg: Mapping[str, Sequence[float]], period_s: float,
          part_ends: Sequence[int] = ()) -> dict[str, Any]:
    """Whether errors are smaller than those of the best baseline at the same samples: better, as_good or worse, with the 95 %
    interval of the difference by a bootstrap over blocks, and in ``words``. ``part_ends``: of parts that are drawn whole.

    >>> import numpy as np
    >>> noise = np.random.default_rng(1).normal(size=4000)
    >>> judge(noise, {"line": 3 * noise}, period_s=0.05)["word"]
    'better'
    """
    if not isinstance(baseline_error_deg, Mapping):
        raise InputError("baseline_error_deg: a mapping of baselines' names to their errors")
    errors = {"": np.asarray(error_deg, float)} | {name: np.asarray(e, float) for name, e in baseline_error_deg.items()}
    for name, e in errors.items():
        if e.ndim != 1 or e.size < 2 or e.shape != errors[""].shape or not np.isfinite(e).all():
            raise InputError(f"errors{name and ' of ' + name}: two finite numbers or more, as many of each, are needed: leave out what either lacks")
    ends = np.asarray([0, *part_ends])
    if len(part_ends) and not ((np.diff(ends) > 0).all() and ends[-1] == len(error_deg)):
        raise InputError(f"part_ends: the number of errors up to each part's end, rising to all {len(error_deg)}")
    if not 0 < period_s < np.inf:
        raise InputError(f"period_s={period_s}: the time between samples, in seconds, is needed")
    return core.judge(errors.pop(""), errors, period_s, list(part_ends))
