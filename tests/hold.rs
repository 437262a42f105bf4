//! The countdown holds when the uplink fails: the real vehicle and a test's ground station, joined
//! by a lossy proxy.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use e2e::{ACCEPTED, ARM, BareGround, Impairment, Running, START, Signal, UdpProxy, vehicle};
use protocol::dialect::{MavMessage, TD_UPLINK_DATA, TdHold, TdInterlock, TdPhase};

/// A vehicle with a running countdown, its ground station and the proxy between them.
struct Countdown {
    proxy: UdpProxy,
    ground: BareGround,
    vehicle: Running,
    _folder: tempfile::TempDir,
}

impl Countdown {
    fn of(profile: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let proxy = UdpProxy::new();
        let mut ground = BareGround::through(&proxy);
        let mut command = vehicle(folder.path(), &[&proxy.vehicle_link()]);
        let vehicle = Running::start(command.args(["--stay", "--mission", profile]));
        ground.wait_until_ready();
        assert_eq!(ground.command(ARM, 1.0), ACCEPTED);
        assert_eq!(ground.command(START, 0.0), ACCEPTED);
        ground.wait_for_status("a countdown", |status| status.countdown_ms != i32::MAX);
        Self { proxy, ground, vehicle, _folder: folder }
    }

    fn end(self) -> String {
        self.vehicle.signal(Signal::SIGTERM);
        self.vehicle.wait().output
    }
}

fn wait_for_uplink(ground: &mut BareGround, wanted: impl Fn(&TD_UPLINK_DATA) -> bool) -> TD_UPLINK_DATA {
    ground.wait_for("TD_UPLINK", |_, message| match message {
        Some(MavMessage::TD_UPLINK(uplink)) if wanted(uplink) => Some(uplink.clone()),
        _ => None,
    })
}

/// Nothing arrives on the uplink while the downlink works: the vehicle holds and reports it, and
/// continues only after a new start command.
#[test]
fn a_silent_uplink_holds_the_countdown() {
    // The last one hangs below a drone.
    for profile in ["mk2", "vlr"] {
        let mut flight = Countdown::of(profile);
        let uplink = wait_for_uplink(&mut flight.ground, |_| true);
        assert_eq!((uplink.target_system, uplink.target_component, uplink.commands), (255, 190, 1));
        assert!(uplink.accepted_age_ms < 1_000, "{uplink:?}");
        flight.proxy.impair(Impairment { drops_uplink: true, ..Impairment::default() });
        let held = flight.ground.wait_for_status("a hold", |status| status.hold != TdHold::TD_HOLD_NONE);
        assert_eq!((held.hold, held.phase), (TdHold::TD_HOLD_UPLINK_SILENT, TdPhase::TD_PHASE_PAD_ARMED));
        assert_eq!(held.countdown_ms, i32::MAX);
        assert!(held.interlocks.contains(TdInterlock::TD_INTERLOCK_ARMED));
        let silent = wait_for_uplink(&mut flight.ground, |uplink| uplink.accepted_age_ms > 3_000);
        assert_eq!(silent.target_system, 255);

        // The vehicle receives the ground again for longer than the countdown, and still holds.
        flight.proxy.impair(Impairment::default());
        let later = flight.ground.wait_for_status("some seconds more", |status| {
            assert_eq!((status.phase, status.countdown_ms), (TdPhase::TD_PHASE_PAD_ARMED, i32::MAX));
            status.time_boot_ms > held.time_boot_ms + 12_000
        });
        assert_eq!(later.hold, TdHold::TD_HOLD_UPLINK_SILENT);
        assert_eq!(flight.ground.command(START, 0.0), ACCEPTED);
        flight
            .ground
            .wait_for_status("a release", |status| status.phase as u32 > TdPhase::TD_PHASE_PAD_ARMED as u32);
        let output = flight.end();
        for words in ["nothing received from 255/190 for 1 s", "HOLD: no countdown"] {
            assert_eq!(output.matches(words).count(), 1, "{words}: {output}");
        }
    }
}

/// These are a few real countdowns. The probability of a hold by chance is computed in the tests of
/// the vehicle's stations.
#[test]
fn a_countdown_continues_when_a_quarter_of_the_datagrams_is_lost() {
    for _ in 0..3 {
        let mut flight = Countdown::of("mk2");
        flight.proxy.impair(Impairment { lost_per_1000: 250, ..Impairment::default() });
        let released = flight.ground.wait_for_status("a release", |status| {
            assert_eq!(status.hold, TdHold::TD_HOLD_NONE);
            status.phase as u32 > TdPhase::TD_PHASE_PAD_ARMED as u32
        });
        assert!(released.interlocks.contains(TdInterlock::TD_INTERLOCK_ARMED), "{released:?}");
        let output = flight.end();
        assert!(!output.contains("HOLD"), "{output}");
    }
}
