"""Exports as their users' own readers see them: OpenSim, the BIDS validator, SciPy, ROS 2, an LSL inlet. A reader that is missing skips."""
import io
import json
import os
import struct
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

pd = pytest.importorskip("pandas")

import flexor
from flexor import export
from flexor.posture_learning import codebook

ROWS = 3000  # several chunks of MCAP
LOST = slice(1000, 1010)
STEM = "sub-{0}/motion/sub-{0}_task-motion_tracksys-glove{1}"


def recording() -> pd.DataFrame:
    k = np.arange(ROWS)
    frame = pd.DataFrame({"index_mcp_deg": 30 + 20 * np.sin(k / 50), "index_mcp_quality": 0, "ring finger_deg": -5.123456789012345 + k / 7,
                          "ring finger_se_deg": 1.5, "Daumen_größe_rad": 0.3 * np.cos(k / 9), "flex_count": 512},
                         index=pd.Index(5 + 0.01 * k, name="t_s"))
    frame.iloc[LOST, 1] = 3
    return frame


def expected_deg() -> np.ndarray:
    k = np.arange(ROWS)
    out = np.column_stack([30 + 20 * np.sin(k / 50), -5.123456789012345 + k / 7, np.degrees(0.3 * np.cos(k / 9))])
    out[LOST, 0] = np.nan
    return out


def small(text: str) -> pd.DataFrame:
    header, *rows = text.split()
    values = [[float(cell) for cell in row.split(",")] for row in rows]
    return pd.DataFrame(values, columns=header.split(",")).set_index("t_s")


EVEN = small("t_s,index_deg,index_quality 0,1.5,0 .01,2,3 .02,3,0 .03,4,0")


def test_joints_are_the_columns_with_an_angles_unit():
    angles = export.joints_of(recording())
    assert list(angles) == ["index_mcp", "ring finger", "Daumen_größe"]
    np.testing.assert_allclose(angles, expected_deg(), atol=1e-12)
    log = flexor.Recording({"index [deg]": np.arange(90), "ring": np.arange(90) / 90}, rate_hz=50, units={"ring": "rad"})
    assert list(export.joints_of(log)) == ["index", "ring"] == list(flexor.score(log, log))


def test_an_angle_that_is_held_is_not_known():
    angles = export.joints_of(small("t_s,a_deg,a_status,b_deg 0,1,0,4 .1,2,2,5 .2,3,4,6"))
    np.testing.assert_array_equal(angles, [[1, 4], [np.nan, 5], [np.nan, 6]])


def test_times_rise_strictly():
    angles = export.joints_of(small("t_s,a_deg 0,1 .1,2 .1,3 .05,4 .2,5"))
    assert list(angles["a"]) == [1, 2, 5]
    with pytest.raises(ValueError, match="starts again"):
        export.joints_of(small("t_s,a_deg 0,1 5,2 0,3 5,4"))
    dated = small("t_s,a_deg 0,1 1,2").set_index(pd.to_datetime(["2026-05-01 12:00:00", "2026-05-01 12:00:01"]))
    assert list(export.joints_of(dated).index) == [0, 1]


def test_angles_become_flexion_by_the_ends_of_their_joints(tmp_path):
    ends = {"index": (170, 80), "thumb": (-10, 45)}
    t = np.arange(0, 14, 0.05)
    closed = np.interp(t, [3, 3.5, 6.5, 7, 10, 10.5], [0, 1, 1, 0, 0, 1])
    poses = flexor.Recording({f"{joint}_adc": 300 + 400 * closed for joint in ends}, time=t, units="count")
    flexor.from_poses(poses, ends_deg=ends)[0].save(tmp_path / "m.json")
    angles = export.joints_of(small("t_s,index_deg,thumb_deg 0,170,0 1,90,30"), tmp_path / "m.json")
    assert angles.to_numpy().tolist() == [[0, 10], [80, 40]]
    with pytest.raises(ValueError, match="no ends of a joint ring"):
        export.joints_of(small("t_s,ring_deg 0,1"), tmp_path / "m.json")


