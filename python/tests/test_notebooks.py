"""The notebooks of examples/ run as they stand; about two minutes together on two idle cores."""

import os
import pathlib

import pytest

nbclient = pytest.importorskip("nbclient")
nbformat = pytest.importorskip("nbformat")
ROOT = pathlib.Path(__file__).parents[2]


@pytest.mark.long
@pytest.mark.parametrize("path", sorted((ROOT / "examples/notebooks").glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_runs(path, tmp_path, monkeypatch):
    for needed in ("distributed", "emcee", "matplotlib", "pandas", "sklearn", "statsmodels"):
        pytest.importorskip(needed)
    monkeypatch.setenv("FLEXOR_DATA", os.environ.get("FLEXOR_DATA") or str(ROOT / "../shared/data"))
    notebook = nbformat.read(path, 4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "stored without what it prints"
    nbclient.NotebookClient(notebook, timeout=None, resources={"metadata": {"path": str(tmp_path)}}).execute()
