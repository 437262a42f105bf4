//! A vehicle, the air, a ground station on a terminal, and the hands of a crew.

use std::path::Path;
use std::process::Command;

use e2e::{Air, Program, Running, Signal, Terminal, program};
use protocol::dialect::MavCmd;

pub(crate) const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
pub(crate) const START: MavCmd = MavCmd::MAV_CMD_MISSION_START;
pub(crate) const ABORT: MavCmd = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION;

pub(crate) const SIZE: (u16, u16) = (80, 24);

/// `ground` with these arguments, by settings of the test's own.
pub(crate) fn ground(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = program(Program::Ground);
    command.args(arguments).env("XDG_RUNTIME_DIR", folder).env("XDG_CONFIG_HOME", folder).current_dir(folder);
    command
}

/// A flight that is about to begin.
pub(crate) struct Stage {
    pub(crate) terminal: Terminal,
    pub(crate) air: Air,
    vehicle: Running,
    profile: &'static str,
    pub(crate) folder: tempfile::TempDir,
}

impl Stage {
    /// A vehicle of this profile on its pad, and its ground station on a terminal.
    pub(crate) fn set(profile: &'static str) -> Self {
        Self::set_on(profile, false, "xterm-256color")
    }

    /// The same; the terminal tells key repeats from presses, or does not, and is of this kind.
    pub(crate) fn set_on(profile: &'static str, tells_repeats: bool, kind: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let air = Air::new();
        let link = air.ground_link();
        let mut command = ground(folder.path(), &["--connect", &link, "--log", "ground.mcap"]);
        let terminal = Terminal::start(command.env("TERM", kind), SIZE, tells_repeats);
        let vehicle = vehicle(profile, &air);
        Self { terminal, air, vehicle, profile, folder }
    }

    /// The vehicle loses its power, and has it again.
    pub(crate) fn reboot_vehicle(&mut self) {
        self.vehicle.signal(Signal::SIGKILL);
        self.vehicle = vehicle(self.profile, &self.air);
    }

    /// How often the ground has sent this command, with this first parameter.
    pub(crate) fn sent(&self, command: MavCmd, param1: f32) -> usize {
        let asked = |request: &&protocol::command::CommandRequest| {
            request.is(command) && request.params[0].to_bits() == param1.to_bits()
        };
        self.air.commands().iter().filter(asked).count()
    }

    /// Types this by hand until something comes of it; returns how often.
    pub(crate) fn type_until(&mut self, keys: &[u8], words: &str) -> usize {
        self.terminal.type_until(keys, words)
    }

    /// The arming ladder, from the first check to the vehicle's own word; returns how often it was climbed.
    pub(crate) fn arm(&mut self) -> usize {
        self.terminal.wait_for("GO: every arming check passes");
        let climbed = self.type_until(b"AARM\r", " ARMED ");
        self.terminal.wait_for("[x] armed, says HEARTBEAT");
        climbed
    }

    /// Starts the countdown.
    pub(crate) fn start(&mut self) {
        self.type_until(b"SSTART\r", "START  commanded");
        self.wait_for_fact("START", "observed yes");
    }

    /// The chord.
    pub(crate) fn abort(&mut self) {
        self.terminal.type_bytes(b"\x18\r");
        self.terminal.wait_for("ABORT  commanded");
    }

    /// Waits until the line of a command's facts holds these words; returns the attempts that it tells.
    pub(crate) fn wait_for_fact(&self, name: &str, words: &str) -> usize {
        self.terminal.wait_until(&format!("{name}: {words}"), |window| {
            facts(window, name).filter(|facts| facts.contains(words)).map(|facts| attempts(&facts))
        })
    }

    /// Waits until the ground tells of this many attempts.
    pub(crate) fn wait_for_attempts(&self, name: &str, wanted: usize) {
        self.terminal.wait_until(&format!("{name} x{wanted}"), |window| {
            facts(window, name).filter(|facts| attempts(facts) >= wanted)
        });
    }
}

fn vehicle(profile: &str, air: &Air) -> Running {
    let mut command = program(Program::OnboardSim);
    command.args(["fly", "--stay", "--profile", profile, "--mavlink", &air.vehicle_link()]);
    Running::start(&mut command)
}

fn facts(window: &e2e::Window, name: &str) -> Option<String> {
    window.row_with(&format!(" {name:<6} commanded "))
}

/// The number in ` ABORT  commanded 12.3 s x4  acknowledged waiting  observed yes`.
fn attempts(facts: &str) -> usize {
    let number = facts.split(" x").nth(1).and_then(|rest| rest.split(' ').next());
    number.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("no attempts in {facts}"))
}
