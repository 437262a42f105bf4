//! Starts of a flight computer: at power-up and at its release; and changes of its settings.

use alloc::boxed::Box;

use nalgebra::Vector3;

use super::motor_watch::MotorWatch;
use super::news::Readiness;
use super::pad::PadWatch;
use super::pad_check::PadCheck;
use super::pilot::{BoosterCommands, Pilot};
use super::self_test::SelfTest;
use super::table::PhaseTable;
use super::{Commands, Computer, CrewMemory, LogState};
use crate::estimation::estimator::StartUncertainty;
use crate::guidance::baseline::Law;
use crate::guidance::powered::ControlLevel;
use crate::rules::arming::Uplink;
use crate::rules::phase::Event;
use crate::vehicle::mission::Mission;
use crate::vehicle::mission::{ArmingLimits, StartPoint};
use crate::vehicle::rigid::RigidState;

impl Computer {
    /// The computer at power-up. `believed` is its estimate of the state at the start of the flight; one that
    /// stands on its rail finds its attitude there by itself.
    pub fn at_power_up(mission: &Mission, law: Law, believed: &RigidState) -> Self {
        let arming = match (mission.start.at, &mission.drop) {
            (StartPoint::Drone, Some(drop)) => ArmingLimits {
                tilt_max_deg: drop.tilt_max_deg,
                rotation_max_deg_s: drop.rotation_max_deg_s,
                speed_max_m_s: drop.speed_max_m_s,
                ..mission.arming
            },
            _ => mission.arming,
        };
        let mut pilot =
            Pilot::starting(mission, 0.0, believed, &StartUncertainty::at_start(mission.start.at));
        pilot.set_law(law.clone());
        Self {
            table: PhaseTable::new(0.0),
            pad: PadWatch::default(),
            pilot: Box::new(pilot),
            law,
            believed: *believed,
            flown: None,
            gate_told: None,
            frame: 0,
            arming,
            countdown_s: mission.start.countdown_s,
            commands: Commands {
                gimbal_rad: [0.0; 2],
                fins_rad: [mission.airframe.fins.closed_rad(); 4],
                ignite: false,
                parachute: false,
                booster: BoosterCommands::default(),
            },
            self_test: SelfTest::NotBegun,
            readiness: Readiness::default(),
            rehearsed: None,
            motor_watch: MotorWatch::default(),
            log: LogState::NONE,
            uplink: Uplink::NeverHeard,
            commander: None,
            people: None,
            crew: CrewMemory::default(),
            fins_answering: [false; 4],
            igniter_continuity: false,
            booster_attached: false,
            battery_v: None,
            pad_check: PadCheck::default(),
            release: None,
            level: ControlLevel::Idle,
        }
    }

    /// The same computer after it has found its state and the bias of its gyro, body, rad/s, on its rail.
    #[must_use]
    pub fn standing(mut self, believed: &RigidState, gyro_bias_rad_s: Vector3<f64>) -> Self {
        self.pilot.stand(believed, gyro_bias_rad_s);
        self
    }

    /// The same computer, released at the start of its clock, for flights that begin without a pad.
    #[must_use]
    pub fn released(mut self) -> Self {
        for event in [
            Event::SelfTestPassed,
            Event::PinPulled,
            Event::ArmRequested { checks_passed: true },
            Event::StartRequested { countdown_s: 0.0 },
        ] {
            // The table accepts these events in this order; a test checks that.
            let _ = self.table.happen(event);
        }
        self.let_go();
        self.table.take_news();
        self.motor_watch.news(self.table.mode(), 0.0);
        self.log = LogState { running: true, space_bytes: u64::MAX };
        self
    }

    /// Changes the mission from now on; the memory stays.
    pub fn reconfigure(&mut self, mission: &Mission) {
        *self.pilot = self.pilot.reconfigured(mission);
    }

    /// Changes the law for the landing burn from now on.
    pub fn set_law(&mut self, law: Law) {
        self.law = law.clone();
        self.pilot.set_law(law);
    }
}
