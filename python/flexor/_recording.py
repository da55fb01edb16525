"""A log: named columns with units over one clock; how far the angles of one are from those of another, and whether that is good."""

import os
import warnings
from typing import Any, Callable, Mapping, Optional, Sequence, Union

import numpy as np

from flexor._core import InputError, core, pandas

LONGEST_UNSTATED_S = 0.99  # beyond, times without a unit may be milliseconds or rows: of files too (host/recording/stream.cpp)


class Recording:
    """Named columns over one clock, as views of the caller's arrays where these are contiguous float64.

    ``data``: a pandas frame with a time index, or a mapping of names to arrays.
    ``time``: seconds, one for each row, or the name of the column that has them; it may be dates or durations.
    ``time_unit``: s, ms, us or ns, of times that are plain numbers and whose name states none (``time_ms`` does).
    ``rate_hz``: of rows that are evenly spaced and have no time.
    ``units``: of columns whose name states none (``index_deg``, ``flex [count]``): count, V, mV, ohm, kohm, deg, rad, mm.
    A missing reading is NaN, or masked; what reads a column leaves such rows out. Columns of text are left out (``warnings``).
    Raises ``InputError``.

    >>> log = Recording({"index_adc": [500, 510, 530, 560]}, rate_hz=50, units={"index_adc": "count"})
    >>> log.t_s
    array([0.  , 0.02, 0.04, 0.06])
    >>> log
    Recording('recording', 4 rows, 0.06 s: index_adc [count])
    """

    def __init__(self, data: Any, *, time: Any = None, time_unit: Optional[str] = None, rate_hz: Optional[float] = None,
                 units: Union[None, str, Mapping[str, str]] = None, source: str = "recording") -> None:
        self.source = source
        self.warnings: list[str] = []
        columns, index = _columns_of(data, source)
        if isinstance(time, str):
            if time not in columns:
                raise InputError(f'{source}: no column "{time}"; there are: {", ".join(columns)}')
            self.t_s = _seconds(columns.pop(time), time, time_unit, source)
        elif time is not None:
            self.t_s = _seconds(as_array(time), "", time_unit, source)
        elif rate_hz is not None:
            if not 0 < rate_hz < np.inf:
                raise InputError("the rate must be positive and finite")
            if core.seconds_in(str(getattr(index, "name", ""))) or getattr(getattr(index, "dtype", None), "kind", "i") in "fmM":
                raise InputError(f"{source}: the index has times, and rate_hz says others: which? (reset_index(drop=True) drops it)")
            self.t_s = np.arange(len(next(iter(columns.values()), ()))) / rate_hz
        else:
            self.t_s = _index_seconds(index, list(columns), time_unit, source)
        self.columns: dict[str, np.ndarray] = {}
        for name, values in columns.items():
            numbers = _numbers(values, name, source)
            if numbers is None:
                self.warnings.append(f"{source}: without numbers, and left out: {name}")
                continue
            if numbers.shape != self.t_s.shape:
                raise InputError(f'{source}: column "{name}" has {numbers.size} values, the times are {self.t_s.size}')
            self.columns[name] = numbers
        if not self.columns:
            raise InputError(f"{source}: no column of numbers")
        self.units = {name: _unit(name, units, source) for name in self.columns}
        for name in units if isinstance(units, Mapping) else ():
            if name not in self.columns:
                raise InputError(f'{source}: a unit of "{name}", which is no column of numbers')
        bad = np.flatnonzero(~np.isfinite(self.t_s))
        if bad.size:
            raise InputError(f"{source}: row {bad[0] + 1} has no time")
        self._digest = ""

    @classmethod
    def _of(cls, parts: tuple) -> "Recording":
        out = cls.__new__(cls)
        out.source, out.t_s, out.columns, out.units, out.warnings, out._digest = parts
        return out

    @property
    def frame(self) -> Any:
        """The columns as a pandas frame over t_s: seconds, of dates those since 1970 (``pandas.to_datetime(t_s, unit="s")``)."""
        pd = pandas()
        return pd.DataFrame(self.columns, index=pd.Index(self.t_s, name="t_s"), copy=False)

    def shifted(self, seconds: float) -> "Recording":
        """The same with ``seconds`` added to its clock."""
        return Recording._of((self.source, self.t_s + seconds, self.columns, self.units, self.warnings, ""))

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.columns:
            raise KeyError(f'{self.source}: no column "{name}"; there are: {", ".join(self.columns)}')
        return self.columns[name]

    def __len__(self) -> int:
        return int(self.t_s.size)

    def __repr__(self) -> str:
        names = [f"{name} [{self.units[name]}]" if self.units[name] else name for name in self.columns]
        lasts_s = self.t_s[-1] - self.t_s[0] if len(self) else 0
        return f"Recording({self.source!r}, {len(self)} rows, {lasts_s:.6g} s: {', '.join(names)})"


