//! The countdown and its uplink, between the real vehicle and a bare ground station through air that loses.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use e2e::{Air, BareGround, Program, Running, Signal, Weather, program};
use protocol::dialect::{
    MavCmd, MavMessage, TD_FLIGHT_STATUS_DATA, TD_UPLINK_DATA, TdHold, TdInterlock, TdPhase,
};

const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
const START: MavCmd = MavCmd::MAV_CMD_MISSION_START;
const ACCEPTED: u8 = 0;

/// A vehicle on its pad with its countdown running, and what lies between it and its ground.
struct Countdown {
    air: Air,
    ground: BareGround,
    vehicle: Running,
    _folder: tempfile::TempDir,
}

impl Countdown {
    fn of(profile: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let air = Air::new();
        let mut ground = BareGround::through(&air);
        let mut command = program(Program::OnboardSim);
        command
            .args(["fly", "--profile", profile, "--stay", "--mavlink", &air.vehicle_link()])
            .args(["--log", "flight.mcap"])
            .current_dir(folder.path());
        let vehicle = Running::start(&mut command);
        wait_for_status(&mut ground, "every check passed", |status| {
            status.phase == TdPhase::TD_PHASE_PAD_IDLE && status.checks_failed.is_empty()
        });
        assert_eq!(ground.command(ARM, 1.0), ACCEPTED);
        assert_eq!(ground.command(START, 0.0), ACCEPTED);
        wait_for_status(&mut ground, "a countdown", |status| status.countdown_ms != i32::MAX);
        Self { air, ground, vehicle, _folder: folder }
    }

    fn end(self) -> String {
        self.vehicle.signal(Signal::SIGTERM);
        self.vehicle.wait().output
    }
}

fn wait_for_status(
    ground: &mut BareGround,
    what: &str,
    wanted: impl Fn(&TD_FLIGHT_STATUS_DATA) -> bool,
) -> TD_FLIGHT_STATUS_DATA {
    ground.wait_for(what, |_, message| match message {
        Some(MavMessage::TD_FLIGHT_STATUS(status)) if wanted(status) => Some(status.clone()),
        _ => None,
    })
}

fn wait_for_uplink(ground: &mut BareGround, wanted: impl Fn(&TD_UPLINK_DATA) -> bool) -> TD_UPLINK_DATA {
    ground.wait_for("TD_UPLINK", |_, message| match message {
        Some(MavMessage::TD_UPLINK(uplink)) if wanted(uplink) => Some(uplink.clone()),
        _ => None,
    })
}

/// Down everything arrives, up nothing: the vehicle holds and says so, and goes on only when it is started anew.
#[test]
fn a_silenced_uplink_alone_holds_the_countdown() {
    for profile in ["paper-calibrated", "mk2"] {
        let mut flight = Countdown::of(profile);
        let heard = wait_for_uplink(&mut flight.ground, |_| true);
        assert_eq!((heard.target_system, heard.target_component, heard.commands), (255, 190, 1));
        assert!(heard.accepted_age_ms < 1_000, "{heard:?}");
        flight.air.set(Weather { uplink_silent: true, ..Weather::default() });
        let held =
            wait_for_status(&mut flight.ground, "a hold", |status| status.hold != TdHold::TD_HOLD_NONE);
        assert_eq!((held.hold, held.phase), (TdHold::TD_HOLD_UPLINK_SILENT, TdPhase::TD_PHASE_PAD_ARMED));
        assert_eq!(held.countdown_ms, i32::MAX);
        assert!(held.interlocks.contains(TdInterlock::TD_INTERLOCK_ARMED));
        let silent = wait_for_uplink(&mut flight.ground, |uplink| uplink.accepted_age_ms > 3_000);
        assert_eq!(silent.target_system, 255);

        // Heard again, longer than the countdown was: it is still held.
        flight.air.set(Weather::default());
        let later = wait_for_status(&mut flight.ground, "some seconds more", |status| {
            assert_eq!((status.phase, status.countdown_ms), (TdPhase::TD_PHASE_PAD_ARMED, i32::MAX));
            status.time_boot_ms > held.time_boot_ms + 7_000
        });
        assert_eq!(later.hold, TdHold::TD_HOLD_UPLINK_SILENT);
        assert_eq!(flight.ground.command(START, 0.0), ACCEPTED);
        wait_for_status(&mut flight.ground, "a release", |status| {
            status.phase as u32 > TdPhase::TD_PHASE_PAD_ARMED as u32
        });
        let output = flight.end();
        for words in ["nothing heard of 255/190 for 2 s", "HOLD: no countdown"] {
            assert_eq!(output.matches(words).count(), 1, "{words}: {output}");
        }
    }
}

/// A bounded number of real countdowns; how seldom chance holds one is computed where the stations are remembered.
#[test]
fn through_air_that_loses_half_a_countdown_is_not_held() {
    for _ in 0..3 {
        let mut flight = Countdown::of("paper-calibrated");
        flight.air.set(Weather { lost: 500, ..Weather::default() });
        let released = wait_for_status(&mut flight.ground, "a release", |status| {
            assert_eq!(status.hold, TdHold::TD_HOLD_NONE);
            status.phase as u32 > TdPhase::TD_PHASE_PAD_ARMED as u32
        });
        assert!(released.interlocks.contains(TdInterlock::TD_INTERLOCK_ARMED), "{released:?}");
        let output = flight.end();
        assert!(!output.contains("HOLD"), "{output}");
    }
}
