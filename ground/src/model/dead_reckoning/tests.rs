use super::*;
use crate::model::motion::{GRAVITY_M_S2, Motion};
use crate::model::touchdown::Touchdown;
use crate::model::vehicle::{Heartbeat, Prediction, Sample};
use proptest::prelude::*;
use protocol::dialect::{TD_DESCENT_DATA, TD_FLIGHT_STATUS_DATA, TdLimit};

const SEEN: Duration = Duration::from_secs(100);

fn after(vehicle: &Vehicle, seconds: f64) -> PredictedPosition {
    predict_position(vehicle, SEEN + Duration::from_secs_f64(seconds)).unwrap()
}

/// A vehicle in this phase at 100 m altitude and 1 m north, with this velocity, m/s, and mean acceleration over the
/// last second, m/s2.
fn moving(phase: TdPhase, velocity: [f64; 3], acceleration: Option<[f64; 3]>) -> Vehicle {
    let [vx_m_s, vy_m_s, climb_m_s] = velocity;
    let motion = Motion { x_m: 1.0, y_m: 0.0, vx_m_s, vy_m_s, ..Motion::vertical(100.0, climb_m_s) };
    let heartbeat = Heartbeat { armed: true, phase: Some(phase), terminated: false };
    let mut vehicle = Vehicle {
        heartbeat: Some(Sample::new(heartbeat, SEEN)),
        motion: Some(Sample::new(motion, SEEN)),
        left_pad_at: Some(SEEN),
        ..Vehicle::default()
    };
    if let Some([north, east, up]) = acceleration {
        let before =
            Motion { vx_m_s: vx_m_s - north, vy_m_s: vy_m_s - east, climb_m_s: climb_m_s - up, ..motion };
        vehicle.trend.note(1_000, &before, Some(phase));
        vehicle.trend.note(2_000, &motion, Some(phase));
    }
    vehicle
}

fn falling_freely() -> Vehicle {
    moving(TdPhase::TD_PHASE_COAST, [2.0, 0.0, -20.0], Some([0.0, 0.0, -GRAVITY_M_S2]))
}

#[test]
fn no_prediction_while_the_vehicle_is_heard_or_landed() {
    assert_eq!(predict_position(&falling_freely(), SEEN + Duration::from_secs(1)), None);
    let landed = moving(TdPhase::TD_PHASE_TOUCHDOWN, [0.0; 3], None);
    assert_eq!(predict_position(&landed, SEEN + Duration::from_secs(9)), None);
}

/// Free fall by hand: 100 - 20 t - 9.80665 t^2 / 2 at t = 2 s is 40.3867 m.
#[test]
fn val_free_fall_without_drag_and_never_below_the_ground() {
    for vehicle in [falling_freely(), moving(TdPhase::TD_PHASE_COAST, [2.0, 0.0, -20.0], None)] {
        let found = after(&vehicle, 2.0);
        assert!((found.altitude_m - 40.3867).abs() < 1e-9 && (found.x_m - 5.0).abs() < 1e-9, "{found:?}");
        assert_eq!(after(&vehicle, 60.0).altitude_m.to_bits(), 0);
    }
    assert_eq!(after(&falling_freely(), 2.0).basis, Basis::Fall);
    assert_eq!(after(&moving(TdPhase::TD_PHASE_COAST, [0.0; 3], None), 2.0).basis, Basis::FreeFall);
}

/// A fall from rest with terminal speed V: `V^2/g ln cosh(g t / V)`; here 40 m/s, with the link lost after 3 s. The
/// last second shows the mean of a growing drag, which costs at most 0.5 % of the distance.
#[test]
fn val_a_fall_with_drag_follows_its_closed_form() {
    let (terminal_m_s, seen_s) = (40.0, 3.0);
    let speed_m_s = |t: f64| terminal_m_s * libm::tanh(GRAVITY_M_S2 * t / terminal_m_s);
    let fallen_m = |t: f64| {
        terminal_m_s * terminal_m_s / GRAVITY_M_S2 * libm::log(libm::cosh(GRAVITY_M_S2 * t / terminal_m_s))
    };
    let now_m_s = speed_m_s(seen_s);
    let pull = speed_m_s(seen_s - 1.0) - now_m_s;
    let vehicle = moving(TdPhase::TD_PHASE_AERO_DESCENT, [0.0, 0.0, -now_m_s], Some([0.0, 0.0, pull]));
    for passed_s in [1.6, 2.5] {
        let way_m = fallen_m(seen_s + passed_s) - fallen_m(seen_s);
        let expected_m = 100.0 - way_m;
        let found = after(&vehicle, passed_s);
        assert!(
            (found.altitude_m - expected_m).abs() < 0.005 * way_m,
            "{} is not {expected_m}",
            found.altitude_m
        );
    }
}

