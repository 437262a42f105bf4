//! Starts of a flight computer: at power-up, at its release, and at a moment of a recorded landing; and changes of its
//! settings.

use alloc::boxed::Box;

use nalgebra::Vector3;

use super::motor_watch::MotorWatch;
use super::news::Readiness;
use super::pad_check::PadCheck;
use super::pilot::BoosterCommands;
use super::plane::{Moment, PlanarLaw, Plane, PlaneError};
use super::self_test::SelfTest;
use super::space::Space;
use super::table::PhaseTable;
use super::{Commands, Computer, CrewMemory, LogState, Vehicle};
use crate::guidance::baseline::Law;
use crate::guidance::controller::ControlLevel;
use crate::rules::arming::Uplink;
use crate::rules::phase::{Event, Phase};
use crate::vehicle::dynamics::PlanarState;
use crate::vehicle::mission::Mission;
use crate::vehicle::profile::{ArmingLimits, Profile, StartPoint};
use crate::vehicle::rigid::RigidState;

impl Computer {
    /// The computer of a rocket at power-up. `believed` is its estimate of the state at the start of the flight; one that
    /// stands on its rail finds its attitude there by itself.
    pub fn in_space(mission: &Mission, law: Law, believed: &RigidState) -> Self {
        let space = Space::new(mission, law, believed);
        let closed_rad = mission.airframe.fins.closed_rad();
        let arming = match (mission.start.at, &mission.drop) {
            (StartPoint::Drone, Some(drop)) => ArmingLimits {
                tilt_max_deg: drop.tilt_max_deg,
                rotation_max_deg_s: drop.rotation_max_deg_s,
                speed_max_m_s: drop.speed_max_m_s,
                ..mission.arming
            },
            _ => mission.arming,
        };
        let countdown_s = mission.start.countdown_s;
        Self::new(Vehicle::Space(Box::new(space)), arming, countdown_s, closed_rad)
    }

    /// The same computer after it has found its state and the bias of its gyro, body, rad/s, on its rail.
    #[must_use]
    pub fn standing(mut self, believed: &RigidState, gyro_bias_rad_s: Vector3<f64>) -> Self {
        if let Vehicle::Space(space) = &mut self.vehicle {
            space.pilot.stand(believed, gyro_bias_rad_s);
        }
        self
    }

    /// The computer of the planar vehicle at power-up in its rig, which releases it in the state `release`.
    ///
    /// # Errors
    /// The profile asks for something that this computer does not support.
    pub fn in_plane(profile: &Profile, release: PlanarState) -> Result<Self, PlaneError> {
        let plane = Plane::new(profile, release)?;
        let (arming, countdown_s) = (profile.arming, profile.start.countdown_s);
        Ok(Self::new(Vehicle::Plane(Box::new(plane)), arming, countdown_s, profile.fins.closed_rad()))
    }

    /// The computer of the planar vehicle at a moment of a recorded landing, to continue from there.
    ///
    /// # Errors
    /// The profile asks for something that this computer does not support.
    pub fn at_moment(profile: &Profile, moment: &Moment, law: PlanarLaw) -> Result<Self, PlaneError> {
        let computer = Self::in_plane(profile, moment.input.state)?;
        let mut computer = computer.released();
        let Vehicle::Plane(plane) = &mut computer.vehicle else { return Ok(computer) };
        **plane = plane.clone().at(moment);
        plane.law = law;
        computer.frame = plane.frame_at(moment.input.time_s);
        // Through the phase table, as in the recorded flight.
        let (table, input) = (&mut computer.table, &moment.input);
        if let Some(ignited_at_s) = plane.ignited_at_s() {
            table.begin(ignited_at_s);
            let _ = table.happen(Event::IgnitionGate { open: true });
        }
        table.begin(input.time_s);
        if input.phase == Phase::Powered {
            let _ = table.happen(Event::ThrustConfirmed);
        }
        if input.lands_here {
            let _ = table.happen(Event::AbortRequested { above_commit_height: false, gate_open: false });
        }
        table.take_news();
        Ok(computer)
    }

    fn new(vehicle: Vehicle, arming: ArmingLimits, countdown_s: f64, closed_rad: f64) -> Self {
        Self {
            table: PhaseTable::new(0.0),
            vehicle,
            frame: 0,
            arming,
            countdown_s,
            commands: Commands {
                gimbal_rad: [0.0; 2],
                fins_rad: [closed_rad; 4],
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
        if let Vehicle::Space(space) = &mut self.vehicle {
            space.pilot = space.pilot.reconfigured(mission);
        }
    }

    /// Gives the planar vehicle's landing controller another profile; its memory stays.
    pub fn reconfigure_controller(&mut self, profile: &Profile) {
        if let Vehicle::Plane(plane) = &mut self.vehicle {
            plane.reconfigure(profile);
        }
    }

    /// Changes the law for the landing burn from now on.
    pub fn set_law(&mut self, law: Law) {
        if let Vehicle::Space(space) = &mut self.vehicle {
            space.law = law.clone();
            space.pilot.set_law(law);
        }
    }
}
