//! Whole landings: the controller with a plant that is integrated in a hundred times smaller steps, down to contact.
//!
//! The plant is the same planar model at 1 ms, so these tests check the loop: delay, shrinking horizon, warm start, end
//! conditions, contact. The command of a tick acts one sample later; in the first sample the gimbal is centred, as in
//! the landing paper.
#![expect(clippy::print_stdout, reason = "the touchdown states are what a reader of the test wants to see")]
#![expect(clippy::expect_used, reason = "a missing built-in profile is a failed test")]

use flight::guidance::controller::{
    ControlLevel, ControllerConfig, ControllerInput, ControllerOutput, ControllerState, step,
};
use flight::rules::phase::Phase;
use flight::rules::verdict::{LandingVerdict, TouchdownLimits};
use flight::vehicle::dynamics::PlanarState;
use flight::vehicle::profile::Profile;

const PLANT_STEP_S: f64 = 1e-3;
const PLANT_STEPS_PER_SAMPLE: u32 = 100;

type Kick = Box<dyn Fn(u64, &mut PlanarState)>;
type Deceit = Box<dyn Fn(&mut ControllerInput)>;

/// A flight under test: its start and its disturbances.
struct Scenario {
    start: PlanarState,
    /// True thrust divided by nominal thrust, known to the controller.
    thrust_scale: f64,
    /// Whether the controller rehearsed on the pad.
    rehearsed: bool,
    /// Ticks whose output comes too late.
    late: Vec<u64>,
    /// Whether the actuator then holds the last command instead of taking the plan's next input.
    holds_when_late: bool,
    /// Changes the true state at a tick.
    kick: Kick,
    /// Changes the controller's input at a tick.
    deceive: Deceit,
}

impl Scenario {
    fn late_command_rad(&self, last_in_time: &ControllerOutput, misses: usize) -> f64 {
        last_in_time.command_after_misses_rad(if self.holds_when_late { 0 } else { misses })
    }
}

struct Flight {
    contact_s: f64,
    contact: PlanarState,
    outputs: Vec<ControllerOutput>,
    digests: Vec<u64>,
}

fn profile() -> Profile {
    vehicles::profile::builtin("paper-calibrated").expect("a built-in profile")
}

fn nominal() -> Scenario {
    Scenario {
        start: profile().start.planar_state(),
        thrust_scale: 1.0,
        rehearsed: true,
        late: Vec::new(),
        holds_when_late: false,
        kick: Box::new(|_, _| ()),
        deceive: Box::new(|_| ()),
    }
}

/// Flies until first contact.
fn fly(scenario: &Scenario) -> Flight {
    let profile = profile();
    let config = ControllerConfig::from_profile(&profile);
    let mut controller = ControllerState::new(&config);
    let pad = ControllerInput {
        tick: 0,
        time_s: 0.0,
        phase: Phase::PadIdle,
        time_since_ignition_s: 0.0,
        state: profile.start.planar_state(),
        gimbal_applied_rad: 0.0,
        thrust_scale: 1.0,
        degraded: false,
        lands_here: false,
        deadline_missed: false,
    };
    if scenario.rehearsed {
        assert!(step(&mut controller, &pad).solver.converged());
    }
    let model = profile.planar_model();
    let mut state = scenario.start;
    let mut applied_rad = 0.0;
    let mut last_in_time: Option<ControllerOutput> = None;
    let mut misses = 0;
    let (mut outputs, mut digests) = (Vec::new(), Vec::new());
    for tick in 0_u32..80 {
        let time_s = f64::from(tick) * config.sample_time_s();
        let tick = u64::from(tick);
        (scenario.kick)(tick, &mut state);
        let mut input = ControllerInput {
            tick,
            time_s,
            phase: if tick == 0 { Phase::Ignition } else { Phase::Powered },
            time_since_ignition_s: time_s,
            state,
            gimbal_applied_rad: applied_rad,
            thrust_scale: scenario.thrust_scale,
            deadline_missed: misses > 0,
            ..pad
        };
        (scenario.deceive)(&mut input);
        let output = step(&mut controller, &input);
        let pending_rad = if scenario.late.contains(&tick) {
            misses += 1;
            last_in_time.as_ref().map_or(0.0, |last| scenario.late_command_rad(last, misses))
        } else {
            misses = 0;
            last_in_time = Some(output.clone());
            output.gimbal_command_rad
        };
        outputs.push(output);
        digests.push(controller.digest());
        for plant_step in 0..PLANT_STEPS_PER_SAMPLE {
            let plant_s = time_s + f64::from(plant_step) * PLANT_STEP_S;
            let thrust_n = scenario.thrust_scale * profile.motor.mean_thrust_n(plant_s, PLANT_STEP_S);
            let before = state;
            state = model.rk4_step(&before, applied_rad, thrust_n, PLANT_STEP_S);
            if state.z_m <= 0.0 {
                // The instant of contact: interpolated from the heights on either side, and then once more between that
                // point and the end, because the path is curved.
                let within =
                    |share: f64| model.rk4_step(&before, applied_rad, thrust_n, share * PLANT_STEP_S);
                let near = before.z_m / (before.z_m - state.z_m);
                let left = within(near).z_m;
                let share = near + (1.0 - near) * left / (left - state.z_m);
                let mut contact = within(share);
                assert!(contact.z_m.abs() < 1e-6, "{contact:?}");
                contact.z_m = 0.0;
                return Flight { contact_s: plant_s + share * PLANT_STEP_S, contact, outputs, digests };
            }
        }
        applied_rad = pending_rad;
    }
    panic!("no contact within 8 s: {state:?}");
}

