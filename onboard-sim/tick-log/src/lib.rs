//! Converts flights into log records and back, bit for bit.
//!
//! The flight code does not know the log, and the log does not know the flight code. Programs that write or replay a
//! log use this crate.
//!
//! * [`computer`]: the flight computer's frames from power-up on, of both vehicles.
//! * [`again`]: the flight computer of a log, run again on these frames.
//! * [`pilot`]: the frames of a rocket in space from its release on.
//! * This module: the ticks of the planar vehicle's landing controller, and its plant.
//! * [`sortie`]: a simulated flight of a rocket as records, with the truth.
//!
//! Without the feature `simulated` (the last one, and the plant) the crate needs no operating system.
#![cfg_attr(not(any(test, feature = "simulated")), no_std)]

extern crate alloc;

pub mod again;
pub mod computer;
pub mod pilot;
#[cfg(feature = "simulated")]
mod plant;
#[cfg(feature = "simulated")]
pub mod sortie;

use flight::guidance::controller::{ControllerInput, ControllerOutput, Plan};
use flight::rules::phase::Phase;
use flight::vehicle::dynamics::PlanarState;
use log_records::v1;
#[cfg(feature = "simulated")]
pub use plant::{ending_in_plane, plant_truth, verdict_to_log};

/// Why a recorded tick cannot be given to this build's controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum TickLogError {
    /// The phase's number has no meaning in this build.
    #[error("tick {tick}: phase {phase} is unknown; this build knows 0 to {}", Phase::ALL.len() - 1)]
    UnknownPhase {
        tick: u64,
        /// The number found.
        phase: u32,
    },
}

/// A state as a record.
pub fn state_to_log(state: &PlanarState) -> v1::PlanarState {
    v1::PlanarState {
        x_m: state.x_m,
        z_m: state.z_m,
        theta_rad: state.theta_rad,
        u_m_s: state.u_m_s,
        w_m_s: state.w_m_s,
        q_rad_s: state.q_rad_s,
    }
}

/// A recorded state.
pub fn state_from_log(state: &v1::PlanarState) -> PlanarState {
    PlanarState {
        x_m: state.x_m,
        z_m: state.z_m,
        theta_rad: state.theta_rad,
        u_m_s: state.u_m_s,
        w_m_s: state.w_m_s,
        q_rad_s: state.q_rad_s,
    }
}

/// A tick's input as a record.
pub fn input_to_log(input: &ControllerInput) -> v1::ControllerInput {
    v1::ControllerInput {
        tick: input.tick,
        time_s: input.time_s,
        phase: u32::from(input.phase.index()),
        time_since_ignition_s: input.time_since_ignition_s,
        state: state_to_log(&input.state),
        gimbal_applied_rad: input.gimbal_applied_rad,
        thrust_scale: input.thrust_scale,
        degraded: input.degraded,
        // Absent if false, so that a tick of an earlier flight is written again byte for byte.
        lands_here: input.lands_here.then_some(true),
        deadline_missed: input.deadline_missed,
    }
}

/// A recorded input.
///
/// # Errors
/// This build does not know the phase.
pub fn input_from_log(input: &v1::ControllerInput) -> Result<ControllerInput, TickLogError> {
    let unknown = TickLogError::UnknownPhase { tick: input.tick, phase: input.phase };
    let phase = u8::try_from(input.phase).ok().and_then(Phase::from_index).ok_or(unknown)?;
    Ok(ControllerInput {
        tick: input.tick,
        time_s: input.time_s,
        phase,
        time_since_ignition_s: input.time_since_ignition_s,
        state: state_from_log(&input.state),
        gimbal_applied_rad: input.gimbal_applied_rad,
        thrust_scale: input.thrust_scale,
        degraded: input.degraded,
        // In earlier flights the field is absent: after an abort under thrust they flew upright, as `degraded` says.
        lands_here: input.lands_here.unwrap_or(false),
        deadline_missed: input.deadline_missed,
    })
}

