//! Range checks of an airframe: one line for each key.

use super::{Airframe, BadValue, Servo};

type Check = Result<(), BadValue>;

/// Longest servo delay, s: the length of the simulation's delay line.
const DELAY_MAX_S: f64 = 0.1;

fn require(ok: bool, key: &'static str, found: f64, required: &'static str) -> Check {
    if ok { Ok(()) } else { Err(BadValue { key, found, required }) }
}

fn positive(key: &'static str, value: f64) -> Check {
    require(value.is_finite() && value > 0.0, key, value, "a finite number above 0")
}

fn not_negative(key: &'static str, value: f64) -> Check {
    require(value.is_finite() && value >= 0.0, key, value, "a finite number, 0 or more,")
}

pub(super) fn validate(airframe: &Airframe) -> Check {
    igniter(airframe)?;
    masses(airframe)?;
    shape(airframe)?;
    actuators(airframe)?;
    recovery(airframe)
}

fn igniter(airframe: &Airframe) -> Check {
    let scale = airframe.igniter.scatter_scale;
    require((0.0..=3.0).contains(&scale), "igniter.scatter_scale", scale, "0 (no scatter) to 3")
}

fn masses(airframe: &Airframe) -> Check {
    let mass = &airframe.mass;
    positive("mass.loaded_kg", mass.loaded_kg)?;
    positive("mass.loaded_cg_station_m", mass.loaded_cg_station_m)?;
    positive("mass.loaded_pitch_inertia_kg_m2", mass.loaded_pitch_inertia_kg_m2)?;
    positive("mass.roll_inertia_kg_m2", mass.roll_inertia_kg_m2)?;
    require(
        (0.0..mass.loaded_cg_station_m).contains(&mass.propellant_station_m),
        "mass.propellant_station_m",
        mass.propellant_station_m,
        "0 or more and below mass.loaded_cg_station_m",
    )
}

fn shape(airframe: &Airframe) -> Check {
    let (body, fins) = (&airframe.body, &airframe.fins);
    positive("body.length_m", body.length_m)?;
    positive("body.diameter_m", body.diameter_m)?;
    positive("body.reference_area_m2", body.reference_area_m2)?;
    not_negative("body.axial_drag_coefficient", body.axial_drag_coefficient)?;
    not_negative("body.crossflow_drag_coefficient", body.crossflow_drag_coefficient)?;
    require(
        (0.0..=body.length_m).contains(&fins.station_m),
        "fins.station_m",
        fins.station_m,
        "0 (the nozzle) to body.length_m",
    )?;
    positive("fins.length_m", fins.length_m)?;
    not_negative("fins.drag_coefficient", fins.drag_coefficient)?;
    not_negative("fins.lift_coefficient", fins.lift_coefficient)
}

fn actuators(airframe: &Airframe) -> Check {
    let (fins, gimbal) = (&airframe.fins, &airframe.gimbal);
    for (key, value_deg) in [
        ("fins.closed_deg", fins.closed_deg),
        ("fins.open_deg", fins.open_deg),
        ("fins.control_min_deg", fins.control_min_deg),
    ] {
        require((0.0..=90.0).contains(&value_deg), key, value_deg, "0 (closed) to 90 (open)")?;
    }
    require(
        fins.closed_deg <= fins.control_min_deg && fins.control_min_deg < fins.open_deg,
        "fins.control_min_deg",
        fins.control_min_deg,
        "fins.closed_deg or more and below fins.open_deg",
    )?;
    require(
        gimbal.limit_deg > 0.0 && gimbal.limit_deg < 90.0,
        "gimbal.limit_deg",
        gimbal.limit_deg,
        "above 0 and below 90",
    )?;
    servo(&fins.servo, ["fins.servo.rate_deg_s", "fins.servo.delay_s", "fins.servo.slop_deg"])?;
    servo(&gimbal.servo, ["gimbal.servo.rate_deg_s", "gimbal.servo.delay_s", "gimbal.servo.slop_deg"])
}

fn servo(servo: &Servo, [rate, delay, slop]: [&'static str; 3]) -> Check {
    positive(rate, servo.rate_deg_s)?;
    require((0.0..=DELAY_MAX_S).contains(&servo.delay_s), delay, servo.delay_s, "0 to 0.1")?;
    require((0.0..10.0).contains(&servo.slop_deg), slop, servo.slop_deg, "0 or more and below 10")
}

fn recovery(airframe: &Airframe) -> Check {
    let (legs, parachute) = (&airframe.legs, &airframe.parachute);
    require(
        legs.foot_station_m.is_finite() && legs.foot_station_m < 0.0,
        "legs.foot_station_m",
        legs.foot_station_m,
        "a finite number below 0 (under the nozzle)",
    )?;
    positive("legs.foot_radius_m", legs.foot_radius_m)?;
    positive("legs.stiffness_n_m", legs.stiffness_n_m)?;
    not_negative("legs.damping_n_s_m", legs.damping_n_s_m)?;
    not_negative("legs.friction_coefficient", legs.friction_coefficient)?;
    positive("parachute.area_m2", parachute.area_m2)?;
    positive("parachute.drag_coefficient", parachute.drag_coefficient)?;
    not_negative("parachute.ejection_delay_s", parachute.ejection_delay_s)?;
    positive("parachute.inflation_distance_m", parachute.inflation_distance_m)
}