@pytest.mark.parametrize(("frame", "what"), [
    (small("t_s,flex 0,1"), "NAME_deg or NAME_rad; there are flex"),
    (small("t_s,a_deg,a_rad 0,1,1"), "two columns are the joint a"),
    (small("t_s,a_deg 0,inf"), "infinite"),
])
def test_what_is_no_angle_is_refused(frame, what):
    with pytest.raises(ValueError, match=what):
        export.joints_of(frame)


def test_opensim_reads_a_motion(tmp_path):
    opensim = pytest.importorskip("opensim")
    assert export.mot(tmp_path / "log.mot", recording()) == ROWS - 10
    opensim.Logger.setLevelString("error")
    table = opensim.TimeSeriesTable(str(tmp_path / "log.mot"))
    assert list(table.getColumnLabels()) == ["index_mcp", "ring_finger", "Daumen_größe"]
    storage = opensim.Storage(str(tmp_path / "log.mot"))
    assert storage.isInDegrees() and storage.getSize() == ROWS - 10
    known = ~np.isnan(expected_deg()[:, 0])
    np.testing.assert_allclose(table.getIndependentColumn(), (5 + 0.01 * np.arange(ROWS))[known], atol=1e-9)
    np.testing.assert_allclose(table.getMatrix().to_numpy(), expected_deg()[known], atol=1e-9)


def test_a_motion_that_cannot_be_leaves_what_was_there(tmp_path):
    (tmp_path / "a.mot").write_text("old")
    for text, what in (("t_s,time_deg 0,1", "cannot have the columns"), ("t_s,a_deg,a_quality 0,1,3", "no row with all")):
        with pytest.raises(ValueError, match=what):
            export.mot(tmp_path / "a.mot", small(text))
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("a.mot", "old")]


def test_matlab_reads_a_mat(tmp_path):
    scipy_io = pytest.importorskip("scipy.io")
    export.mat(tmp_path / "a.mat", recording())
    back = scipy_io.loadmat(tmp_path / "a.mat")
    np.testing.assert_array_equal(back["t_s"][:, 0], recording().index)
    np.testing.assert_allclose(back["angle_deg"], expected_deg(), atol=1e-12)
    assert [cell[0] for cell in back["joints"][0]] == ["index_mcp", "ring finger", "Daumen_größe"]


def test_a_bids_dataset_grows_and_nothing_in_it_changes(tmp_path):
    export.bids(tmp_path, EVEN)
    assert (tmp_path / STEM.format("01", "_motion.tsv")).read_text() == "1.5\t0.000000\nn/a\t0.010000\n3.0\t0.020000\n4.0\t0.030000\n"
    (tmp_path / "participants.tsv").write_text("participant_id\tage\nsub-01\t30\n")
    export.bids(tmp_path, EVEN, subject="02", number=3)
    assert (tmp_path / "participants.tsv").read_text() == "participant_id\tage\nsub-01\t30\nsub-02\tn/a\n"
    assert (tmp_path / STEM.format("02", "_run-3_motion.tsv")).exists()
    before = sorted(tmp_path.rglob("*"))
    uneven = small("t_s,index_deg 0,1 .01,2 .04,3 .05,4 .06,5")
    for frame, options, what in ((EVEN, {}, "is there already"), (EVEN, {"subject": "02", "number": 3}, "is there already"),
                                 (uneven, {"subject": "03"}, "steps of 0.01 to 0.03 s"), (EVEN, {"task": "../x"}, "letters and digits"),
                                 (small("t_s,latency_deg 0,1 1,2"), {"subject": "03"}, "called latency")):
        with pytest.raises(ValueError, match=what):
            export.bids(tmp_path, frame, **options)
    assert sorted(tmp_path.rglob("*")) == before
    (tmp_path / "dataset_description.json").unlink()
    with pytest.raises(ValueError, match="no BIDS dataset"):
        export.bids(tmp_path, EVEN, subject="03")


