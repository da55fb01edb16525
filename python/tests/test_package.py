"""Results as frames, the regressor, figures, the command of the package."""

import subprocess
import sys

import numpy as np
import pytest

import flexor


def test_parameters_have_errors_and_intervals(found):
    pytest.importorskip("pandas")
    table = found.parameters.loc["index"].dropna()
    assert len(table) > 0 and (table["standard_error"] > 0).all()
    assert np.allclose(table["high95"] - table["value"], 1.959964 * table["standard_error"])
    covariance = found.covariance("index")
    assert np.allclose(np.sqrt(np.diag(covariance))[: len(table)], found.parameters.loc["index"]["standard_error"][: len(table)])


def test_a_model_is_its_document(found, tmp_path):
    (tmp_path / "m.json").write_text("the one before")
    with open(tmp_path / "m.json") as before:
        found.compensator.save(tmp_path / "m.json")
        assert before.read() == "the one before", "replaced in one step: a disk that is full takes no model away"
    again = flexor.Compensator.load(tmp_path / "m.json")
    assert again == found.compensator and again.inputs[1] == "index_alpha_deg"
    assert set(again.accuracy["joint"]) == set(again.joints)
    assert "lti" in set(again.blocks["type"])


def test_angles_state_their_error(found, donning):
    angles = found.compensator.predict(donning.glove, intervals=True, progress=False)
    assert (angles["index_se_deg"] > 0).all()
    assert list(angles.frame.columns[:3]) == ["thumb_deg", "thumb_status", "thumb_se_deg"]


def test_a_glove_without_a_camera():
    t = np.arange(0, 14, 0.05)
    closed = np.clip(np.interp(t, [3, 3.5, 6.5, 7, 10, 10.5], [0, 1, 1, 0, 0, 1]), 0, 1)
    log = flexor.Recording({"index_adc": 300 + 400 * closed, "thumb_adc": 200 + 300 * closed}, time=t, units="count")
    compensator, _ = flexor.from_poses(log)
    assert sorted(compensator.joints) == ["index", "thumb"]


def test_the_twin_changes_with_its_parameters():
    assert flexor.twin_parameters(["radio.loss=0.05"]) != flexor.twin_parameters()
    with pytest.raises(flexor.InputError):
        flexor.twin(set=["radio.los=0.05"])


def test_figures(found, tmp_path):
    pytest.importorskip("matplotlib").use("Agg")
    from flexor import plot

    for axes in (plot.held_out(found, "index"), plot.experiment(flexor.experiment("1", trials=2))):
        axes.figure.savefig(tmp_path / "figure.png")


def test_every_public_name_says_what_it_is():
    for name in flexor.__all__:
        if name[0] != "_":
            assert getattr(flexor, name).__doc__, name


def test_the_command_of_the_package(program):
    done = subprocess.run([sys.executable, "-m", "flexor", "--version"], capture_output=True, text=True)
    assert done.stdout == program("--version")


def test_only_numpy_is_needed():
    code = "import sys; sys.modules['pandas'] = sys.modules['tqdm'] = None; import flexor; flexor.twin(); print(len(flexor.twin()))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "1\n", done.stderr
