//! The landing paper's planar vehicle: a rig that holds it until its release, and a landing from there.
//!
//! A sample is several frames. On a sample, in this order: the actuators get the commands decided one sample earlier,
//! the phases change, the controller runs, the ignition gate is checked. The motor is measured in every frame.

use alloc::boxed::Box;
use alloc::format;
use alloc::vec::Vec;
use core::f64::consts::FRAC_PI_2;

use super::Input;
use super::news::Severity;
use super::pad::Stance;
use super::table::PhaseTable;
use crate::computer::memory::remembers;
use crate::estimation::thrust_estimate::{ThrustEstimate, ThrustSample};
use crate::guidance::controller::{
    self, ControlLevel, ControllerConfig, ControllerInput, ControllerOutput, ControllerState,
};
use crate::guidance::vertical::fall_ends_m_s;
use crate::rules::arming;
use crate::rules::check::Check;
use crate::rules::gate::{GateInput, gate_checks};
use crate::rules::phase::{Effect, Event, Motor, NO_THRUST_TIMEOUT_S, Phase};
use crate::rules::verdict::TouchdownLimits;
use crate::vehicle::dynamics::PlanarState;
use crate::vehicle::profile::{Profile, StartPoint};

/// Frames are at least this long, ms.
const FRAME_MIN_MS: u64 = 20;
/// The landing is rehearsed this often while the vehicle waits on the pad, s.
const REHEARSAL_PERIOD_S: f64 = 1.0;
/// Thrust is confirmed once it has been measured for this long, s: a single spike is not a burning motor.
const THRUST_CONFIRM_S: f64 = 0.04;

/// Why a profile cannot be flown.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlaneError {
    #[error("profile {profile}: start.at = {at:?} is not simulated; only \"ignition\" is")]
    Start { profile: alloc::string::String, at: StartPoint },
    #[error(
        "profile {profile}: nmpc.sample_time_s = {sample_time_s}: must be a whole number of milliseconds"
    )]
    SampleTime { profile: alloc::string::String, sample_time_s: f64 },
}

/// The measurements of perfect sensors on the planar vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneSensed {
    pub state: PlanarState,
    /// Specific force along the nose axis, m/s^2.
    pub axial_specific_force_m_s2: f64,
    /// Where the gimbal is, rad.
    pub gimbal_rad: f64,
    /// Reading of a load cell under the motor, N.
    pub thrust_n: f64,
    /// The thrust is too small to lift the vehicle.
    pub thrust_below_weight: bool,
}

/// One tick of the landing controller: input, output and digest.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanarTick {
    pub input: ControllerInput,
    pub output: ControllerOutput,
    /// Digest of the controller's memory afterwards.
    pub state_digest: u64,
}

/// Which law flies the planar landing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PlanarLaw {
    /// The landing controller, with its plans.
    #[default]
    Nmpc,
    /// The upright law alone. It plans no landing, so the ignition gate has no plan to judge.
    Upright,
}

/// A moment of a recorded landing to go on from.
#[derive(Debug, Clone)]
pub struct Moment {
    /// The controller's memory at that moment.
    pub controller: ControllerState,
    /// The input of the tick at that moment, in LAND_ARMED, IGNITION or POWERED.
    pub input: ControllerInput,
    /// The fin commands at that moment, rad.
    pub fins_told_rad: [f64; 4],
}

/// The planar vehicle's part of the flight computer.
#[derive(Debug, Clone)]
pub struct Plane {
    profile: Profile,
    limits: TouchdownLimits,
    controller: ControllerState,
    frame_ms: u64,
    frames_per_sample: u64,
    tick: u64,
    ignition_sample: Option<u64>,
    output: Option<ControllerOutput>,
    thrust: ThrustEstimate,
    /// Time since when thrust has been measured without a break, s.
    thrust_felt_since_s: Option<f64>,
    /// The gate check that the crew was last told of.
    gate_complaint: Option<&'static str>,
    /// The command that the gimbal gets at the next sample, rad.
    next_gimbal_rad: f64,
    fin_command_rad: [f64; 4],
    /// The last output is new: it is not known yet whether it came in time.
    fresh: bool,
    /// The last output that came in time, and the ticks missed since.
    in_time: Option<ControllerOutput>,
    misses: usize,
    /// The state at the release, which cannot be measured in the rig.
    release: PlanarState,
    felt: PlaneSensed,
    pub(super) law: PlanarLaw,
    /// This frame's measurements were already used in the record that this flight continues.
    felt_before: bool,
    /// The last commands to the actuators: gimbal and fins, rad.
    pub(super) told: (f64, [f64; 4]),
}

