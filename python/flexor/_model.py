"""Compensators."""

import functools
import json
import os
import pathlib
from typing import Any, Sequence, Union

import numpy as np

from flexor._core import InputError, Show, core, pandas, run, write_text
from flexor._recording import Recording, as_array, as_log


class Compensator:
    """A model document, and the compensator that it describes: readings in, angles in degrees out."""

    def __init__(self, text: str, *, source: str = "model", arithmetic: str = "double") -> None:
        """``text``: the document. ``arithmetic``: double, float, or fixed, as in the glove. Raises ``InputError``."""
        self._arithmetic = arithmetic
        self._core = core.model(text, source)
        self.text: str = self._core.to_json()
        self.reset()

    @classmethod
    def load(cls, path: Union[str, os.PathLike], *, arithmetic: str = "double") -> "Compensator":
        """Raises ``InputError``: no model document, with the place; ``OSError``."""
        return cls(pathlib.Path(path).read_text("utf-8"), source=os.fspath(path), arithmetic=arithmetic)

    def save(self, path: Union[str, os.PathLike]) -> None:
        """The bytes that ``flexor identify --model`` writes. Raises ``InputError``, ``JobError``: `path` is as it was."""
        write_text(path, self.text)

    @property
    def document(self) -> dict[str, Any]:
        """docs/model.schema.json says what is in it."""
        return json.loads(self.text)

    @property
    def inputs(self) -> list[str]:
        """The columns that it reads."""
        return [one.get("column") or one["name"] for one in self.document["inputs"]]

    @property
    def joints(self) -> list[str]:
        return [joint["name"] for joint in self.document["joints"]]

    @property
    def sample_period_s(self) -> float:
        return self.document["sample_period_s"]

    @property
    def blocks(self) -> Any:
        """What it is made of: a frame with a row for each block and its parameters as columns."""
        return pandas().json_normalize(self.document["blocks"])

    @property
    def accuracy(self) -> Any:
        """Of each joint the root mean square error on data that the fit did not see, over the angle: a frame."""
        rows = [(joint["name"], *pair) for joint in self.document["joints"] if "accuracy" in joint
                for pair in zip(joint["accuracy"]["angle_deg"], joint["accuracy"]["standard_error_deg"])]
        return pandas().DataFrame(rows, columns=["joint", "angle_deg", "standard_error_deg"])

    def predict(self, recording: Any, *, inputs: Sequence[str] = (), intervals: bool = False,
                track: bool = False, progress: Show = None) -> Recording:
        """The angles of a log, as ``flexor apply`` gives them: JOINT_deg and JOINT_status on the model's grid.

        Status: 0 ok, 1 below and 2 above the valid range, 3 not a number, 4 a pause of the log; with anything but 0 the last
        good angle is held. ``inputs``: the columns of its inputs, if not those of the model. ``intervals``: also JOINT_se_deg,
        the root mean square error of such an angle on data that the fit did not see. ``track``: follows each sensor while the
        glove is worn. Raises ``InputError``: no such column, another unit, no reading; ``JobError``: readings that the model
        hardly knows, as where ``flexor apply`` ends with 3.
        """
        return Recording._of(run(core.predict, self._core, self._arithmetic, as_log(recording), list(inputs), intervals, track,
                                 progress=progress))

    def step(self, rows: Any) -> tuple[np.ndarray, np.ndarray]:
        """Readings as they come: ``rows`` of one reading of each input (n x inputs), a sample period apart. Angles in degrees and
        status (see ``predict``), n x joints. What was stepped before is remembered, until ``reset``."""
        readings = as_array(rows[self.inputs] if hasattr(rows, "iloc") else rows)
        if readings.dtype.kind in "cSU":
            raise InputError(f"rows of {readings.dtype}: readings are numbers")
        return self._steps.step(np.atleast_2d(np.ascontiguousarray(readings, dtype=np.float64)))

    def reset(self) -> None:
        self._steps = core.Steps(self._core, self._arithmetic)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Compensator) and self.text == other.text

    def __hash__(self) -> int:
        return hash(self.text)

    def __reduce__(self) -> tuple:
        return functools.partial(Compensator, arithmetic=self._arithmetic), (self.text,)

    def __repr__(self) -> str:
        return f"Compensator({', '.join(self.inputs)} -> {', '.join(self.joints)}, every {self.sample_period_s:g} s)"
