//! A pad without a flight: one vehicle and one station that never fly, while the clock of the
//! laptop steps, the disk fills, the link goes and programs stop for a while.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use e2e::{Impairment, Program, Running, Signal, Terminal, UdpProxy, program};

use crate::footprint::{HISTORY_BYTES_H, LOG_INDEX_BYTES_H, Watched};
use crate::{Failure, KEY, print_line, rest};

/// The disk of the station's log; it is full after a quarter of an hour or so.
const DISK: &str = "size=1m";

/// What happens to the pad between two flights, in turn.
#[derive(Clone, Copy)]
enum Event {
    /// The laptop's clock steps to this many hours from the true time.
    ClockAt(i8),
    NoLink,
    StationStopped,
    VehicleStopped,
    ScreenBlocked,
}
const EVENTS: [Event; 7] = [
    Event::ClockAt(1),
    Event::NoLink,
    Event::StationStopped,
    Event::ClockAt(-2),
    Event::VehicleStopped,
    Event::ScreenBlocked,
    Event::ClockAt(0),
];
const LASTS: Duration = Duration::from_secs(12);

pub(crate) struct Pad {
    /// The file that names the step of the laptop's clock; `None` without the library that changes
    /// it.
    clock: Option<PathBuf>,
    proxy: UdpProxy,
    vehicle: Running,
    station: Running,
    screen: Terminal,
    events: usize,
    /// Whether the screen has said that the log has failed.
    disk_was_full: bool,
}

impl Pad {
    pub(crate) fn open(folder: &Path) -> Result<Self, Failure> {
        let folder = folder.join("pad");
        let disk = folder.join("disk");
        std::fs::create_dir_all(&disk)?;
        crate::make_key(&folder)?;
        let proxy = UdpProxy::new();
        let mut vehicle = program(Program::OnboardSim);
        vehicle.args(["fly", "--mission", "mk2", "--stay", "--key", KEY, "--log", "vehicle.mcap"]);
        vehicle.args(["--mavlink", &proxy.vehicle_link()]).current_dir(&folder);
        let vehicle = Running::start(&mut vehicle);
        // A disk of its own, which no other process sees.
        let mut command = Command::new("unshare");
        command.args(["--map-root-user", "--mount", "sh", "-c"]);
        command.arg(r#"mount -t tmpfs -o "$1" none "$2" && shift 2 && exec "$@""#);
        command.args(["sh", DISK]).arg(&disk).arg(program(Program::Ground).get_program());
        command.args(["daemon", "--connect", &proxy.ground_link(), "--key", KEY]);
        command.args(["--log", "disk/station.mcap"]);
        crate::at_home(&mut command, &folder);
        let clock = stepping_clock(&mut command, &folder)?;
        let mut station = Running::start(&mut command);
        station.wait_for_line("PAD_IDLE");
        let screen = Terminal::start(crate::ground(&folder).arg("attach"), (80, 24), false);
        let pad = Self { clock, proxy, vehicle, station, screen, events: 0, disk_was_full: false };
        pad.expect_both_ways()?;
        Ok(pad)
    }

    pub(crate) fn watched(&self) -> Vec<Watched> {
        vec![
            Watched::new("vehicle on its pad", self.vehicle.pid()).keeping(LOG_INDEX_BYTES_H),
            Watched::new("station on a full disk", self.station.pid()).keeping(HISTORY_BYTES_H),
            Watched::new("its screen, 80x24", self.screen.pid()),
        ]
    }

    /// The next thing goes wrong and is over; then both directions of the link live again.
    pub(crate) fn suffer(&mut self) -> Result<(), Failure> {
        let event = EVENTS[self.events % EVENTS.len()];
        self.events += 1;
        let what = match event {
            Event::ClockAt(hours) => match &self.clock {
                Some(file) => {
                    std::fs::write(file, format!("{hours:+}h\n"))?;
                    rest(LASTS);
                    format!("the laptop's clock steps to {hours:+} h")
                }
                None => "NOT RUN, libfaketime is missing: the laptop's clock steps".to_owned(),
            },
            Event::NoLink => {
                self.proxy.impair(Impairment { drops_all: true, ..Impairment::default() });
                self.screen.wait_for("LINK LOST: no telemetry");
                self.proxy.impair(Impairment::default());
                "no link".to_owned()
            }
            Event::StationStopped => stopped("station", |signal| self.station.signal(signal)),
            Event::VehicleStopped => stopped("vehicle", |signal| self.vehicle.signal(signal)),
            Event::ScreenBlocked => {
                let blocked = self.screen.stop_reading();
                rest(LASTS);
                drop(blocked);
                "a terminal that takes nothing".to_owned()
            }
        };
        self.expect_both_ways()?;
        let failed = self.screen.window().shows("LOG FAILED");
        self.disk_was_full |= failed;
        print_line(&format!("pad: {what}{}", if failed { ", and the log's disk is full" } else { "" }))
    }

    /// An abort is still possible: it is the last request to the pad.
    pub(crate) fn close(mut self) -> Result<Vec<String>, Failure> {
        self.screen.type_bytes(b"\x18\r");
        self.screen.wait_for_fact("ABORT", "observed yes");
        let log = format!("/proc/{}/cwd/disk/station.mcap", self.station.pid());
        let info = Running::to_end(program(Program::Replay).args(["info", &log]));
        print_line(&format!("aborted; replay info of the log on the full disk\n{}", info.output))?;
        let mut wrong = Vec::new();
        if !self.disk_was_full {
            wrong.push("the pad's full disk was not reported; it takes a quarter of an hour".to_owned());
        }
        if info.code != Some(0) {
            wrong.push(format!("the log on the full disk cannot be read: {:?}", info.code));
        }
        self.station.signal(Signal::SIGTERM);
        let ended = self.station.wait();
        print_line(&format!(
            "the station ended with {:?}: {}",
            ended.code,
            ended.output.lines().last().unwrap_or("")
        ))?;
        Ok(wrong)
    }

    /// Both directions of the link work.
    fn expect_both_ways(&self) -> Result<(), Failure> {
        let heard = |window: &e2e::Window| window.rows()[0].contains(" down 0s up 0s").then_some(());
        if self.screen.wait_within(e2e::PATIENCE, heard).is_none() {
            return Err(
                format!("the pad's link is dead on\n{}", self.screen.window().rows().join("\n")).into()
            );
        }
        Ok(())
    }
}

fn stopped(who: &str, signal: impl Fn(Signal)) -> String {
    signal(Signal::SIGSTOP);
    rest(LASTS);
    signal(Signal::SIGCONT);
    format!("the {who} is stopped for {} s", LASTS.as_secs())
}

/// Gives the program a clock that can be stepped, if the machine has the library for it.
fn stepping_clock(command: &mut Command, folder: &Path) -> Result<Option<PathBuf>, Failure> {
    let library =
        Path::new("/usr/lib").join(format!("{}-linux-gnu/faketime/libfaketime.so.1", std::env::consts::ARCH));
    if !library.exists() {
        return Ok(None);
    }
    let file = folder.join("clock");
    std::fs::write(&file, "+0h\n")?;
    command.env("LD_PRELOAD", library).env("FAKETIME_TIMESTAMP_FILE", &file);
    // Only the time of day steps. It is read again every second.
    command.env("FAKETIME_DONT_FAKE_MONOTONIC", "1").env("FAKETIME_CACHE_DURATION", "1");
    Ok(Some(file))
}
