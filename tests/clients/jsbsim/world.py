"""JSBSim as the world of our flight computer, over the messages of hardware in the loop, in lockstep over UDP.

world.py PORT ORDER.json: flies the flights of the order with the computer at 127.0.0.1:PORT and prints one line of JSON
for each. The order names the airframe's and the motor's file, the site, the mission's hash, and the draw of each flight.
"""
import json
import math
import os
import random
import socket
import struct
import sys
import tempfile

os.environ["MAVLINK20"] = "1"
import jsbsim  # noqa: E402
import numpy as np  # noqa: E402
from pymavlink.dialects.v20 import touchdown as mav  # noqa: E402

import vehicle  # noqa: E402
from sensors import Sensors  # noqa: E402

M = vehicle.M_PER_FT
FRAME_US, STEP_S = 5000, 0.001
LONGEST_S, SEND_AGAIN_S, GIVE_UP = 150.0, 0.5, 40
NOTHING = (1 << 64) - 1
IMU_FIELDS, BAROMETER_FIELDS = 0x3F, 0x200 | 0x800
QUARTER_TURN = math.pi / 2
# WGS 84.
EQUATORIAL_RADIUS_M, ECCENTRICITY_SQUARED = 6378137.0, 6.69437999014e-3


class Computer:
    """The flight computer at the other end."""

    def __init__(self, port):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(("127.0.0.1", port))
        self.socket.settimeout(SEND_AGAIN_S)
        self.mav = mav.MAVLink(None, srcSystem=254, srcComponent=1)

    def ask(self, flight_id, time_usec, messages):
        """Sends messages in one datagram, again until they are answered; returns (controls, phase)."""
        for _ in range(GIVE_UP):
            self.socket.send(b"".join(message.pack(self.mav) for message in messages))
            try:
                while True:
                    told = None
                    for message in self.mav.parse_buffer(self.socket.recv(4096)) or []:
                        if message.get_type() == "TD_HIL_COMPUTER":
                            told = message
                        elif message.get_type() == "HIL_ACTUATOR_CONTROLS" and told is not None:
                            if (told.flight_id, told.time_usec, message.time_usec) == (flight_id, time_usec, time_usec):
                                return message.controls, told.phase
            except TimeoutError:
                continue
        raise SystemExit(f"the flight computer does not answer at {time_usec} us")


def single(value):
    """As the wire carries it."""
    return struct.unpack("<f", struct.pack("<f", value))[0]


