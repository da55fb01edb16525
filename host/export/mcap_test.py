"""MCAP as its users' own readers see it: mcap, mcap-ros2-support.

Argument: the program flexor. Ends with 77 where the reader is not installed.
"""
import math
import subprocess
import sys
import tempfile

flexor = sys.argv[1]
ROWS = 3000
NAMES = ["index_mcp", "ring finger", "Daumen_größe"]
START_NS = 1777636991500000000


def angles(k):
    """Degrees of row k, as the recording below has them; the last column is in radians there."""
    return [30 + 20 * math.sin(k / 50), -5.123456789012345 + k / 7, math.degrees(round(0.3 * math.cos(k / 9), 6))]


def is_lost(k):
    return 1000 <= k < 1010


def write_recording(path):
    with open(path, "w", encoding="utf-8") as log:
        log.write("t_s,index_mcp_deg,index_mcp_quality,ring finger_deg,ring finger_se_deg,Daumen_größe_rad\n")
        for k in range(ROWS):
            a = angles(k)
            quality = 3 if is_lost(k) else 0
            log.write(f"{5 + 0.01 * k:.6f},{a[0]!r},{quality},{a[1]!r},1.5,{round(0.3 * math.cos(k / 9), 6)}\n")


def expect(condition, text):
    if not condition:
        sys.exit(f"mcap: {text}")


def expect_angles(k, seen, unit=1.0, tolerance=1e-9):
    for i, (wanted, found) in enumerate(zip(angles(k), seen, strict=True)):
        if i == 0 and is_lost(k):
            expect(math.isnan(found), f"row {k}: {found} is lost")
        else:
            expect(abs(found * unit - wanted) <= tolerance, f"row {k}, {NAMES[i]}: {found * unit} instead of {wanted}")


def export(*arguments):
    subprocess.run([flexor, "export", *arguments], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def expect_indices(file, summary):
    """Each chunk's index of messages lies where the summary says, and names times and places of its messages."""
    from mcap.data_stream import ReadDataStream
    from mcap.opcode import Opcode
    from mcap.records import Chunk, Message, MessageIndex
    import io

    def record(stream, opcode, kind, *arguments):
        expect(stream.read1() == opcode, f"no {kind.__name__} where the index says")
        length = stream.read8()
        return kind.read(stream, length) if kind is Message else kind.read(stream)

    count = 0
    for chunk_index in summary.chunk_indexes:
        file.seek(chunk_index.chunk_start_offset)
        chunk = record(ReadDataStream(file), Opcode.CHUNK, Chunk)
        (place,) = chunk_index.message_index_offsets.values()
        expect(file.tell() == place == chunk_index.chunk_start_offset + chunk_index.chunk_length, "end of a chunk")
        index = record(ReadDataStream(file), Opcode.MESSAGE_INDEX, MessageIndex)
        expect(file.tell() == place + chunk_index.message_index_length, "end of an index")
        times = [t for t, _ in index.records]
        expect((min(times), max(times)) == (chunk.message_start_time, chunk.message_end_time), "times of a chunk")
        for t, offset in index.records:
            message = record(ReadDataStream(io.BytesIO(chunk.data[offset:])), Opcode.MESSAGE, Message)
            expect(message.log_time == t, f"message {count}: time in the index")
            count += 1
    expect(count == ROWS, f"{count} messages in the indices")


def mcap(folder):
    from mcap.reader import make_reader
    from mcap.stream_reader import StreamReader
    from mcap.exceptions import EndOfFile
    from mcap_ros2._dynamic import serialize_dynamic
    from mcap_ros2.decoder import DecoderFactory

    write_recording(f"{folder}/log.csv")
    export(f"{folder}/log.csv", "--to", "mcap", "--out", f"{folder}/log.mcap", "--start", "2026-05-01T12:03:11.5Z")
    with open(f"{folder}/log.mcap", "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        expect(reader.get_header().profile == "ros2", "profile")
        expect(summary.statistics.message_count == ROWS, "messages in the statistics")
        expect(summary.statistics.message_start_time == START_NS, "start in the statistics")
        expect(len(summary.chunk_indexes) == summary.statistics.chunk_count > 0, "chunks in the index")
        schema = next(iter(summary.schemas.values()))
        encode = serialize_dynamic(schema.name, schema.data.decode())[schema.name]
        k = 0
        for _, channel, message, state in reader.iter_decoded_messages(topics=["/flexor/joint_states"]):
            expect(channel.message_encoding == "cdr" and message.sequence == k, f"message {k}")
            expect(message.log_time == START_NS + 10_000_000 * k, f"row {k}: time {message.log_time}")
            expect(state.header.stamp.sec * 10**9 + state.header.stamp.nanosec == message.log_time, f"row {k}: stamp")
            expect(state.header.frame_id == "" and list(state.name) == NAMES, f"row {k}: names {state.name}")
            expect(len(state.velocity) == len(state.effort) == 0, f"row {k}: velocity or effort")
            expect_angles(k, state.position, 180 / math.pi)
            expect(is_lost(k) or encode(state) == message.data, f"row {k}: other bytes than the ROS 2 writer's")
            k += 1
        expect(k == ROWS, f"{k} rows")
        expect_indices(file, summary)
        # Found by its time, through the index.
        some = list(reader.iter_messages(starting_at=START_NS + 10**10, ending_before=START_NS + 10**10 + 50_000_000))
        expect([m.sequence for _, _, m in some] == list(range(1000, 1005)), "rows between two times")
        file.seek(0)
        in_order = sum(type(r).__name__ == "Message" for r in StreamReader(file, validate_crcs=True).records)
        expect(in_order == ROWS, "rows one after the other")

    # What is there of a file that grew until its program was killed: whole chunks without an end.
    last = summary.chunk_indexes[-1]
    with open(f"{folder}/log.mcap", "rb+") as file:
        file.truncate(last.chunk_start_offset + last.chunk_length + last.message_index_length)
        sequences = []
        try:
            for record in StreamReader(file, validate_crcs=True).records:
                if type(record).__name__ == "Message":
                    sequences.append(record.sequence)
            sys.exit("mcap: a file without an end has one")
        except EndOfFile:
            expect(sequences == list(range(ROWS)), "samples of a killed program")


with tempfile.TemporaryDirectory() as place:
    try:
        mcap(place)
    except ImportError as missing:
        print(f"skipped: {missing} (script/bootstrap tests)")
        sys.exit(77)
print("mcap: read back as written")