// Outputs are compared tick by tick, and the measurements came with the input.
remembers!(Plane {
    controller, tick, ignition_sample, thrust, thrust_felt_since_s, gate_complaint, next_gimbal_rad, fin_command_rad, fresh,
    misses, felt_before, told
} but { profile, limits, frame_ms, frames_per_sample, output, in_time, release, felt, law });

impl Plane {
    pub(super) fn new(profile: &Profile, release: PlanarState) -> Result<Self, PlaneError> {
        if profile.start.at != StartPoint::Ignition {
            return Err(PlaneError::Start { profile: profile.name.clone(), at: profile.start.at });
        }
        let sample_time_s = profile.nmpc.sample_time_s;
        let sample_ms = libm::round(sample_time_s / 1e-3);
        if sample_ms < 1.0 || (sample_ms * 1e-3 - sample_time_s).abs() > 1e-9 {
            return Err(PlaneError::SampleTime { profile: profile.name.clone(), sample_time_s });
        }
        let sample_ms = sample_ms as u64;
        let divides = |length: &u64| sample_ms.is_multiple_of(*length);
        let frame_ms = (FRAME_MIN_MS..=sample_ms).find(divides).unwrap_or(sample_ms);
        Ok(Self {
            limits: TouchdownLimits::from_profile(profile),
            controller: ControllerState::new(&ControllerConfig::from_profile(profile)),
            frame_ms,
            frames_per_sample: sample_ms / frame_ms,
            tick: 0,
            ignition_sample: None,
            output: None,
            thrust: ThrustEstimate::default(),
            thrust_felt_since_s: None,
            gate_complaint: None,
            next_gimbal_rad: 0.0,
            fin_command_rad: [profile.fins.closed_rad(); 4],
            fresh: false,
            in_time: None,
            misses: 0,
            release,
            felt: PlaneSensed {
                state: PlanarState {
                    x_m: release.x_m,
                    z_m: release.z_m,
                    theta_rad: FRAC_PI_2,
                    ..PlanarState::default()
                },
                axial_specific_force_m_s2: 0.0,
                gimbal_rad: 0.0,
                thrust_n: 0.0,
                thrust_below_weight: true,
            },
            law: PlanarLaw::Nmpc,
            felt_before: false,
            told: (0.0, [profile.fins.closed_rad(); 4]),
            profile: profile.clone(),
        })
    }

    /// The same vehicle at a moment of a recorded landing.
    pub(super) fn at(self, moment: &Moment) -> Self {
        let Moment { controller, input, fins_told_rad } = moment;
        let sample_s = self.profile.nmpc.sample_time_s;
        let samples = |time_s: f64| libm::round(time_s / sample_s) as u64;
        let lit = input.phase.in_landing_burn();
        let since = samples(input.time_since_ignition_s);
        Self {
            controller: controller.clone(),
            tick: input.tick,
            ignition_sample: lit.then(|| samples(input.time_s).saturating_sub(since)),
            thrust: ThrustEstimate::resumed(input.thrust_scale),
            next_gimbal_rad: input.gimbal_applied_rad,
            fin_command_rad: *fins_told_rad,
            felt_before: true,
            ..self
        }
    }

    /// Number of the frame at a vehicle time, s.
    pub(super) fn frame_at(&self, time_s: f64) -> u64 {
        libm::round(time_s / self.profile.nmpc.sample_time_s) as u64 * self.frames_per_sample
    }

