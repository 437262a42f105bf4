//! The controller of the planar landing.

use std::collections::BTreeMap;

use flight::guidance::controller::{
    ControlLevel, ControllerConfig, ControllerInput, ControllerOutput, ControllerState, step,
};
use flight::rules::verdict::{LandingVerdict, TouchdownLimits};
use flight::vehicle::dynamics::PlanarState;
use flight::vehicle::profile::Profile;
use prost_reflect::MessageDescriptor;
use protocol::log::v1;
use tick_log::{TickLogError, input_from_log, state_from_log, tick_to_log};

use super::{Decided, Decides, Moment, Replayed, phase_name, settings_in_flight};
use crate::log::tick_descriptor;
use crate::settings::{Schedule, SettingError};

/// A controller that is run on the ticks of a log; ticks must come in order, from the first tick on.
#[derive(Debug, Clone)]
pub struct LoggedController {
    state: ControllerState,
    schedule: Option<Schedule<Profile>>,
    limits: TouchdownLimits,
}

impl LoggedController {
    /// The controller of a profile before its first tick.
    pub fn new(profile: &Profile) -> Self {
        Self {
            state: ControllerState::new(&ControllerConfig::from_profile(profile)),
            schedule: None,
            limits: TouchdownLimits::from_profile(profile),
        }
    }

    /// A controller whose settings change in flight, before its first tick.
    pub fn scheduled(schedule: &Schedule<Profile>) -> Self {
        Self { schedule: Some(schedule.clone()), ..Self::new(schedule.base()) }
    }

    /// The controller that a log's ticks came from, before its first tick. It is built from the profile and from the
    /// changes of settings in flight that the run facts name.
    ///
    /// # Errors
    /// The run facts name settings that this build does not have.
    pub fn recorded(
        profile: &Profile,
        profile_toml: &str,
        run: &BTreeMap<String, String>,
    ) -> Result<Self, SettingError> {
        let in_flight = settings_in_flight(run)?;
        if in_flight.is_empty() {
            return Ok(Self::new(profile));
        }
        Ok(Self::scheduled(&Schedule::new(profile_toml, &in_flight)?))
    }

    /// The same controller, whose plans are judged by other limits than its own.
    #[must_use]
    pub fn judged_by(self, limits: TouchdownLimits) -> Self {
        Self { limits, ..self }
    }

    /// Runs one tick.
    pub fn step(&mut self, input: &ControllerInput) -> ControllerOutput {
        if let Some(schedule) = &mut self.schedule
            && let Some(profile) = schedule.due(input.time_s)
        {
            self.state = self.state.reconfigured(&ControllerConfig::from_profile(profile));
        }
        step(&mut self.state, input)
    }

    /// The changes of settings still to come; `None` for a controller without a schedule.
    pub(crate) fn schedule(&self) -> Option<Schedule<Profile>> {
        self.schedule.clone()
    }

    /// The controller's memory.
    pub fn state(&self) -> &ControllerState {
        &self.state
    }
}

impl Replayed for LoggedController {
    type Tick = v1::ControllerTick;
    type Error = TickLogError;

    fn descriptor() -> Option<MessageDescriptor> {
        tick_descriptor()
    }

    fn moment(tick: &v1::ControllerTick) -> Moment {
        let input = &tick.input;
        Moment { tick: input.tick, time_s: input.time_s, phase: phase_name(input.phase) }
    }

    fn apart(a: &v1::ControllerTick, b: &v1::ControllerTick) -> (f64, Option<f64>) {
        let end = |tick: &v1::ControllerTick| {
            let state = &tick.output.predicted_touchdown.state;
            (state.x_m, state.z_m)
        };
        let (then, now) = (end(a), end(b));
        let gimbal_rad = (a.output.gimbal_command_rad - b.output.gimbal_command_rad).abs();
        (gimbal_rad, Some(libm::hypot(then.0 - now.0, then.1 - now.1)))
    }

    fn run_again(&mut self, tick: &v1::ControllerTick) -> Result<v1::ControllerTick, TickLogError> {
        let input = input_from_log(&tick.input)?;
        let output = self.step(&input);
        Ok(tick_to_log(&input, &output, self.state.digest(), tick.solve_time_s, tick.deadline_s))
    }
}

impl Decides for LoggedController {
    fn decided(&self, tick: &v1::ControllerTick) -> Decided {
        let output = &tick.output;
        let level = u8::try_from(output.level).ok().and_then(ControlLevel::from_index);
        let planned = !matches!(level, None | Some(ControlLevel::Idle));
        let end: PlanarState = state_from_log(&output.predicted_touchdown.state);
        Decided {
            gimbal_rad: vec![output.gimbal_command_rad],
            fins_rad: output.fin_command_rad.clone(),
            phase: phase_name(tick.input.phase),
            level: level.map_or("unknown", ControlLevel::name),
            cost: output.solver.cost,
            iterations: output.solver.iterations,
            plan_lands: planned.then(|| LandingVerdict::judge_plan(&self.limits, &end).landed()),
        }
    }
}
