//! A launch day: one station with three screens, and a flight every few minutes over a link that
//! comes and goes.

use std::path::{Path, PathBuf};
use std::time::Duration;

use e2e::{Impairment, Program, Running, Signal, Terminal, UdpProxy, program, raw_frames_of};
use protocol::dialect::{MavMessage, TD_LANDING_VERDICT_DATA};
use protocol::frame::Framer;

use crate::footprint::{HISTORY_BYTES_H, Watched};
use crate::{Failure, KEY, print_line, rest};

const LOG: &str = "station.mcap";

/// What the link does from the start of a flight to its end, in turn.
const LINKS: [(&str, Impairment); 5] = [
    ("a clean link", IDEAL),
    ("10 % lost, 5 % doubled", Impairment { lost_per_1000: 100, duplicated_per_1000: 50, ..IDEAL }),
    ("up to 0.3 s late, out of order", Impairment { delay_max: Duration::from_millis(300), ..IDEAL }),
    ("no uplink", Impairment { drops_uplink: true, ..IDEAL }),
    ("no link", Impairment { drops_all: true, ..IDEAL }),
];
const IDEAL: Impairment = Impairment {
    lost_per_1000: 0,
    duplicated_per_1000: 0,
    delay_max: Duration::ZERO,
    drops_answers: false,
    drops_all: false,
    drops_uplink: false,
};

/// Who is stopped for some seconds while a vehicle flies, in turn.
#[derive(Clone, Copy)]
enum Stopped {
    Nobody,
    Screen,
    Station,
}
const STOPS: [Stopped; 3] = [Stopped::Nobody, Stopped::Screen, Stopped::Station];
const STOPPED_FOR: Duration = Duration::from_secs(5);

pub(crate) struct Field {
    folder: PathBuf,
    proxy: UdpProxy,
    station: Running,
    screens: [Terminal; 3],
    flights: u32,
}

impl Field {
    pub(crate) fn open(folder: &Path) -> Result<Self, Failure> {
        let folder = folder.join("field");
        std::fs::create_dir_all(&folder)?;
        crate::make_key(&folder)?;
        let proxy = UdpProxy::new();
        let mut command = crate::ground(&folder);
        command.args(["daemon", "--connect", &proxy.ground_link(), "--log", LOG]);
        command.args(["--key", KEY]);
        let mut station = Running::start(&mut command);
        station.wait_for_line("type next: ground attach");
        let attach = |options: &[&str], size| {
            Terminal::start(crate::ground(&folder).arg("attach").args(options), size, false)
        };
        let screens =
            [attach(&[], (80, 24)), attach(&["--watch"], (140, 45)), attach(&["--watch"], (200, 60))];
        Ok(Self { folder, proxy, station, screens, flights: 0 })
    }

    pub(crate) fn watched(&self) -> Vec<Watched> {
        let screen = |name, which: usize| Watched::new(name, self.screens[which].pid());
        vec![
            Watched::new("station with flights", self.station.pid())
                .keeping(HISTORY_BYTES_H)
                .with_log(self.folder.join(LOG)),
            screen("its screen, 80x24", 0),
            screen("a screen that only watches, 140x45", 1),
            screen("another one, 200x60", 2),
        ]
    }

