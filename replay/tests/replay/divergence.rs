//! Tests that one changed bit in one recorded output is found at its tick and field.

use proptest::prelude::*;
use protocol::log::v1::ControllerTick;
use replay::verify::{FieldValue, Verification};

use crate::flown::{FLIGHT, WHOLE, verify_bytes, verify_ticks};

type Flip = fn(&mut ControllerTick, u32);

fn flip_f64(number: &mut f64, bit: u32) {
    *number = f64::from_bits(number.to_bits() ^ (1 << (bit % 64)));
}

fn flip_u32(number: &mut u32, bit: u32) {
    *number ^= 1 << (bit % 32);
}

/// Every kind of field that is compared.
const FIELDS: [(&str, Flip); 21] = [
    ("output.tick", |tick, bit| tick.output.tick ^= 1 << (bit % 64)),
    ("output.gimbal_command_rad", |tick, bit| {
        flip_f64(&mut tick.output.gimbal_command_rad, bit);
    }),
    ("output.fin_command_rad[3]", |tick, bit| {
        flip_f64(&mut tick.output.fin_command_rad[3], bit);
    }),
    ("output.level", |tick, bit| flip_u32(&mut tick.output.level, bit)),
    ("output.solver.status", |tick, bit| {
        flip_u32(&mut tick.output.solver.status, bit);
    }),
    ("output.solver.iterations", |tick, bit| {
        flip_u32(&mut tick.output.solver.iterations, bit);
    }),
    ("output.solver.qp_iterations", |tick, bit| {
        flip_u32(&mut tick.output.solver.qp_iterations, bit);
    }),
    ("output.solver.cost", |tick, bit| {
        flip_f64(&mut tick.output.solver.cost, bit);
    }),
    ("output.solver.kkt_stationarity", |tick, bit| {
        flip_f64(&mut tick.output.solver.kkt_stationarity, bit);
    }),
    ("output.solver.kkt_feasibility", |tick, bit| {
        flip_f64(&mut tick.output.solver.kkt_feasibility, bit);
    }),
    ("output.solver.landing_feasible", |tick, _| {
        let flag = &mut tick.output.solver.landing_feasible;
        *flag = !*flag;
    }),
    ("output.solver.best_touchdown_speed_m_s", |tick, bit| {
        flip_f64(&mut tick.output.solver.best_touchdown_speed_m_s, bit);
    }),
    ("output.predicted_touchdown.time_from_now_s", |tick, bit| {
        flip_f64(&mut tick.output.predicted_touchdown.time_from_now_s, bit);
    }),
    ("output.predicted_touchdown.state.theta_rad", |tick, bit| {
        flip_f64(&mut tick.output.predicted_touchdown.state.theta_rad, bit);
    }),
    ("output.plan.states[0].x_m", |tick, bit| {
        flip_f64(&mut tick.output.plan.states[0].x_m, bit);
    }),
    ("output.plan.states[1].q_rad_s", |tick, bit| {
        flip_f64(&mut tick.output.plan.states[1].q_rad_s, bit);
    }),
    ("output.plan.gimbal_rad[0]", |tick, bit| {
        flip_f64(&mut tick.output.plan.gimbal_rad[0], bit);
    }),
    ("output.plan.starts_in_s", |tick, bit| {
        flip_f64(&mut tick.output.plan.starts_in_s, bit);
    }),
    ("output.plan.step_s", |tick, bit| {
        flip_f64(&mut tick.output.plan.step_s, bit);
    }),
    ("output.plan.gimbal_rad.len", |tick, _| {
        tick.output.plan.gimbal_rad.pop();
    }),
    ("state_digest", |tick, bit| tick.state_digest ^= 1 << (bit % 64)),
];

#[test]
fn the_flight_is_identical() {
    let report = verify_bytes(&WHOLE.bytes).unwrap();
    assert_eq!(report.outcome, Verification::Identical, "{report:?}");
    assert_eq!(report.ticks_identical, FLIGHT.ticks.len() as u64);
    assert!(report.ticks_compared > 50, "a whole landing is compared");
    assert_eq!(report.build.differences, []);
}

#[test]
fn every_kind_of_field_is_compared() {
    let mut ticks = FLIGHT.ticks[..=FIELDS.len()].to_vec();
    for (tick, (_, flip)) in ticks.iter_mut().skip(1).zip(FIELDS) {
        flip(tick, 0);
    }
    let report = verify_ticks(&ticks);
    assert_eq!(report.outcome, Verification::Diverged);
    assert_eq!(report.ticks_different, FIELDS.len() as u64, "one change in each tick, and none spreads");
    assert_eq!(report.fields_different, FIELDS.len() as u64);
    assert_eq!(report.first_divergence.unwrap().tick, 1);
}

#[test]
fn minus_zero_is_not_zero() {
    let mut ticks = FLIGHT.ticks[..2].to_vec();
    let fin_rad = &mut ticks[1].output.fin_command_rad[0];
    assert_eq!(fin_rad.to_bits(), 0.0_f64.to_bits(), "closed on the pad");
    *fin_rad = -0.0;
    let first = verify_ticks(&ticks).first_divergence.unwrap();
    assert_eq!(first.fields[0].path, "output.fin_command_rad[0]");
    assert_eq!(first.fields[0].recorded, FieldValue::Float(-0.0));
    assert_eq!(first.fields[0].recomputed, FieldValue::Float(0.0));
    assert_eq!(first.fields[0].ulps, Some(1));
}

#[test]
fn measured_times_are_not_compared() {
    let mut ticks = FLIGHT.ticks[..3].to_vec();
    ticks[1].solve_time_s = f64::NAN;
    ticks[2].deadline_s = -1.0;
    let report = verify_ticks(&ticks);
    assert_eq!((report.ticks_different, report.obstacle), (0, None));
}

/// A NaN input reaches the controller with its payload and leads to the same fallback again.
#[test]
fn an_input_that_is_not_a_number_is_replayed_like_any_other() {
    let payload = f64::from_bits(0x7ff8_dead_beef_0001);
    let mut ticks = FLIGHT.ticks[..8].to_vec();
    ticks[7].input.state.u_m_s = payload;
    let report = verify_ticks(&ticks);
    assert_eq!(report.ticks_compared, 8);
    assert_eq!(report.first_divergence.unwrap().tick, 7, "the recorded output belonged to another input");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn one_flipped_bit_is_reported_at_its_tick_and_field(
        place in 0_usize..25, field in 0..FIELDS.len(), bit in 0_u32..64,
    ) {
        let (path, flip) = FIELDS[field];
        let mut ticks = FLIGHT.ticks[..25].to_vec();
        flip(&mut ticks[place], bit);
        let report = verify_ticks(&ticks);
        prop_assert_eq!(report.outcome, Verification::Diverged);
        prop_assert_eq!((report.ticks_different, report.fields_different), (1, 1));
        let first = report.first_divergence.unwrap();
        prop_assert_eq!(first.tick, place as u64);
        prop_assert_eq!(&first.fields[0].path, path);
    }
}
