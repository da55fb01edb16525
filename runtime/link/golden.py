"""Writes golden.txt: frames of PROTOCOL.md by an implementation that shares no line with the C++ one.

python3 runtime/link/golden.py > runtime/link/golden.txt
"""
import random
import struct

MASK = (1 << 64) - 1


def rotate(x, by):
    return ((x << by) | (x >> (64 - by))) & MASK


def siphash(key, message):
    k0, k1 = struct.unpack("<QQ", key)
    v = [k0 ^ 0x736F6D6570736575, k1 ^ 0x646F72616E646F6D, k0 ^ 0x6C7967656E657261, k1 ^ 0x7465646279746573]

    def sip_round():
        v[0] = (v[0] + v[1]) & MASK
        v[1] = rotate(v[1], 13) ^ v[0]
        v[0] = rotate(v[0], 32)
        v[2] = (v[2] + v[3]) & MASK
        v[3] = rotate(v[3], 16) ^ v[2]
        v[0] = (v[0] + v[3]) & MASK
        v[3] = rotate(v[3], 21) ^ v[0]
        v[2] = (v[2] + v[1]) & MASK
        v[1] = rotate(v[1], 17) ^ v[2]
        v[2] = rotate(v[2], 32)

    padded = message + bytes(-(len(message) + 1) % 8) + bytes([len(message) & 255])
    for (word,) in struct.iter_unpack("<Q", padded):
        v[3] ^= word
        sip_round()
        sip_round()
        v[0] ^= word
    v[2] ^= 0xFF
    for _ in range(4):
        sip_round()
    return struct.pack("<Q", v[0] ^ v[1] ^ v[2] ^ v[3])


def crc16(data, crc=0x464C):
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = ((crc << 1) ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return struct.pack(">H", crc)


def cobs(data):
    return b"".join(bytes([len(run) + 1]) + run for run in data.split(b"\0")) + b"\0"


def session(pair, nonce):
    return siphash(pair, b"S" + nonce + b"\0") + siphash(pair, b"S" + nonce + b"\1")


def bits(fields):
    """(value, width) one after the other, least significant bit first."""
    number = at = 0
    for value, width in fields:
        number |= value << at
        at += width
    return number.to_bytes((at + 7) // 8, "little")


def frame(kind, body, key=None, counter=0, listens=False):
    first = bytes([kind | (16 if key else 0) | (32 if listens else 0) | 2 << 6])
    tag = siphash(key, first + counter.to_bytes(3, "little") + body)[:6] if key else b""
    data = first + (counter & 0xFFFF).to_bytes(2, "little") + body + tag
    return cobs(data + crc16(data))


def angles(time_ms, joints):
    return time_ms.to_bytes(2, "little") + bits([f for angle, status in joints for f in ((angle, 12), (status, 2))])


def main():
    draw = random.Random(14)
    print("# what, then its fields, then the wire; written by golden.py")
    print("# angles: pair key (- none) nonce counter listens time_ms angle/state of each joint")
    print("# challenge: pair key, nonce")

    def show_angles(pair, nonce, counter, listens, time_ms, joints):
        wire = frame(1, angles(time_ms, joints), session(pair, nonce) if pair else None, counter, listens)
        print("angles", pair.hex() if pair else "-", nonce.hex(), counter, int(listens), time_ms,
              ",".join(f"{a}/{s}" for a, s in joints), wire.hex())

    key = bytes(range(16))
    rest = [(1440, 0), (464, 0), (464, 0), (1792, 0), (1792, 0)]
    show_angles(None, bytes(8), 0, False, 0, [(0, 0)] * 5)
    show_angles(key, bytes(range(8)), 0, True, 1000, rest)
    show_angles(key, bytes(range(8)), 65536, False, 65535, rest)
    show_angles(key, bytes(range(8)), (1 << 24) - 1, False, 65535, [(4095, 3)] * 5)
    for joints in (1, 2, 5, 5, 5, 5, 5, 5, 6, 14, 21):
        pair = draw.randbytes(16) if draw.random() < 0.7 else None
        show_angles(pair, draw.randbytes(8), draw.randrange(1 << 24 if pair else 1 << 16), draw.random() < 0.5,
                    draw.randrange(1 << 16), [(draw.randrange(4096), draw.randrange(4)) for _ in range(joints)])
    for _ in range(4):
        pair, nonce = draw.randbytes(16), draw.randbytes(8)
        print("challenge", pair.hex(), nonce.hex(), frame(6, nonce, pair).hex())
    for counts in ([0, 1, 2, 3, 4], [1023] * 5, [draw.randrange(1024) for _ in range(8)]):
        time_ms = draw.randrange(1 << 16)
        body = time_ms.to_bytes(2, "little") + bits([(n, 10) for n in counts])
        print("readings", time_ms, ",".join(map(str, counts)), frame(2, body).hex())
    for _ in range(2):
        fingers = [(draw.randrange(4096), draw.randrange(-127, 128), draw.randrange(16)) for _ in range(5)]
        time_ms, faults = draw.randrange(1 << 16), draw.randrange(256)
        body = struct.pack("<HB", time_ms, faults)
        body += b"".join(struct.pack("<Hb", angle | fault << 12, duty) for angle, duty, fault in fingers)
        print("telemetry", time_ms, faults, ",".join("/".join(map(str, f)) for f in fingers), frame(4, body).hex())
    for board, touch, has_key, cause, temperature, uptime_s in ((0, 0, 1, 1, -128, 0), (1, 1, 0, 8, -7, 65535)):
        faults, supply = draw.randrange(256), draw.randrange(256)
        body = struct.pack("<BBbBH", board | touch << 1 | has_key << 2 | cause << 4, faults, temperature, supply, uptime_s)
        print("state", board, touch, has_key, cause, faults, temperature, supply, uptime_s, frame(3, body).hex())
    for what in (1, 2, 3):
        print("request", what, frame(7, bytes([what])).hex())
    for length in (1, 24):
        pair, nonce, counter = draw.randbytes(16), draw.randbytes(8), draw.randrange(1 << 24)
        size, offset, data = draw.randrange(1 << 16), draw.randrange(1 << 16), draw.randbytes(length)
        body = struct.pack("<HH", size, offset) + data
        print("piece", pair.hex(), nonce.hex(), counter, size, offset, data.hex(),
              frame(5, body, session(pair, nonce), counter).hex())
    nonce, crcs = draw.randbytes(8), [draw.randrange(1 << 16) for _ in range(5)]
    room, rate_hz, model = draw.randrange(1 << 16), 10, draw.randrange(1 << 16)
    body = b"\0" + nonce + struct.pack("<HBH5H", room, rate_hz, model, *crcs)
    print("offer", nonce.hex(), room, rate_hz, model, ",".join(map(str, crcs)), frame(5, body).hex())
    for received, stage in ((0, 0), (65535, 1), (300, 254)):
        print("receipt", received, stage, frame(5, b"\1" + struct.pack("<HB", received, stage)).hex())


if __name__ == "__main__":
    main()
