//! Range checks of a parsed profile: one line for each key.

use alloc::string::{String, ToString as _};
use core::fmt::Display;

use flight::guidance::controller::MAX_HORIZON_STEPS;
use flight::vehicle::profile::Profile;

/// A value outside its range.
pub(super) struct BadValue {
    pub(super) key: &'static str,
    pub(super) found: String,
    pub(super) required: &'static str,
}

type Check = Result<(), BadValue>;

fn require(ok: bool, key: &'static str, found: impl Display, required: &'static str) -> Check {
    if ok { Ok(()) } else { Err(BadValue { key, found: found.to_string(), required }) }
}

fn finite(key: &'static str, value: f64) -> Check {
    require(value.is_finite(), key, value, "a finite number")
}

fn positive(key: &'static str, value: f64) -> Check {
    require(value.is_finite() && value > 0.0, key, value, "a finite number above 0")
}

fn not_negative(key: &'static str, value: f64) -> Check {
    require(value.is_finite() && value >= 0.0, key, value, "a finite number, 0 or more")
}

fn angle_below_right(key: &'static str, value_deg: f64) -> Check {
    require(value_deg > 0.0 && value_deg < 90.0, key, value_deg, "above 0 and below 90")
}

pub(super) fn validate(profile: &Profile) -> Check {
    require(!profile.name.trim().is_empty(), "name", "\"\"", "a name")?;
    vehicle(profile)?;
    actuators(profile)?;
    start(profile)?;
    nmpc(profile)?;
    limits(profile)?;
    if let Some((key, found, required)) = profile.site.bad_value() {
        require(false, key, found, required)?;
    }
    scatter(profile)
}

fn vehicle(profile: &Profile) -> Check {
    let vehicle = &profile.vehicle;
    positive("vehicle.mass_kg", vehicle.mass_kg)?;
    positive("vehicle.pitch_inertia_kg_m2", vehicle.pitch_inertia_kg_m2)?;
    positive("vehicle.length_m", vehicle.length_m)?;
    positive("vehicle.diameter_m", vehicle.diameter_m)?;
    positive("vehicle.reference_area_m2", vehicle.reference_area_m2)?;
    not_negative("vehicle.drag_coefficient", vehicle.drag_coefficient)?;
    finite("vehicle.nozzle_from_mid_m", vehicle.nozzle_from_mid_m)?;
    require(
        vehicle.cg_from_mid_m.is_finite() && vehicle.thrust_arm_m() > 0.0,
        "vehicle.cg_from_mid_m",
        vehicle.cg_from_mid_m,
        "finite and forward of the nozzle (above vehicle.nozzle_from_mid_m)",
    )?;
    positive("environment.gravity_m_s2", profile.environment.gravity_m_s2)?;
    not_negative("environment.air_density_kg_m3", profile.environment.air_density_kg_m3)?;
    positive("motor.thrust_n", profile.motor.thrust_n)?;
    positive("motor.burn_time_s", profile.motor.burn_time_s)?;
    require(
        profile.plant.thrust_scale.is_finite() && (0.0..=2.0).contains(&profile.plant.thrust_scale),
        "plant.thrust_scale",
        profile.plant.thrust_scale,
        "from 0 to 2",
    )
}

fn actuators(profile: &Profile) -> Check {
    angle_below_right("gimbal.limit_deg", profile.gimbal.limit_deg)?;
    if let Some(rate) = profile.gimbal.rate_limit_deg_s {
        positive("gimbal.rate_limit_deg_s", rate)?;
    }
    let fins = &profile.fins;
    for (key, value) in [("fins.closed_deg", fins.closed_deg), ("fins.deployed_deg", fins.deployed_deg)] {
        require((0.0..=90.0).contains(&value), key, value, "from 0 (closed) to 90 (open)")?;
    }
    positive("fins.rate_limit_deg_s", fins.rate_limit_deg_s)
}

fn start(profile: &Profile) -> Check {
    let start = &profile.start;
    finite("start.x_m", start.x_m)?;
    not_negative("start.altitude_m", start.altitude_m)?;
    require(
        (0.0..=180.0).contains(&start.pitch_deg),
        "start.pitch_deg",
        start.pitch_deg,
        "from 0 to 180 (90 is upright)",
    )?;
    finite("start.u_m_s", start.u_m_s)?;
    finite("start.w_m_s", start.w_m_s)?;
    finite("start.pitch_rate_deg_s", start.pitch_rate_deg_s)?;
    not_negative("start.countdown_s", start.countdown_s)
}