def read(path: Union[str, os.PathLike], columns: Union[Sequence[str], Callable[[list[str]], list[str]]] = (), *, time_unit: str = "",
         time_column: Optional[str] = None, log_rate_hz: float = 0, repair: bool = True) -> Recording:
    """A log of text, as every command reads it: separators, decimal commas, units and clocks are found, and what was assumed
    or repaired is in ``warnings``. ``columns``: all of numbers, unless some are named or chosen of those by
    a function. ``repair``: its clock; else rows are as they stand, also where it goes back or starts again. Raises ``InputError``."""
    return Recording._of(core.read(path, columns, time_unit, [time_column] if time_column else [], log_rate_hz, repair))


def as_recording(log: Any, name: str = "recording") -> Recording:
    """A recording, a frame with a time index, which messages call `name`, or a file's path as a recording."""
    if isinstance(log, Recording):
        return log
    if isinstance(log, (str, os.PathLike)):
        return read(log)
    return Recording(log, source=name)


def as_log(given: Any, name: str = "recording") -> Any:
    """The same for a room, which reads a file itself; none of None."""
    if isinstance(given, (str, os.PathLike)):
        return core.Log(given)
    return core.Log() if given is None else core.Log(as_recording(given, name))


def angles_of(log: Recording) -> dict[str, str]:
    """The column of each joint, by its unit; a standard error is no angle. Raises InputError: two of one joint."""
    out: dict[str, str] = {}
    for name, unit in log.units.items():
        joint = core.without_unit(name)
        if unit in ("deg", "rad") and not joint.endswith("_se"):
            if joint in out:
                raise InputError(f"{log.source}: two columns are the joint {joint}: drop one")
            out[joint] = name
    return out


def score(measured: Any, estimated: Any, columns: Optional[Mapping[str, str]] = None) -> dict[str, dict[str, Any]]:
    """Figures of each joint, as ``flexor score --json`` prints them: rmse_deg, max_abs_deg, r2, best_lag_s, ...

    Both on one clock; else it warns. ``columns``: from the measured one's to the estimate's, where not called alike (NAME_deg).
    Raises ``InputError``: no common column, no second in common; ``JobError``: the angle never changes.

    >>> import numpy as np
    >>> angle = 40 + 30 * np.sin(np.arange(200) / 10)
    >>> truth = Recording({"index_deg": angle}, rate_hz=20)
    >>> round(score(truth, Recording({"index_deg": angle + 2}, rate_hz=20))["index"]["rmse_deg"], 6)
    2.0
    """
    reference, estimate = as_recording(measured, "measured"), as_recording(estimated, "estimated")
    if columns is None:
        joints = angles_of(estimate)
        columns = {name: joints[joint] for joint, name in angles_of(reference).items() if joint in joints}
    if not columns:
        raise InputError(f"no angle of one name: {reference.source} has {', '.join(reference.columns)}; "
                         f"{estimate.source} has {', '.join(estimate.columns)}")
    out = {}
    for one, other in columns.items():
        joint = core.without_unit(one)
        out[joint], found = core.score(as_log(reference), one, as_log(estimate), other)
        for text in found:
            warnings.warn(f"{joint}: {InputError(text)}", stacklevel=2)
    return out


def judge(error_deg: Sequence[float], baseline_error_deg: Mapping[str, Sequence[float]], period_s: float,
          part_ends: Sequence[int] = ()) -> dict[str, Any]:
    """Whether errors are smaller than those of the best baseline at the same samples: better, as good or worse, with the 95 %
    interval of the difference from blocks of 10 s, and in ``words``. ``part_ends``: of parts that are drawn whole.

    >>> import numpy as np
    >>> noise = np.random.default_rng(1).normal(size=4000)
    >>> judge(noise, {"line": 3 * noise}, period_s=0.05)["word"]
    'better'
    """
    if not isinstance(baseline_error_deg, Mapping):
        raise InputError("baseline_error_deg: a mapping of baselines' names to their errors")
    errors = {name: np.asarray(as_array(e), float) for name, e in {"": error_deg, **baseline_error_deg}.items()}
    for name, e in errors.items():
        if e.ndim != 1 or e.size < 2 or e.shape != errors[""].shape or not np.isfinite(e).all():
            raise InputError(f"errors{name and ' of ' + name}: two finite numbers or more, as many of each, are needed: leave out what either lacks")
    ends = np.asarray([0, *part_ends])
    if len(part_ends) and not ((np.diff(ends) > 0).all() and ends[-1] == len(error_deg)):
        raise InputError(f"part_ends: the number of errors up to each part's end, rising to all {len(error_deg)}")
    if not 0 < period_s < np.inf:
        raise InputError(f"period_s={period_s}: the time between samples, in seconds, is needed")
    return core.judge(errors.pop(""), errors, period_s, list(part_ends))


