"""Fetches the log of a landed vehicle that sends to HOST:PORT with MAVSDK (native, 4.x).

Usage: files_mavsdk.py HOST:PORT FOLDER. Prints a line for each fact; fails with an exception.
"""

import os
import sys
import threading
import time

from mavsdk import Configuration, ConnectionResult, Mavsdk
from mavsdk.component_type import ComponentType
from mavsdk.plugins.ftp import Ftp
from mavsdk.plugins.ftp.ftp import FtpError, FtpResult
from facts import check

PATIENCE_S = 120


def main():
    address, folder = sys.argv[1:]
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    check("it listens", mavsdk.add_any_connection(f"udpin://{address}") == ConnectionResult.SUCCESS)
    system = mavsdk.first_autopilot(PATIENCE_S)
    check("an autopilot is found", system is not None)
    ftp = Ftp(system)
    # Until the vehicle is down it refuses.
    files, deadline = [], time.monotonic() + PATIENCE_S
    while not files and time.monotonic() < deadline:
        try:
            files = list(ftp.list_directory("/log").entries)
        except FtpError:
            time.sleep(0.5)
    check(f"one log is listed, {files[0].size_bytes if files else 0} bytes", [entry.name for entry in files] == ["flight.mcap"])
    for use_burst in [True, False]:
        ended, results = threading.Event(), []

        def on_news(result, _progress, _user_data):
            results.append(result)
            if result != FtpResult.NEXT:
                ended.set()

        ftp.download_async("/log/flight.mcap", folder, use_burst, on_news)
        check("the download ends", ended.wait(10 * PATIENCE_S))
        check(f"it succeeds, bursts {use_burst}", results[-1] == FtpResult.SUCCESS)
    fetched = os.path.join(folder, "flight.mcap")
    check("the checksums are the same", ftp.are_files_identical(fetched, "/log/flight.mcap"))
    try:
        ftp.remove_file("/log/flight.mcap")
        raise SystemExit("a file was removed")
    except Exception as error:
        check(f"nothing is removed: {error}", True)
    print("ALL OK", flush=True)
    mavsdk.destroy()


main()
