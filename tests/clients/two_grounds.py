"""Checks that a vehicle answers each of two grounds with different system ids.

Usage: two_grounds.py PORT.
"""

import sys

from facts import check
from pymavlink_client import ACCEPTED, DENIED, Ground, ready


def main():
    address = f"udpout:127.0.0.1:{sys.argv[1]}"
    first, second = Ground(address), Ground(address, system=250, component=191)
    first.beats = True
    second.beat()
    ready(first)
    first.link.mav.command_long_send(1, 1, 300, 0, *[0] * 7)
    second.link.mav.command_long_send(1, 1, 512, 0, 148, *[0] * 6)
    check("the first is refused its own command", first.answer_to(300) == DENIED)
    check("the second is granted its own", second.answer_to(512) == ACCEPTED)
    second.beat()
    check("the second arms", second.command(400, 1) == ACCEPTED)
    first.message("HEARTBEAT", lambda m: m.base_mode & 128)
    check("the first sees it armed", True)
    check("the first terminates", first.command(185, 1) == ACCEPTED)
    second.message("HEARTBEAT", lambda m: m.system_status == 8)
    check("the second sees it terminated", True)
    print("ALL OK")


main()
