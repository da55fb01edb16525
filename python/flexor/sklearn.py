"""A compensator as a regressor of scikit-learn's: rows are samples in the order in which they were taken, ``1 / rate_hz`` apart."""

import warnings
from typing import Any, Optional

import numpy as np
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from flexor._core import JobError, core, filled
from flexor._model import Compensator
from flexor._recording import Recording, as_log


class FlexorRegressor(MultiOutputMixin, RegressorMixin, BaseEstimator):
    """Readings of one sensor or several to an angle, or several.

    ``structure``: as ``flexor.identify`` takes it. Where the rows are too few for it, or tell nothing of the angle, a straight line
    by least squares is fitted in its place, and ``refusal_`` says why; ``compensator_`` is none then.
    Raises ValueError: a structure that does not parse, a rate that is not positive.
    The past counts: ``predict`` starts again at each call, and rows have an order.

    >>> import numpy as np
    >>> t = np.arange(1200) / 20
    >>> angle = 45 + 40 * np.sin(t + np.sin(0.7 * t))
    >>> model = FlexorRegressor(structure="line").fit(3 * angle[:, None] + 200, angle)
    >>> model.score(3 * angle[:, None] + 200, angle) > 0.99
    True
    """

    def __init__(self, structure: str = "auto", rate_hz: float = 20) -> None:
        self.structure = structure
        self.rate_hz = rate_hz

    def fit(self, X: Any, y: Any) -> "FlexorRegressor":
        X, y = validate_data(self, X, y, multi_output=True, y_numeric=True, dtype=np.float64, ensure_min_samples=2)
        if not 0 < self.rate_hz < np.inf:
            raise ValueError(f"rate_hz={self.rate_hz!r}: rows a second, more than 0")
        core.check_structure(self.structure)
        angles = y.reshape(len(y), -1).astype(np.float64)
        self._shape = y.shape[1:]
        self.refusal_: Optional[str] = None
        self.compensator_: Optional[Compensator] = None
        sensors = {f"x{i}": X[:, i] for i in range(X.shape[1])}
        columns = {f"y{j}_deg": angles[:, j] for j in range(angles.shape[1])}
        try:
            log = Recording({**sensors, **columns}, rate_hz=self.rate_hz)
            joints = [core.JointMap(f"y{j}", list(sensors), name) for j, name in enumerate(columns)]
            request = filled(core.Request(), map=joints, rate_hz=self.rate_hz, structure=self.structure)
            self.compensator_ = Compensator(core.fit(request, as_log(log)))
        except (JobError, ValueError) as error:
            self.refusal_ = str(error)
            warnings.warn(f"a straight line is fitted in place of structure={self.structure!r}: {error}")
            self.line_ = np.linalg.lstsq(np.column_stack([X, np.ones(len(X))]), angles, rcond=None)[0]
        return self

    def predict(self, X: Any) -> np.ndarray:
        check_is_fitted(self)
        X = validate_data(self, X, dtype=np.float64, reset=False)
        if self.compensator_ is None:
            angles = np.column_stack([X, np.ones(len(X))]) @ self.line_
        else:
            steps = core.Steps(self.compensator_._core, "double")  # own: others may predict at the same time
            angles, status = steps.step(np.ascontiguousarray(X[:, [int(name[1:]) for name in self.compensator_.inputs]]))
            if 2 * np.count_nonzero(status) >= status.size:
                warnings.warn(f"{np.count_nonzero(status)} of {status.size} angles are held: readings lie outside of the range of those "
                              "that were fitted")
        return angles.reshape(len(X), *self._shape)

