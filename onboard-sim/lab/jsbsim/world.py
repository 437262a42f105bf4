"""JSBSim as the world of our flight computer, which is a process of its own, in lockstep.

world.py BOARD ORDER.json: flies the flights of the order with the program BOARD and prints one line of JSON for each. The
order names the airframe's, the motor's and the mission's file, the site, and the draw of each flight.
"""
import json
import math
import sys
import tempfile
import tomllib

import jsbsim
import numpy as np

import vehicle
from board import Computer, double, doubles, message, vector, whole
from sensors import Sensors

M = vehicle.M_PER_FT
FRAME_S, STEP_S, LONGEST_S = 0.005, 0.001, 150.0
# WGS 84.
EQUATORIAL_RADIUS_M, ECCENTRICITY_SQUARED = 6378137.0, 6.69437999014e-3


class Plant:
    """One flight's vehicle in JSBSim. World axes as ours: x north, y west, z up."""

    def __init__(self, folder, order, draw):
        truth = draw["truth"]
        # Where the sensors are, m above the nozzle exit.
        with open(order["mission"], "rb") as mission:
            self.sensors = tomllib.load(mission)["sensors"]
        imu_station_m = self.sensors["imu_station_m"]
        self.airframe = vehicle.write(folder, order["airframe"], order["motor"], truth, imu_station_m)
        self.truth, self.site = truth, order["site"]
        # JSBSim swings no mass: the body turns back by the motor's share of its inertia.
        pitch_kg_m2 = self.airframe["mass"]["loaded_pitch_inertia_kg_m2"]
        self.turns_back = vehicle.swinging_kg_m2(order["motor"]) / pitch_kg_m2
        self.gimbal_rad, self.swing_rad_s = np.zeros(2), np.zeros(2)
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
            ("terrain-elevation-ft", self.site["altitude_m"] / M), ("lat-geod-deg", latitude_deg), ("long-gc-deg", longitude_deg),
            ("h-sl-ft", (z + self.site["altitude_m"]) / M), ("phi-rad", phi), ("theta-rad", theta), ("psi-true-rad", psi),
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

    def command(self, gimbal, fins, ignite):
        fdm = self.fdm
        fdm["fcs/gimbal-pitch-cmd"], fdm["fcs/gimbal-yaw-cmd"] = gimbal
        for fin in range(4):
            fdm[f"fcs/fin{fin}-cmd"] = fins[fin]
        if ignite and self.lit_at is None:
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
        gimbal_rad = np.array([fdm[f"fcs/gimbal-{axis}-rad"] for axis in ("pitch", "yaw")])
        self.swing_rad_s, self.gimbal_rad = (gimbal_rad - self.gimbal_rad) / STEP_S, gimbal_rad
        self.time_s += STEP_S

    def height(self):
        return self.fdm["position/h-sl-ft"] * M - self.site["altitude_m"]

    def motion(self):
        fdm = self.fdm
        north, east = self.radii
        cg_station = -fdm["inertia/cg-x-in"] * 0.0254
        theta, phi = fdm["attitude/theta-rad"], fdm["attitude/phi-rad"]
        place = np.array([
            math.radians(fdm["position/lat-geod-deg"] - self.site["latitude_deg"]) * north,
            math.radians(fdm["position/long-gc-deg"] - self.site["longitude_deg"]) * east,
            self.height(),
        ])
        velocity = np.array([fdm["velocities/v-north-fps"], fdm["velocities/v-east-fps"],
                             -fdm["velocities/v-down-fps"]]) * M
        nose, right, down = body_axes(phi, theta, fdm["attitude/psi-rad"])
        pitching, yawing = fdm["velocities/qi-rad_sec"], fdm["velocities/ri-rad_sec"]
        ahead = {sensor: self.sensors[f"{sensor}_station_m"] - cg_station for sensor in ("gnss", "barometer", "lidar")}
        return {
            "rate": np.array([fdm[f"velocities/{axis}i-rad_sec"] for axis in "pqr"])
            - self.turns_back * np.array([0.0, *self.swing_rad_s]),
            "force": np.array([fdm[f"accelerations/a-pilot-{axis}-ft_sec2"] * M for axis in "xyz"]),
            "place": place,
            "velocity": velocity,
            "antenna_place": place + ahead["gnss"] * nose,
            "antenna_velocity": velocity + ahead["gnss"] * (yawing * right - pitching * down),
            "barometer_height": place[2] + ahead["barometer"] * nose[2],
            "airspeed": fdm["air/speed"],
            # The nose is at theta above the horizon whatever the roll.
            "tilt": math.pi / 2 - theta,
            "roll": phi,
            "lidar_behind_cg": -ahead["lidar"],
            "turning": math.sqrt(sum(fdm[f"velocities/{axis}-rad_sec"] ** 2 for axis in "pqr")),
        }

    def contacts(self):
        """Feet and other parts on the ground."""
        on = [self.fdm[f"contact/unit[{unit}]/WOW"] > 0 for unit in range(12)]
        return sum(on[:4]), any(on[4:])

    def thrust_over_weight(self):
        return self.fdm["propulsion/engine[0]/thrust-lbs"] / self.fdm["inertia/weight-lbs"]