class Plant:
    """One flight's vehicle in JSBSim. World axes as ours: x north, y west, z up."""

    def __init__(self, folder, order, draw):
        truth = draw["truth"]
        self.airframe = vehicle.write(folder, order["airframe"], order["motor"], truth)
        self.truth, self.site = truth, order["site"]
        fdm = jsbsim.FGFDMExec(folder)
        fdm.set_debug_level(0)
        fdm.set_aircraft_path("aircraft")
        fdm.set_engine_path("engine")
        # Servos and delays read it when they are made.
        fdm.set_dt(STEP_S)
        assert fdm.load_model("vehicle")
        self.fdm = fdm
        latitude = math.radians(self.site["latitude_deg"])
        flat = 1.0 - ECCENTRICITY_SQUARED * math.sin(latitude) ** 2
        across = EQUATORIAL_RADIUS_M / math.sqrt(flat)
        self.radii = across * (1.0 - ECCENTRICITY_SQUARED) / flat, across * math.cos(latitude)
        state = draw["apogee"]
        (x, y, z), (vx, vy, vz) = state["position_m"], state["velocity_m_s"]
        latitude_deg, longitude_deg = self.degrees(x, -y)
        phi, theta, psi = euler(state["world_from_body"])
        for name, value in (
            ("terrain-elevation-ft", 0.0), ("lat-geod-deg", latitude_deg), ("long-gc-deg", longitude_deg),
            ("h-sl-ft", z / M), ("phi-rad", phi), ("theta-rad", theta), ("psi-true-rad", psi),
            ("vn-fps", vx / M), ("ve-fps", -vy / M), ("vd-fps", -vz / M),
        ):
            fdm[f"ic/{name}"] = value
        for axis, value in zip("pqr", state["rate_rad_s"]):
            fdm[f"ic/{axis}-rad_sec"] = value
        assert fdm.run_ic()
        self.lit_at = None
        self.time_s = 0.0

    def degrees(self, north_m, east_m):
        north, east = self.radii
        return (
            self.site["latitude_deg"] + math.degrees(north_m / north),
            self.site["longitude_deg"] + math.degrees(east_m / east),
        )

    def command(self, controls):
        fdm = self.fdm
        fdm["fcs/gimbal-pitch-cmd"] = controls[0] * QUARTER_TURN
        fdm["fcs/gimbal-yaw-cmd"] = controls[1] * QUARTER_TURN
        for fin in range(4):
            fdm[f"fcs/fin{fin}-cmd"] = controls[2 + fin] * QUARTER_TURN
        if controls[6] > 0.5 and self.lit_at is None:
            self.lit_at = self.time_s + self.truth["ignition_delay_s"]

    def step(self):
        fdm = self.fdm
        if self.lit_at is not None and self.time_s >= self.lit_at and not fdm["propulsion/engine[0]/set-running"]:
            if fdm["fcs/throttle-cmd-norm[0]"] == 0.0:
                fdm["fcs/throttle-cmd-norm[0]"] = 1.0
                fdm["propulsion/set-running"] = 0
        mean = self.truth["wind_m_s"] * (max(self.height(), 0.5) / 10.0) ** (1.0 / 7.0)
        towards = self.truth["wind_towards_rad"]
        fdm["atmosphere/wind-north-fps"] = mean * math.cos(towards) / M
        fdm["atmosphere/wind-east-fps"] = -mean * math.sin(towards) / M
        fdm.run()
        self.time_s += STEP_S

    def height(self):
        return self.fdm["position/h-sl-ft"] * M

    def motion(self):
        fdm = self.fdm
        north, east = self.radii
        cg_station = -fdm["inertia/cg-x-in"] * 0.0254
        theta, phi = fdm["attitude/theta-rad"], fdm["attitude/phi-rad"]
        legs = self.airframe["legs"]
        return {
            "rate": np.array([fdm[f"velocities/{axis}i-rad_sec"] for axis in "pqr"]),
            "force": np.array([fdm[f"accelerations/a-pilot-{axis}-ft_sec2"] * M for axis in "xyz"]),
            "place": np.array([
                math.radians(fdm["position/lat-geod-deg"] - self.site["latitude_deg"]) * north,
                math.radians(fdm["position/long-gc-deg"] - self.site["longitude_deg"]) * east,
                self.height(),
            ]),
            "velocity": np.array([fdm["velocities/v-north-fps"], fdm["velocities/v-east-fps"],
                                  -fdm["velocities/v-down-fps"]]) * M,
            "airspeed": fdm["air/speed"],
            # The nose is at theta above the horizon whatever the roll.
            "tilt": math.pi / 2 - theta,
            "roll": phi,
            "lidar_behind_cg": cg_station - legs["foot_station_m"] - 0.15,
            "turning": math.sqrt(sum(fdm[f"velocities/{axis}-rad_sec"] ** 2 for axis in "pqr")),
        }

    def contacts(self):
        """Feet and other parts on the ground."""
        on = [self.fdm[f"contact/unit[{unit}]/WOW"] > 0 for unit in range(12)]
        return sum(on[:4]), any(on[4:])

    def thrust_over_weight(self):
        return self.fdm["propulsion/engine[0]/thrust-lbs"] / self.fdm["inertia/weight-lbs"]


