"""What the sensed joints say of all 23."""

from typing import Any, Optional, Sequence

from flexor._core import Show, core, run
from flexor._model import Compensator
from flexor._recording import Recording, as_log


def complete(recording: Any, sensed: Sequence[str], *, bends: Sequence[str] = (), rest_s: float = 0,
             flexion_is_positive: bool = False, model: Optional[Compensator] = None, document: str = "",
             progress: Show = None) -> Recording:
    """All 23 joints with standard errors, NAME_deg and NAME_se_deg, and INPUT_quality of each input, row by row, as
    ``flexor posture complete`` gives them.

    ``sensed``: columns NAME_deg of a joint, or of a bend. ``bends``: sensors over several joints,
    ``["index=index_mcp+index_pip"]``. ``rest_s``: so long the person is shown, at rest first. Flexion of fingers is negative,
    unless ``flexion_is_positive``, or ``model``, whose angles these are. ``document``: of ``flexor posture learn``, if not the
    shipped one. Raises ``InputError``.
    """
    return Recording._of(run(core.complete, as_log(recording), document, list(sensed), list(bends), rest_s, flexion_is_positive,
                             model and model._core, progress=progress))
