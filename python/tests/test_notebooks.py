"""The notebooks of examples/ run as they stand; about two minutes together on two idle cores."""

import os
import pathlib

import pytest

ROOT = pathlib.Path(__file__).parents[2]


@pytest.mark.long
@pytest.mark.parametrize("path", sorted((ROOT / "examples/notebooks").glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_runs(path, tmp_path, monkeypatch):
    import nbclient  # where a package is missing, this fails: nothing else runs them
    import nbformat

    monkeypatch.setenv("FLEXOR_DATA", os.environ.get("FLEXOR_DATA") or str(ROOT / "../shared/data"))
    notebook = nbformat.read(path, 4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "stored without what it prints"
    nbclient.NotebookClient(notebook, timeout=None, resources={"metadata": {"path": str(tmp_path)}}).execute()
