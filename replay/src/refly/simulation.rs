//! The simulated plant and the controller, flying on from the start to the ground.
//!
//! The order of a sample is that of the flight computer: actuators, controller, ignition gate, then the plant in
//! steps of a millisecond, with the motor weighed once a frame.

use std::collections::BTreeMap;

use flight::controller::{ControllerInput, ControllerOutput};
use flight::dynamics::PlanarParams;
use flight::gate::{GateInput, all_passed, gate_checks};
use flight::phase::Phase;
use flight::profile::Profile;
use flight::thrust_estimate::{ThrustEstimate, ThrustSample};
use flight::verdict::{LandingVerdict, TouchdownLimits};
use onboard_sim::plant::{Impact, Plant, STEP_S};
use onboard_sim::scatter::Draw;
use onboard_sim::vehicle::{DeadlinePolicy, Vehicle, VehicleError};
use protocol::log::record::Record;
use protocol::log::v1;
use tick_log::{state_to_log, tick_to_log, verdict_to_log};

use super::Law;
use super::start::Start;
use crate::controller::LoggedController;

/// What is not down by then will not come down.
const LONGEST_S: f64 = 60.0;
/// Thrust is believed once it has been sensed for this long, as on board.
const THRUST_CONFIRM_S: f64 = 0.04;

/// One tick, flown again.
#[derive(Debug, Clone, PartialEq)]
pub struct ReflownTick {
    /// Input, output and digest; the measured times are nought.
    pub record: v1::ControllerTick,
}

/// A flight, flown again.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReflownFlight {
    /// The recorded ticks before the start, decided again.
    pub before: Vec<v1::ControllerTick>,
    /// Its ticks.
    pub ticks: Vec<ReflownTick>,
    /// The plant, once a frame.
    pub truth: Vec<v1::PlantTruth>,
    /// Everything of a flight from apogee, with its vehicle times, s.
    pub records: Vec<(f64, Record)>,
    /// What its log says beside what the recorded one says.
    pub run: BTreeMap<String, String>,
    /// The landing verdict; `None` if it did not come down.
    pub verdict: Option<v1::LandingVerdict>,
}

pub(super) struct Simulation<'a> {
    profile: &'a Profile,
    params: PlanarParams,
    plant: Plant,
    controller: LoggedController,
    law: Law,
    degraded: bool,
    lands_here: bool,
    frame_s: f64,
    frames_per_sample: u64,
    sample: u64,
    first_sample: u64,
    tick: u64,
    phase: Phase,
    ignition_sample: Option<u64>,
    thrust: ThrustEstimate,
    thrust_felt_since_s: Option<f64>,
    gimbal_applied_rad: f64,
    next_gimbal_rad: f64,
    fin_command_rad: [f64; 4],
    impacts: Vec<Impact>,
}

impl<'a> Simulation<'a> {
    /// `profile` is what the flight computer believes, `plant_profile` what is true.
    pub(super) fn new(
        profile: &'a Profile,
        plant_profile: &Profile,
        draw: &Draw,
        controller: LoggedController,
        start: &Start,
        law: Law,
    ) -> Result<Self, VehicleError> {
        // The vehicle knows which profiles can be simulated and how its frames fall.
        let frame_s = Vehicle::new(profile, *draw, DeadlinePolicy::Observe)?.frame_s();
        let sample_s = profile.nmpc.sample_time_s;
        let input = &start.input;
        let sample = (input.time_s / sample_s).round() as u64;
        let lit = matches!(input.phase, Phase::Ignition | Phase::Powered);
        let since_samples = (input.time_since_ignition_s / sample_s).round() as u64;
        let ignition_sample = lit.then(|| sample.saturating_sub(since_samples));
        let steps_per_sample = (sample_s / STEP_S).round() as u64;

        let mut plant = Plant::new(plant_profile, draw);
        plant.command(start.gimbal_rad, start.fins_rad);
        // In its rig until the moment of the start, so that its clock and its motor are where they were.
        for step in 0..sample * steps_per_sample {
            if ignition_sample.is_some_and(|ignition| step == ignition * steps_per_sample) {
                plant.ignite();
            }
            plant.step();
        }
        if ignition_sample == Some(sample) {
            plant.ignite();
        }
        plant.release(start.plant);
        Ok(Self {
            profile,
            params: PlanarParams::from_profile(profile),
            plant,
            controller,
            law,
            degraded: input.degraded || law == Law::Stabiliser,
            lands_here: input.lands_here,
            frame_s,
            frames_per_sample: (sample_s / frame_s).round().max(1.0) as u64,
            sample,
            first_sample: sample,
            tick: input.tick,
            phase: input.phase,
            ignition_sample,
            thrust: ThrustEstimate::resumed(input.thrust_scale),
            thrust_felt_since_s: None,
            gimbal_applied_rad: input.gimbal_applied_rad,
            next_gimbal_rad: input.gimbal_applied_rad,
            fin_command_rad: start.fins_commanded_rad.unwrap_or([profile.fins.deployed_rad(); 4]),
            impacts: Vec::new(),
        })
    }

