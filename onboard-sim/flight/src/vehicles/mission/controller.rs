//! The controller settings that depend on the vehicle, as formulas. Settings common to all vehicles
//! are in `controller.toml`.
//!
//! Three numbers of a vehicle decide ([`EvenLanding`]): how long its thrust carries it, its fall
//! speed at ignition, and the lean needed to waste the surplus thrust. The factors are mk3's values
//! where the formula only scales them. They were chosen on seeds from 7001 on seven vehicles, and
//! each states its purpose.

use alloc::borrow::ToOwned as _;
use alloc::string::String;
use alloc::vec::Vec;
use core::f64::consts::PI;

use crate::guidance::descent::SHORT_FALL_M_S;
use crate::guidance::vertical::EvenLanding;
use crate::vehicle::airframe::Airframe;
use crate::vehicle::launch::Launch;
use crate::vehicle::mission::{LegLimits, Mission, StartPoint};
use crate::vehicle::thrust_curve::ThrustCurve;

/// The formulas of one mission: which keys its file states, and which of these are the
/// controller's.
pub(super) struct Formulas<'a> {
    pub(super) stated: &'a [String],
    pub(super) changed: Vec<String>,
}

impl Formulas<'_> {
    pub(super) fn states(&self, key: &str) -> bool {
        self.stated.iter().any(|stated| stated == key)
    }

    /// A value of the vehicle that its file may state.
    fn of_vehicle<T>(&self, key: &str, place: &mut T, value: T) {
        if !self.states(key) {
            *place = value;
        }
    }

    /// A value of the controller, which only a study states.
    fn of_controller<T>(&mut self, key: &str, place: &mut T, value: T) {
        if !self.states(key) {
            *place = value;
        } else if !self.changed.iter().any(|changed| changed == key) {
            self.changed.push(key.to_owned());
        }
    }

    /// Shape and balance derived from a builder's measurements.
    pub(super) fn airframe(&self, airframe: &mut Airframe, motor: &ThrustCurve) {
        /// Coefficients of a fin on its own area: the paper's 1.55 and 1.28 on a body of 0.0043 m2,
        /// for a fin of 58 by 100 mm.
        const FIN_DRAG: f64 = 1.149;
        const FIN_LIFT: f64 = 0.949;
        /// A saw's cut between two fins, m.
        const CUT_M: f64 = 1e-4;
        /// Inflation distance of a canopy over the root of its area: mk3's 20 m of 2.05 m2.
        const FILLS_PER_ROOT: f64 = 14.0;
        let of = |key: &str, place: &mut f64, value: f64| self.of_vehicle(key, place, value);
        let (mass, body, fins) = (&mut airframe.mass, &mut airframe.body, &mut airframe.fins);
        let middle_m = 0.5 * motor.length_m();
        of("airframe.mass.propellant_station_m", &mut mass.propellant_station_m, middle_m);
        // There the motor has most room to swing in the tube, and its weight stays on the axis.
        of("airframe.gimbal.pivot_station_m", &mut airframe.gimbal.pivot_station_m, middle_m);
        let diameter_m = body.diameter_m;
        let circle_m2 = 0.25 * PI * diameter_m * diameter_m;
        of("airframe.body.reference_area_m2", &mut body.reference_area_m2, circle_m2);
        of("airframe.fins.width_m", &mut fins.width_m, 0.25 * PI * diameter_m - CUT_M);
        let share = fins.length_m * fins.width_m / body.reference_area_m2;
        of("airframe.fins.drag_coefficient", &mut fins.drag_coefficient, FIN_DRAG * share);
        of("airframe.fins.lift_coefficient", &mut fins.lift_coefficient, FIN_LIFT * share);
        let fills_m = FILLS_PER_ROOT * libm::sqrt(airframe.parachute.area_m2);
        of("airframe.parachute.inflation_distance_m", &mut airframe.parachute.inflation_distance_m, fills_m);
    }

    /// The booster's, below a vehicle of this body.
    pub(super) fn launch(&self, launch: &mut Launch, airframe: &Airframe) {
        let booster = &mut launch.booster;
        let (diameter_m, radius_m) = (airframe.body.diameter_m, 0.5 * airframe.body.diameter_m);
        let of = |key: &str, place: &mut f64, value: f64| self.of_vehicle(key, place, value);
        // Half in its skin, half within: 0.63 of a tube's.
        let roll_kg_m2 = 0.63 * booster.dry_kg * radius_m * radius_m;
        of("launch.booster.roll_inertia_kg_m2", &mut booster.roll_inertia_kg_m2, roll_kg_m2);
        let middle_m = 0.5 * booster.motor_curve.length_m() - booster.length_m;
        of("launch.booster.propellant_station_m", &mut booster.propellant_station_m, middle_m);
        // A nose cap of 2 cm: a third of it behind its tip.
        of("launch.booster.nose.station_m", &mut booster.nose.station_m, airframe.body.length_m - 0.0067);
        booster.fin_force = booster.fins.force(diameter_m, -booster.length_m);
        booster.fin_radius_m = radius_m + 0.5 * booster.fins.span_m;
    }

    /// The controller of a vehicle.
    pub(super) fn controller(&mut self, mission: &mut Mission) {
        let EvenLanding { carried_s, speed_m_s, height_m, tilt_rad } = EvenLanding::of(mission);
        let motor = mission.motor;
        let airframe = mission.airframe.clone();
        let (legs, fins, parachute) = (&airframe.legs, &airframe.fins, &airframe.parachute);
        let mut of = |key: &str, place: &mut f64, value: f64| self.of_controller(key, place, value);

        // Room beyond the even tilt for a motor that is stronger.
        let even_deg = tilt_rad.unwrap_or_default().to_degrees();
        let soft_deg = (even_deg + 8.0).clamp(38.0, 66.0);
        of("soft_tilt_deg", &mut mission.soft_tilt_deg, soft_deg);
        of("fin_soft_tilt_deg", &mut mission.fin_soft_tilt_deg, soft_deg);
        let powered = &mut mission.powered;
        // The more thrust there is, the faster an error of its time becomes one of height: a strong
        // motor ends its plan higher.
        let floor_m_s = (0.47 + 0.045 * (even_deg - 27.0)).clamp(0.47, 1.2);
        of("powered.floor_rise_m_s", &mut powered.floor_rise_m_s, floor_m_s);
        // It sinks no faster than the floor at its end, less a tenth of a metre per second for the
        // last interval.
        let end = &mut powered.final_box;
        of("powered.final.u_min_m_s", &mut end.u_min_m_s, 0.11 - floor_m_s);
        of("powered.final.u_max_m_s", &mut end.u_max_m_s, -0.05 - 0.35 * (floor_m_s - 0.47));
        // The planner's room beyond the soft tilt.
        of("powered.tilt_max_deg", &mut powered.tilt_max_deg, (soft_deg + 10.0).max(45.0));
        // A lean moves a vehicle by g t^2. With four times as much one far from the pad hurries
        // there, and 1 flight in 200 more does not stop in time.
        of("powered.weights.x", &mut powered.weights.x, 0.5 * libm::pow(4.32 / carried_s, 4.0));
        // Half of the height at most.
        let reach_m_s2 = 0.53 * height_m / (carried_s * carried_s);
        of("powered.homing.reach_m_s2", &mut powered.homing.reach_m_s2, reach_m_s2);
        let interval_s = (carried_s / 29.0).clamp(0.15, 0.2);
        of("powered.interval_s", &mut powered.interval_s, interval_s);
        // A foot of a vehicle that leans touches early, and a short burn has no time to be upright
        // early. With 0.2 s mk3 met the ground inside its legs' design in 469 of 500 `real`
        // flights, with 0.3, 0.4, 0.5 and 0.6 in 476, 484, 482 and 479; in `wild` more than 0.3
        // costs landings.
        of("powered.settled_s", &mut powered.settled_s, 0.06 * carried_s);
        // The rest is the attitude loop's.
        of("powered.gimbal_deg", &mut powered.gimbal_deg, 0.72 * airframe.gimbal.limit_deg);

        // A slow fall meets the wind at a larger angle and turns back slowly; and where the
        // parachute is decided before the ignition, the vehicle must be upright by then.
        let fills_m = speed_m_s * parachute.ejection_delay_s + parachute.inflation_distance_m;
        let fades_s = libm::pow(33.7 / speed_m_s, 2.0) + 4.0 * (fills_m - height_m).max(0.0) / speed_m_s;
        let descent = &mut mission.descent;
        of("descent.lean_fades_s", &mut descent.lean_fades_s, fades_s.clamp(1.0, 3.0));
        let arm_m = fins.station_m - airframe.mass.loaded_cg_station_m;
        let fins_m2 = airframe.open_fin_drag_area_m2();
        let steers = arm_m >= 0.1 * airframe.body.length_m;
        // Legs that drag by 0.010 m2 more or less than the airframe's leave mk3 50 degrees and 6 dB
        // of margin.
        let stiffness_m3 = if steers { 0.69 * fins_m2 * arm_m } else { 0.0 };
        of("descent.stiffness_m3", &mut descent.stiffness_m3, stiffness_m3);
        if !steers {
            // Fins near the centre of gravity do not turn the vehicle: they only act against roll.
            of("descent.lean_max_deg", &mut descent.lean_max_deg, 0.2);
            of("descent.lean_at_ignition_deg", &mut descent.lean_at_ignition_deg, 0.1);
            of("descent.natural_frequency_rad_s", &mut descent.natural_frequency_rad_s, 0.05);
        }

        let estimator = &mut mission.estimator;
        of("estimator.ground_slope_deg", &mut estimator.ground_slope_deg, mission.site.ground_slope_deg);
        of("motor.shape_lasts_s", &mut mission.motor.shape_lasts_s, carried_s / 3.0);
        let aim = &mut mission.aim;
        let servo = &airframe.gimbal.servo;
        of("aim.latency_s", &mut aim.latency_s, servo.delay_s + mission.estimator.frame_s);
        // A hobby linkage wears.
        of("aim.play_deg", &mut aim.play_deg, servo.slop_deg + 0.4);
        // A drop in wind turns the vehicle: with 20 degrees some flights end under a parachute that
        // has no room.
        let tilt_max_deg = if mission.start.at == StartPoint::Drone { 35.0 } else { 20.0 };
        of("gate.tilt_max_deg", &mut mission.gate.tilt_max_deg, tilt_max_deg);

        // In a short fall fins ahead of the centre of gravity brake little, and turn the vehicle
        // into a wind that is as fast.
        let opens_fins = speed_m_s > SHORT_FALL_M_S || arm_m < 0.03 * airframe.body.length_m;
        self.of_controller("descent.opens_fins", &mut mission.descent.opens_fins, opens_fins);
        // Motors within this many deviations of the expectation.
        let around = |sigmas: f64, sigma: f64| [1.0 - sigmas * sigma, 1.0 + sigmas * sigma];
        let ignition = &mut mission.ignition;
        let scales = around(1.67, motor.impulse_sigma);
        self.of_controller("ignition.impulse_scales", &mut ignition.impulse_scales, scales);
        let scales = around(2.0, motor.burn_time_sigma);
        self.of_controller("ignition.burn_time_scales", &mut ignition.burn_time_scales, scales);
        let intervals = libm::ceil((carried_s + powered.latest_after_s) / powered.interval_s).min(60.0);
        // A plan then takes at most 22 million instructions of a Cortex-M7
        // (onboard-sim/lab/cortex-m7/README.md): the last iteration, which is finished, is about
        // five passes over every interval. With twice the passes no more flights land, because the
        // plan comes later (`cargo bench --bench work`).
        let passes = (1_230.0 - 5.0 * intervals) as usize;
        self.of_controller("powered.max_passes", &mut powered.max_passes, Some(passes));

        // Default design limits of legs: crushable ones bear more.
        let designed = match legs.crush {
            Some(_) => LegLimits { vertical_m_s: 1.5, lateral_m_s: 0.7, tilt_deg: 10.0, rate_deg_s: 60.0 },
            None => LegLimits { vertical_m_s: 1.0, lateral_m_s: 0.7, tilt_deg: 10.0, rate_deg_s: 30.0 },
        };
        self.of_vehicle("leg_limits.vertical_m_s", &mut mission.leg_limits, designed);
        if let Some(launch) = &mut mission.launch {
            // Half the drift of the fall in 1 m/s of wind: the stack that turns into the wind makes
            // up for the rest.
            let falls_s = mission.start.height_m / speed_m_s;
            self.of_vehicle("launch.rail.upwind_s", &mut launch.rail.upwind_s, libm::round(falls_s));
        }
    }
}
