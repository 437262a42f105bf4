//! The paper's vehicle in motion: its closed loop, and what the numbers and equations exactly as
//! printed predict and what really happens.

use paper::plane::dynamics::{ModelKind, PlanarModel, PlanarState};
use paper::plane::{LANDING_MISS, Problem, Solution, best_touchdown_speed_m_s, solve};
use paper::problem::{HORIZON, PRINTED_THRUST_N, TOUCHDOWN_SPEED_MAX_M_S, model, problem, start};

use super::{Finish, Sample};

/// Integration step, s.
const STEP_S: f64 = 0.001;

/// Changes a state before a sample.
type Disturbance = fn(usize, &mut PlanarState);

/// The paper's closed loop from the start of a problem to the end of its burn: the rest of the
/// landing is solved once a sample from the state predicted one sample ahead, and the first input
/// acts there, one sample late. As in the paper there is no ground in between: its final state is
/// the state at the end of its 5 s, and its optimum dips some millimetres below the ground just
/// before.
pub(super) fn closed_loop(problem: &Problem) -> Finish {
    disturbed(problem, |_, _| (), |_, _| ())
}

/// [`closed_loop`] of a vehicle that is kicked, and whose controller is deceived about its state.
fn disturbed(problem: &Problem, kick: Disturbance, deceive: Disturbance) -> Finish {
    let Problem { model, step_s, thrust_n, intervals, .. } = *problem;
    let mut state = problem.initial;
    let mut gimbal_rad = 0.0;
    let (mut plans, mut plan) = (Vec::new(), None::<Solution>);
    let mut path = vec![Sample { time_s: 0.0, state, gimbal_rad }];
    for sample in 0..intervals {
        kick(sample, &mut state);
        let mut known = state;
        deceive(sample, &mut known);
        let rest = Problem {
            initial: model.rk4_step(&known, gimbal_rad, thrust_n, step_s),
            intervals: intervals - sample - 1,
            ..problem.clone()
        };
        for _ in 0..(step_s / STEP_S).round() as u32 {
            state = model.rk4_step(&state, gimbal_rad, thrust_n, STEP_S);
        }
        path.push(Sample { time_s: sample as f64 * step_s + step_s, state, gimbal_rad });
        // At the last sample there is nothing left to plan.
        if rest.intervals > 0 {
            let solution = solve(&rest, plan.as_ref().map(|plan| plan.start(1)).as_ref());
            plans
                .push((solution.outcome.cost, solution.converged() && solution.outcome.miss <= LANDING_MISS));
            gimbal_rad = solution.inputs_rad[0][0];
            plan = Some(solution);
        }
    }
    let cost = plans.first().map_or(0.0, |(cost, _)| *cost);
    Finish::judged(path, cost, plans.iter().all(|(_, converged)| *converged))
}

/// Time and state at the contact of a vehicle that burns with these gimbal angles, one a sample,
/// and then coasts; `None` if it does not come down within 5 s after the burn.
pub(super) fn contact(
    model: PlanarModel,
    start: PlanarState,
    thrust_n: f64,
    inputs_rad: &[[f64; 1]],
) -> Option<(f64, PlanarState)> {
    let burn = inputs_rad.iter().map(|[input_rad]| (*input_rad, thrust_n));
    let samples = burn.chain(std::iter::repeat_n((0.0, 0.0), 50));
    let steps = samples.flat_map(|sample| std::iter::repeat_n(sample, 100)).enumerate();
    let mut state = start;
    for (step, (gimbal_rad, thrust_n)) in steps {
        let after = |time_s| model.rk4_step(&state, gimbal_rad, thrust_n, time_s);
        let next = after(STEP_S);
        if next.z_m <= 0.0 {
            // Bisect for the instant of contact: 40 halvings of 1 ms are below a double's
            // resolution of time.
            let (mut above_s, mut below_s) = (0.0, STEP_S);
            for _ in 0..40 {
                let middle_s = 0.5 * (above_s + below_s);
                *(if after(middle_s).z_m > 0.0 { &mut above_s } else { &mut below_s }) = middle_s;
            }
            return Some((step as f64 * STEP_S + above_s, after(above_s)));
        }
        state = next;
    }
    None
}

/// Iterations that the printed equations need; they are harder for the solver than the corrected
/// ones.
const MAX_ITERATIONS: usize = 1000;

/// Results of the printed numbers and equations.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AsPrinted {
    /// Printed thrust, N.
    pub(crate) thrust_n: f64,
    /// The slowest touchdown that is possible with it, m/s: upright under full thrust all the way.
    pub(crate) best_touchdown_speed_m_s: f64,
    /// The slowest touchdown that counts as a landing, m/s.
    pub(crate) limit_m_s: f64,
    /// Energy gained or lost in one second of coasting from a tilted attitude without thrust or
    /// drag, J/kg: by the printed equations, and by the corrected ones.
    pub(crate) energy_error_j_kg: [f64; 2],
    /// The landing that a solver with the printed equations and the printed thrust predicts.
    pub(crate) promised: PlanarState,
    /// Its vertical velocity there by the printed equations, whose frames are their own, m/s.
    pub(crate) promised_vertical_m_s: f64,
    /// The lowest altitude on the way there, m.
    pub(crate) promised_lowest_m: f64,
    /// Whether that solve converged.
    pub(crate) promise_converged: bool,
    /// The contact that the true vehicle makes when it flies that plan; `None` if it does not come
    /// down in time.
    pub(crate) happens: Option<PlanarState>,
}

