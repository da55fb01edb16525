"""The simulated person, glove, radio and bionic hand."""

import collections
import dataclasses
import json
import os
from typing import Any, Mapping, Sequence, Union

from flexor._core import Show, core, filled, pandas, run
from flexor._model import Compensator
from flexor._recording import Recording

Donning = collections.namedtuple("Donning", ["glove", "camera", "hand"])


def _parameters(parameters: Mapping[str, Any], changes: Sequence[str]) -> Any:
    return core.parameters(json.dumps(parameters) if parameters else "", list(changes))


def twin_parameters(set: Sequence[str] = (), *, parameters: Mapping[str, Any] = {}) -> dict[str, Any]:
    """All numbers of the twin, as ``flexor twin --json`` prints them. ``set``: changes, ``["radio.loss=0.05"]``."""
    return json.loads(_parameters(parameters, set).to_json())


def twin(donnings: int = 1, *, rate_hz: float = 10, seed: int = 1001, set: Sequence[str] = (),
         parameters: Mapping[str, Any] = {}, progress: Show = None) -> list[Donning]:
    """What a user records: two minutes of the recommended motion for each donning: the glove's log, what a camera with a clock of
    its own sees of the fingers, and what it sees of the hand that follows them. Raises ``InputError``.

    >>> glove, camera, hand = twin(seed=3)[0]
    >>> glove.units["index_alpha_deg"], list(camera.columns)[1]
    ('deg', 'index_deg')
    """
    found = run(core.twin_record, _parameters(parameters, set), donnings, rate_hz, seed, progress=progress)
    # Each is called what it is, in place of a file's name.
    return [Donning(*(Recording._of((name, *parts[1:])) for name, parts in zip(Donning._fields, one))) for one in found]


@dataclasses.dataclass(frozen=True)
class Experiment:
    results: dict[str, Any]
    """What ``flexor experiment --json`` prints (docs/json.md)."""

    @property
    def cells(self) -> Any:
        """A frame with a row for each gesture and compensator."""
        return pandas().json_normalize(self.results["cells"])


def experiment(gestures: Union[str, Sequence[int]] = "1-6", compensators: Sequence[
        Union[str, os.PathLike, Compensator, tuple[str, Compensator]]] = ("raw", "published-w", "published-hw"), *, trials: int = 3,
               seed: int = 1, rate_hz: float = 10, set: Sequence[str] = (), parameters: Mapping[str, Any] = {}, threads: int = 0,
               folder: Union[str, os.PathLike] = "", shard: str = "", progress: Show = None) -> Experiment:
    """The published experiment in the twin: gestures x compensators x trials. ``compensators``: names, files, or models, with a
    name each or called by their own. ``folder``: rows go there, and a run that was cut off goes on. ``shard``: ``"2/8"``, only
    that part, for ``merge``. Ctrl-C stops it. Raises ``InputError``.

    >>> experiment([1], trials=1).cells["compensator"].tolist()
    ['raw', 'published-w', 'published-hw']
    """
    named: list[Any] = []
    for one in compensators:
        if isinstance(one, Compensator):
            one = (one.document.get("name") or "identified", one)
        named.append(core.NamedModel(one[0], one[1]._core) if isinstance(one, tuple) else core.named_model(os.fspath(one), rate_hz))
    plan = filled(core.Plan(), parameters=_parameters(parameters, set), compensators=named, trials=trials, seed=seed, threads=threads,
                  folder=folder)
    played = gestures if isinstance(gestures, str) else ",".join(map(str, gestures))
    return Experiment(run(core.experiment, plan, played, rate_hz, shard, progress=progress))


def merge(folders: Sequence[Union[str, os.PathLike]], out: Union[str, os.PathLike], *, progress: Show = None) -> Experiment:
    """The folders of an experiment's shards, in any order, to the results of the whole run. Raises ``InputError``: one is missing or another run's.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as d:
    ...     parts = [experiment("1,4", folder=f"{d}/{i}", shard=f"{i}/2") and f"{d}/{i}" for i in (1, 2)]
    ...     merge(parts, f"{d}/whole").results == experiment("1,4").results
    True
    """
    return Experiment(run(core.merge, list(folders), out, progress=progress))
