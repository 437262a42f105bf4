"""Reads a .tlog as MAVProxy and Mission Planner's tools do; prints how many frames of some messages it has."""
import collections
import sys

from pymavlink import mavutil

log = mavutil.mavlink_connection(sys.argv[1])
counts = collections.Counter()
while (message := log.recv_match()) is not None:
    counts[message.get_type()] += 1
for name in ["HEARTBEAT", "ATTITUDE_QUATERNION", "LOCAL_POSITION_NED"]:
    print(name, counts[name])
