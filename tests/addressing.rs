//! Which vehicle a command is addressed to, and by whom: the real vehicle, and ground stations of a
//! test that share their ids.

use e2e::{ABORT, ACCEPTED, ARM, BareGround, Bound, Program, Running, START, Signal, program};
use protocol::dialect::{COMMAND_LONG_DATA, MavCmd, MavMessage, TD_UPLINK_DATA, TdHold, TdLatch, TdPhase};

const NOT_NOW: u8 = 1;
const DENIED: u8 = 2;

const BOOT: &str = "4242";

/// A vehicle on its pad that listens.
fn listening(folder: &std::path::Path) -> Running {
    let mut fly = program(Program::OnboardSim);
    fly.args(["fly", "--mission", "mk2", "--stay", "--mavlink", "udpin:127.0.0.1:0", "--boot-number", BOOT])
        .current_dir(folder);
    Running::start(&mut fly)
}

fn station(vehicle: &mut Running, session: u32) -> BareGround {
    let port = vehicle.bound_port(Bound::Udp);
    let mut ground = BareGround::to(([127, 0, 0, 1], port).into());
    ground.session = session;
    ground
}

fn command(command: MavCmd, param1: f32, boot: f32) -> COMMAND_LONG_DATA {
    COMMAND_LONG_DATA {
        command,
        param1,
        param7: boot,
        target_system: 1,
        target_component: 1,
        ..COMMAND_LONG_DATA::default()
    }
}

fn report(ground: &mut BareGround, wanted: impl Fn(&TD_UPLINK_DATA) -> bool) -> TD_UPLINK_DATA {
    let session = ground.session;
    ground.wait_for("TD_UPLINK", |_, message| match message {
        Some(MavMessage::TD_UPLINK(uplink)) if uplink.session == session && wanted(uplink) => {
            Some(uplink.clone())
        }
        _ => None,
    })
}

#[test]
fn a_vehicle_takes_no_command_for_another_boot_or_for_everybody_but_an_abort() {
    let folder = tempfile::tempdir().unwrap();
    let mut vehicle = listening(folder.path());
    let mut ground = station(&mut vehicle, 7);
    ground.wait_until_ready();
    assert_eq!(ground.command_with(command(ARM, 1.0, 4243.0)), DENIED);
    let everybody = COMMAND_LONG_DATA { target_system: 0, target_component: 0, ..command(ARM, 1.0, 4242.0) };
    assert_eq!(ground.command_with(everybody.clone()), DENIED);
    assert_eq!(ground.command_with(command(ARM, 1.0, 4242.0)), ACCEPTED);
    assert_eq!(ground.command_with(command(START, 0.0, 4243.0)), DENIED);
    assert_eq!(ground.command_with(command(START, 0.0, 0.0)), DENIED);
    // Clients that name every component of the system.
    let start = COMMAND_LONG_DATA { target_component: 0, ..command(START, 0.0, 4242.0) };
    assert_eq!(ground.command_with(start), ACCEPTED);
    let status = ground.wait_for_status("a countdown", |status| status.countdown_ms != i32::MAX);
    assert_eq!((status.boot_number, status.last_hold_ds), (4242, 20));
    assert!(status.countdown_ms > 8_000, "{status:?}");
    let abort = COMMAND_LONG_DATA { command: ABORT, ..everybody };
    assert_eq!(ground.command_with(abort), ACCEPTED);
    let status = ground.wait_for_phase(TdPhase::TD_PHASE_PAD_IDLE);
    assert_eq!((status.latch, status.countdown_ms), (TdLatch::TD_LATCH_COMMANDED, i32::MAX));
    vehicle.signal(Signal::SIGTERM);
    vehicle.wait();
    for words in ["refused: for boot 4243; this is boot 4242", "refused: it is for every vehicle"] {
        let said = ground.texts.concat();
        assert!(said.contains(words), "{words}: {said}");
    }
}

/// The one that armed dies in the countdown, and another one with its ids goes on.
#[test]
fn the_death_of_the_station_that_armed_holds_whoever_else_has_its_ids() {
    for sessions in [[7, 8], [0, 0]] {
        let folder = tempfile::tempdir().unwrap();
        let mut vehicle = listening(folder.path());
        let mut first = station(&mut vehicle, sessions[0]);
        let mut second = station(&mut vehicle, sessions[1]);
        first.wait_until_ready();
        assert_eq!(first.command_with(command(ARM, 1.0, 4242.0)), ACCEPTED);
        assert_eq!(first.command_with(command(START, 0.0, 4242.0)), ACCEPTED);
        // From now on only the second one speaks.
        second.wait_for_status("a countdown", |status| status.countdown_ms != i32::MAX);
        let held = second.wait_for_status("a hold", |status| {
            assert!(status.phase == TdPhase::TD_PHASE_PAD_ARMED, "{status:?}");
            status.hold != TdHold::TD_HOLD_NONE
        });
        assert_eq!(held.hold, TdHold::TD_HOLD_UPLINK_SILENT);
        if sessions[1] != 0 {
            assert_eq!(report(&mut second, |_| true).commands, 0, "it has not armed");
        }
        vehicle.signal(Signal::SIGTERM);
        assert!(vehicle.wait().output.contains("nothing received from 255/190 for 1 s"));
    }
}

#[test]
fn while_two_have_the_same_ids_neither_arms_and_either_aborts() {
    let folder = tempfile::tempdir().unwrap();
    let mut vehicle = listening(folder.path());
    let mut first = station(&mut vehicle, 7);
    let mut second = station(&mut vehicle, 8);
    first.wait_until_ready();
    second.wait_until_ready();
    assert_eq!(report(&mut second, |uplink| uplink.accepted_age_ms < 1_000).same_id, 1);
    assert_eq!(second.command_with(command(ARM, 1.0, 4242.0)), NOT_NOW);
    // The first one has been silent since; after 5 s the second is alone.
    report(&mut second, |uplink| uplink.same_id == 0);
    assert_eq!(second.command_with(command(ARM, 1.0, 4242.0)), ACCEPTED);
    assert_eq!(first.command(ABORT, 1.0), ACCEPTED);
    vehicle.signal(Signal::SIGTERM);
    vehicle.wait();
}
