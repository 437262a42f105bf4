//! The tolerances of docs/build-mk3.md follow from the airframe, its motor, the limits of the pad
//! check, and the scatter of `real`: two standard deviations to either side, because a part outside
//! of them is wrong rather than unlucky.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::f64::consts::TAU;

use flight::vehicles::{mission, motors};
use sim::dispersion::Dispersion;
use sim::world::truth::Truth;

const PAGE: &str = include_str!("../../../docs/build-mk3.md");
const SIGMAS: f64 = 2.0;
const G_M_S2: f64 = 9.80665;

/// The numbers with which cells of a row of a table in a section begin.
fn row(section: &str, name: &str) -> Vec<f64> {
    let section = PAGE.split(&format!("\n## {section}\n")).nth(1).unwrap().split("\n## ").next().unwrap();
    let row = section
        .lines()
        .find(|line| line.starts_with(&format!("| {name}")))
        .unwrap_or_else(|| panic!("{name}"));
    let number = |cell: &str| {
        let digits: String =
            cell.trim().chars().take_while(|c| c.is_ascii_digit() || ".-".contains(*c)).collect();
        digits.parse().ok()
    };
    row.split('|').skip(2).filter_map(number).collect()
}

/// What a row says: expected, stop below, stop above.
fn row_is(name: &str, expected: [f64; 3], decimals: usize) {
    let found = row("What a builder measures", name);
    let rounded = expected.map(|value| format!("{value:.decimals$}").parse::<f64>().unwrap());
    assert_eq!(found, rounded, "{name}");
}

/// Expected, and so many deviations below and above.
fn about(value: f64, deviation: f64) -> [f64; 3] {
    [value, value - SIGMAS * deviation, value + SIGMAS * deviation]
}

#[test]
fn the_bounds_for_a_builder_follow_from_the_data() {
    let (mk3, real) = (mission::builtin_airframe("mk3").unwrap(), Dispersion::builtin("real").unwrap());
    let (mass, wrong) = (&mk3.mass, &real.mismatch);
    row_is("mass,", about(mass.loaded_kg, real.mass_share * mass.loaded_kg), 2);
    row_is("centre of gravity,", about(1e3 * mass.loaded_cg_station_m, 1e3 * wrong.cg_along_m), 0);
    row_is("centre of gravity beside", [0.0, 0.0, 1e3 * SIGMAS * real.cg_off_axis_m], 1);
    // Two strings of 1 m, 0.4 m apart: T = 2 pi sqrt(I L / (m g b^2)), b = 0.2 m.
    let ten_s = |share: f64| {
        let inertia = mass.loaded_pitch_inertia_kg_m2 * (1.0 + share);
        10.0 * TAU * (inertia / (mass.loaded_kg * G_M_S2 * 0.2 * 0.2)).sqrt()
    };
    let share = SIGMAS * wrong.inertia_share;
    row_is("pitch inertia", [ten_s(0.0), ten_s(-share), ten_s(share)], 1);
    // The rod turns about the gimbal's ring.
    let below_ring = PAGE.split("rod in place of the motor, to ").nth(1).unwrap();
    let rod_m: f64 = below_ring.split(" m below the ring's middle").next().unwrap().parse().unwrap();
    let (rod_mm, limit_deg) = (1e3 * rod_m, mk3.gimbal.limit_deg);
    let tip_mm = |deg: f64| rod_mm * libm::tan(deg.to_radians());
    row_is("thrust line, direction", [0.0, 0.0, tip_mm(SIGMAS * real.thrust_misalignment_deg)], 1);
    row_is("thrust line, position", [0.0, 0.0, 1e3 * SIGMAS * wrong.thrust_offset_m], 1);
    let gain = SIGMAS * wrong.gimbal_gain_share;
    row_is("gimbal, each end", [1.0, 1.0 - gain, 1.0 + gain].map(|gain| tip_mm(gain * limit_deg)), 0);
    row_is("gimbal, play", [mk3.gimbal.servo.slop_deg, 0.0, wrong.gimbal_slop_deg[1]].map(tip_mm), 1);
    // An end of a fin moves on an arc of its length.
    let end_mm = |deg: f64| 1e3 * mk3.fins.length_m * deg.to_radians();
    row_is("fins, play", [wrong.fin_slop_deg[0], 0.0, wrong.fin_slop_deg[1]].map(end_mm), 1);
    row_is("fins, open", about(mk3.fins.open_deg, wrong.fin_offset_deg), 0);
    for (name, servo, way_deg) in [
        ("gimbal servo", &mk3.gimbal.servo, 2.0 * limit_deg),
        ("fin servo", &mk3.fins.servo, mk3.fins.open_deg - mk3.fins.closed_deg),
    ] {
        // The pad check allows 20 ms more. A servo that is faster than 1.5 times its data makes the
        // loop another one.
        let whole_ms = |rate: f64| 1e3 * (servo.delay_s + way_deg / (rate * servo.rate_deg_s));
        row_is(name, [whole_ms(1.0), whole_ms(1.5), whole_ms(1.0) + 20.0], 0);
    }
    row_is(
        "igniters",
        about(1e3 * Truth::default().ignition_delay_s, 1e3 * real.ignition_delay_s * mk3.igniter_scatter()),
        0,
    );
    let motor = motors::builtin(&mk3.motor).unwrap();
    let impulse_n_s = motor.total_impulse_n_s();
    row_is("motor, impulse", about(impulse_n_s, real.impulse_share * impulse_n_s), 0);
    let burn_s = motor.burn_time_s();
    row_is("motor, burn time", about(burn_s, real.burn_time_share * burn_s), 2);
    row_is("IMU, square", [0.0, 0.0, SIGMAS * real.sensor_params.imu.mounting_deg], 1);
}

