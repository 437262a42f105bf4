//! What the terminal tests share: a vehicle, a proxy, a ground station on a terminal, and the keys
//! that a crew types.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use e2e::{Program, Running, Signal, Terminal, UdpProxy, program};
use protocol::dialect::MavCmd;

pub(crate) const SIZE: (u16, u16) = (80, 24);

/// A flight begins ten seconds after its start, if nothing holds it.
pub(crate) const COUNTDOWN: Duration = Duration::from_secs(20);

/// `ground` with these arguments and with settings of the test's own.
pub(crate) fn ground(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = program(Program::Ground);
    command.args(arguments).env("XDG_RUNTIME_DIR", folder).env("XDG_CONFIG_HOME", folder).current_dir(folder);
    command
}

/// A vehicle on its pad and its ground station on a terminal.
pub(crate) struct Rig {
    pub(crate) terminal: Terminal,
    pub(crate) proxy: UdpProxy,
    pub(crate) vehicle: Running,
    profile: &'static str,
    pub(crate) folder: tempfile::TempDir,
}

impl Rig {
    pub(crate) fn new(profile: &'static str) -> Self {
        Self::on_terminal(profile, false, "xterm-256color")
    }

    /// The same with a vehicle that has this fault.
    pub(crate) fn with_fault(profile: &'static str, fault: &str) -> Self {
        let mut rig = Self::new(profile);
        rig.vehicle.signal(Signal::SIGKILL);
        rig.restart_vehicle(&["--fault", fault]);
        rig
    }

    /// The same on a terminal of this kind; `reports_repeats` is whether it distinguishes key
    /// repeats from presses.
    pub(crate) fn on_terminal(profile: &'static str, reports_repeats: bool, kind: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let proxy = UdpProxy::new();
        let link = proxy.ground_link();
        let mut command = ground(folder.path(), &["--connect", &link, "--log", "ground.mcap"]);
        let terminal = Terminal::start(command.env("TERM", kind), SIZE, reports_repeats);
        let vehicle = Running::start(&mut vehicle(profile, &proxy, folder.path()));
        Self { terminal, proxy, vehicle, profile, folder }
    }

    /// Kills the vehicle and starts it again.
    pub(crate) fn reboot_vehicle(&mut self) {
        self.vehicle.signal(Signal::SIGKILL);
        self.restart_vehicle(&[]);
    }

    /// Starts the vehicle again, with these options.
    pub(crate) fn restart_vehicle(&mut self, options: &[&str]) {
        let mut vehicle = vehicle(self.profile, &self.proxy, self.folder.path());
        self.vehicle = Running::start(vehicle.args(options));
    }

    /// How often the ground has sent this command with this first parameter.
    pub(crate) fn sent(&self, command: MavCmd, param1: f32) -> usize {
        let asked = |request: &&protocol::command::CommandRequest| {
            request.is(command) && request.params[0].to_bits() == param1.to_bits()
        };
        self.proxy.commands().iter().filter(asked).count()
    }

    /// Types these keys repeatedly until the words are shown; returns how often.
    pub(crate) fn type_until(&mut self, keys: &[u8], words: &str) -> usize {
        self.terminal.type_until(keys, words)
    }

    /// Types the arming sequence until the vehicle reports that it is armed; returns how often it
    /// was typed.
    pub(crate) fn arm(&mut self) -> usize {
        self.terminal.wait_for("every arming check passes");
        let climbed = self.type_until(b"AARM\r", " ARMED ");
        self.terminal.wait_for("✓ armed (HEARTBEAT)");
        climbed
    }

    /// Starts the countdown.
    pub(crate) fn start(&mut self) {
        self.type_until(b"SSTART\r", "START  commanded");
        self.wait_for_fact("START", "observed yes");
    }

    /// Arms and starts until the flight begins.
    pub(crate) fn fly(&mut self) {
        self.terminal.wait_for("every arming check passes");
        self.terminal.arm_and_start(COUNTDOWN, " T+");
    }

    pub(crate) fn abort(&mut self) {
        self.terminal.type_bytes(b"\x18\r");
        self.wait_for_fact("ABORT", "acknowledged ");
    }

    /// Waits until the facts about a command contain these words; returns the number of attempts
    /// shown.
    pub(crate) fn wait_for_fact(&self, name: &str, words: &str) -> usize {
        attempts(&self.terminal.wait_for_fact(name, words))
    }

    /// Waits until the ground shows this many attempts.
    pub(crate) fn wait_for_attempts(&self, name: &str, wanted: usize) {
        self.terminal.wait_until(&format!("{name} x{wanted}"), |window| {
            window.facts_about(name).filter(|facts| attempts(facts) >= wanted)
        });
    }
}

/// A vehicle on its pad, the proxy before it, and a folder that its ground stations share.
pub(crate) struct Pad {
    pub(crate) folder: tempfile::TempDir,
    pub(crate) proxy: UdpProxy,
    pub(crate) vehicle: Running,
}

impl Pad {
    pub(crate) fn new() -> Self {
        Self::with_vehicle(&[])
    }

    /// The same with a vehicle that has these options.
    pub(crate) fn with_vehicle(options: &[&str]) -> Self {
        let proxy = UdpProxy::new();
        let folder = tempfile::tempdir().unwrap();
        let vehicle = Running::start(vehicle("mk2", &proxy, folder.path()).args(options));
        Self { folder, proxy, vehicle }
    }

    /// A ground station without a screen that holds the link.
    pub(crate) fn daemon(&self, log: &str) -> Running {
        let arguments = ["daemon", "--connect", &self.proxy.ground_link(), "--log", log];
        let mut daemon = Running::start(&mut ground(self.folder.path(), &arguments));
        daemon.wait_for_line("PAD_IDLE");
        daemon
    }

    /// A screen of the daemon.
    pub(crate) fn attach(&self, options: &[&str], environment: &[(&str, &str)]) -> Terminal {
        let mut command = ground(self.folder.path(), &[&["attach"], options].concat());
        Terminal::start(command.envs(environment.iter().copied()), SIZE, false)
    }
}

/// It keeps its unique id, so that it is known again after a reboot.
fn vehicle(profile: &str, proxy: &UdpProxy, folder: &Path) -> Command {
    let mut command = program(Program::OnboardSim);
    command.args(["fly", "--stay", "--mission", profile, "--mavlink", &proxy.vehicle_link()]);
    command.arg("--uid-file").arg(folder.join("vehicle.uid"));
    command
}

/// The number in ` ABORT  commanded 12.3 s x4  acknowledged waiting  observed yes`.
fn attempts(facts: &str) -> usize {
    let number = facts.split(" x").nth(1).and_then(|rest| rest.split(' ').next());
    number.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("no attempts in {facts}"))
}
