"""Sends commands to a vehicle with a key: signed by pymavlink, unsigned, wrongly signed, replayed, old and bit-flipped.

Usage: signed_client.py PORT KEYFILE.
"""

import sys
import time

from facts import check
from pymavlink import mavutil
from pymavlink_client import ACCEPTED, Ground

EPOCH_S = 1420070400


class Recorder:
    """Remembers the last bytes sent, so that they can be sent again."""

    def __init__(self, link):
        self.write, self.last = link.write, b""
        link.write = self

    def __call__(self, data):
        self.last = bytes(data)
        return self.write(data)


def silence(ground, what, seconds=2.0):
    """Checks that the vehicle acknowledges nothing for a while and still sends heartbeats."""
    deadline = time.monotonic() + seconds
    alive = False
    while time.monotonic() < deadline:
        message = ground.link.recv_match(blocking=True, timeout=0.2)
        if message is None:
            continue
        assert message.get_type() != "COMMAND_ACK", f"{what} was answered"
        if message.get_type() == "STATUSTEXT":
            ground.hear_text(message)
        alive |= message.get_type() == "HEARTBEAT"
    check(f"{what}: not answered, vehicle alive", alive)


def main():
    port, key_path = sys.argv[1:3]
    with open(key_path, encoding="ascii") as file:
        key = bytes.fromhex(file.read().strip())
    ground = Ground(f"udpout:127.0.0.1:{port}")
    recorder = Recorder(ground.link)
    signing = ground.link.mav.signing
    ground.link.mav.robust_parsing = True
    ground.link.setup_signing(key, sign_outgoing=True, allow_unsigned_callback=None)

    # The vehicle learns the address of the ground from its first frame.
    ground.beat()
    beat = ground.message("HEARTBEAT")
    check("the vehicle's frames are signed", beat.get_signed())
    check("a signed command is accepted", ground.command(512, 148) == ACCEPTED)
    replay = recorder.last

    recorder.write(replay)
    silence(ground, "a replayed command")

    flipped = bytearray(replay)
    flipped[-1] ^= 1
    recorder.write(bytes(flipped))
    silence(ground, "a command with a flipped bit in its signature")

    signing.secret_key = bytes(32)
    ground.link.mav.command_long_send(1, 1, 185, 0, 1, *[0] * 6)
    wrong = recorder.last
    signing.secret_key = key
    silence(ground, "a command signed with another key")
    assert wrong[2] == 1

    old, signing.timestamp = signing.timestamp, int((time.time() - EPOCH_S - 3600) * 1e5)
    signing.link_id = 77
    ground.link.mav.command_long_send(1, 1, 185, 0, 1, *[0] * 6)
    silence(ground, "a new stream an hour old")
    signing.timestamp, signing.link_id = old, 0

    signing.sign_outgoing = False
    ground.link.mav.command_long_send(1, 1, 185, 0, 1, *[0] * 6)
    silence(ground, "an unsigned termination", 6.0)
    signing.sign_outgoing = True
    check("the refusal is told in words", ground.text("refused:"))
    check("nothing was terminated", ground.message("HEARTBEAT").system_status != 8)
    check("a signed command still is accepted", ground.command(512, 148) == ACCEPTED)
    with open(key_path + ".replay", "wb") as file:
        file.write(recorder.last)
    print("ALL OK")


def replay_after_restart():
    """Sends the last command of the previous run to the restarted vehicle."""
    port, key_path = sys.argv[1:3]
    with open(key_path, encoding="ascii") as file:
        key = bytes.fromhex(file.read().strip())
    with open(key_path + ".replay", "rb") as file:
        replay = file.read()
    ground = Ground(f"udpout:127.0.0.1:{port}")
    ground.link.setup_signing(key, sign_outgoing=True, allow_unsigned_callback=None)
    ground.beat()
    ground.message("HEARTBEAT")
    ground.link.write(replay)
    silence(ground, "a command of the run before")
    print("ALL OK")


assert mavutil
if len(sys.argv) > 3:
    replay_after_restart()
else:
    main()