def as_array(values: Any) -> np.ndarray:
    """What a mask hides is missing."""
    return values.astype(float).filled(np.nan) if np.ma.isMaskedArray(values) else np.asarray(values)


def _columns_of(data: Any, source: str) -> tuple[dict[str, Any], Any]:
    """And the index that a frame has."""
    if hasattr(data, "columns") and hasattr(data, "index"):
        names = [str(name) for name in data.columns]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f'{source}: column "{name}" occurs twice: rename one of them')
        return {name: data.iloc[:, i] for i, name in enumerate(names)}, data.index
    if isinstance(data, Mapping):
        return {str(name): as_array(values) for name, values in data.items()}, None
    raise InputError(f"{source}: a frame with a time index or a mapping of names to arrays, not {type(data).__name__}")


def _index_seconds(index: Any, columns: list[str], time_unit: Optional[str], source: str) -> np.ndarray:
    counts = type(index).__name__ == "RangeIndex" and index.name is None  # nobody's: pandas numbers rows so
    if index is not None and not counts and type(index).__name__ != "MultiIndex":
        return _seconds(index, str(index.name or ""), time_unit, source)
    what = "nothing says the time" if index is None else "the frame has no time index"
    hint = next((c for c in columns if c.lower().startswith(("t_", "time", "timestamp", "millis"))), "t_s")
    raise InputError(f'{source}: {what}: Recording(..., time="{hint}") names a column of times, rate_hz=50 says that rows are even')


def _seconds(times: Any, name: str, time_unit: Optional[str], source: str) -> np.ndarray:
    """Dates are seconds since 1970, as in a file."""
    if getattr(getattr(times, "dtype", None), "tz", None) is not None:
        times = getattr(times, "dt", times).tz_convert(None)
    values = np.asarray(times)
    if values.dtype.kind in "mM":
        seconds = values.astype(values.dtype.str[:2] + "8[ns]").astype(np.int64) * 1e-9
        return np.where(np.isnat(values), np.nan, seconds)
    if values.dtype.kind not in "iuf":
        raise InputError(f"{source}: the times are {values.dtype}: numbers, dates or durations are needed (pandas.to_datetime)")
    stated = core.seconds_in(name if time_unit is None else f"t_{time_unit}")
    if time_unit is not None and stated is None:
        raise InputError(f'{source}: time_unit "{time_unit}": s, ms, us or ns')
    seconds = np.ascontiguousarray(values, dtype=np.float64)
    step = np.median(np.diff(seconds)) if seconds.size > 1 else 0.0
    if stated is None and (values.dtype.kind in "iu" or step > LONGEST_UNSTATED_S):
        raise InputError(f'{source}: times in steps of {step:g}, and nothing says of what: time_unit="ms"? or "s"?')
    return seconds if stated in (None, 1.0) else seconds * stated


def _numbers(values: Any, name: str, source: str) -> Optional[np.ndarray]:
    """None: text."""
    values = np.asarray(values)  # of pandas' own types objects, where values are missing
    if values.dtype.kind not in "biufO":
        return None
    if values.ndim != 1:
        raise InputError(f'{source}: column "{name}" has {values.ndim} dimensions, not one')
    if values.dtype.kind != "O":
        return np.ascontiguousarray(values, dtype=np.float64)
    texts = [(row, value) for row, value in enumerate(values, 1) if isinstance(value, str)]
    if texts and len(texts) == pandas().notna(values).sum():
        return None
    if texts:
        raise InputError(f'{source}: column "{name}" mixes numbers with text: row {texts[0][0]} is {texts[0][1]!r}; '
                         "pandas.to_numeric makes it numbers")
    return pandas().to_numeric(pandas().Series(values), errors="coerce").to_numpy(np.float64, na_value=np.nan)


def _unit(name: str, units: Union[None, str, Mapping[str, str]], source: str) -> str:
    own: str = core.unit_of(name)
    stated = units.get(name) if isinstance(units, Mapping) else units
    if not stated:
        return own
    known = core.known_unit(stated)
    if known is None:
        raise InputError(f'unknown unit "{stated}"; known: count, V, mV, ohm, kohm, deg, rad, mm')
    if own and own != known and isinstance(units, Mapping):
        raise InputError(f'{source}: column "{name}" is in {own} by its name, in {known} by units: which?')
    return own or known
