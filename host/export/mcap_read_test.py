"""MCAP of `flexor export` as ROS 2's own Python reader sees it. Run by ctest `python`."""
import io
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

pd = pytest.importorskip("pandas")

PROGRAM = Path(os.environ.get("FLEXOR_PROGRAM", "build/release/flexor"))
ROWS = 3000
LOST = slice(1000, 1010)


def recording(step_s: float = 0.01) -> pd.DataFrame:
    k = np.arange(ROWS)
    frame = pd.DataFrame({"index_mcp_deg": 30 + 20 * np.sin(k / 50), "index_mcp_quality": 0, "ring finger_deg": -5.123456789012345 + k / 7,
                          "ring finger_se_deg": 1.5, "Daumen_größe_rad": 0.3 * np.cos(k / 9), "flex_count": 512},
                         index=pd.Index(5 + step_s * k, name="t_s"))
    frame.iloc[LOST, 1] = 3
    return frame


def expected_deg() -> np.ndarray:
    k = np.arange(ROWS)
    out = np.column_stack([30 + 20 * np.sin(k / 50), -5.123456789012345 + k / 7, np.degrees(0.3 * np.cos(k / 9))])
    out[LOST, 0] = np.nan
    return out


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


def test_ros_reads_mcap_whole_and_of_a_killed_program(tmp_path):
    reader_of = pytest.importorskip("mcap.reader").make_reader
    ros2 = pytest.importorskip("mcap_ros2.decoder")
    from mcap.exceptions import EndOfFile
    from mcap.stream_reader import StreamReader
    from mcap_ros2._dynamic import serialize_dynamic

    if not PROGRAM.exists():
        pytest.skip("flexor is not built")
    recording().to_csv(tmp_path / "log.csv")
    subprocess.run([PROGRAM, "export", "log.csv", "--to", "mcap", "--out", "log.mcap", "--start", "2026-05-01T12:03:11.5Z"], cwd=tmp_path,
                   check=True, capture_output=True)
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