/// The plan is followed only under thrust.
#[test]
fn under_thrust_it_follows_the_plan_and_stays_at_its_end() {
    let mut vehicle = moving(TdPhase::TD_PHASE_POWERED, [2.0, 1.0, -10.0], None);
    let touchdown = Touchdown {
        x_m: 0.0,
        altitude_m: 0.0,
        pitch_rad: 1.57,
        u_m_s: 0.0,
        w_m_s: 0.0,
        q_rad_s: 0.0,
        violated: TdLimit::empty(),
    };
    vehicle.prediction = Some(Sample::new(Prediction { time_to_go_s: 4.0, touchdown }, SEEN));
    vehicle.path = Some(Sample::new(vec![(4.0, 40.0), (2.0, 10.0), (0.0, 0.0)], SEEN));
    assert_eq!(after(&vehicle, 3.0).basis, Basis::Plan);
    assert!((after(&vehicle, 3.0).altitude_m - 5.0).abs() < 1e-9);
    assert!((after(&vehicle, 3.0).x_m - 1.0).abs() < 1e-9);
    assert!(after(&vehicle, 9.0).altitude_m.abs() < 1e-9);
    // The motion east at 1 m/s stops when the plan ends: 2 m in 4 s.
    assert!((after(&vehicle, 9.0).y_m - 2.0).abs() < 1e-9);
    assert!(after(&vehicle, 2.0).error_m < after(&vehicle, 3.0).error_m);
    assert!(after(&vehicle, 3.0).error_m < after(&vehicle, 9.0).error_m);
    // The path arrived one second before the time to go, so the vehicle is one second further along.
    let sooner = Duration::from_secs(99);
    vehicle.path = Some(Sample::new(vec![(4.0, 40.0), (2.0, 10.0), (0.0, 0.0)], sooner));
    assert!((after(&vehicle, 1.6).altitude_m - (10.0 - 0.04 * 10.0)).abs() < 1e-9);
    let coasting = Heartbeat { armed: true, phase: Some(TdPhase::TD_PHASE_AERO_DESCENT), terminated: false };
    vehicle.heartbeat = Some(Sample::new(coasting, SEEN));
    assert_eq!(after(&vehicle, 3.0).basis, Basis::FreeFall);
}

#[test]
fn under_thrust_without_a_plan_the_last_acceleration_continues() {
    let vehicle = moving(TdPhase::TD_PHASE_POWERED, [0.0, 2.0, -20.0], Some([0.0, -0.5, 3.0]));
    let found = after(&vehicle, 2.0);
    assert_eq!(found.basis, Basis::LastThrust);
    assert!((found.altitude_m - 66.0).abs() < 1e-9 && (found.y_m - 3.0).abs() < 1e-9, "{found:?}");
}

/// At terminal speed, with the motor to be lit at 50 m: from there, 40 m/s are braked to zero in 2.5 s.
#[test]
fn the_planned_burn_brakes_and_the_circle_covers_a_fall_without_it() {
    let mut vehicle = moving(TdPhase::TD_PHASE_LAND_ARMED, [0.0, 0.0, -40.0], Some([0.0; 3]));
    let descent = TD_DESCENT_DATA { chosen_height_m: 50.0, ..TD_DESCENT_DATA::default() };
    vehicle.descent = Some(Sample::new(descent, SEEN));
    let phase = TdPhase::TD_PHASE_LAND_ARMED;
    let mut status = TD_FLIGHT_STATUS_DATA { phase, ..TD_FLIGHT_STATUS_DATA::default() };
    status.interlocks = protocol::dialect::TdInterlock::TD_INTERLOCK_ARMED;
    vehicle.status = Some(Sample::new(status.clone(), SEEN));
    // 1.25 s to the burn, then 1.25 s of it: half the speed and a quarter of the height remain.
    let found = after(&vehicle, 2.5);
    assert_eq!(found.basis, Basis::FallThenBurn);
    assert!((found.altitude_m - 12.5).abs() < 0.5, "{found:?}");
    assert!(found.error_m > found.altitude_m, "unlit it is on the ground by now");
    assert!(after(&vehicle, 30.0).altitude_m < 0.5);
    // With an inhibited motor it keeps falling.
    status.interlocks |= protocol::dialect::TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED;
    vehicle.status = Some(Sample::new(status, SEEN));
    assert_eq!(after(&vehicle, 2.5).basis, Basis::Fall);
    assert_eq!(after(&vehicle, 2.6).altitude_m.to_bits(), 0);
}