    /// Flies to the ground.
    pub(super) fn fly(&mut self, limits: &TouchdownLimits) -> ReflownFlight {
        let mut flown = ReflownFlight::default();
        let sample_s = self.profile.nmpc.sample_time_s;
        let steps_per_frame = (self.frame_s / STEP_S).round() as u64;
        while ((self.sample - self.first_sample) as f64) * sample_s < LONGEST_S {
            flown.ticks.push(self.run_sample());
            for frame in 0..self.frames_per_sample {
                for _ in 0..steps_per_frame {
                    self.impacts.extend(self.plant.step());
                }
                let time_s = (self.sample * self.frames_per_sample + frame + 1) as f64 * self.frame_s;
                self.look_around(time_s);
                let down = self.plant.in_contact() && self.plant.thrust_below_weight();
                flown.truth.push(self.truth(time_s));
                if down {
                    flown.verdict = self.judge(limits);
                    return flown;
                }
            }
            self.sample += 1;
        }
        flown
    }

    fn run_sample(&mut self) -> ReflownTick {
        let sample_s = self.profile.nmpc.sample_time_s;
        self.gimbal_applied_rad = self.next_gimbal_rad;
        self.plant.command(self.gimbal_applied_rad, self.fin_command_rad);
        let input = ControllerInput {
            tick: self.tick,
            time_s: (self.sample * self.frames_per_sample) as f64 * self.frame_s,
            phase: self.phase,
            time_since_ignition_s: self
                .ignition_sample
                .map_or(0.0, |ignition| self.sample.saturating_sub(ignition) as f64 * sample_s),
            state: self.plant.state(),
            gimbal_applied_rad: self.gimbal_applied_rad,
            thrust_scale: self.thrust.scale(),
            degraded: self.degraded,
            lands_here: self.lands_here,
            deadline_missed: false,
        };
        let output = self.controller.step(&input);
        self.next_gimbal_rad = output.gimbal_command_rad;
        self.fin_command_rad = output.fin_command_rad;
        self.tick += 1;
        if self.phase == Phase::LandArmed && self.gate_is_open(&output) {
            self.phase = Phase::Ignition;
            self.ignition_sample = Some(self.sample);
            self.plant.ignite();
        }
        let digest = self.controller.state().digest();
        ReflownTick { record: tick_to_log(&input, &output, digest, 0.0, sample_s) }
    }

    fn gate_is_open(&self, output: &ControllerOutput) -> bool {
        // The upright law plans no landing for the gate to judge.
        if self.law == Law::Stabiliser {
            return true;
        }
        let state = self.plant.state();
        let input = GateInput {
            tilt_rad: state.theta_rad - core::f64::consts::FRAC_PI_2,
            vertical_speed_m_s: state.ground_velocity_m_s().1,
            pitch_rate_rad_s: state.q_rad_s,
            speed_m_s: state.speed_m_s(),
            predicted_speed_m_s: self.profile.start.planar_state().speed_m_s(),
            height_disagreement_m: 0.0,
            landing_feasible: output.solver.landing_feasible,
            predicted_touchdown_x_m: output.predicted_touchdown.state.x_m,
            fins_confirmed: true,
            parachute_stowed: true,
            igniter_continuity: self.ignition_sample.is_none(),
            estimator_healthy: state.is_finite(),
        };
        all_passed(&gate_checks(&self.profile.gate, &input))
    }

    /// What is sensed once a frame: whether the motor burns, and how strongly.
    fn look_around(&mut self, time_s: f64) {
        let force_m_s2 = self.plant.axial_specific_force_m_s2();
        if let (Phase::Powered, Some(ignition)) = (self.phase, self.ignition_sample) {
            let since_s = time_s - ignition as f64 * self.profile.nmpc.sample_time_s;
            let sample = ThrustSample {
                axial_specific_force_m_s2: force_m_s2,
                state: self.plant.state(),
                gimbal_rad: self.plant.gimbal_rad().1,
                nominal_thrust_n: if self.plant.in_contact() {
                    0.0
                } else {
                    self.profile.motor.thrust_at_n(since_s)
                },
                interval_s: self.frame_s,
            };
            self.thrust.update(&self.params, &sample);
        }
        let half_m_s2 = 0.5 * self.profile.motor.thrust_n / self.profile.vehicle.mass_kg;
        if self.phase != Phase::Ignition || self.plant.in_contact() || force_m_s2 < half_m_s2 {
            self.thrust_felt_since_s = None;
        } else if time_s - *self.thrust_felt_since_s.get_or_insert(time_s) >= THRUST_CONFIRM_S {
            self.phase = Phase::Powered;
        }
    }

    /// A landing is as good as its worst contact.
    fn judge(&self, limits: &TouchdownLimits) -> Option<v1::LandingVerdict> {
        let mut judged =
            self.impacts.iter().map(|impact| (impact, LandingVerdict::judge(limits, &impact.state)));
        let first = judged.next()?;
        let (impact, verdict) =
            if first.1.landed() { judged.find(|(_, later)| !later.landed()).unwrap_or(first) } else { first };
        Some(verdict_to_log(impact.time_s, &impact.state, &verdict))
    }

    fn truth(&self, time_s: f64) -> v1::PlantTruth {
        let (gimbal_commanded_rad, gimbal_actual_rad) = self.plant.gimbal_rad();
        let (fin_commanded_rad, fin_actual_rad) = self.plant.fins_rad();
        let in_contact = self.plant.in_contact();
        let down = in_contact && self.plant.thrust_below_weight();
        let phase = if down { Phase::Touchdown } else { self.phase };
        v1::PlantTruth {
            time_s,
            phase: u32::from(phase.index()),
            state: state_to_log(&self.plant.state()),
            gimbal_commanded_rad,
            gimbal_actual_rad,
            fin_commanded_rad: fin_commanded_rad.to_vec(),
            fin_actual_rad: fin_actual_rad.to_vec(),
            thrust_n: self.plant.thrust_n(),
            mass_kg: self.plant.mass_kg(),
            in_contact,
        }
    }
}
