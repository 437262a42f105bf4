//! Screens whose station is another process, and what becomes of them when it dies.

use e2e::{Air, Program, Running, Signal, Terminal, program};
use protocol::dialect::MavCmd;

use crate::stage::{ABORT, SIZE, ground};

/// A vehicle on its pad beyond clear air, and the folder of everybody here.
struct Field {
    folder: tempfile::TempDir,
    air: Air,
    _vehicle: Running,
}

impl Field {
    fn new() -> Self {
        let air = Air::new();
        let mut vehicle = program(Program::OnboardSim);
        vehicle.args(["fly", "--stay", "--mavlink", &air.vehicle_link()]);
        let vehicle = Running::start(&mut vehicle);
        Self { folder: tempfile::tempdir().unwrap(), air, _vehicle: vehicle }
    }

    fn daemon(&self, log: &str) -> Running {
        let link = self.air.ground_link();
        let arguments = ["daemon", "--connect", &link, "--log", log];
        let mut daemon = Running::start(&mut ground(self.folder.path(), &arguments));
        daemon.wait_for_line("PAD_IDLE");
        daemon
    }

    fn attach(&self, flags: &[&str], environment: &[(&str, &str)]) -> Terminal {
        let mut command = ground(self.folder.path(), &[&["attach"], flags].concat());
        Terminal::start(command.envs(environment.iter().copied()), SIZE, false)
    }

    fn sent(&self, command: MavCmd) -> usize {
        self.air.commands().iter().filter(|request| request.is(command)).count()
    }
}

#[test]
fn an_abort_without_a_station_is_said_on_every_screen_and_goes_to_the_next_station() {
    let field = Field::new();
    let first = field.daemon("first.mcap");
    let mut screen = field.attach(&[], &[]);
    let watching = field.attach(&["--watch"], &[]);
    screen.wait_for("GO: every arming check passes");
    watching.wait_for("GO: every arming check passes");
    first.signal(Signal::SIGKILL);
    first.wait();
    screen.wait_for("LINK DOWN: the ground station of this screen is gone");
    // A screen without a list of events.
    screen.type_bytes(b"2");
    screen.wait_for("[2Descent]");
    screen.type_bytes(b"\x18\r");
    screen.wait_for("ABORT NOT SENT");
    assert_eq!(field.sent(ABORT), 0);
    let second = field.daemon("second.mcap");
    for shown in [&screen, &watching] {
        // The second station's clock is another than the first's: nothing is old, nothing is lost.
        shown.wait_until("the abort, by the second station", |window| {
            let rows = window.rows();
            let heard = rows[1].contains(" down 0s up 0s") && rows[1].starts_with(" PAD_IDLE ");
            (heard && rows[2].contains("acknowledged accepted  observed yes")).then_some(())
        });
    }
    assert!(field.sent(ABORT) >= 1);
    second.signal(Signal::SIGTERM);
    assert_eq!(second.wait().code, Some(4), "aborted");
}

#[test]
fn a_terminal_that_can_show_nothing_gets_lines() {
    let field = Field::new();
    let daemon = field.daemon("flight.mcap");
    for environment in [[("TERM", "dumb")], [("TERM", "")]] {
        let mut lines = field.attach(&[], &environment);
        lines.wait_for("PAD_IDLE");
        lines.signal(Signal::SIGTERM);
        assert_eq!(lines.wait_for_end(), Some(0));
        assert!(lines.is_restored() && !lines.look().bytes().contains(&0x1B), "no escape sequence");
    }
    let mut ascii = field.attach(&[], &[("LC_ALL", "C"), ("NO_COLOR", "1")]);
    ascii.wait_for("[1Pad]");
    ascii.wait_for("Arming ladder ---");
    assert!(ascii.look().bytes().is_ascii());
    // 30 to 37 are the colours of ECMA-48's SGR, 38 begins a longer one; no colour at all is left of them.
    let coloured = |bytes: &[u8]| bytes.windows(3).any(|found| found == b"[38" || found == b"[31");
    assert!(!coloured(ascii.look().bytes()));
    ascii.type_bytes(b"q");
    assert_eq!(ascii.wait_for_end(), Some(0));
    daemon.signal(Signal::SIGTERM);
    assert_eq!(daemon.wait().code, Some(5), "no flight was seen");
}
