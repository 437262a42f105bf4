//! The pin of a simulated vehicle, which somebody moves by hand, and an abort on the pad that
//! outlives the power switch.

use std::io::Write as _;
use std::path::Path;
use std::process::ChildStdin;
use std::time::Duration;

use e2e::{
    ABORT, ACCEPTED, ARM, BareGround, Bound, Program, Running, Signal, Terminal, Window, program, vehicle,
    wait_for_removal,
};
use protocol::dialect::{TdInterlock, TdMotor, TdPhase};

const SIZE: (u16, u16) = (120, 30);

fn type_line(input: &mut ChildStdin, words: &str) {
    writeln!(input, "{words}").expect("a program that reads its input");
}

/// A flight that ends under its parachute with an unburnt motor; in the air, and after it, its time
/// runs faster.
#[test]
fn a_crew_practises_from_the_start_to_may_be_approached_with_the_pin_in_its_hand() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = program(Program::Ground);
    command.args(["--connect", "udpin:127.0.0.1:0", "--log", "none"]).current_dir(folder.path());
    command.envs([("XDG_RUNTIME_DIR", folder.path()), ("XDG_CONFIG_HOME", folder.path())]);
    let mut screen = Terminal::start(&command, SIZE, false);
    let link = format!("udpout:127.0.0.1:{}", screen.bound_port(Bound::Udp));
    let mut command = vehicle(folder.path(), &[&link]);
    command.args(["--stay", "--mission", "mk2", "--start", "pad", "--dispersion", "none"]);
    command.args(["--speed", "4", "--fault", "abort@descent"]);
    let (mut hand, mut vehicle) = Running::start_with_input(&mut command);
    screen.wait_for("every arming check passes");
    type_line(&mut hand, "pin  IN");
    screen.wait_for("pin");
    screen.wait_until("no GO with the pin in", |window| window.shows("NO-GO: ").then_some(()));
    type_line(&mut hand, "pull the pin");
    vehicle.wait_for_line("type `pin in` or `pin out`");
    type_line(&mut hand, "pin out");
    screen.wait_for("every arming check passes");
    // A busy machine may leave the vehicle without its station for a second of its time, which
    // holds the countdown.
    let lands = |window: &Window| window.shows("do not approach for").then_some(());
    let flown = (0..3).any(|_| {
        screen.type_until(b"0AARM\r", " ARMED ");
        screen.type_until(b"0SSTART\r", "START  commanded");
        screen.wait_within(Duration::from_secs(40), lands).is_some()
    });
    assert!(flown, "{}", screen.window().rows().join("\n"));
    screen.wait_for("one person: pin in");
    type_line(&mut hand, "pin in");
    screen.wait_for("may be approached: the pin is in");
    vehicle.wait_for_line("TOUCHDOWN to SAFED");
}

/// The vehicle of this folder, switched on.
fn switched_on(folder: &Path, ground: &BareGround) -> (ChildStdin, Running) {
    Running::start_with_input(vehicle(folder, &[&ground.link()]).args(["--stay", "--dispersion", "none"]))
}

fn is_due(interlocks: TdInterlock) -> bool {
    interlocks.contains(TdInterlock::TD_INTERLOCK_PIN_DUE)
}

#[test]
fn a_wait_on_the_pad_runs_again_after_a_power_cycle_and_the_pin_is_due_until_it_was_put_in() {
    let folder = tempfile::tempdir().expect("a folder");
    let saved = folder.path().join("vehicle.mcap.aborted");
    let mut ground = BareGround::new();
    let (_hand, vehicle) = switched_on(folder.path(), &ground);
    ground.wait_until_ready();
    assert_eq!(ground.command(ABORT, 1.0), ACCEPTED);
    ground.wait_for_status("the latch", |status| status.approach_wait_s > 0);
    vehicle.signal(Signal::SIGKILL);
    vehicle.wait();

    // Off and on, twice: no clock shows how long it was off, so the wait runs again in full.
    for _ in 0..2 {
        let mut ground = BareGround::new();
        let (_hand, mut vehicle) = switched_on(folder.path(), &ground);
        vehicle.wait_for_line("not ready: abort latch: found keep away for");
        let status = ground.wait_for_status("the wait", |status| status.phase == TdPhase::TD_PHASE_PAD_IDLE);
        assert!(is_due(status.interlocks) && (40..=60).contains(&status.approach_wait_s), "{status:?}");
        assert_ne!(ground.command(ARM, 1.0), ACCEPTED);
        vehicle.wait_for_line("arm refused: abort latch: found keep away for");
        vehicle.signal(Signal::SIGKILL);
        vehicle.wait();
        assert!(saved.exists());
    }

    // The pin goes in while the minute passes.
    let mut ground = BareGround::new();
    let (mut hand, vehicle) = switched_on(folder.path(), &ground);
    type_line(&mut hand, "pin in");
    ground.wait_for_status("the pin", |status| status.motor == TdMotor::TD_MOTOR_PIN_IN);
    for left_s in [40, 20, 0] {
        ground.wait_for_status("the end of the wait", |status| status.approach_wait_s <= left_s);
    }
    wait_for_removal(&saved);
    type_line(&mut hand, "pin out");
    ground.wait_for_status("a vehicle that is prepared", |status| !is_due(status.interlocks));
    ground.wait_until_ready();
    assert_eq!(ground.command(ARM, 1.0), ACCEPTED);
    vehicle.signal(Signal::SIGTERM);
}
