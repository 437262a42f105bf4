"""Checks with pymavlink that a vehicle on udpin:127.0.0.1:PORT answers as the MAVLink standard requires.

The dialect is generated from our XML by pymavlink's generator.

Usage: pymavlink_client.py PORT. Prints a line for each fact; fails with an exception.
"""

import os
import sys
import time

os.environ["MAVLINK20"] = "1"
from pymavlink import mavutil  # noqa: E402  (reads the environment when imported)
from pymavlink.dialects.v20 import touchdown as mav  # noqa: E402
from facts import check

PATIENCE_S = 30
ACCEPTED, REJECTED_NOW, DENIED, UNSUPPORTED, FAILED = 0, 1, 2, 3, 4


class Ground:
    def __init__(self, address, system=255, component=190):
        self.link = mavutil.mavlink_connection(
            address, source_system=system, source_component=component, dialect="touchdown"
        )
        self.me = (system, component)
        self.texts = []
        self.chunks = {}
        # Whether it sends heartbeats while it waits, ten a second as a countdown asks, and when the next one is due.
        self.beats = False
        self.beat_at = 0.0

    def wait(self, what, wanted, patience_s=PATIENCE_S):
        deadline = time.monotonic() + patience_s
        while time.monotonic() < deadline:
            if self.beats and time.monotonic() >= self.beat_at:
                self.beat()
            message = self.link.recv_match(blocking=True, timeout=0.05)
            if message is None or message.get_type() == "BAD_DATA":
                continue
            if message.get_type() == "STATUSTEXT":
                self.hear_text(message)
            found = wanted(message)
            if found:
                return found
        raise AssertionError(f"no {what} within the time limit; heard: {self.texts}")

    def hear_text(self, message):
        if message.id == 0:
            self.texts.append(message.text)
            return
        self.chunks.setdefault(message.id, {})[message.chunk_seq] = message.text
        parts = self.chunks[message.id]
        if len(message.text) < 50 or message.chunk_seq == 7:
            self.texts.append("".join(parts[k] for k in sorted(parts)))

    def message(self, kind, wanted=lambda message: True):
        return self.wait(kind, lambda m: m if m.get_type() == kind and m.get_srcSystem() == 1 and wanted(m) else None)

    def beat(self):
        self.beat_at = time.monotonic() + 0.1
        self.link.mav.heartbeat_send(mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, 4)

    def answer_to(self, command, patience_s=PATIENCE_S):
        def wanted(m):
            mine = (m.target_system, m.target_component) == self.me
            return m if m.command == command and mine else None

        return self.wait(
            f"an answer to {command}",
            lambda m: wanted(m) if m.get_type() == "COMMAND_ACK" else None,
            patience_s,
        ).result

    def command(self, command, *params):
        params = list(params) + [float("nan")] * (7 - len(params))
        # The vehicle does not answer every one of many refusals in a row, so ask again, as the standard says.
        for confirmation in range(3):
            self.link.mav.command_long_send(1, 1, command, confirmation, *params)
            try:
                return self.answer_to(command, 2)
            except AssertionError as error:
                unanswered = error
        raise unanswered

    def text(self, words):
        def wanted(_):
            return next((text for text in self.texts if words in text), None)

        return wanted(None) or self.wait(f"the words `{words}`", wanted)


def ready(ground):
    prearm = mav.MAV_SYS_STATUS_PREARM_CHECK
    ground.message("SYS_STATUS", lambda m: m.onboard_control_sensors_health & prearm)


def identity(ground):
    ground.beat()
    beat = ground.message("HEARTBEAT")
    check("the vehicle is 1/1, a rocket, generic", (beat.get_srcComponent(), beat.type, beat.autopilot) == (1, 9, 0))
    check("custom_mode has the phase", beat.custom_mode & 0xFF in (0, 1) and beat.base_mode & 1)
    for request in ((512, 148), (520, 1)):
        assert ground.command(*request) == ACCEPTED
        version = ground.message("AUTOPILOT_VERSION")
        bits = version.capabilities
        true = mav.MAV_PROTOCOL_CAPABILITY_MAVLINK2 | mav.MAV_PROTOCOL_CAPABILITY_COMMAND_INT | 0x800
        check(f"capabilities by command {request[0]}", bits & true == true)
        encodings = bits & (16 | 131072)
        check("exactly one parameter encoding", encodings == 131072)
    for request in ((512, 300), (519, 1)):
        assert ground.command(*request) == ACCEPTED
        check(f"PROTOCOL_VERSION by command {request[0]}", ground.message("PROTOCOL_VERSION").version == 200)


def modes(ground):
    assert ground.command(512, 435, 0) == ACCEPTED
    names = {}
    while len(names) < 13:
        mode = ground.message("AVAILABLE_MODES")
        names[mode.custom_mode & 0xFF] = mode.mode_name
    check("13 modes have names", names[9] == "POWERED" and mode.number_modes == 13)
    assert ground.command(512, 436) == ACCEPTED
    check("CURRENT_MODE", ground.message("CURRENT_MODE").custom_mode & 0xFF == 1)


