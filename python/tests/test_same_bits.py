"""The module and the command are one program: the same bytes and numbers."""

import json

import numpy as np
import pytest

import flexor


def test_each_argument_is_the_commands_option(program, files, donning, tmp_path):
    pair = files / "glove-1.csv", files / "camera-1.csv"
    offset_s = flexor.align(*pair, input="index_alpha_deg", output="index_deg")[0]["clock_offset_s"]
    options = ("--rate", 10, "--structure", "line", "--split", 0.6, "--lead", 0.1, f"--clock-offset={offset_s!r}", "--fit-all", "--leave-out", "block",
               "--reference-error", "index=2", "--pose-angles", "index=5:95")
    command = json.loads(program("identify", "--pair", *pair, *options, "--model", tmp_path / "m.json", "--json"))
    given = dict(rate_hz=10, structure="line", split=0.6, lead_s=0.1, clock_offset_s=offset_s, fit_all=True, leave_out="block",
                 reference_error_deg={"index": 2}, ends_deg={"index": (5, 95)}, progress=False)
    found = flexor.identify([pair], **given)
    assert found.compensator.text == (tmp_path / "m.json").read_text() != found.proven.text
    del command["fit_seconds"], found.results["fit_seconds"]
    assert found.results == command
    for name in set(given) - {"progress"}:  # each tells
        less = flexor.identify([pair], **{key: value for key, value in given.items() if key != name})
        assert (less.results, less.compensator) != (found.results, found.compensator), name
    one = flexor.Recording({**donning.glove.columns, "index_deg": donning.glove["index_alpha_deg"]}, time=donning.glove.t_s)
    assert flexor.identify([(one, one)], {"index": ("index_alpha_deg", "index_deg")}, structure="line").clock_offset_s == 0


def test_frames_give_the_models_of_files(files):
    pandas = pytest.importorskip("pandas")
    found = flexor.identify([(files / "glove-1.csv", files / "camera-1.csv")], rate_hz=10, structure="line", progress=False)
    frames = [pandas.read_csv(files / name, index_col="t_s") for name in ("glove-1.csv", "camera-1.csv")]
    of_frames = flexor.identify([tuple(frames)], rate_hz=10, structure="line", progress=False)
    assert of_frames.compensator.document["blocks"] == found.compensator.document["blocks"]


def test_angles_are_the_commands(program, files, found, tmp_path):
    found.compensator.save(tmp_path / "m.json")
    for arithmetic in ("double", "fixed"):
        command = json.loads(program("apply", tmp_path / "m.json", files / "glove-1.csv", "--json", "--arithmetic", arithmetic, "--intervals"))
        compensator = flexor.Compensator.load(tmp_path / "m.json", arithmetic=arithmetic)
        angles = compensator.predict(files / "glove-1.csv", intervals=True, progress=False)
        assert angles.t_s.tolist() == command["t_s"]
        for joint in found.compensator.joints:
            assert angles[f"{joint}_deg"].tolist() == command["channels"][joint]["angle_deg"]
            assert angles[f"{joint}_status"].tolist() == command["channels"][joint]["status"]
            assert angles[f"{joint}_se_deg"].tolist() == command["channels"][joint]["se_deg"]


def test_steps_are_the_prediction(donning, found):
    angles = found.compensator.predict(donning.glove, progress=False)
    readings = np.column_stack([donning.glove[name] for name in found.compensator.inputs])
    found.compensator.reset()
    stepped = np.vstack([found.compensator.step(rows)[0] for rows in np.array_split(readings, 13)])
    expected = np.column_stack([angles[f"{joint}_deg"] for joint in found.compensator.joints])
    assert np.array_equal(stepped, expected[: len(stepped)])


def test_scores_and_clocks_are_the_commands(program, files, found, tmp_path):
    glove, camera = files / "glove-1.csv", files / "camera-1.csv"
    angles = found.compensator.predict(glove, progress=False)
    angles.frame.filter(like="_deg").to_csv(tmp_path / "angles.csv")
    offset_s = found.clock_offset_s
    command = json.loads(program("score", camera, tmp_path / "angles.csv", "--estimate-offset", repr(offset_s), "--json"))
    figures = flexor.score(camera, flexor.read(tmp_path / "angles.csv").shifted(offset_s))
    assert figures == command["joints"]
    with pytest.warns(UserWarning, match=r"index: by their motion Recording.shifted [\d.+-]+ puts the two on one clock"):
        flexor.score(camera, flexor.read(tmp_path / "angles.csv"))
    command = json.loads(program("align", "--sensor", glove, "--reference", camera, "--input", "index_alpha_deg", "--output",
                                 "index_deg", "--json"))
    assert flexor.align(glove, camera, input="index_alpha_deg", output="index_deg")[0] == command


def test_an_experiment_is_the_commands(program):
    command = json.loads(program("experiment", "--gestures", "1", "--trials", 2, "--seed", 3, "--set", "radio.loss=0.2", "--json"))
    results = flexor.experiment("1", trials=2, seed=3, set=["radio.loss=0.2"], progress=False).results
    assert {key: command[key] for key in results} == results


def test_a_glove_that_was_put_on_again(program, files, found, tmp_path):
    found.compensator.save(tmp_path / "m.json")
    command = json.loads(program("recalibrate", tmp_path / "m.json", "--pair", files / "glove-1.csv", files / "camera-1.csv",
                                 "--out", tmp_path / "n.json", "--json"))
    compensator, results = flexor.recalibrate(found.compensator, pair=(files / "glove-1.csv", files / "camera-1.csv"))
    assert results == command
    assert compensator.text == (tmp_path / "n.json").read_text()


def test_all_joints_are_the_commands(program, files, tmp_path):
    program("posture", "complete", "models/posture.json", files / "camera-1.csv", "--flexion", "positive", "--from", "index_deg",
            "--bends", "index=index_mcp+index_pip", "--out", tmp_path / "hand.csv")
    command = flexor.read(tmp_path / "hand.csv")
    hand = flexor.posture.complete(files / "camera-1.csv", ["index_deg"], bends=["index=index_mcp+index_pip"],
                                   flexion_is_positive=True)
    assert np.array_equal(hand["index_pip_deg"], command["index_pip_deg"])
    assert list(hand.columns) == list(command.columns)
