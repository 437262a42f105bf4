//! Range checks of a parsed mission.

use alloc::format;

use toml::Value;

use crate::vehicle::airframe::BadValue;
use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use crate::vehicle::drop::LOWEST_ARMED_M;
use crate::vehicle::launch::Launch;
use crate::vehicle::mission::Mission;

type Check = Result<(), BadValue>;

/// A range as text, its ends, and the keys it applies to; the key of a section stands for all its
/// numbers that no earlier row names.
type Range = (&'static str, f64, f64, &'static [&'static str]);

/// Above 0.
const LEAST: f64 = f64::MIN_POSITIVE;
/// Below 90.
const RIGHT: f64 = 89.999_999;

#[rustfmt::skip]
const RANGES: [Range; 41] = [
    ("0.5 to 10", 0.5, 10.0, &["launch.rail.length_m"]),
    // NAR Model Rocket Safety Code, rule 5: within 30 degrees of the vertical.
    ("0 to 30", 0.0, 30.0, &["launch.rail.tilt_deg", "drop.swing_deg"]),
    ("-360 to 360", -360.0, 360.0, &["launch.rail.towards_deg"]),
    // Farther away lies beyond the largest fence.
    ("-1000 to 1000", -1_000.0, 1_000.0, &["launch.rail.x_m", "launch.rail.y_m"]),
    ("-60 to 60", -60.0, 60.0, &["launch.rail.upwind_s"]),
    ("0 to 10", 0.0, 10.0, &["launch.separate_before_apogee_s", "drop.speed_max_m_s"]),
    ("0.05 to 3", 0.05, 3.0, &["launch.booster.length_m"]),
    ("0.01 to 20", 0.01, 20.0, &["launch.booster.dry_kg"]),
    ("above 0 to 10", 1e-6, 10.0, &["launch.booster.pitch_inertia_kg_m2", "launch.booster.roll_inertia_kg_m2"]),
    ("0 to 3", 0.0, 3.0, &["launch.booster.nose.station_m"]),
    ("0 to 100", 0.0, 100.0, &["launch.booster.stack_drag_coefficient", "launch.booster.nose.slope_per_rad"]),
    ("0 to 20", 0.0, 20.0, &["launch.booster.separation_impulse_n_s"]),
    ("10 to 150", LOWEST_ARMED_M, 150.0, &["drop.height_m"]),
    ("0 to 5", 0.0, 5.0, &["drop.drift_m_s"]),
    ("0.05 to 10", 0.05, 10.0, &["drop.rope_m"]),
    ("0 to 45", 0.0, 45.0, &["drop.tilt_max_deg"]),
    ("0 to 360", 0.0, 360.0, &["drop.rotation_max_deg_s"]),
    ("0 to 60", 0.0, 60.0, &["drop.release_after_s"]),
    // The motor filter covers scales from 0.7 to 1.3; a motor beyond is another motor.
    ("0.7 to 1.3", 0.7, 1.3, &["lot.impulse.mean", "lot.burn_time.mean"]),
    ("0 to 0.2", 0.0, 0.2, &["lot.impulse", "lot.burn_time"]),
    // Neither Kelvin nor Fahrenheit; propellants are sold for -30 to 55 degrees.
    ("degrees Celsius, -40 to 60", -40.0, 60.0, &["lot.temperature", "site.temperature_c"]),
    // The simulated world and the guidance have the standard's.
    ("9.80665", STANDARD_GRAVITY_M_S2, STANDARD_GRAVITY_M_S2, &["estimator.gravity_m_s2"]),
    // From the shore of the Dead Sea to above the highest road.
    ("-450 to 6000", -450.0, 6_000.0, &["site.altitude_m"]),
    // Beyond a slope of 15 degrees nothing stands.
    ("0 to 15", 0.0, 15.0, &["site.ground_slope_deg"]),
    // Close to a pole a path to the east circles the pole.
    ("-85 to 85", -85.0, 85.0, &["site.latitude_deg"]),
    ("-180 to 180", -180.0, 180.0, &["site.longitude_deg"]),
    // The feet stand up to half a metre below the nozzle.
    ("from -1 to 3", -1.0, 3.0, &["sensors"]),
    ("-1 to 1", -1.0, 1.0, &["exhaust"]),
    ("0 to 600", 0.0, 600.0, &["start.countdown_s"]),
    ("from 0 to 180", 0.0, 180.0, &["start.tilt_deg"]),
    ("from 0 to 1", 0.0, 1.0, &["start.carried_share", "ignition.place"]),
    ("from 0.001 to 1", 0.001, 1.0, &["powered.interval_s"]),
    ("0.001 to 0.02", 0.001, 0.02, &["estimator.frame_s", "motor.frame_s"]),
    // The loop remembers 24 frames.
    ("from 0 to 0.1", 0.0, 0.1, &["aim.latency_s"]),
    ("from 1 to 10", 1.0, 10.0, &["estimator.wind_passes"]),
    ("from 1 to 1000", 1.0, 1_000.0, &["powered.max_solves", "powered.solver.max_iterations"]),
    ("1 or more", 1.0, 1e6, &["powered.max_passes"]),
    ("from -10 to 10", -10.0, 10.0, &["powered.final.u_min_m_s", "powered.final.u_max_m_s"]),
    ("above 0 and below 90", LEAST, RIGHT, &["soft_tilt_deg", "fin_soft_tilt_deg", "descent.lean_max_deg",
        "descent.lean_at_ignition_deg", "powered.tilt_max_deg", "powered.gimbal_deg", "powered.guess_lean_deg", "powered.upright_lean_max_deg"]),
    ("a finite number above 0", LEAST, f64::MAX, &["caution_fades_s", "start.height_m", "descent.lean_fades_s",
        "descent.natural_frequency_rad_s", "descent.damping", "descent.time_to_go_min_s", "ignition.impulse_scales", "ignition.burn_time_scales",
        "ignition.fixed_height_m", "powered.homing.near_m", "powered.landing_miss", "powered.final", "powered.solver", "powered.weights.delta",
        // Without a weight the fins of a plan are not unique.
        "powered.weights.fins",
        "aim.natural_frequency_rad_s", "aim.damping", "aim.disturbance_time_s", "motor.shape_lasts_s", "gate", "leg_limits",
        "arming.tilt_max_deg", "arming.rotation_max_deg_s", "arming.speed_max_m_s", "estimator.gyro_noise_deg_s_sqrt_hz",
        "estimator.accelerometer_noise_mg_sqrt_hz", "estimator.barometer_m", "estimator.gnss_horizontal_m", "estimator.gnss_vertical_m",
        "estimator.gnss_velocity_m_s", "estimator.lidar_m", "estimator.gate_sigmas", "estimator.health"]),
    ("a finite number, 0 or more", 0.0, f64::MAX, &["caution_sigmas", "settle_s", "start", "descent", "ignition", "powered", "aim", "motor",
        "arming", "estimator"]),
];

/// The vehicle and its start, from which the controller is derived.
pub(super) fn vehicle(mission: &Mission) -> Check {
    if mission.name.trim().is_empty() {
        return Err(BadValue::new("name", &"\"\"", "a name"));
    }
    mission.airframe.validate().map_err(|bad| BadValue { key: format!("airframe.{}", bad.key), ..bad })?;
    numbers(mission, &|key| ["lot.", "launch.", "drop."].iter().any(|section| key.starts_with(section)))?;
    mission.launch.as_ref().map_or(Ok(()), Launch::validate)
}

/// The motor does not touch the tube before the gimbal meets its stop.
pub(super) fn room_to_swing(mission: &Mission) -> Check {
    let gimbal = &mission.airframe.gimbal;
    let free_rad = mission.airframe.gimbal_clearance_rad(&mission.motor_curve);
    if gimbal.limit_rad() <= free_rad {
        return Ok(());
    }
    let motor = mission.motor_curve.name();
    let found = format!("{}, and {motor} touches the tube at {:.1}", gimbal.limit_deg, free_rad.to_degrees());
    let required = "an angle that gimbal.pivot_station_m and gimbal.inside_diameter_m leave free";
    Err(BadValue::new("gimbal.limit_deg", &found, required))
}

/// All numbers of the mission that `looked_at` names, each in its range.
pub(super) fn numbers(mission: &Mission, looked_at: &dyn Fn(&str) -> bool) -> Check {
    let bad_text = |error: toml::ser::Error| BadValue::new("mission", &error, "values that a file can hold");
    let table = Value::try_from(mission).map_err(bad_text)?;
    each_number("", &table, &mut |key, found| {
        let range = RANGES.iter().find_map(|(required, least, most, keys)| {
            let holds =
                |of: &&str| key.strip_prefix(of).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
            keys.iter().any(holds).then_some((*required, *least..=*most))
        });
        match range {
            Some((required, range)) if looked_at(key) && !range.contains(&found) => {
                Err(BadValue::new(key, &found, required))
            }
            _ => Ok(()),
        }
    })?;
    let end = &mission.powered.final_box;
    for (key, [least, most]) in [
        ("ignition.impulse_scales", mission.ignition.impulse_scales),
        ("ignition.burn_time_scales", mission.ignition.burn_time_scales),
        ("powered.final.u_min_m_s", [end.u_min_m_s, end.u_max_m_s]),
    ] {
        if looked_at(key) && least > most {
            let found = format!("[{least}, {most}]");
            return Err(BadValue::new(key, &found, "two numbers, the smaller one first"));
        }
    }
    Ok(())
}

fn each_number(key: &str, value: &Value, look: &mut dyn FnMut(&str, f64) -> Check) -> Check {
    match value {
        Value::Table(table) => table.iter().try_for_each(|(name, value)| {
            let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
            each_number(&key, value, look)
        }),
        Value::Array(values) => values.iter().try_for_each(|value| each_number(key, value, look)),
        Value::Float(number) => look(key, *number),
        Value::Integer(number) => look(key, *number as f64),
        _ => Ok(()),
    }
}