    /// One flight from power-up to the check of its log.
    pub(crate) fn fly(&mut self) -> Result<(), Failure> {
        let number = self.flights;
        self.flights += 1;
        let (link, impairment) = LINKS[number as usize % LINKS.len()];
        let stop = STOPS[number as usize % STOPS.len()];
        let log = format!("vehicle-{number}.mcap");
        let start = if number.is_multiple_of(2) { "apogee" } else { "pad" };
        let mut vehicle = program(Program::OnboardSim);
        vehicle.args(["fly", "--mission", "mk2", "--stay", "--seed", "11", "--start", start, "--log", &log]);
        vehicle.args(["--flight", &number.to_string(), "--mavlink", &self.proxy.vehicle_link()]);
        let mut vehicle = Running::start(vehicle.args(["--key", KEY]).current_dir(&self.folder));
        vehicle.wait_for_line("PAD_IDLE");
        let [screen, watching, distant] = &mut self.screens;
        // All of them look through the pages while they wait.
        for (page, terminal) in [(b"1", &mut *screen), (b"2", &mut *watching), (b"4", &mut *distant)] {
            terminal.type_bytes(page);
        }
        for terminal in [&*screen, &*watching, &*distant] {
            terminal.wait_for("every arming check passes");
        }
        screen.type_until(b"AARM\r", " ARMED ");
        screen.wait_for("✓ armed (HEARTBEAT)");
        screen.type_until(b"SSTART\r", "START  commanded");
        vehicle.wait_for_line("to AERO_DESCENT");
        self.proxy.impair(impairment);
        match stop {
            Stopped::Nobody => {}
            Stopped::Screen => {
                screen.signal(Signal::SIGSTOP);
                rest(STOPPED_FOR);
                screen.signal(Signal::SIGCONT);
            }
            Stopped::Station => {
                self.station.signal(Signal::SIGSTOP);
                rest(STOPPED_FOR);
                self.station.signal(Signal::SIGCONT);
            }
        }
        // One in a hundred hits the ground: the station has to live through that, too.
        let how = vehicle.wait_for_line("its legs");
        vehicle.wait_for_line("disarmed");
        self.proxy.impair(IDEAL);
        for terminal in [&*screen, &*watching, &*distant] {
            terminal.wait_until("a vehicle that is down", |window| {
                let rows = window.rows();
                (rows[1].contains("TOUCHDOWN") || rows[1].contains("SAFED")).then_some(())
            });
        }
        // The verdict comes every 2 s.
        screen.type_bytes(b"4");
        screen.wait_for("LANDED by");
        vehicle.signal(Signal::SIGTERM);
        vehicle.wait();
        let verified =
            Running::to_end(program(Program::Replay).args(["verify", &log]).current_dir(&self.folder));
        if verified.code != Some(0) {
            return Err(format!("{log}: {}", verified.output).into());
        }
        std::fs::remove_file(self.folder.join(&log))?;
        print_line(&format!("flight {number}, from the {start}, {link}: {}", how.trim()))
    }

    /// Ends the station, and checks that its log holds every flight.
    pub(crate) fn close(self) -> Result<Vec<String>, Failure> {
        drop(self.screens);
        self.station.signal(Signal::SIGTERM);
        let ended = self.station.wait();
        let mut wrong = Vec::new();
        for command in [&["info"][..], &["verify", "--book"]] {
            let told =
                Running::to_end(program(Program::Replay).args(command).arg(LOG).current_dir(&self.folder));
            let command = command.join(" ");
            print_line(&format!("replay {command} {LOG}\n{}", told.output))?;
            if told.code != Some(0) {
                wrong.push(format!("replay {command} {LOG} ended with {:?}", told.code));
            }
        }
        let verdicts = verdicts_in(&self.folder.join(LOG))?;
        print_line(&format!(
            "{} flights, {verdicts} verdicts in the log; the station ended with {:?}",
            self.flights, ended.code
        ))?;
        if verdicts < self.flights as usize {
            wrong.push(format!("{} flights, but {verdicts} verdicts in the station's log", self.flights));
        }
        Ok(wrong)
    }
}

/// How many different verdicts a station has recorded: no two flights touch down alike to the last
/// bit.
fn verdicts_in(log: &Path) -> Result<usize, Failure> {
    let mut heard: Vec<TD_LANDING_VERDICT_DATA> = Vec::new();
    for bytes in raw_frames_of(log, "rx") {
        let mut framer = Framer::new();
        framer.push_datagram(&bytes);
        while let Some(frame) = framer.next_frame() {
            if let MavMessage::TD_LANDING_VERDICT(verdict) = frame.decode()?
                && !heard.contains(&verdict)
            {
                heard.push(verdict);
            }
        }
    }
    Ok(heard.len())
}