/// A tick's output as a record.
pub fn output_to_log(output: &ControllerOutput) -> v1::ControllerOutput {
    let solver = &output.solver;
    v1::ControllerOutput {
        tick: output.tick,
        gimbal_command_rad: output.gimbal_command_rad,
        fin_command_rad: output.fin_command_rad.to_vec(),
        level: u32::from(output.level.index()),
        solver: v1::SolverReport {
            status: u32::from(solver.status.index()),
            iterations: solver.iterations,
            qp_iterations: solver.qp_iterations,
            cost: solver.cost,
            kkt_stationarity: solver.kkt_stationarity,
            kkt_feasibility: solver.kkt_feasibility,
            landing_feasible: solver.landing_feasible,
            best_touchdown_speed_m_s: solver.best_touchdown_speed_m_s,
        },
        predicted_touchdown: v1::PredictedTouchdown {
            time_from_now_s: output.predicted_touchdown.time_from_now_s,
            state: state_to_log(&output.predicted_touchdown.state),
        },
        plan: plan_to_log(&output.plan),
    }
}

/// A whole tick as a record. `state_digest` is the controller's
/// [digest](flight::guidance::controller::ControllerState::digest) after the tick; the two times are measurements.
pub fn tick_to_log(
    input: &ControllerInput,
    output: &ControllerOutput,
    state_digest: u64,
    solve_time_s: f64,
    deadline_s: f64,
) -> v1::ControllerTick {
    v1::ControllerTick {
        input: input_to_log(input),
        output: output_to_log(output),
        solve_time_s,
        deadline_s,
        state_digest,
    }
}

fn plan_to_log(plan: &Plan) -> v1::Plan {
    v1::Plan {
        states: plan.used_states().iter().map(state_to_log).collect(),
        gimbal_rad: plan.used_gimbal_rad().to_vec(),
        starts_in_s: plan.starts_in_s,
        step_s: plan.step_s,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use prost::Message as _;

    /// Any bit pattern: NaN payloads, both zeros, infinities, subnormals.
    fn any_bits() -> impl Strategy<Value = f64> {
        prop_oneof![any::<u64>().prop_map(f64::from_bits), Just(0.0), Just(-0.0), Just(f64::NAN)]
    }

    fn bits(input: &ControllerInput) -> Vec<u64> {
        let mut bits: Vec<u64> = input.state.to_array().iter().map(|value| value.to_bits()).collect();
        bits.extend([
            input.tick,
            input.time_s.to_bits(),
            u64::from(input.phase.index()),
            input.time_since_ignition_s.to_bits(),
            input.gimbal_applied_rad.to_bits(),
            input.thrust_scale.to_bits(),
            u64::from(input.degraded),
            u64::from(input.lands_here),
            u64::from(input.deadline_missed),
        ]);
        bits
    }

    proptest! {
        #[test]
        fn an_input_survives_the_log_bit_for_bit(
            tick: u64,
            phase in 0..Phase::ALL.len(),
            numbers in prop::array::uniform10(any_bits()),
            [degraded, lands_here, deadline_missed]: [bool; 3],
        ) {
            let [x_m, z_m, theta_rad, u_m_s, w_m_s, q_rad_s, time_s, since, gimbal, scale] = numbers;
            let input = ControllerInput {
                tick,
                time_s,
                phase: Phase::ALL[phase],
                time_since_ignition_s: since,
                state: PlanarState { x_m, z_m, theta_rad, u_m_s, w_m_s, q_rad_s },
                gimbal_applied_rad: gimbal,
                thrust_scale: scale,
                degraded,
                lands_here,
                deadline_missed,
            };
            let bytes = input_to_log(&input).encode_to_vec();
            let read = v1::ControllerInput::decode(bytes.as_slice()).unwrap();
            prop_assert_eq!(bits(&input_from_log(&read).unwrap()), bits(&input));
        }
    }

    /// In earlier releases an abort under thrust flew upright instead of landing on the ground below.
    #[test]
    fn an_input_of_an_earlier_flight_does_not_land_here() {
        let earlier = v1::ControllerInput { degraded: true, ..v1::ControllerInput::default() };
        let read = v1::ControllerInput::decode(earlier.encode_to_vec().as_slice()).unwrap();
        assert_eq!(read.lands_here, None);
        let input = input_from_log(&read).unwrap();
        assert!(input.degraded && !input.lands_here);
        assert_eq!(input_to_log(&input).encode_to_vec(), earlier.encode_to_vec(), "as replay compares them");
    }

    #[test]
    fn an_unknown_phase_is_refused_by_its_number() {
        let input = v1::ControllerInput { tick: 7, phase: 13, ..v1::ControllerInput::default() };
        let error = input_from_log(&input).unwrap_err().to_string();
        assert_eq!(error, "tick 7: phase 13 is unknown; this build knows 0 to 12");
    }
}