def body_axes(phi, theta, psi):
    """Nose, right and down of the body, in axes north, east, up."""
    (sp, cp), (st, ct), (sy, cy) = ((math.sin(angle), math.cos(angle)) for angle in (phi, theta, psi))
    nose = np.array([ct * cy, ct * sy, st])
    right = np.array([sp * st * cy - cp * sy, sp * st * sy + cp * cy, -sp * ct])
    down = np.array([cp * st * cy + sp * sy, cp * st * sy - sp * cy, -cp * ct])
    return nose, right, down


def euler(world_from_body):
    """Roll, pitch, yaw of a body whose attitude (w, x, y, z) is told in axes north, west, up."""
    w, x, y, z = world_from_body
    # Half a turn about north makes them north, east, down.
    w, x, y, z = -x, w, -z, y
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - x * z))))
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    return roll, pitch, math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def input_of(time_s, plant, sample, contact):
    """A frame's input but for its number: time, readings, gimbal (its servos do not say), fins, contact, igniter, pin, log."""
    gyro, force, height, fix, distance = sample
    measured = message(1, vector(1, gyro) + vector(2, force))
    if height is not None:
        measured += double(2, height)
    if fix:
        (north, east, up), (north_m_s, east_m_s, up_m_s), valid_us = fix
        place, velocity = vector(1, (north, -east, up)), vector(2, (north_m_s, -east_m_s, up_m_s))
        measured += message(3, place + velocity + double(3, valid_us * 1e-6))
    if distance is not None:
        measured += double(4, distance)
    fins = [plant.fdm[f"fcs/fin{fin}-rad"] for fin in range(4)]
    # Contact, continuity of the igniter, no booster, the pin is out; the log.
    flags = whole(7, contact) + whole(8, True) + whole(9, False) + whole(10, True)
    log = message(12, whole(1, True) + whole(2, 1 << 30))
    # What is posed is taken over within ten frames, five in the middle: about what a Cortex-M7 takes.
    ready = whole(18, round(time_s / 0.005) % 10 == 5)
    return double(2, time_s) + message(3, measured) + doubles(5, (0.0, 0.0)) + doubles(6, fins) + flags + log + ready


def fly(computer, order, draw):
    with tempfile.TemporaryDirectory() as folder:
        return fly_in(folder, computer, order, draw)


def fly_in(folder, computer, order, draw):
    plant, sensors = Plant(folder, order, draw), Sensors(draw["number"])
    begin, frame = computer.begin(open(order["mission"]).read(), draw["believed"]), 0
    closed = math.radians(order["fins_closed_deg"])
    gimbal, fins, ignite, eject = (0.0, 0.0), (closed,) * 4, False, False
    before, touchdown, ignited_m, still_s, ending, chute = plant.motion(), None, None, 0.0, "time-out", False
    while plant.time_s < LONGEST_S and ending == "time-out":
        plant.command(gimbal, fins, ignite)
        if ignite and ignited_m is None:
            ignited_m = before["place"][2]
        chute |= eject
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
        frame += 1
        told = input_of(FRAME_S * frame, plant, sample, touchdown is not None)
        (gimbal, fins, ignite, eject), begin = computer.ask(frame, told, begin), b""
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
    program, order = sys.argv[1], json.load(open(sys.argv[2]))
    computer = Computer(program)
    for draw in order["flights"]:
        print(json.dumps(fly(computer, order, draw)), flush=True)


if __name__ == "__main__":
    main()