/// Solves and flies the landing with the equations as printed.
pub(crate) fn as_printed() -> AsPrinted {
    let of_kind = |kind| PlanarModel { kind, ..model() };
    let in_truth = Problem { thrust_n: PRINTED_THRUST_N, ..problem(start(), HORIZON) };
    let mut assumed = Problem { model: of_kind(ModelKind::AsPrinted), ..in_truth.clone() };
    assumed.solver.max_iterations = MAX_ITERATIONS;
    let promise = solve(&assumed, None);
    let promised = promise.end();
    AsPrinted {
        thrust_n: PRINTED_THRUST_N,
        best_touchdown_speed_m_s: best_touchdown_speed_m_s(&in_truth),
        limit_m_s: TOUCHDOWN_SPEED_MAX_M_S,
        energy_error_j_kg: [ModelKind::AsPrinted, ModelKind::Consistent]
            .map(of_kind)
            .map(coasting_energy_error),
        promised,
        promised_vertical_m_s: assumed.model.derivative(&promised.to_array(), 0.0, 0.0)[1],
        promised_lowest_m: promise.states.iter().map(|[_, z_m, ..]| *z_m).fold(f64::INFINITY, f64::min),
        promise_converged: promise.converged(),
        happens: contact(model(), start(), PRINTED_THRUST_N, &promise.inputs_rad).map(|(_, state)| state),
    }
}

/// Change of specific energy over 1 s without thrust and drag, from 30 degrees of tilt.
fn coasting_energy_error(mut model: PlanarModel) -> f64 {
    model.drag_per_m = 0.0;
    let tilted = PlanarState { theta_rad: 60f64.to_radians(), ..start() };
    let mut state = tilted;
    for _ in 0..1000 {
        state = model.rk4_step(&state, 0.0, 0.0, 0.001);
    }
    model.specific_energy_j_kg(&state) - model.specific_energy_j_kg(&tilted)
}

#[cfg(test)]
mod tests {
    use core::f64::consts::FRAC_PI_2;

    use paper::problem::settled;

    use super::super::cases::broken;
    use super::*;

    /// Touches the ground inside Table 2, and as the burn ends: a contact while thrust still
    /// exceeds weight would not end the flight.
    fn assert_lands(name: &str, problem: &Problem, flown: &Finish) {
        let above = flown.path.iter().take_while(|sample| sample.state.z_m > 0.0).count();
        let last = &flown.path[above - 1];
        let gimbals_rad: Vec<_> = flown.path[above..].iter().map(|sample| [sample.gimbal_rad]).collect();
        let (later_s, contact) = contact(problem.model, last.state, problem.thrust_n, &gimbals_rad).unwrap();
        assert_eq!(broken(&contact), [""; 0], "{name}");
        assert!(last.time_s + later_s >= 4.95, "{name}: contact {later_s} s after {last:?}, under thrust");
    }

    fn turned(w_m_s: f64, pitch_deg: f64, rate_deg_s: f64) -> PlanarState {
        PlanarState {
            w_m_s,
            theta_rad: FRAC_PI_2 + pitch_deg.to_radians(),
            q_rad_s: rate_deg_s.to_radians(),
            ..start()
        }
    }

    /// The starts of the paper's section 3.3.2, and starts of one and two sigma of 0.2 m/s, 3 deg
    /// and 2 deg/s.
    #[test]
    fn every_start_lands_on_the_settled_plan() {
        let papers = [
            (0.0, 0.0, 0.0),
            (0.0, -30.0, 0.0),
            (0.0, 30.0, 0.0),
            (-1.0, 0.0, 0.0),
            (1.0, 0.0, 0.0),
            (0.0, 0.0, -5.0),
            (0.0, 0.0, 5.0),
        ];
        let signs = (0..8).map(|bits| [1, 2, 4].map(|bit| if bits & bit == 0 { 1.0 } else { -1.0 }));
        let dispersed = signs.flat_map(|[w, pitch, rate]| {
            [1.0, 2.0].map(|sigma| (0.2 * sigma * w, 3.0 * sigma * pitch, 2.0 * sigma * rate))
        });
        for (w_m_s, pitch_deg, rate_deg_s) in papers.into_iter().chain(dispersed) {
            let problem = settled(turned(w_m_s, pitch_deg, rate_deg_s), HORIZON);
            let name = format!("w {w_m_s} m/s, pitch {pitch_deg} deg, rate {rate_deg_s} deg/s");
            assert_lands(&name, &problem, &closed_loop(&problem));
        }
    }

