"""Fetches the log of a landed vehicle on udpin:127.0.0.1:PORT with pymavlink's own FTP client.

Usage: files_pymavlink.py PORT FILE. Prints a line for each fact; fails with an exception.
"""

import os
import sys

os.environ["MAVLINK20"] = "1"
from pymavlink import mavftp, mavutil  # noqa: E402  (reads the environment when imported)
from facts import check

PATIENCE_S = 60


def main():
    port, fetched = sys.argv[1:]
    link = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=254, source_component=190)
    # The vehicle speaks to those whose frames it has accepted.
    for _ in range(PATIENCE_S):
        link.mav.heartbeat_send(6, 8, 0, 0, 4)
        if link.wait_heartbeat(timeout=1):
            break
    ftp = mavftp.MAVFTP(link, target_system=1, target_component=1)
    listed = ftp.cmd_list(["/log"])
    listed = listed if listed.directory_listing else ftp.process_ftp_reply("ListDirectory", timeout=PATIENCE_S)
    names = [(entry.name, entry.size_b) for entry in listed.directory_listing or []]
    check(f"one log is listed: {names}", len(names) == 1 and names[0][0] == "flight.mcap")
    # 80 bytes a packet, its default, and as many as fit.
    for size in [239, 80]:
        ftp.ftp_settings.burst_read_size = size
        ftp.cmd_get(["/log/flight.mcap", fetched])
        got = ftp.process_ftp_reply("OpenFileRO", timeout=10 * PATIENCE_S)
        check(f"a log is fetched in pieces of {size}", got.error_code == mavftp.FtpError.Success)
        check("all of it", os.path.getsize(fetched) == names[0][1])
    ftp.cmd_put([fetched, "/log/other.mcap"])
    put = ftp.process_ftp_reply("CreateFile", timeout=PATIENCE_S)
    check("nothing is written", put.error_code != mavftp.FtpError.Success)
    print("ALL OK", flush=True)


main()
