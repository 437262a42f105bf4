"""A flight computer in a process of its own (`board fly`), in lockstep over its standard input and output.

The records are those of a flight's log: protocol buffers (protocol/proto), here put together by field numbers. On
the wire each is followed by its CRC-32, stuffed (COBS) and ended by a zero.
"""
import struct
import subprocess
import zlib


def varint(number):
    out = b""
    while number > 0x7F:
        out, number = out + bytes([number & 0x7F | 0x80]), number >> 7
    return out + bytes([number])


def whole(field, number):
    return varint(field << 3) + varint(int(number))


def double(field, number):
    return varint(field << 3 | 1) + struct.pack("<d", number)


def message(field, content):
    return varint(field << 3 | 2) + varint(len(content)) + content


def doubles(field, numbers):
    return message(field, struct.pack(f"<{len(numbers)}d", *numbers))


def vector(field, numbers):
    """Fields 1, 2 and so on, as a Vector3 and a Quaternion have them."""
    return message(field, b"".join(double(number + 1, value) for number, value in enumerate(numbers)))


def fields(content):
    """The fields of a message by their numbers; the last one counts."""
    found, place = {}, 0

    def number():
        nonlocal place
        value, shift = 0, 0
        while True:
            byte = content[place]
            place, value, shift = place + 1, value | (byte & 0x7F) << shift, shift + 7
            if byte < 0x80:
                return value

    while place < len(content):
        key = number()
        size = {0: 0, 1: 8, 5: 4}.get(key & 7)
        if key & 7 == 0:
            found[key >> 3] = number()
            continue
        size = number() if size is None else size
        found[key >> 3] = content[place:place + size]
        place += size
    return found


def numbers(packed):
    return struct.unpack(f"<{len(packed) // 8}d", packed)


def stuffed(content):
    out = b""
    for part in content.split(b"\0"):
        while len(part) >= 254:
            out, part = out + b"\xff" + part[:254], part[254:]
        out += bytes([len(part) + 1]) + part
    return out + b"\0"


def plain(content):
    out, place = b"", 0
    while place < len(content):
        code = content[place]
        out += content[place + 1:place + code]
        place += code
        # The last block and a full one have no zero behind them.
        out += b"\0" if code < 255 and place < len(content) else b""
    return out


class Computer:
    """The flight computer at the other end; a flight begins with its first frame."""

    def __init__(self, program):
        self.process = subprocess.Popen([program, "fly"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.flight = 0

    def begin(self, mission_toml, believed):
        """A flight that is released at once, with the computer's estimate of its state."""
        state = b"".join((
            vector(1, believed["position_m"]), vector(2, believed["velocity_m_s"]),
            vector(3, believed["world_from_body"]), vector(4, believed["rate_rad_s"]),
        ))
        self.flight += 1
        # Frame, estimate, released.
        start = whole(1, 0) + message(2, state) + whole(6, True)
        content = message(1, mission_toml.encode()) + message(2, start)
        return message(2, content + whole(4, self.flight))

    def ask(self, frame, content, begin=b""):
        """Has a frame of a flight in the air decided; returns gimbal and fins, rad, and whether it lights and ejects."""
        record = message(1, whole(1, frame) + content) + begin
        self.process.stdin.write(stuffed(record + struct.pack("<I", zlib.crc32(record))))
        self.process.stdin.flush()
        answered = b""
        while not answered.endswith(b"\0"):
            byte = self.process.stdout.read(1)
            if not byte:
                raise SystemExit(f"the flight computer has ended before frame {frame}")
            answered += byte
        answer = plain(answered[:-1])
        answer, sum_of_it = answer[:-4], answer[-4:]
        assert struct.pack("<I", zlib.crc32(answer)) == sum_of_it
        answer = fields(answer)
        assert answer[1] == frame
        output = fields(answer[2])
        return numbers(output[1]), numbers(output[2]), bool(output[3]), bool(output[4])
