"""Figures with matplotlib, in the colours of Flexor's reports."""

from typing import Any, Optional

import numpy as np

from flexor._core import needed
from flexor._identify import Identification
from flexor._twin import Experiment

#: Okabe and Ito's, which stay apart for colour-blind readers; each compensator the same everywhere.
COLOURS = {"raw": "#E69F00", "published-w": "#56B4E9", "published-hw": "#D55E00", "line": "#009E73", "line-lead": "#CC79A7",
           "identified": "#332288", "measured": "#000000"}


def _axes(ax: Any) -> Any:
    if ax is None:
        ax = needed("matplotlib.pyplot").subplots(figsize=(8, 4), layout="constrained")[1]
    ax.grid(alpha=0.3)
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def held_out(found: Identification, joint: Optional[str] = None, ax: Any = None) -> Any:
    """The held-out part of a joint: measured, estimated, and the straight line."""
    joint = joint or found.compensator.joints[0]
    ax = _axes(ax)
    curve = found.results["joints"][joint]["held_out_curve"]
    for key, name in (("measured_deg", "measured"), ("straight_line_deg", "line"), ("estimated_deg", "identified")):
        ax.plot(curve["t_s"], [float("nan") if y is None else y for y in curve[key]], color=COLOURS[name], label=name, linewidth=1)
    rmse_deg = found.results["joints"][joint]["holdout"]["rmse_deg"]
    ax.set(xlabel="time (s)", ylabel=f"{joint} (deg)", title=f"{joint}: {rmse_deg:.2f} deg on data it never saw")
    ax.legend(frameon=False)
    return ax


def experiment(found: Experiment, ax: Any = None) -> Any:
    """Total error of each gesture and compensator, with 95 % intervals and the published figures."""
    ax = _axes(ax)
    groups = dict(list(found.cells.groupby("compensator", sort=False)))
    motions = found.cells.gesture.astype(str).unique()
    for i, (name, cells) in enumerate(groups.items()):
        at = np.arange(len(motions)) + (i - (len(groups) - 1) / 2) * 0.8 / len(groups)
        error = cells["total_error_deg_s.mean"], cells["total_error_deg_s.ci95"].astype(float).fillna(0)
        ax.bar(at, error[0], 0.8 / len(groups), yerr=error[1], color=COLOURS.get(name, "#777777"), label=name)
        if cells.published_deg_s.notna().any():
            ax.plot(at, cells.published_deg_s.astype(float), "k_", label=None if i else "published")
    ax.set(ylabel="total error (deg s)", xticks=range(len(motions)), xticklabels=motions)
    ax.legend(frameon=False)
    return ax
