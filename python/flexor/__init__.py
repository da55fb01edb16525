"""Flexor: turn a flex-sensor glove into a measuring instrument.

Logs of a glove and of what measured its joints become a compensator that is proven on data it never saw:

>>> import flexor
>>> glove, camera, _ = flexor.twin(seed=3)[0]           # two minutes of a simulated glove; or flexor.read("glove.csv")
>>> found = flexor.identify([(glove, camera)], rate_hz=10, structure="line")
>>> found.compensator.joints
['thumb', 'index', 'middle', 'ring', 'pinky']
>>> angles = found.compensator.predict(glove)           # angles["index_deg"], on the compensator's grid
>>> flexor.score(camera, angles.shifted(found.clock_offset_s))["index"]["rmse_deg"] < 15
True

Everything is what the command ``flexor`` does, by the same functions. Only NumPy is needed; results as frames need pandas, bars
of progress tqdm, ``flexor.sklearn`` scikit-learn, ``flexor.plot`` matplotlib.
"""

from flexor._core import InputError, JobError, __version__
from flexor import posture
from flexor._identify import Identification, align, cohort, from_poses, identify, recalibrate
from flexor._model import Compensator
from flexor._recording import Recording, judge, read, score
from flexor._twin import Experiment, experiment, merge, twin, twin_parameters

__all__ = [
    "Compensator", "Experiment", "Identification", "InputError", "JobError", "Recording", "__version__", "align", "cohort",
    "experiment", "from_poses", "identify", "judge", "merge", "posture", "read", "recalibrate", "score", "twin", "twin_parameters",
]