fn judged(name: &str, flight: &Flight) -> LandingVerdict {
    let verdict = LandingVerdict::judge(&TouchdownLimits::from_profile(&profile()), &flight.contact);
    let values: Vec<String> = verdict
        .results
        .iter()
        .map(|limit| format!("{} {:+.4} {}", limit.name, limit.value, limit.unit))
        .collect();
    let count = |level| flight.outputs.iter().filter(|output| output.level == level).count();
    let most = flight.outputs.iter().map(|output| output.solver.iterations).max().unwrap_or(0);
    println!(
        "{name}: contact {:.3} s, {}; {} ticks converged, {} best feasible, {} upright; at most {most} iterations",
        flight.contact_s,
        values.join(", "),
        count(ControlLevel::Converged),
        count(ControlLevel::BestFeasible),
        count(ControlLevel::Stabiliser),
    );
    verdict
}

fn assert_lands(name: &str, scenario: &Scenario) {
    let flight = fly(scenario);
    let verdict = judged(name, &flight);
    assert!(verdict.landed(), "{name}: {}", verdict.summary());
    // A contact while thrust still exceeds weight would not end the flight.
    assert!(flight.contact_s >= 4.95, "{name}: contact at {} s, under thrust", flight.contact_s);
}

/// The start states of the landing paper, section 3.3.2.
fn paper_starts() -> [(&'static str, PlanarState); 7] {
    let nominal = profile().start.planar_state();
    [
        ("nominal", nominal),
        ("theta0 = 60 deg", PlanarState { theta_rad: 60.0_f64.to_radians(), ..nominal }),
        ("theta0 = 120 deg", PlanarState { theta_rad: 120.0_f64.to_radians(), ..nominal }),
        ("w0 = -1 m/s", PlanarState { w_m_s: -1.0, ..nominal }),
        ("w0 = +1 m/s", PlanarState { w_m_s: 1.0, ..nominal }),
        ("q0 = -5 deg/s", PlanarState { q_rad_s: -5.0_f64.to_radians(), ..nominal }),
        ("q0 = +5 deg/s", PlanarState { q_rad_s: 5.0_f64.to_radians(), ..nominal }),
    ]
}

#[test]
fn the_paper_starts_land_inside_table_2() {
    for (name, start) in paper_starts() {
        assert_lands(name, &Scenario { start, ..nominal() });
    }
}

#[test]
fn dispersed_starts_land_inside_table_2() {
    let nominal_start = profile().start.planar_state();
    // (w m/s, pitch error deg, pitch rate deg/s): one and two sigma of `paper-dispersed`.
    let offsets = [
        (0.2, 3.0, 2.0),
        (0.2, 3.0, -2.0),
        (0.2, -3.0, 2.0),
        (0.2, -3.0, -2.0),
        (-0.2, 3.0, 2.0),
        (-0.2, 3.0, -2.0),
        (-0.2, -3.0, 2.0),
        (-0.2, -3.0, -2.0),
        (0.4, 6.0, 4.0),
        (-0.4, -6.0, -4.0),
        (0.4, -6.0, 4.0),
        (-0.4, 6.0, 4.0),
    ];
    for (w_m_s, pitch_deg, rate_deg_s) in offsets {
        let start = PlanarState {
            w_m_s,
            theta_rad: nominal_start.theta_rad + f64::to_radians(pitch_deg),
            q_rad_s: f64::to_radians(rate_deg_s),
            ..nominal_start
        };
        let name = format!("w {w_m_s} m/s, pitch {pitch_deg} deg, rate {rate_deg_s} deg/s");
        assert_lands(&name, &Scenario { start, ..nominal() });
    }
}

#[test]
fn half_a_percent_of_thrust_known_to_the_controller_lands() {
    for thrust_scale in [0.995, 1.005] {
        assert_lands(&format!("thrust {thrust_scale}"), &Scenario { thrust_scale, ..nominal() });
    }
}

#[test]
fn a_flight_without_a_rehearsal_also_lands() {
    assert_lands("cold", &Scenario { rehearsed: false, ..nominal() });
}

#[test]
fn a_flight_disturbed_at_one_tick_still_lands() {
    for at in [5, 20, 40] {
        let kick = move |tick, state: &mut PlanarState| {
            if tick == at {
                state.u_m_s += 0.02;
                state.w_m_s -= 0.02;
                state.q_rad_s += 0.5_f64.to_radians();
            }
        };
        assert_lands(&format!("kick at tick {at}"), &Scenario { kick: Box::new(kick), ..nominal() });
    }
}

/// Estimates with errors of 2 mm/s and 0.05 deg/s (one sigma, new at every tick).
#[test]
fn a_flight_with_noisy_estimates_still_lands() {
    for seed in 1..=5_u64 {
        let deceive = move |input: &mut ControllerInput| {
            let noise = |channel: u64| gaussian(seed.wrapping_mul(1_000) + 10 * input.tick + channel);
            let (u, w, q) = (noise(0), noise(1), noise(2));
            input.state.u_m_s += 0.002 * u;
            input.state.w_m_s += 0.002 * w;
            input.state.q_rad_s += 0.05_f64.to_radians() * q;
        };
        assert_lands(&format!("noise {seed}"), &Scenario { deceive: Box::new(deceive), ..nominal() });
    }
}

/// A nearly normal random number of sigma one that depends only on the key: the sum of twelve uniform numbers from a
/// `SplitMix64` stream.
fn gaussian(key: u64) -> f64 {
    let uniform = |draw: u64| {
        let mut bits = (key.wrapping_mul(12) + draw).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..12).map(uniform).sum::<f64>() - 6.0
}

#[test]
fn late_outputs_do_no_harm_when_the_actuator_takes_the_plans_next_input() {
    for late in [vec![1], vec![3], vec![4, 5], vec![17, 18, 19], vec![40], vec![47]] {
        assert_lands(&format!("late at {late:?}"), &Scenario { late, ..nominal() });
    }
}

/// If the actuator holds the last command instead, a late output in the first half second, at full gimbal, loses the
/// landing.
#[test]
fn late_outputs_in_the_first_turn_lose_the_landing_when_the_last_command_is_held() {
    let flight = fly(&Scenario { late: vec![3], holds_when_late: true, ..nominal() });
    assert!(!judged("late at 3, held", &flight).landed());
}

#[test]
fn two_ticks_without_an_estimate_fly_the_shifted_plan_and_still_land() {
    let deceive = |input: &mut ControllerInput| {
        if matches!(input.tick, 20 | 21) {
            input.state.u_m_s = f64::NAN;
        }
    };
    let scenario = Scenario { deceive: Box::new(deceive), ..nominal() };
    assert_lands("two blind ticks", &scenario);
    let levels: Vec<ControlLevel> =
        fly(&scenario).outputs[19..23].iter().map(|output| output.level).collect();
    let (seen, blind) = (ControlLevel::Converged, ControlLevel::ShiftedPlan);
    assert_eq!(levels, [seen, blind, blind, seen]);
}

/// An abort under thrust gives up the landing but keeps the attitude.
#[test]
fn with_the_upright_law_from_two_seconds_on_the_vehicle_comes_down_upright() {
    let deceive = |input: &mut ControllerInput| input.degraded = input.tick >= 20;
    let flight = fly(&Scenario { deceive: Box::new(deceive), ..nominal() });
    judged("degraded", &flight);
    assert!((flight.contact.theta_rad.to_degrees() - 90.0).abs() < 1.0);
}

/// Two flights with the same inputs agree in every bit of every output and of the controller's memory.
#[test]
fn two_runs_agree_in_every_bit() {
    let start = PlanarState { w_m_s: 0.3, theta_rad: 1.5, ..profile().start.planar_state() };
    let [one, other] = [(); 2].map(|()| fly(&Scenario { start, ..nominal() }));
    assert_eq!(one.digests, other.digests);
    assert_eq!(one.outputs.len(), other.outputs.len());
    for (one, other) in one.outputs.iter().zip(&other.outputs) {
        assert_eq!(bits(one), bits(other));
        // Everything that is not a float.
        assert_eq!(format!("{one:?}"), format!("{other:?}"));
    }
    let contacts = [one.contact, other.contact].map(|state| state.to_array().map(f64::to_bits));
    assert_eq!(contacts[0], contacts[1]);
}

fn bits(output: &ControllerOutput) -> Vec<u64> {
    let solver = &output.solver;
    let plan = &output.plan;
    let touchdown = &output.predicted_touchdown;
    [output.gimbal_command_rad, solver.cost, solver.kkt_stationarity, solver.kkt_feasibility]
        .into_iter()
        .chain([solver.best_touchdown_speed_m_s, touchdown.time_from_now_s, plan.starts_in_s, plan.step_s])
        .chain(output.fin_command_rad)
        .chain(touchdown.state.to_array())
        .chain(plan.used_gimbal_rad().iter().copied())
        .chain(plan.used_states().iter().flat_map(|state| state.to_array()))
        .map(f64::to_bits)
        .collect()
}