proptest! {
    /// At terminal speed the forces balance: the speed is kept, whatever the speed and the wind.
    #[test]
    fn at_terminal_speed_the_speed_is_kept(
        down_m_s in 8.5..60.0_f64,
        wind in prop::array::uniform2(-8.0..8.0_f64),
        seconds in 1.6..3.0_f64,
    ) {
        let mut vehicle =
            moving(TdPhase::TD_PHASE_AERO_DESCENT, [wind[0], wind[1], -down_m_s], Some([0.0; 3]));
        let [wind_x_m_s, wind_y_m_s] = wind.map(|part| part as f32);
        let descent =
            TD_DESCENT_DATA { wind_x_m_s, wind_y_m_s, chosen_height_m: f32::NAN, ..TD_DESCENT_DATA::default() };
        vehicle.descent = Some(Sample::new(descent, SEEN));
        let found = after(&vehicle, seconds);
        let expected_m = (100.0 - down_m_s * seconds).max(0.0);
        prop_assert!((found.altitude_m - expected_m).abs() < 1e-3, "{found:?}");
        if expected_m > 0.0 {
            prop_assert!((found.x_m - 1.0 - wind[0] * seconds).abs() < 1e-3);
            prop_assert!((found.y_m - wind[1] * seconds).abs() < 1e-3);
        }
    }

    /// In free fall only gravity acts, on the way up and down.
    #[test]
    fn in_free_fall_only_gravity_acts(
        velocity in prop::array::uniform3(-30.0..30.0_f64),
        seconds in 1.6..4.0_f64,
    ) {
        let vehicle = moving(TdPhase::TD_PHASE_COAST, velocity, Some([0.0, 0.0, -GRAVITY_M_S2]));
        let expected_m = 100.0 + velocity[2] * seconds - 0.5 * GRAVITY_M_S2 * seconds * seconds;
        let found = after(&vehicle, seconds);
        prop_assert!((found.altitude_m - expected_m.max(0.0)).abs() < 1e-6, "{found:?} {expected_m}");
    }

    /// Whatever was last received, the prediction is finite if the last position was, and the circle never shrinks.
    #[test]
    fn any_last_report_gives_a_finite_position_and_a_growing_circle(
        phase in 3_u32..13,
        velocity in prop::array::uniform3(-1e3..1e3_f64),
        acceleration in prop::option::of(prop::array::uniform3(-1e3..1e3_f64)),
        chosen_height_m in prop_oneof![Just(f32::NAN), -1e3_f32..1e3],
        seconds in 1.6..500.0_f64,
    ) {
        let phase = crate::model::telemetry::phase_from_number(phase).unwrap();
        let mut vehicle = moving(phase, velocity, acceleration);
        let descent = TD_DESCENT_DATA { chosen_height_m, ..TD_DESCENT_DATA::default() };
        vehicle.descent = Some(Sample::new(descent, SEEN));
        let at = |seconds: f64| predict_position(&vehicle, SEEN + Duration::from_secs_f64(seconds));
        if let (Some(sooner), Some(later)) = (at(seconds), at(seconds + 0.5)) {
            prop_assert!(later.x_m.is_finite() && later.y_m.is_finite() && later.altitude_m.is_finite());
            prop_assert!(sooner.altitude_m >= 0.0 && sooner.error_m > 0.0);
            prop_assert!(later.error_m >= sooner.error_m || later.basis == Basis::FallThenBurn);
        }
    }
}
