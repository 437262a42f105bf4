"""Checks MAVSDK 3.x with its server against a vehicle that listens on 127.0.0.1:PORT.

Usage: mavsdk_grpc.py PORT.
"""

import asyncio
import os
import re
import sys

import mavsdk
from mavsdk import System
from mavsdk.action import ActionError
from facts import check, upright

PATIENCE_S = 60


async def first(stream, wanted):
    async for item in stream:
        if wanted(item):
            return item
    raise AssertionError("the stream has ended")


async def within(what, awaitable):
    found = await asyncio.wait_for(awaitable, PATIENCE_S)
    print("ok", what, flush=True)
    return found


async def refused(awaitable):
    try:
        await awaitable
    except ActionError as error:
        return str(error)
    return None


async def port_of(server):
    """Waits until the server prints its port, which it does once it has found the vehicle."""
    async for line in server.stdout:
        told = re.search(rb"listen on [0-9.]+:(\d+)", line)
        if told:
            return int(told[1])
    raise AssertionError("the server has ended")


async def main():
    # With port 0 the system chooses a free port. The library would not learn the port of a server that it starts itself.
    program = os.path.join(os.path.dirname(mavsdk.__file__), "bin", "mavsdk_server")
    options = ["-p", "0", f"udpout://127.0.0.1:{sys.argv[1]}"]
    server = await asyncio.create_subprocess_exec(program, *options, stdout=asyncio.subprocess.PIPE)
    try:
        await fly(System("127.0.0.1", await within("the server serves", port_of(server))))
    finally:
        server.kill()
        await server.wait()


async def fly(drone):
    await within("connected", drone.connect())
    await within("found", first(drone.core.connection_state(), lambda state: state.is_connected))
    attitude = drone.telemetry.attitude_quaternion()
    await within("the attitude is upright", first(attitude, upright))
    check("a parameter is read", await drone.param.get_param_float("NMPC_W_THETA") == 200)
    everything = await within("all parameters", drone.param.get_all_params())
    check("all of them are floats", len(everything.float_params) > 20 and not everything.int_params)
    check("a takeoff is refused", await refused(drone.action.takeoff()))
    await asyncio.sleep(2)
    await within("arm", drone.action.arm())
    await within("armed, as HEARTBEAT says", first(drone.telemetry.armed(), lambda armed: armed))
    await within("disarm", drone.action.disarm())
    await within("disarmed, as HEARTBEAT says", first(drone.telemetry.armed(), lambda armed: not armed))
    await within("terminate", drone.action.terminate())
    check("arming is refused afterwards", await refused(drone.action.arm()))
    print("ALL OK", flush=True)


asyncio.run(main())
