"""Checks MAVSDK's native wheel (4.x): it listens on HOST:PORT, and a vehicle sends to that address.

Usage: mavsdk_native.py HOST:PORT. MAVSDK shares a port with other programs that allow it, so no other program may use this one.
"""

import sys
import time

from mavsdk import Configuration, ConnectionResult, Mavsdk
from mavsdk.component_type import ComponentType
from mavsdk.plugins.action import Action
from mavsdk.plugins.info import Info
from mavsdk.plugins.param import Param
from mavsdk.plugins.telemetry import Telemetry
from facts import check, upright

PATIENCE_S = 30


def until(what, holds):
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        if holds():
            print("ok", what, flush=True)
            return
        time.sleep(0.05)
    raise AssertionError(f"no {what} within the time limit")


def refused(action):
    try:
        action()
    except Exception as error:  # every plugin has its own class of errors
        return str(error)
    return None


def main():
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    check("it listens", mavsdk.add_any_connection(f"udpin://{sys.argv[1]}") == ConnectionResult.SUCCESS)
    system = mavsdk.first_autopilot(PATIENCE_S)
    check("an autopilot is found", system is not None)
    check("its system id is 1", system.get_system_id() == 1)
    telemetry, action, param, info = Telemetry(system), Action(system), Param(system), Info(system)
    # It is NaN until the first attitude has arrived.
    until("the attitude is upright", lambda: upright(telemetry.attitude_quaternion()))
    until("the position is told", lambda: abs(telemetry.position_velocity_ned().position.down_m) < 5)
    check("the version is told", info.get_version() is not None)
    value = param.get_param_float("NMPC_W_THETA")
    check(f"a parameter is read ({value})", value == 200)
    param.set_param_float("RATE_FINS", 1.0)
    check("a parameter is set", param.get_param_float("RATE_FINS") == 1.0)
    everything = param.get_all_params()
    check("all parameters are read", len(everything.float_params) > 20 and not everything.int_params)
    time.sleep(2)
    action.arm()
    until("armed, as HEARTBEAT says", telemetry.armed)
    action.disarm()
    until("disarmed, as HEARTBEAT says", lambda: not telemetry.armed())
    check("a takeoff is refused", refused(action.takeoff))
    action.terminate()
    check("terminated; arming is refused", refused(action.arm))
    print("ALL OK", flush=True)
    mavsdk.destroy()


main()
