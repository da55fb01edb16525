"""Exports as their users' own readers see them: mcap, mcap-ros2-support, opensim, the BIDS validator.

Arguments: which of mcap, mot, bids; the program flexor. Ends with 77 where the reader is not installed.
"""
import json
import math
import os
import subprocess
import sys
import tempfile

what, flexor = sys.argv[1:3]
ROWS = 3000
NAMES = ["index_mcp", "ring finger", "Daumen_größe"]
START_NS = 1777636991500000000


def angles(k):
    """Degrees of row k, as the recording below has them; the last column is in radians there."""
    return [30 + 20 * math.sin(k / 50), -5.123456789012345 + k / 7, math.degrees(round(0.3 * math.cos(k / 9), 6))]


def is_lost(k):
    return 1000 <= k < 1010


def write_recording(path, step_s=0.01):
    with open(path, "w", encoding="utf-8") as log:
        log.write("t_s,index_mcp_deg,index_mcp_quality,ring finger_deg,ring finger_se_deg,Daumen_größe_rad\n")
        for k in range(ROWS):
            a = angles(k)
            quality = 3 if is_lost(k) else 0
            log.write(f"{5 + step_s * k:.6f},{a[0]!r},{quality},{a[1]!r},1.5,{round(0.3 * math.cos(k / 9), 6)}\n")


def expect(condition, text):
    if not condition:
        sys.exit(f"{what}: {text}")


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


def mot(folder):
    import opensim

    write_recording(f"{folder}/log.csv")
    export(f"{folder}/log.csv", "--to", "mot", "--out", f"{folder}/log.mot", "--names", "index_mcp=finger_flexion")
    opensim.Logger.setLevelString("error")
    table = opensim.TimeSeriesTable(f"{folder}/log.mot")
    known = [k for k in range(ROWS) if not is_lost(k)]
    expect(table.getNumRows() == len(known), "rows")
    expect(list(table.getColumnLabels()) == ["finger_flexion", "ring_finger", NAMES[2]], str(table.getColumnLabels()))
    expect(table.getTableMetaDataString("inDegrees") == "yes", "inDegrees")
    storage = opensim.Storage(f"{folder}/log.mot")
    expect(storage.isInDegrees() and storage.getSize() == len(known), "as a Storage")
    times = table.getIndependentColumn()
    for place, k in enumerate(known):
        expect(abs(times[place] - (5 + 0.01 * k)) < 1e-9, f"row {k}: time {times[place]}")
        row = table.getRowAtIndex(place)
        expect_angles(k, [row[i] for i in range(3)])


def bids(folder):
    validator = os.path.join(os.path.dirname(sys.executable), "bids-validator-deno")
    if not os.path.exists(validator):
        raise ImportError("no bids-validator-deno")
    write_recording(f"{folder}/log.csv")
    write_recording(f"{folder}/uneven.csv", 0.0153)
    dataset = f"{folder}/set"
    export(f"{folder}/log.csv", "--to", "bids", "--out", dataset)
    export(f"{folder}/uneven.csv", f"{folder}/log.csv", "--to", "bids", "--out", dataset, "--subject", "02", "--task", "fist",
           "--rate", "50")
    done = subprocess.run([validator, "--json", dataset], capture_output=True, text=True,
                          env={**os.environ, "NO_COLOR": "1", "DENO_DIR": f"{folder}/deno"})
    issues = json.loads(done.stdout)["issues"]["issues"]
    errors = [i for i in issues if i.get("severity") == "error"]
    expect(not errors and done.returncode == 0, f"errors: {errors} {done.stderr[-500:]}")
    kinds = {i["code"] for i in issues}
    expect(kinds <= {"JSON_KEY_RECOMMENDED", "SIDECAR_KEY_RECOMMENDED", "NO_AUTHORS", "TOO_FEW_AUTHORS",
                     "EVENTS_TSV_MISSING"}, f"warnings: {kinds}")
    # The validator that is asked does look.
    os.remove(f"{dataset}/sub-01/motion/sub-01_task-motion_tracksys-glove_motion.json")
    broken = subprocess.run([validator, "--json", dataset], capture_output=True, text=True,
                            env={**os.environ, "NO_COLOR": "1", "DENO_DIR": f"{folder}/deno"})
    expect(broken.returncode != 0, "a dataset without motion.json is taken")
    stem = f"{dataset}/sub-01/motion/sub-01_task-motion_tracksys-glove"
    with open(f"{stem}_channels.tsv", encoding="utf-8") as file:
        types = [line.split("\t")[2] for line in file][1:]
    expect(types == ["JNTANG"] * len(NAMES) + ["LATENCY"], f"channels {types}")
    with open(f"{stem}_motion.tsv", encoding="utf-8") as file:
        rows = [[math.nan if c == "n/a" else float(c) for c in line.rstrip("\n").split("\t")] for line in file]
    expect(len(rows) == ROWS, f"{len(rows)} rows")
    for k, row in enumerate(rows):
        expect_angles(k, row[:-1])
        expect(abs(row[-1] - 0.01 * k) < 1e-6, f"row {k}: {row[-1]} s")


with tempfile.TemporaryDirectory() as place:
    try:
        {"mcap": mcap, "mot": mot, "bids": bids}[what](place)
    except ImportError as missing:
        print(f"skipped: {missing} (script/bootstrap tests)")
        sys.exit(77)
print(f"{what}: read back as written")