    #[test]
    fn half_a_percent_of_thrust_within_the_controller_model_lands() {
        for scale in [0.995, 1.005] {
            let mut problem = settled(start(), HORIZON);
            problem.thrust_n *= scale;
            assert_lands(&format!("thrust {scale}"), &problem, &closed_loop(&problem));
        }
    }

    #[test]
    fn a_landing_disturbed_at_one_sample_still_lands() {
        fn kick<const AT: usize>(sample: usize, state: &mut PlanarState) {
            if sample == AT {
                state.u_m_s += 0.02;
                state.w_m_s -= 0.02;
                state.q_rad_s += 0.5_f64.to_radians();
            }
        }
        for (at, kick) in [(5, kick::<5> as Disturbance), (20, kick::<20>), (40, kick::<40>)] {
            let problem = settled(start(), HORIZON);
            let flown = disturbed(&problem, kick, |_, _| ());
            assert_lands(&format!("kick at sample {at}"), &problem, &flown);
        }
    }

    /// Estimates with errors of 2 mm/s and 0.05 deg/s (one sigma, new at every sample).
    #[test]
    fn a_landing_with_noisy_estimates_still_lands() {
        fn deceive<const SEED: u64>(sample: usize, state: &mut PlanarState) {
            let noise = |channel| gaussian(SEED.wrapping_mul(1_000) + 10 * sample as u64 + channel);
            state.u_m_s += 0.002 * noise(0);
            state.w_m_s += 0.002 * noise(1);
            state.q_rad_s += 0.05_f64.to_radians() * noise(2);
        }
        let of_seeds = [deceive::<1> as Disturbance, deceive::<2>, deceive::<3>, deceive::<4>, deceive::<5>];
        for (place, deceive) in of_seeds.into_iter().enumerate() {
            let problem = settled(start(), HORIZON);
            let flown = disturbed(&problem, |_, _| (), deceive);
            assert_lands(&format!("noise {}", place + 1), &problem, &flown);
        }
    }

    /// A nearly normal random number of sigma one that depends only on the key: the sum of twelve
    /// uniform numbers from a `SplitMix64` stream.
    fn gaussian(key: u64) -> f64 {
        let uniform = |draw: u64| {
            let mut bits = (key.wrapping_mul(12) + draw).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(uniform).sum::<f64>() - 6.0
    }

    /// Without thrust and drag, from rest: v^2 = 2 g h.
    #[test]
    fn val_free_fall_from_rest_hits_the_ground_at_the_textbook_speed() {
        let mut model = model();
        model.drag_per_m = 0.0;
        let at_rest = PlanarState { z_m: 5.0, u_m_s: 0.0, ..start() };
        let (time_s, contact) = contact(model, at_rest, 0.0, &[]).unwrap();
        let gravity = model.gravity_m_s2;
        assert!((contact.u_m_s + (2.0 * gravity * 5.0).sqrt()).abs() < 1e-9, "{contact:?}");
        assert!((time_s - (2.0 * 5.0 / gravity).sqrt()).abs() < 1e-9, "{time_s}");
        assert!(contact.z_m >= 0.0 && contact.z_m < 1e-9);
    }

    /// 30 N on 3 kg, upright all the way: on the ground at 3.2 s at -4.3 m/s (hand integration of
    /// the paper's case).
    #[test]
    fn val_hand_integration_thirty_newton_cannot_stop_the_vehicle() {
        let (time_s, contact) = contact(model(), start(), PRINTED_THRUST_N, &[[0.0]; HORIZON]).unwrap();
        assert!((time_s - 3.2).abs() < 0.05 && (contact.u_m_s + 4.3).abs() < 0.05, "{time_s} {contact:?}");
    }

    /// 30 N on 3 kg from 15 m at -5 m/s: at best -4.3 m/s at the ground, by hand integration.
    #[test]
    fn val_hand_integration_the_printed_thrust_cannot_land() {
        let printed = as_printed();
        assert!((printed.best_touchdown_speed_m_s - 4.3).abs() < 0.05, "{printed:?}");
        assert!(printed.best_touchdown_speed_m_s > printed.limit_m_s);
    }

    #[test]
    fn the_printed_equations_create_energy_and_the_corrected_ones_do_not() {
        let [printed, mended] = as_printed().energy_error_j_kg;
        assert!(printed.abs() > 1.0, "{printed}");
        assert!(mended.abs() < 1e-9, "{mended}");
    }

    /// By the printed equations the motor brings the vehicle back up to the ground from below; in
    /// truth it cannot even stop it.
    #[test]
    fn the_landing_predicted_by_the_printed_equations_does_not_happen() {
        let printed = as_printed();
        assert!(printed.promise_converged && printed.promised.z_m.abs() < 1e-6, "{printed:?}");
        assert!(printed.promised_vertical_m_s > 0.0, "{printed:?}");
        let happens = printed.happens.unwrap();
        assert!(happens.ground_velocity_m_s().1 <= -printed.best_touchdown_speed_m_s + 0.01, "{happens:?}");
    }
}
