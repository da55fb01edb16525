"""A cohort: the command's bytes, whoever runs it, also where a part of it is killed."""

import os
import signal
import subprocess
import time

import numpy as np
import pytest

pd = pytest.importorskip("pandas")

import flexor

PROGRAM = os.environ.get("FLEXOR_PROGRAM", "flexor")


@pytest.fixture(scope="module")
def manifest(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cohort")
    rows = []
    for k in range(8):
        random = np.random.default_rng(k)
        t_s = np.arange(2400) * 0.05
        angle = 45 + 30 * np.sin(t_s * (1 + 0.02 * k)) + 10 * np.sin(2.3 * t_s + k)
        counts = np.round(300 + 4 * angle + random.normal(size=t_s.size))
        pd.DataFrame({"t_s": t_s, "host_s": t_s, "index_adc": counts}).to_csv(folder / f"{k}_glove.csv", index=False)
        pd.DataFrame({"t_s": t_s, "host_s": t_s, "index_deg": angle}).to_csv(folder / f"{k}_camera.csv", index=False)
        rows.append((f"P{k // 2}", f"0{k % 2}", f"{k}_glove.csv", f"{k}_camera.csv", "", 30 + k))
    rows[7] = ("NA", *rows[7][1:])  # initials
    rows.append(("P9", "01", "none.csv", "0_camera.csv", "", 40))
    path = folder / "m.csv"
    pd.DataFrame(rows, columns=["subject", "session", "glove", "reference", "map", "age"]).to_csv(path, index=False)
    return path


def command(manifest, out, *more):
    return [PROGRAM, "identify", "--manifest", str(manifest), "--out", str(out), "--structure", "curve", *more]


def files(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.fixture(scope="module")
def whole(manifest):
    out = manifest.parent / "whole"
    done = subprocess.run(command(manifest, out), capture_output=True, text=True)
    assert done.returncode == 0 and "8 of 9 takes identified" in done.stderr and "none.csv" in done.stderr
    return files(out)


def test_the_module_gives_the_commands_bytes(manifest, whole, tmp_path):
    table = flexor.cohort(manifest, tmp_path / "out", structure="curve", progress=False)
    assert files(tmp_path / "out") == whole
    assert table.subject[7] == "NA" and table.session.tolist() == ["00", "01"] * 4 + ["01"] and table.rmse_deg[:8].max() < 2 and table.age[3] == 33


def test_a_clock_offset_is_that_of_every_take(manifest, tmp_path):
    right, wrong = (flexor.cohort(manifest, tmp_path / str(offset_s), structure="curve", clock_offset_s=offset_s, progress=False).rmse_deg[:8]
                    for offset_s in (0.0, 0.2))
    assert (wrong > 2 * right).all()


def test_all_that_fail_are_an_error(manifest, tmp_path):
    bad = manifest.parent / "bad.csv"
    bad.write_text("subject,session,glove,reference,map\nP,1,no.csv,no.csv,\n")
    with pytest.raises(flexor.JobError, match="row 2"):
        flexor.cohort(bad, tmp_path / "out", progress=False)
    done = subprocess.run(command(bad, tmp_path / "again"), capture_output=True, text=True)
    assert done.returncode == 1 and (tmp_path / "again" / "cohort.csv").read_text().count("\n") == 2


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_interrupted_it_goes_on(manifest, whole, tmp_path, how):
    out = tmp_path / "out"
    run = subprocess.Popen(command(manifest, out, "--threads", "1"), stderr=subprocess.PIPE, text=True)
    while run.poll() is None and not (out / "rows" / "2.json").exists():
        time.sleep(0.002)
    run.send_signal(how)
    error = run.communicate()[1]
    assert run.returncode in ((-how,) if how == signal.SIGKILL else (75, 0)), error
    assert subprocess.run(command(manifest, out), capture_output=True).returncode == 0
    kept = files(out)
    kept.pop("lock", None)  # of who was killed
    assert kept == whole


def test_dask_loses_two_workers(manifest, whole, tmp_path, dying_cluster):
    client, progress = dying_cluster
    flexor.cohort(manifest, tmp_path / "out", client=client, structure="curve", progress=progress)
    assert files(tmp_path / "out") == whole