/// Drag of an open fin at 36 m/s at sea level, at half the fin's length; a servo that keeps half
/// its unloaded speed needs twice that at a stall.
#[test]
fn val_hand_the_servo_of_a_fin() {
    let mk3 = mission::builtin_airframe("mk3").unwrap();
    let fins = &mk3.fins;
    let drag_n = 0.5 * 1.225 * 36.0 * 36.0 * mk3.body.reference_area_m2 * fins.drag_coefficient;
    let hinge_n_m = drag_n * 0.5 * fins.length_m;
    let fin_row = |name: &str| row("Fins", name);
    assert!((fin_row("hinge torque of an open fin at 36 m/s")[0] - hinge_n_m).abs() < 0.005, "{hinge_n_m}");
    let section = PAGE.split("\n## Fins\n").nth(1).unwrap();
    assert!(section.contains(&format!("at least {:.2} N m", 2.0 * hinge_n_m)), "{hinge_n_m}");
    assert!(fin_row("servo's class")[0] >= 2.0 * hinge_n_m);
    // The page has tenths of a millimetre.
    assert!((fin_row("width along the skin")[0] - 1e3 * fins.width_m).abs() < 0.05);
    let opens_s = fins.servo.delay_s + (fins.open_deg - fins.closed_deg) / fins.servo.rate_deg_s;
    assert!(section.contains(&format!("the {opens_s:.2} s that their servos take")), "{opens_s}");
}

/// The cut lengths of a leg's tubes and wire reach from the skin at the hinge and at the tail to
/// the joint above the foot.
#[test]
fn val_hand_the_lengths_of_a_leg() {
    let airframe = mission::builtin_airframe("mk3").unwrap();
    let legs = PAGE.split("\n## Legs\n").nth(1).unwrap().split("\n## ").next().unwrap();
    let number = |before: &str, after: &str| -> f64 {
        let text = legs.split(before).nth(1).unwrap().split(after).next().unwrap();
        text.split_whitespace().next_back().unwrap().parse().unwrap()
    };
    let hinge_m = number("```text", " m  |o)");
    let joint_m = number("wire  '-O' '", " m: the joint");
    let across_m = airframe.legs.foot_radius_m - airframe.body.diameter_m / 2.0;
    let tube_m =
        number("tube of 14 mm,", " m") + number("tube of 12 mm,", " m,") - 1e-3 * number("glued", " mm deep");
    assert!((tube_m - across_m.hypot(hinge_m - joint_m)).abs() < 0.001, "{tube_m}");
    assert!((number("12 x 10 mm,", " m from hinge") - tube_m).abs() < 0.001);
    let angle_deg = libm::atan2(across_m, hinge_m - joint_m).to_degrees();
    assert!((number("from hinge to joint, at", " degrees") - angle_deg).abs() < 0.5, "{angle_deg}");
    assert!((number("7 x 7, 1 mm,", " m, 570") - across_m.hypot(joint_m)).abs() < 0.005);
    // A tube's mass: its sections at the 1.6 g/cm3 of pultruded carbon.
    let section_m2 =
        |outside_m: f64, inside_m: f64| TAU / 8.0 * (outside_m * outside_m - inside_m * inside_m);
    let tubes_kg = 1600.0
        * (section_m2(0.014, 0.012) * number("tube of 14 mm,", " m")
            + section_m2(0.012, 0.010) * number("tube of 12 mm,", " m,"));
    assert!((number("- tube,", " kg") - tubes_kg).abs() < 0.001, "{tubes_kg}");
    // The leg that is tested to its strength.
    let crush = airframe.legs.crush.unwrap();
    let tested = format!("to {} N along and {} N across", crush.strength_n, crush.strength_across_n);
    assert!(legs.split_whitespace().collect::<Vec<_>>().join(" ").contains(&tested), "{tested}");
}