def test_the_validator_takes_a_dataset(tmp_path):
    validator = os.path.join(os.path.dirname(sys.executable), "bids-validator-deno")
    if not os.path.exists(validator):
        pytest.skip("no bids-validator-deno (script/bootstrap --dev)")
    folder = tmp_path / "set"
    export.bids(folder, recording())
    export.bids(folder, recording(), subject="02", task="fist", number=2)

    def validate() -> subprocess.CompletedProcess:
        return subprocess.run([validator, "--json", str(folder)], capture_output=True, text=True, timeout=100, check=False,
                              env={**os.environ, "NO_COLOR": "1", "DENO_DIR": str(tmp_path / "deno")})

    done = validate()
    issues = json.loads(done.stdout)["issues"]["issues"]
    assert done.returncode == 0 and not [issue for issue in issues if issue.get("severity") == "error"], done.stderr[-500:]
    assert {issue["code"] for issue in issues} <= {"JSON_KEY_RECOMMENDED", "SIDECAR_KEY_RECOMMENDED", "NO_AUTHORS", "TOO_FEW_AUTHORS",
                                                   "EVENTS_TSV_MISSING"}
    rows = pd.read_csv(folder / STEM.format("01", "_motion.tsv"), sep="\t", header=None).to_numpy()
    np.testing.assert_allclose(rows[:, :3], expected_deg(), atol=1e-9)
    np.testing.assert_allclose(rows[:, 3], 0.01 * np.arange(ROWS), atol=1e-6)
    (folder / STEM.format("01", "_motion.json")).unlink()
    assert validate().returncode != 0, "the validator looks"


def require_indices(file, summary) -> None:
    """Each chunk's index of messages lies where the summary says, and names times and places of its messages."""
    from mcap.data_stream import ReadDataStream
    from mcap.records import Chunk, Message, MessageIndex

    def record(source, kind):
        stream = ReadDataStream(source)
        stream.read1()  # the opcode
        length = stream.read8()
        return kind.read(stream, length) if kind is Message else kind.read(stream)

    count = 0
    for at in summary.chunk_indexes:
        file.seek(at.chunk_start_offset)
        chunk = record(file, Chunk)
        (place,) = at.message_index_offsets.values()
        assert file.tell() == place == at.chunk_start_offset + at.chunk_length
        index = record(file, MessageIndex)
        assert file.tell() == place + at.message_index_length
        times = [t for t, _ in index.records]
        assert (min(times), max(times)) == (chunk.message_start_time, chunk.message_end_time)
        assert times == [record(io.BytesIO(chunk.data[offset:]), Message).log_time for _, offset in index.records]
        count += len(times)
    assert count == ROWS


def test_ros_reads_mcap_whole_and_of_a_killed_program(program, tmp_path):
    reader_of = pytest.importorskip("mcap.reader").make_reader
    ros2 = pytest.importorskip("mcap_ros2.decoder")
    from mcap.exceptions import EndOfFile
    from mcap.stream_reader import StreamReader
    from mcap_ros2._dynamic import serialize_dynamic

    recording().to_csv(tmp_path / "log.csv")
    program("export", tmp_path / "log.csv", "--to", "mcap", "--out", tmp_path / "log.mcap", "--start", "2026-05-01T12:03:11.5Z")
    start_ns, step_ns = 1777636991500000000, 10_000_000
    with open(tmp_path / "log.mcap", "rb") as file:
        reader = reader_of(file, validate_crcs=True, decoder_factories=[ros2.DecoderFactory()])
        summary = reader.get_summary()
        statistics, (schema,) = summary.statistics, summary.schemas.values()
        assert reader.get_header().profile == "ros2"
        assert (statistics.message_count, statistics.message_start_time, statistics.chunk_count) == (ROWS, start_ns, len(summary.chunk_indexes))
        encode = serialize_dynamic(schema.name, schema.data.decode())[schema.name]
        angles = []
        for k, (_, channel, message, state) in enumerate(reader.iter_decoded_messages(topics=["/flexor/joint_states"])):
            stamp_ns = state.header.stamp.sec * 10**9 + state.header.stamp.nanosec
            assert (channel.message_encoding, message.sequence, message.log_time, stamp_ns) == ("cdr", k, start_ns + k * step_ns, message.log_time)
            assert (state.header.frame_id, list(state.name), len(state.velocity), len(state.effort)) == (
                "", ["index_mcp", "ring finger", "Daumen_größe"], 0, 0)
            assert np.isnan(state.position[0]) or encode(state) == message.data, f"row {k}: other bytes than the ROS 2 writer's"
            angles.append(np.degrees(state.position))
        np.testing.assert_allclose(angles, expected_deg(), atol=1e-9)
        require_indices(file, summary)
        some = reader.iter_messages(starting_at=start_ns + 1000 * step_ns, ending_before=start_ns + 1005 * step_ns)
        assert [message.sequence for _, _, message in some] == list(range(1000, 1005))
    last = summary.chunk_indexes[-1]
    with open(tmp_path / "log.mcap", "rb+") as file:
        file.truncate(last.chunk_start_offset + last.chunk_length + last.message_index_length)
        sequences = []
        with pytest.raises(EndOfFile):
            for record in StreamReader(file, validate_crcs=True).records:
                if type(record).__name__ == "Message":
                    sequences.append(record.sequence)
        assert sequences == list(range(ROWS))


