"""The wheel as a user meets it: its size, the first fit in a new environment, the page's demonstration. Minutes to build."""

import json
import pathlib
import subprocess
import sys
import urllib.request

import pytest

ROOT = pathlib.Path(__file__).parents[2]
FIRST_FIT = """
import flexor
glove, camera, _ = flexor.twin(seed=3)[0]
print(flexor.identify([(glove.frame, camera.frame)], rate_hz=10, structure="line"))
"""


@pytest.fixture(scope="module")
def wheel():
    subprocess.run([ROOT / "script/wheel", sys.executable], check=True, stdout=subprocess.DEVNULL)
    return next((ROOT / "out/wheel").glob("flexor-*manylinux_2_17_x86_64.whl"))


@pytest.mark.long
def test_a_new_environment_has_a_fit_and_the_demonstration_answers(wheel, tmp_path):
    assert wheel.stat().st_size <= 12e6
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "venv"], check=True)
    subprocess.run([tmp_path / "venv/bin/pip", "install", "-q", "--disable-pip-version-check", f"{wheel}[pandas]"], check=True)
    done = subprocess.run([tmp_path / "venv/bin/python", "-c", FIRST_FIT], cwd=tmp_path, capture_output=True, text=True)
    assert "deg held out" in done.stdout, done.stderr
    live = subprocess.Popen([tmp_path / "venv/bin/flexor", "live", "--demo", "--json", "--sessions", tmp_path / "sessions"],
                            stdout=subprocess.PIPE, text=True)
    try:
        address = json.loads(live.stdout.readline())["url"]
        assert b"<html" in urllib.request.urlopen(address, timeout=3).read()
    finally:
        live.terminate()
        live.wait()
