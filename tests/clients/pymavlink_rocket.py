"""Flies a rocket from apogee with pymavlink: arms, starts, watches the descent, aborts, and sees the parachute open.

Usage: pymavlink_rocket.py PORT, or pymavlink_rocket.py DEVICE BAUD. Prints a line for each fact; fails with an exception.
"""

import sys

from facts import check
from pymavlink import mavutil
from pymavlink_client import ACCEPTED, Ground, mav


class SerialGround(Ground):
    def __init__(self, device, baud):
        super().__init__("udpout:127.0.0.1:9")
        self.link.close()
        self.link = mavutil.mavlink_connection(
            device, baud=baud, source_system=255, source_component=190, dialect="touchdown"
        )


def ready(ground):
    healthy = mav.MAV_SYS_STATUS_PREARM_CHECK
    status = ground.message("SYS_STATUS", lambda m: m.onboard_control_sensors_health & healthy)
    for name in ("3D_GYRO", "3D_ACCEL", "ABSOLUTE_PRESSURE", "GPS"):
        bit = getattr(mav, f"MAV_SYS_STATUS_SENSOR_{name}")
        check(f"{name} is there and healthy", status.onboard_control_sensors_health & bit)
    # Two lithium cells.
    check("the battery is told", 6000 < status.voltage_battery < 8500 and 0 < status.battery_remaining <= 100)


def pad(ground):
    check("the battery answers", ground.command(512, 147) == ACCEPTED)
    battery = ground.message("BATTERY_STATUS")
    check("and has a voltage and a current", 6000 < battery.voltages[0] < 8500 and battery.current_battery > 0)
    check("the IMU answers", ground.command(512, 105) == ACCEPTED)
    imu = ground.message("HIGHRES_IMU")
    check("and feels the pad", abs(imu.xacc - 9.81) < 0.3)


def main():
    ground = Ground(f"udpout:127.0.0.1:{sys.argv[1]}") if len(sys.argv) == 2 else SerialGround(sys.argv[1], int(sys.argv[2]))
    ground.beats = True
    ready(ground)
    pad(ground)
    check("arm", ground.command(400, 1) == ACCEPTED)
    check("start", ground.command(300, 0) == ACCEPTED)
    check("it says that no ascent is flown", ground.text("no ascent is flown"))
    descent = ground.message("TD_DESCENT", lambda m: m.vertical_speed_m_s < -20)
    check("it falls from apogee", 100 < descent.height_m < 310 and descent.chute == 1)
    check("the commit height is computed", 30 < descent.commit_height_m < 120)
    estimator = ground.message("ESTIMATOR_STATUS")
    check("the estimator vouches for itself", estimator.flags & 1 and estimator.pos_vert_accuracy < 5)
    check("abort", ground.command(185, 1) == ACCEPTED)
    ground.message("HEARTBEAT", lambda m: m.custom_mode & 0xFF == 12 and m.system_status == 8)
    check("it is under its parachute, terminated", True)
    slow = ground.message("TD_DESCENT", lambda m: m.chute == 3)
    check("which carries it", -10 < slow.vertical_speed_m_s < 0)
    print("ALL OK")


main()