def test_samples_of_the_live_socket_are_read():
    state = json.dumps({"fingers": [{"name": "index"}, {"name": "middle"}]})
    samples = struct.pack("<BBH", 1, 2, 2) + struct.pack("<d4f", 0, 500, 501, 1, 2) + struct.pack("<d4f", 1, 500, 501, 3, 4)
    other = struct.pack("<BBH", 2, 1, 0)
    found = list(export.live_samples([samples, state, other, samples]))
    assert found == [(["index", "middle"], [1, 2]), (["index", "middle"], [3, 4])]


def test_an_inlet_receives_what_is_played():
    pylsl = pytest.importorskip("pylsl")
    received = []

    def receive():
        info, = pylsl.resolve_byprop("name", "flexor test", timeout=20)
        inlet = pylsl.StreamInlet(info)
        received.append(inlet.info().get_channel_labels())
        while len(received) < 4:
            received.append(inlet.pull_sample(timeout=20)[0])

    reader = threading.Thread(target=receive)
    reader.start()
    frame = pd.DataFrame({"a_deg": np.arange(60.0), "b_rad": 0.0}, index=pd.Index(0.05 * np.arange(60), name="t_s"))
    assert export.lsl(frame, stream="flexor test") == 60
    reader.join()
    assert received[0] == ["a", "b"]
    first = received[1][0]
    assert received[1:] == [[first, 0], [first + 1, 0], [first + 2, 0]]


@pytest.mark.parametrize(("module", "package", "work"), [("pylsl", "pylsl", lambda: export.lsl(EVEN)),
                                                         ("scipy.io", "scipy", lambda: export.mat("a.mat", EVEN)),
                                                         ("sklearn.cluster", "scikit-learn", lambda: codebook(np.eye(23), 1, 2, 1))])
def test_an_extra_that_is_missing_is_named(monkeypatch, module, package, work):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ImportError, match=f"^this needs {module}: pip install {package}$"):
        work()


def test_the_command_says_what_is_wrong_in_one_line(tmp_path):
    (tmp_path / "a.csv").write_text("t_s,index_deg,index_status\n0,1,0\n0.1,2,0\n0.2,3,0\n")
    (tmp_path / "no.csv").write_text("note,index_deg\na,1\nb,2\n")

    def command(*arguments: str) -> tuple[int, str]:
        done = subprocess.run([sys.executable, "-m", "flexor.export", *arguments], cwd=tmp_path, capture_output=True, text=True, check=False,
                              env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)})
        return done.returncode, done.stdout + done.stderr

    assert command("a.csv", "--to", "mot", "--out", "a.mot") == (0, "a.mot: 3 of 3 rows\n")
    assert command("a.csv", "--to", "mot") == (2, "flexor.export: --out is needed\n")
    status, text = command("no.csv", "--to", "mat", "--out", "a.mat")
    assert status == 2 and text.startswith("flexor.export: no.csv: no time column") and text.count("\n") == 1