def refusals(ground):
    check("START before arming is denied", ground.command(300, 0) == DENIED)
    check("and says why", "PAD_IDLE" in ground.text("start refused"))
    check("arm with 2 is denied", ground.command(400, 2) == DENIED)
    check("and says why", ground.text("param1 = 2"))
    check("arm with NaN is denied", ground.command(400, float("nan")) == DENIED)
    check("termination with 0 has failed", ground.command(185, 0) == FAILED)
    for unknown in (22, 31000, 65535):
        check(f"command {unknown} is unsupported", ground.command(unknown, 0) == UNSUPPORTED)
    ground.link.mav.command_int_send(1, 1, 0, 31001, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    check("COMMAND_INT is answered, too", ground.answer_to(31001) == UNSUPPORTED)
    ground.link.mav.command_int_send(1, 0, 0, 512, 0, 0, 148, 0, 0, 0, 0, 0, 0)
    check("COMMAND_INT to component 0 is done", ground.answer_to(512) == ACCEPTED)


def intervals(ground):
    check("a message that is none of ours has failed", ground.command(511, 36, 0) == FAILED)
    check("one of our own dialect is set", ground.command(511, 54001, 1000000) == ACCEPTED)
    check("and comes", len(ground.message("TD_FINS").measured) == 4)
    check("attitude slowed to 2 Hz", ground.command(511, 31, 500000) == ACCEPTED)
    assert ground.command(512, 244, 31) == ACCEPTED
    check("and read back", ground.message("MESSAGE_INTERVAL", lambda m: m.message_id == 31).interval_us == 500000)
    check("beyond the budget it is denied", ground.command(511, 31, 1000) == DENIED)
    check("and says why", ground.text("budget is 2000"))
    check("default again", ground.command(511, 31, 0) == ACCEPTED)


def parameters(ground):
    ground.link.mav.param_request_list_send(1, 1)
    values = {}
    while not values or len(values) < next(iter(values.values())).param_count:
        value = ground.message("PARAM_VALUE")
        assert value.param_type == mav.MAV_PARAM_TYPE_REAL32
        values[value.param_id] = value
    check(f"{len(values)} parameters, all REAL32", len(values) > 20 and "RATE_FLIGHT_STAT" in values)
    check("names have at most 16 bytes", max(map(len, values)) == 16)
    ground.link.mav.param_request_read_send(1, 1, b"NMPC_W_THETA", -1)
    check("one by name", ground.message("PARAM_VALUE").param_value == 200)

    def set_to(name, value, kind=mav.MAV_PARAM_TYPE_REAL32):
        ground.link.mav.param_set_send(1, 1, name.encode(), value, kind)
        return ground.message("PARAM_VALUE", lambda m: m.param_id == name).param_value

    check("a rate is set", set_to("RATE_FINS", 1) == 1)
    check("a weight is not, and answered", set_to("NMPC_W_Q", 1) == 0)
    check("an INT32 is not, and answered", set_to("RATE_FINS", 2, mav.MAV_PARAM_TYPE_INT32) == 1)
    check("back again", set_to("RATE_FINS", 2) == 2)


def files(ground):
    payload = bytearray(251)
    payload[0:6] = [7, 0, 0, 4, 17, 0]
    payload[12:29] = b"@PARAM/param.pck\0"
    began = time.monotonic()
    ground.link.mav.file_transfer_protocol_send(0, 1, 1, payload)
    answer = ground.message("FILE_TRANSFER_PROTOCOL")
    check("FTP has no parameters", (answer.payload[3], answer.payload[5], answer.payload[0]) == (129, 4, 8))
    check("at once", time.monotonic() - began < 2)


def clocks(ground):
    ground.link.mav.timesync_send(0, 12345)
    sync = ground.message("TIMESYNC")
    check("TIMESYNC is answered, addressed", sync.ts1 == 12345 and sync.tc1 != 0 and sync.target_system == 255)
    ground.link.mav.ping_send(5, 6, 0, 0)
    ping = ground.message("PING")
    check("PING is answered, addressed", (ping.seq, ping.target_system, ping.target_component) == (6, 255, 190))


def arming(ground):
    ready(ground)
    check("arm is accepted", ground.command(400, 1) == ACCEPTED)
    armed = mav.MAV_MODE_FLAG_SAFETY_ARMED
    ground.message("HEARTBEAT", lambda m: m.base_mode & armed)
    check("armed again is accepted", ground.command(400, 1, 21196) == ACCEPTED)
    check("disarm is accepted", ground.command(400, 0) == ACCEPTED)
    ground.message("HEARTBEAT", lambda m: not m.base_mode & armed)
    check("armed, then terminated", ground.command(400, 1) == ACCEPTED and ground.command(185, 1) == ACCEPTED)
    ended = ground.message("HEARTBEAT", lambda m: m.system_status == mav.MAV_STATE_FLIGHT_TERMINATION)
    check("HEARTBEAT says terminated and disarmed", not ended.base_mode & armed)
    for force in (0, 21196, 2989):
        check(f"arming with {force} is refused afterwards", ground.command(400, 1, force) not in (ACCEPTED, UNSUPPORTED))
    check("termination is irreversible", ground.command(185, 0) == FAILED)


def main():
    ground = Ground(f"udpout:127.0.0.1:{sys.argv[1]}")
    # A ground station sends heartbeats; without them the vehicle refuses to arm.
    ground.beats = True
    identity(ground)
    ground.message("HEARTBEAT", lambda m: m.custom_mode & 0xFF == 1)
    for part in (modes, refusals, intervals, parameters, files, clocks, arming):
        ground.beat()
        part(ground)
    print("ALL OK")


if __name__ == "__main__":
    main()
