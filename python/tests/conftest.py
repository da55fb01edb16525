"""A glove of the twin's, recorded once, as objects and as files; and the command beside the module."""

import os
import pathlib
import signal
import subprocess

import pytest

import flexor

@pytest.fixture(scope="session")
def donning():
    return flexor.twin(seed=7, progress=False)[0]


@pytest.fixture(scope="session")
def found(donning):
    return flexor.identify([(donning.glove, donning.camera)], rate_hz=10, structure="line", progress=False)


@pytest.fixture(scope="session")
def program():
    path = pathlib.Path(os.environ.get("FLEXOR_PROGRAM") or pathlib.Path(flexor.__file__).with_name("bin") / "flexor")
    if not path.exists():
        pytest.skip("the command is not built")

    def run(*arguments):
        done = subprocess.run([path, *map(str, arguments)], capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="session")
def files(tmp_path_factory, program):
    folder = tmp_path_factory.mktemp("glove") / "logs"
    program("twin", "record", "--out", folder, "--seed", 7)
    return folder


@pytest.fixture
def dying_cluster(tmp_path):
    """A client of two workers of Dask, and a progress function whose first two calls kill one each."""
    distributed = pytest.importorskip("distributed", reason="distributed is not installed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, local_directory=str(tmp_path)) as cluster, \
            distributed.Client(cluster) as client:
        victims = list(client.run(os.getpid).values())

        def progress(done, of, what):
            if victims:
                os.kill(victims.pop(), signal.SIGKILL)

        yield client, progress
        assert not victims
