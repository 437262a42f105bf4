//! Whole landings: the controller against a plant integrated a hundred times finer, contact and all.
//!
//! The plant is the same planar model at 1 ms, so what is tested is the loop: delay, shrinking horizon, warm start,
//! end conditions, contact. The command of a tick acts one sample later; the first sample flies with the gimbal
//! centred, as in the landing paper.

use flight::controller::{
    ControlLevel, ControllerConfig, ControllerInput, ControllerOutput, ControllerState, step,
};
use flight::dynamics::{PlanarModel, PlanarState};
use flight::phase::Phase;
use flight::profile::Profile;
use flight::verdict::{LandingVerdict, TouchdownLimits};

const PLANT_STEP_S: f64 = 1e-3;

/// What distinguishes one flight from another.
#[derive(Clone, Copy)]
struct Scenario {
    start: PlanarState,
    thrust_scale: f64,
    rehearsed: bool,
}

struct Flight {
    contact_s: f64,
    contact: PlanarState,
    outputs: Vec<ControllerOutput>,
}

fn profile() -> Profile {
    Profile::builtin("paper-calibrated").unwrap()
}

/// A tick's input; tests that spoil something change it before it is used.
fn input(
    tick: u64,
    time_s: f64,
    state: PlanarState,
    gimbal_applied_rad: f64,
    thrust_scale: f64,
) -> ControllerInput {
    ControllerInput {
        tick,
        time_s,
        phase: if tick == 0 {
            Phase::Ignition
        } else {
            Phase::Powered
        },
        time_since_ignition_s: time_s,
        state,
        gimbal_applied_rad,
        thrust_scale,
        degraded: false,
        deadline_missed: false,
    }
}

/// Flies until first contact, letting `spoil` change each tick's input.
fn fly_with(scenario: Scenario, mut spoil: impl FnMut(&mut ControllerInput)) -> Flight {
    let mut profile = profile();
    let nominal = profile.start.planar_state();
    let config = ControllerConfig::from_profile(&profile);
    let mut controller = ControllerState::new(&config);
    if scenario.rehearsed {
        let rehearsal = ControllerInput {
            phase: Phase::PadIdle,
            ..input(0, 0.0, nominal, 0.0, 1.0)
        };
        let output = step(&mut controller, &rehearsal);
        assert!(output.solver.converged(), "{}", output.solver.summary());
    }
    let model = PlanarModel::from_profile(&profile);
    profile.motor.thrust_n *= scenario.thrust_scale;
    let samples = (config.sample_time_s() / PLANT_STEP_S).round() as u64;

    let mut state = scenario.start;
    let (mut applied_rad, mut pending_rad) = (0.0, 0.0);
    let mut outputs = Vec::new();
    for tick in 0_u64..80 {
        let time_s = tick as f64 * config.sample_time_s();
        let mut input = input(tick, time_s, state, applied_rad, scenario.thrust_scale);
        spoil(&mut input);
        let output = step(&mut controller, &input);
        assert!(output.gimbal_command_rad.abs() <= profile.gimbal.limit_rad());
        if !input.deadline_missed {
            pending_rad = output.gimbal_command_rad;
        }
        outputs.push(output);
        for sample in 0..samples {
            let plant_s = time_s + sample as f64 * PLANT_STEP_S;
            let thrust_n = profile.motor.mean_thrust_n(plant_s, PLANT_STEP_S);
            state = model.rk4_step(&state, applied_rad, thrust_n, PLANT_STEP_S);
            if state.z_m <= 0.0 {
                return Flight {
                    contact_s: plant_s + PLANT_STEP_S,
                    contact: state,
                    outputs,
                };
            }
        }
        applied_rad = pending_rad;
    }
    panic!("no contact within 8 s: {state:?}");
}

fn fly(scenario: Scenario) -> Flight {
    fly_with(scenario, |_| ())
}

fn report(name: &str, flight: &Flight) -> LandingVerdict {
    let verdict = LandingVerdict::judge(&TouchdownLimits::from_profile(&profile()), &flight.contact);
    let values: Vec<String> = verdict
        .results
        .iter()
        .map(|limit| format!("{} {:+.4} {}", limit.name, limit.value, limit.unit))
        .collect();
    let count = |level| {
        flight
            .outputs
            .iter()
            .filter(|output| output.level == level)
            .count()
    };
    let worst = flight
        .outputs
        .iter()
        .map(|output| output.solver.iterations)
        .max()
        .unwrap_or(0);
    println!(
        "{name}: contact {:.3} s, {}; {} converged, {} best feasible, {} stabiliser, at most {worst} iterations",
        flight.contact_s,
        values.join(", "),
        count(ControlLevel::Converged),
        count(ControlLevel::BestFeasible),
        count(ControlLevel::Stabiliser),
    );
    verdict
}

fn assert_lands(name: &str, flight: &Flight) {
    let verdict = report(name, flight);
    assert!(verdict.landed(), "{name}: {}", verdict.summary());
    // Contact while thrust still exceeds weight would not be the end of the flight.
    assert!(
        flight.contact_s >= 4.95,
        "{name}: contact at {} s, under thrust",
        flight.contact_s
    );
}

fn nominal() -> Scenario {
    Scenario {
        start: profile().start.planar_state(),
        thrust_scale: 1.0,
        rehearsed: true,
    }
}

/// The start states of the landing paper, section 3.3.2.
fn paper_starts() -> [(&'static str, PlanarState); 7] {
    let nominal = profile().start.planar_state();
    [
        ("nominal", nominal),
        (
            "theta0 = 60 deg",
            PlanarState {
                theta_rad: 60.0_f64.to_radians(),
                ..nominal
            },
        ),
        (
            "theta0 = 120 deg",
            PlanarState {
                theta_rad: 120.0_f64.to_radians(),
                ..nominal
            },
        ),
        (
            "w0 = -1 m/s",
            PlanarState {
                w_m_s: -1.0,
                ..nominal
            },
        ),
        (
            "w0 = +1 m/s",
            PlanarState {
                w_m_s: 1.0,
                ..nominal
            },
        ),
        (
            "q0 = -5 deg/s",
            PlanarState {
                q_rad_s: -5.0_f64.to_radians(),
                ..nominal
            },
        ),
        (
            "q0 = +5 deg/s",
            PlanarState {
                q_rad_s: 5.0_f64.to_radians(),
                ..nominal
            },
        ),
    ]
}

#[test]
fn the_paper_starts_land_inside_table_2() {
    for (name, start) in paper_starts() {
        assert_lands(name, &fly(Scenario { start, ..nominal() }));
    }
}

#[test]
fn dispersed_starts_land_inside_table_2() {
    let nominal_start = profile().start.planar_state();
    // (w m/s, pitch error deg, pitch rate deg/s): about one and two sigma of `paper-dispersed`, all signs.
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
        assert_lands(
            &format!("w {w_m_s}, pitch {pitch_deg}, rate {rate_deg_s}"),
            &fly(Scenario { start, ..nominal() }),
        );
    }
}

#[test]
fn half_a_percent_of_thrust_known_to_the_controller_lands() {
    for thrust_scale in [0.995, 1.005] {
        assert_lands(
            &format!("thrust {thrust_scale}"),
            &fly(Scenario {
                thrust_scale,
                ..nominal()
            }),
        );
    }
}

#[test]
fn a_cold_first_tick_lands_too() {
    assert_lands(
        "cold",
        &fly(Scenario {
            rehearsed: false,
            ..nominal()
        }),
    );
}