    /// Gives the landing controller another profile; its memory stays.
    pub(super) fn reconfigure(&mut self, profile: &Profile) {
        self.controller = self.controller.reconfigured(&ControllerConfig::from_profile(profile));
    }

    /// The profile it flies.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    pub fn limits(&self) -> &TouchdownLimits {
        &self.limits
    }

    pub fn frame_ms(&self) -> u64 {
        self.frame_ms
    }

    pub fn frame_s(&self) -> f64 {
        self.profile.nmpc.sample_time_s / self.frames_per_sample as f64
    }

    /// The controller's last output.
    pub fn output(&self) -> Option<&ControllerOutput> {
        self.output.as_ref()
    }

    /// Estimated thrust over nominal thrust.
    pub fn thrust_scale(&self) -> f64 {
        self.thrust.scale()
    }

    /// When the landing motor was commanded to light, s.
    pub fn ignited_at_s(&self) -> Option<f64> {
        self.ignition_sample.map(|sample| sample as f64 * self.profile.nmpc.sample_time_s)
    }

    /// The last measurements.
    pub fn felt(&self) -> &PlaneSensed {
        &self.felt
    }

    pub(super) fn is_on_sample(&self, frame: u64) -> bool {
        frame.is_multiple_of(self.frames_per_sample)
    }

    /// Attitude and motion in the rig. The estimate is the truth here.
    pub(super) fn stance(&self) -> Stance {
        let state = &self.felt.state;
        Stance {
            tilt_rad: state.theta_rad - FRAC_PI_2,
            rotation_rad_s: state.q_rad_s,
            speed_m_s: state.speed_m_s(),
            settled: true,
            hanging_m: None,
        }
    }

    /// Whether the rehearsal converged, and its result in words.
    pub(super) fn rehearsal(&self) -> (bool, alloc::string::String) {
        let solver = self.output.as_ref().map(|output| output.solver);
        let words = solver.map_or_else(|| "no rehearsal yet".into(), |solver| solver.summary());
        (solver.is_some_and(|solver| solver.converged()), words)
    }

    /// The verdict on the end of the rehearsed landing.
    pub(super) fn predicted_landing(&self) -> Option<crate::rules::verdict::LandingVerdict> {
        let rehearsed = self.output.as_ref().filter(|output| output.level == ControlLevel::Rehearsal)?;
        (rehearsed.plan.len > 0).then(|| {
            crate::rules::verdict::LandingVerdict::judge_plan(
                &self.limits,
                &rehearsed.predicted_touchdown.state,
            )
        })
    }

    /// Whether the controller plans a landing, or has not tried yet.
    pub(super) fn plans_a_landing(&self) -> bool {
        self.output.as_ref().is_none_or(|output| output.level != ControlLevel::Stabiliser)
    }

    /// Speed at the ground after a fall from here without thrust, m/s, falling positive.
    pub(super) fn impact_m_s(&self) -> f64 {
        let state = &self.felt.state;
        let params = self.profile.planar_params();
        let terminal_m_s = libm::sqrt(params.gravity_m_s2 / params.drag_per_m);
        fall_ends_m_s(state.z_m, state.ground_velocity_m_s().1, terminal_m_s, params.gravity_m_s2)
    }

    /// This vehicle carries no parachute: no height is above its commit height.
    pub(super) fn abort_event(&self, table: &PhaseTable, igniter_continuity: bool) -> Event {
        let gate_open =
            table.mode().phase.in_descent() && arming::all_passed(&self.gate_checks(igniter_continuity));
        Event::AbortRequested { above_commit_height: false, gate_open }
    }

    /// Carries out the effects of an event on the actuators.
    pub(super) fn carry_out(&mut self, effects: crate::rules::phase::Effects, frame: u64) {
        if effects.contains(Effect::IgniteLandingMotor) {
            self.ignition_sample = Some(frame.div_ceil(self.frames_per_sample));
        }
        if effects.contains(Effect::FinsOpen) {
            self.fin_command_rad = [self.profile.fins.deployed_rad(); 4];
        }
    }

    fn happen(
        &mut self,
        table: &mut PhaseTable,
        event: Event,
        frame: u64,
    ) -> Result<(), crate::rules::phase::Refusal> {
        let effects = table.happen(event)?;
        self.carry_out(effects, frame);
        Ok(())
    }

    /// Evaluates the measurements of every frame: whether the motor burns, its thrust, and contact with the ground.
    pub(super) fn feel(&mut self, table: &mut PhaseTable, sensed: &PlaneSensed, input: &Input<'_>) {
        self.felt = *sensed;
        if core::mem::take(&mut self.felt_before) {
            return;
        }
        let time_s = table.time_s();
        let mode = *table.mode();
        self.weigh_the_motor(mode.phase, input, time_s);
        let confirmed = self.thrust_is_confirmed(mode.phase, input.contact, time_s);
        let in_phase_s = time_s - mode.entered_at_s;
        let event = match mode.phase {
            Phase::Ignition if confirmed => Some(Event::ThrustConfirmed),
            Phase::Ignition if in_phase_s >= NO_THRUST_TIMEOUT_S && !mode.interlocks.no_light_latched => {
                Some(Event::NoThrustTimeout)
            }
            Phase::Powered | Phase::Touchdown if mode.motor == Motor::Burning && sensed.thrust_n <= 0.0 => {
                Some(Event::Burnout)
            }
            _ => None,
        };
        // The table refuses an event that does not fit the phase; nothing changes then.
        let _ = event.map(|event| self.happen(table, event, input.frame));
        let phase = table.mode().phase;
        let airborne = !phase.on_pad() && !matches!(phase, Phase::Touchdown | Phase::Safed);
        if airborne && input.contact {
            let thrust_below_weight = sensed.thrust_below_weight;
            let _ = self.happen(table, Event::Contact { thrust_below_weight }, input.frame);
        }
    }

    /// Whether the accelerometer has measured at least half the nominal thrust for long enough since ignition.
    fn thrust_is_confirmed(&mut self, phase: Phase, contact: bool, time_s: f64) -> bool {
        let half_m_s2 = 0.5 * self.profile.motor.thrust_n / self.profile.vehicle.mass_kg;
        let lit = phase == Phase::Ignition && !contact;
        if !lit || self.felt.axial_specific_force_m_s2 < half_m_s2 {
            self.thrust_felt_since_s = None;
            return false;
        }
        time_s - *self.thrust_felt_since_s.get_or_insert(time_s) >= THRUST_CONFIRM_S
    }

    /// Estimates the motor's thrust, from its confirmation until contact.
    fn weigh_the_motor(&mut self, phase: Phase, input: &Input<'_>, time_s: f64) {
        let Some(ignited_at_s) = self.ignited_at_s().filter(|_| phase == Phase::Powered) else { return };
        let nominal_thrust_n = self.profile.motor.thrust_at_n(time_s - ignited_at_s);
        let sample = ThrustSample {
            axial_specific_force_m_s2: self.felt.axial_specific_force_m_s2,
            state: self.felt.state,
            gimbal_rad: self.felt.gimbal_rad,
            // In contact, the ground pushes too.
            nominal_thrust_n: if input.contact { 0.0 } else { nominal_thrust_n },
            interval_s: self.frame_s(),
        };
        self.thrust.update(&self.profile.planar_params(), &sample);
    }

    /// The part of a sample before the phases: the actuators get the commands decided one sample earlier. If those came
    /// too late, they get the commands that the last timely plan holds for the present time.
    pub(super) fn apply(&mut self, late: bool) {
        if core::mem::take(&mut self.fresh) {
            if late {
                self.misses += 1;
                let in_time = self.in_time.as_ref();
                self.next_gimbal_rad =
                    in_time.map_or(0.0, |before| before.command_after_misses_rad(self.misses));
            } else {
                self.misses = 0;
                self.in_time.clone_from(&self.output);
            }
        }
        self.told = (self.next_gimbal_rad, self.fin_command_rad);
    }

    /// The rig releases the vehicle.
    pub(super) fn release(&mut self) {
        self.felt.state = self.release;
    }

    /// Every sample in flight; on the pad every sample until the first rehearsal, then once a rehearsal period.
    pub(super) fn controller_is_due(&self, phase: Phase, frame: u64) -> bool {
        let between = libm::round(REHEARSAL_PERIOD_S / self.profile.nmpc.sample_time_s).max(1.0) as u64;
        if !phase.on_pad() {
            return true;
        }
        let rehearsed = self.output.as_ref().is_some_and(|output| output.level == ControlLevel::Rehearsal);
        (frame / self.frames_per_sample).is_multiple_of(between) || (phase != Phase::Safe && !rehearsed)
    }

    pub(super) fn run_controller(&mut self, table: &mut PhaseTable, input: &Input<'_>) -> Box<PlanarTick> {
        let sample_s = self.profile.nmpc.sample_time_s;
        let sample = input.frame / self.frames_per_sample;
        let mode = *table.mode();
        let input = ControllerInput {
            tick: self.tick,
            time_s: table.time_s(),
            phase: mode.phase,
            time_since_ignition_s: self
                .ignition_sample
                .map_or(0.0, |ignition| (sample - ignition) as f64 * sample_s),
            state: self.felt.state,
            gimbal_applied_rad: self.told.0,
            thrust_scale: self.thrust.scale(),
            degraded: self.law == PlanarLaw::Upright,
            lands_here: mode.interlocks.lands_here,
            deadline_missed: self.misses > 0,
        };
        let output = controller::step(&mut self.controller, &input);
        let level_before = self.output.as_ref().map(|output| output.level);
        if mode.phase.in_landing_burn() && level_before != Some(output.level) {
            table.say(Severity::Notice, format!("controller level {}", output.level.name()));
        }
        self.fresh = true;
        self.next_gimbal_rad = output.gimbal_command_rad;
        if !mode.phase.on_pad() {
            self.fin_command_rad = output.fin_command_rad;
        }
        self.tick += 1;
        self.output = Some(output.clone());
        Box::new(PlanarTick { input, output, state_digest: self.controller.digest() })
    }

    pub(super) fn consider_ignition(&mut self, table: &mut PhaseTable, input: &Input<'_>) {
        let checks = self.gate_checks(input.igniter_continuity);
        let failing = checks.iter().find(|check| !check.passed && self.law == PlanarLaw::Nmpc);
        let open = failing.is_none();
        // Told only when the reason changes, not ten times a second over a radio.
        let complaint = failing.map(|check| check.name);
        let news = complaint != self.gate_complaint;
        if news && let Some(reason) = failing.and_then(Check::refusal) {
            table.say_gate_shut(&reason);
        }
        if let Err(refusal) = self.happen(table, Event::IgnitionGate { open }, input.frame)
            && news
        {
            table.say(Severity::Critical, format!("no ignition: {}", refusal.reason()));
        }
        self.gate_complaint = complaint;
    }

    /// The ignition gate's checks with the present values.
    fn gate_checks(&self, igniter_continuity: bool) -> Vec<Check> {
        let state = &self.felt.state;
        let predicted = self.output.as_ref();
        let input = GateInput {
            tilt_rad: state.theta_rad - FRAC_PI_2,
            vertical_speed_m_s: state.ground_velocity_m_s().1,
            pitch_rate_rad_s: state.q_rad_s,
            speed_m_s: state.speed_m_s(),
            predicted_speed_m_s: self.profile.start.planar_state().speed_m_s(),
            // One height source: the truth.
            height_disagreement_m: 0.0,
            landing_feasible: predicted.is_some_and(|output| output.solver.landing_feasible),
            predicted_touchdown_x_m: predicted
                .map_or(f64::NAN, |output| output.predicted_touchdown.state.x_m),
            // This vehicle is released at ignition and its fins open with the release; confirming them belongs to the
            // descent.
            fins_confirmed: true,
            parachute_stowed: true,
            igniter_continuity,
            estimator_healthy: state.is_finite(),
        };
        gate_checks(&self.profile.gate, &input)
    }
}
