//! Range checks of a parsed profile: one line for each key.

use flight::guidance::controller::MAX_HORIZON_STEPS;
use flight::vehicle::profile::Profile;

use super::super::ranges::{self, Check, angle_below_right, finite, not_negative, positive, require};

pub(super) fn validate(profile: &Profile) -> Check {
    require(!profile.name.trim().is_empty(), "name", "\"\"", "a name")?;
    vehicle(profile)?;
    actuators(profile)?;
    start(profile)?;
    nmpc(profile)?;
    ranges::touchdown_limits(&profile.touchdown_limits)?;
    ranges::arming(&profile.arming)?;
    ranges::gate(&profile.gate)?;
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
    ranges::weights("nmpc", &nmpc.weights)?;
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
        ranges::final_box("nmpc.limits", end)?;
    }
    ranges::solver("nmpc", &nmpc.solver)?;
    let decay = profile.stabiliser.decay_rate_per_s;
    require(
        decay.is_finite() && decay > 0.0 && decay * nmpc.sample_time_s <= 2.0,
        "stabiliser.decay_rate_per_s",
        decay,
        "above 0 and at most 2 / nmpc.sample_time_s",
    )
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
