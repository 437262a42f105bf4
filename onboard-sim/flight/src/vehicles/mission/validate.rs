//! Range checks of a parsed mission: one line for each key.

use alloc::format;

use crate::control::aim::AimGains;
use crate::guidance::descent::DescentGains;
use crate::guidance::ignition::IgnitionSettings;
use crate::guidance::powered::PoweredSettings;
use crate::vehicle::lot::Lot;
use crate::vehicle::mission::{LegLimits, Mission, Start};

use super::super::ranges::{self, Check, angle_below_right, not_negative, positive, require, share};

/// Accepted altitudes of a pad, m: from the shore of the Dead Sea to above the highest road.
const PAD_ALTITUDES_M: core::ops::RangeInclusive<f64> = -450.0..=6_000.0;

/// All of the mission but its estimator's section, whose errors have a type of their own.
pub(super) fn validate(mission: &Mission) -> Check {
    require(!mission.name.trim().is_empty(), "name", "\"\"", "a name")?;
    mission.airframe.validate()?;
    mission.motor.validate()?;
    mission.lot.as_deref().map_or(Ok(()), Lot::validate)?;
    mission.exhaust.validate()?;
    // From the Moon to twice the Earth.
    require(
        (1.0..=20.0).contains(&mission.gravity_m_s2),
        "gravity_m_s2",
        mission.gravity_m_s2,
        "from 1 to 20",
    )?;
    require(
        PAD_ALTITUDES_M.contains(&mission.pad_altitude_m),
        "pad_altitude_m",
        mission.pad_altitude_m,
        "-450 to 6000",
    )?;
    if let Some((key, found, required)) = mission.site.bad_value() {
        require(false, key, found, required)?;
    }
    // The feet stand up to half a metre below the nozzle.
    require(
        (-1.0..=3.0).contains(&mission.lidar_ahead_of_feet_m),
        "lidar_ahead_of_feet_m",
        mission.lidar_ahead_of_feet_m,
        "from -1 to 3",
    )?;
    hedges(mission)?;
    start(&mission.start)?;
    if let Some(launch) = &mission.launch {
        launch.validate()?;
    }
    if let Some(drop) = &mission.drop {
        drop.validate()?;
    }
    descent(&mission.descent)?;
    ignition(&mission.ignition)?;
    powered(&mission.powered)?;
    aim(&mission.aim)?;
    ranges::arming(&mission.arming)?;
    ranges::gate(&mission.gate)?;
    legs(&mission.leg_limits)
}

/// The motor does not touch the tube before the gimbal meets its stop.
pub(super) fn room_to_swing(mission: &Mission) -> Check {
    let gimbal = &mission.airframe.gimbal;
    let free_rad = mission.airframe.gimbal_clearance_rad(&mission.motor_curve);
    let motor = mission.motor_curve.name();
    let found = format!("{}, and {motor} touches the tube at {:.1}", gimbal.limit_deg, free_rad.to_degrees());
    let required = "an angle that gimbal.pivot_station_m and gimbal.inside_diameter_m leave free";
    require(gimbal.limit_rad() <= free_rad, "gimbal.limit_deg", found, required)
}

fn hedges(mission: &Mission) -> Check {
    not_negative("caution_sigmas", mission.caution_sigmas)?;
    positive("caution_fades_s", mission.caution_fades_s)?;
    angle_below_right("soft_tilt_deg", mission.soft_tilt_deg)?;
    angle_below_right("fin_soft_tilt_deg", mission.fin_soft_tilt_deg)?;
    not_negative("settle_s", mission.settle_s)
}

fn start(start: &Start) -> Check {
    require((0.0..=600.0).contains(&start.countdown_s), "start.countdown_s", start.countdown_s, "0 to 600")?;
    positive("start.height_m", start.height_m)?;
    not_negative("start.distance_m", start.distance_m)?;
    not_negative("start.speed_m_s", start.speed_m_s)?;
    share("start.carried_share", start.carried_share)?;
    require((0.0..=180.0).contains(&start.tilt_deg), "start.tilt_deg", start.tilt_deg, "from 0 to 180")
}