fn nmpc(profile: &Profile) -> Check {
    let nmpc = &profile.nmpc;
    require(
        (1e-3..=1.0).contains(&nmpc.sample_time_s),
        "nmpc.sample_time_s",
        nmpc.sample_time_s,
        "from 0.001 to 1",
    )?;
    require(
        (1..=MAX_HORIZON_STEPS).contains(&nmpc.horizon_steps),
        "nmpc.horizon_steps",
        nmpc.horizon_steps,
        "from 1 to 200",
    )?;
    require(
        nmpc.actuation_delay_steps == 1,
        "nmpc.actuation_delay_steps",
        nmpc.actuation_delay_steps,
        "1: a command is applied one sample after the state it answers",
    )?;
    let weights = &nmpc.weights;
    not_negative("nmpc.weights.x", weights.x)?;
    not_negative("nmpc.weights.z", weights.z)?;
    not_negative("nmpc.weights.theta", weights.theta)?;
    not_negative("nmpc.weights.u", weights.u)?;
    not_negative("nmpc.weights.w", weights.w)?;
    not_negative("nmpc.weights.q", weights.q)?;
    positive("nmpc.weights.delta", weights.delta)?;
    angle_below_right("nmpc.limits.gimbal_deg", nmpc.limits.gimbal_deg)?;
    require(
        nmpc.limits.gimbal_deg <= profile.gimbal.limit_deg,
        "nmpc.limits.gimbal_deg",
        nmpc.limits.gimbal_deg,
        "at most gimbal.limit_deg",
    )?;
    positive("nmpc.limits.x_final_m", nmpc.limits.x_final_m)?;
    if let Some(altitude_min_m) = nmpc.limits.altitude_min_m {
        finite("nmpc.limits.altitude_min_m", altitude_min_m)?;
    }
    if let Some(end) = &nmpc.limits.final_box {
        require(
            (1..=nmpc.horizon_steps).contains(&end.settled_nodes),
            "nmpc.limits.final.settled_nodes",
            end.settled_nodes,
            "from 1 to nmpc.horizon_steps",
        )?;
        positive("nmpc.limits.final.pitch_error_deg", end.pitch_error_deg)?;
        finite("nmpc.limits.final.u_max_m_s", end.u_max_m_s)?;
        require(
            end.u_min_m_s.is_finite() && end.u_min_m_s < end.u_max_m_s,
            "nmpc.limits.final.u_min_m_s",
            end.u_min_m_s,
            "finite and below nmpc.limits.final.u_max_m_s",
        )?;
        positive("nmpc.limits.final.w_m_s", end.w_m_s)?;
        positive("nmpc.limits.final.pitch_rate_deg_s", end.pitch_rate_deg_s)?;
    }
    let solver = &nmpc.solver;
    require(
        (1..=1000).contains(&solver.max_iterations),
        "nmpc.solver.max_iterations",
        solver.max_iterations,
        "from 1 to 1000",
    )?;
    require(
        solver.max_iterations_after_miss <= solver.max_iterations,
        "nmpc.solver.max_iterations_after_miss",
        solver.max_iterations_after_miss,
        "at most nmpc.solver.max_iterations",
    )?;
    positive("nmpc.solver.kkt_tolerance", solver.kkt_tolerance)?;
    positive("nmpc.solver.terminal_penalty", solver.terminal_penalty)?;
    require(
        (1..=1000).contains(&solver.qp_max_iterations),
        "nmpc.solver.qp_max_iterations",
        solver.qp_max_iterations,
        "from 1 to 1000",
    )?;
    require(
        (0.0..=1.0).contains(&solver.guess_amplitude_rad),
        "nmpc.solver.guess_amplitude_rad",
        solver.guess_amplitude_rad,
        "from 0 to 1",
    )?;
    require(
        (1..=10).contains(&solver.guess_half_waves),
        "nmpc.solver.guess_half_waves",
        solver.guess_half_waves,
        "from 1 to 10",
    )?;
    let decay = profile.stabiliser.decay_rate_per_s;
    require(
        decay.is_finite() && decay > 0.0 && decay * nmpc.sample_time_s <= 2.0,
        "stabiliser.decay_rate_per_s",
        decay,
        "above 0 and at most 2 / nmpc.sample_time_s",
    )
}

fn limits(profile: &Profile) -> Check {
    let touchdown = &profile.touchdown_limits;
    positive("touchdown_limits.x_m", touchdown.x_m)?;
    finite("touchdown_limits.altitude_min_m", touchdown.altitude_min_m)?;
    require(
        touchdown.altitude_max_m.is_finite() && touchdown.altitude_max_m > touchdown.altitude_min_m,
        "touchdown_limits.altitude_max_m",
        touchdown.altitude_max_m,
        "finite and above touchdown_limits.altitude_min_m",
    )?;
    positive("touchdown_limits.pitch_error_deg", touchdown.pitch_error_deg)?;
    positive("touchdown_limits.u_m_s", touchdown.u_m_s)?;
    positive("touchdown_limits.w_m_s", touchdown.w_m_s)?;
    positive("touchdown_limits.pitch_rate_deg_s", touchdown.pitch_rate_deg_s)?;
    let arming = &profile.arming;
    positive("arming.tilt_max_deg", arming.tilt_max_deg)?;
    positive("arming.rotation_max_deg_s", arming.rotation_max_deg_s)?;
    positive("arming.speed_max_m_s", arming.speed_max_m_s)?;
    let gate = &profile.gate;
    positive("gate.tilt_max_deg", gate.tilt_max_deg)?;
    positive("gate.pitch_rate_max_deg_s", gate.pitch_rate_max_deg_s)?;
    positive("gate.speed_error_max_fraction", gate.speed_error_max_fraction)?;
    positive("gate.height_disagreement_max_m", gate.height_disagreement_max_m)?;
    positive("gate.fence_radius_m", gate.fence_radius_m)
}

fn scatter(profile: &Profile) -> Check {
    let sigma = &profile.dispersion;
    not_negative("dispersion.thrust_fraction", sigma.thrust_fraction)?;
    not_negative("dispersion.u_m_s", sigma.u_m_s)?;
    not_negative("dispersion.w_m_s", sigma.w_m_s)?;
    not_negative("dispersion.pitch_deg", sigma.pitch_deg)?;
    not_negative("dispersion.pitch_rate_deg_s", sigma.pitch_rate_deg_s)?;
    not_negative("dispersion.altitude_m", sigma.altitude_m)
}