def euler(world_from_body):
    """Roll, pitch, yaw of a body whose attitude (w, x, y, z) is told in axes north, west, up."""
    w, x, y, z = world_from_body
    # Half a turn about north makes them north, east, down.
    w, x, y, z = -x, w, -z, y
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - x * z))))
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    return roll, pitch, math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def messages_of(flight_id, time_usec, plant, sample, contact):
    gyro, force, height, fix, distance = sample
    fdm = plant.fdm
    # Contact, continuity, pin out; there is no booster.
    switches = 2 | 8 | (1 if contact else 0)
    messages = [mav.MAVLink_td_hil_vehicle_message(
        time_usec=time_usec, gnss_time_usec=fix[2] if fix else NOTHING, flight_id=flight_id,
        gimbal=[fdm["fcs/gimbal-pitch-rad"], fdm["fcs/gimbal-yaw-rad"]],
        fins=[fdm[f"fcs/fin{fin}-rad"] for fin in range(4)],
        battery=0xFFFF, switches=switches, range=0 if distance is None else 1,
    )]
    if fix:
        place, velocity, valid_us = fix
        latitude_deg, longitude_deg = plant.degrees(place[0], place[1])
        north, east, down = (round(100 * speed) for speed in (velocity[0], velocity[1], -velocity[2]))
        messages.append(mav.MAVLink_hil_gps_message(
            valid_us, 3, round(1e7 * latitude_deg), round(1e7 * longitude_deg), round(1e3 * place[2]),
            0xFFFF, 0xFFFF, 0xFFFF, north, east, down, 0xFFFF, 0xFF,
        ))
    if distance is not None:
        messages.append(mav.MAVLink_distance_sensor_message(
            time_usec // 1000, 0, 0xFFFF, round(100 * distance), 0, 0, 12, 0xFF,
        ))
    fields = IMU_FIELDS | (BAROMETER_FIELDS if height is not None else 0)
    pressure_hpa = fdm["atmosphere/P-psf"] * 0.47880259 if height is not None else 0.0
    messages.append(mav.MAVLink_hil_sensor_message(
        time_usec, *map(single, force), *map(single, gyro), 0, 0, 0, pressure_hpa, 0, height or 0.0, 0, fields,
    ))
    return messages


def fly(computer, order, draw):
    with tempfile.TemporaryDirectory() as folder:
        return fly_in(folder, computer, order, draw)


def fly_in(folder, computer, order, draw):
    plant, sensors = Plant(folder, order, draw), Sensors(draw["number"])
    flight_id, believed = random.getrandbits(32), draw["believed"]
    start = mav.MAVLink_td_hil_start_message(
        position_m=believed["position_m"], velocity_m_s=believed["velocity_m_s"],
        world_from_body=believed["world_from_body"], rate_rad_s=believed["rate_rad_s"], flight_id=flight_id,
        mission_hash=order["mission_hash"], pace=0,
    )
    controls, _ = computer.ask(flight_id, 0, [start])
    before, touchdown, ignited_m, still_s, ending, chute = plant.motion(), None, None, 0.0, "time-out", False
    while plant.time_s < LONGEST_S and ending == "time-out":
        plant.command(controls)
        if controls[6] > 0.5 and ignited_m is None:
            ignited_m = before["place"][2]
        chute |= controls[7] > 0.5
        sample = None
        for _ in range(5):
            plant.step()
            motion = plant.motion()
            feet, hull = plant.contacts()
            if touchdown is None and (feet or hull):
                touchdown = dict(before, time_s=plant.time_s)
            sample = sensors.tell(motion) or sample
            before = motion
            if touchdown is None:
                continue
            speed = float(np.linalg.norm(motion["velocity"]))
            still = feet >= 3 and speed < 0.03 and motion["turning"] < 0.05 and plant.thrust_over_weight() < 0.5
            still_s = still_s + STEP_S if still else 0.0
            ending = (
                "body strike" if hull else "tipped over" if motion["tilt"] > math.pi / 4
                else "upright" if still_s >= 0.3 else ending
            )
        time_usec = round(plant.time_s / STEP_S) * 1000
        controls, phase = computer.ask(
            flight_id, time_usec, messages_of(flight_id, time_usec, plant, sample, touchdown is not None)
        )
    told = {"number": draw["number"], "ending": ending, "parachute": bool(chute), "ignited_m": ignited_m}
    if touchdown:
        velocity = touchdown["velocity"]
        told |= {
            "time_s": touchdown["time_s"], "vertical_m_s": float(velocity[2]),
            "lateral_m_s": float(math.hypot(velocity[0], velocity[1])), "tilt_rad": touchdown["tilt"],
            "rate_rad_s": touchdown["turning"], "place_m": float(math.hypot(*touchdown["place"][:2])),
        }
    return told


def main():
    port, order = int(sys.argv[1]), json.load(open(sys.argv[2]))
    computer = Computer(port)
    for draw in order["flights"]:
        print(json.dumps(fly(computer, order, draw)), flush=True)


if __name__ == "__main__":
    main()