fn descent(gains: &DescentGains) -> Check {
    angle_below_right("descent.lean_max_deg", gains.lean_max_deg)?;
    angle_below_right("descent.lean_at_ignition_deg", gains.lean_at_ignition_deg)?;
    positive("descent.lean_fades_s", gains.lean_fades_s)?;
    positive("descent.natural_frequency_rad_s", gains.natural_frequency_rad_s)?;
    not_negative("descent.stiffness_m3", gains.stiffness_m3)?;
    positive("descent.damping", gains.damping)?;
    not_negative("descent.roll_decay_per_s", gains.roll_decay_per_s)?;
    positive("descent.time_to_go_min_s", gains.time_to_go_min_s)
}

fn ignition(settings: &IgnitionSettings) -> Check {
    for (key, [least, greatest]) in [
        ("ignition.impulse_scales", settings.impulse_scales),
        ("ignition.burn_time_scales", settings.burn_time_scales),
    ] {
        let found = format!("[{least}, {greatest}]");
        let ordered = least > 0.0 && least <= greatest && greatest.is_finite();
        require(ordered, key, found, "two finite numbers above 0, the smaller one first")?;
    }
    share("ignition.place", settings.place)?;
    not_negative("ignition.delay_s", settings.delay_s)?;
    not_negative("ignition.arm_before_s", settings.arm_before_s)?;
    settings.fixed_height_m.map_or(Ok(()), |height_m| positive("ignition.fixed_height_m", height_m))
}

fn powered(settings: &PoweredSettings) -> Check {
    require(
        (1e-3..=1.0).contains(&settings.interval_s),
        "powered.interval_s",
        settings.interval_s,
        "from 0.001 to 1",
    )?;
    ranges::weights("powered", &settings.weights)?;
    angle_below_right("powered.tilt_max_deg", settings.tilt_max_deg)?;
    angle_below_right("powered.gimbal_deg", settings.gimbal_deg)?;
    positive("powered.homing.near_m", settings.homing.near_m)?;
    not_negative("powered.homing.reach_m_s2", settings.homing.reach_m_s2)?;
    ranges::final_box("powered", &settings.final_box)?;
    not_negative("powered.floor_rise_m_s", settings.floor_rise_m_s)?;
    not_negative("powered.latest_after_s", settings.latest_after_s)?;
    not_negative("powered.settled_s", settings.settled_s)?;
    not_negative("powered.flown_out_s", settings.flown_out_s)?;
    not_negative("powered.quiet_s", settings.quiet_s)?;
    not_negative("powered.contact_quiet_s", settings.contact_quiet_s)?;
    require(
        (1..=100).contains(&settings.max_solves),
        "powered.max_solves",
        settings.max_solves,
        "from 1 to 100",
    )?;
    require(
        settings.max_passes.is_none_or(|passes| passes >= 1),
        "powered.max_passes",
        settings.max_passes.unwrap_or_default(),
        "1 or more",
    )?;
    positive("powered.landing_miss", settings.landing_miss)?;
    not_negative("powered.upright_decay_per_s", settings.upright_decay_per_s)?;
    angle_below_right("powered.upright_lean_max_deg", settings.upright_lean_max_deg)?;
    angle_below_right("powered.guess_lean_deg", settings.guess_lean_deg)?;
    ranges::solver("powered", &settings.solver)
}

fn aim(gains: &AimGains) -> Check {
    positive("aim.natural_frequency_rad_s", gains.natural_frequency_rad_s)?;
    positive("aim.damping", gains.damping)?;
    // The loop remembers 24 frames.
    require((0.0..=0.1).contains(&gains.latency_s), "aim.latency_s", gains.latency_s, "from 0 to 0.1")?;
    positive("aim.disturbance_time_s", gains.disturbance_time_s)?;
    not_negative("aim.disturbance_max_rad_s2", gains.disturbance_max_rad_s2)?;
    not_negative("aim.play_deg", gains.play_deg)
}

fn legs(limits: &LegLimits) -> Check {
    positive("leg_limits.vertical_m_s", limits.vertical_m_s)?;
    positive("leg_limits.lateral_m_s", limits.lateral_m_s)?;
    positive("leg_limits.tilt_deg", limits.tilt_deg)?;
    positive("leg_limits.rate_deg_s", limits.rate_deg_s)
}
