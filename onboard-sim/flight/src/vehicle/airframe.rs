//! The vehicle as data: masses, shape, fins, gimbal, legs and parachute.
//!
//! Stations are heights above the nozzle exit of the upright vehicle, positive towards the nose.
//! The thrust goes through the gimbal's pivot. The controller's model and the simulated truth use
//! the same data.

use alloc::borrow::ToOwned as _;
use alloc::string::{String, ToString};
use serde::{Deserialize, Serialize};

use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use crate::vehicle::fins::{FinModel, sin_cos_deg};
use crate::vehicle::thrust_curve::ThrustCurve;

/// A vehicle.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Airframe {
    /// Name of a built-in landing motor, or the text of its `.eng` or `.rse` file.
    pub motor: String,
    /// How many independent igniters light the landing motor, 1 to 3.
    pub igniters: u32,
    /// The servos report where they are. If not, people must have seen them move before the vehicle
    /// is armed.
    pub servos_report: bool,
    /// Masses and their positions.
    pub mass: Mass,
    /// The fuselage.
    pub body: Body,
    pub fins: FinData,
    /// The thrust-vectoring actuator.
    pub gimbal: Gimbal,
    pub legs: Legs,
    /// The recovery parachute.
    pub parachute: Parachute,
}

/// A value is outside its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{key} is {found}; {required} is accepted")]
pub struct BadValue {
    /// The key, with its section.
    pub key: String,
    pub found: String,
    /// The accepted range, in words.
    pub required: &'static str,
}

impl BadValue {
    pub(crate) fn new(key: &str, found: &dyn ToString, required: &'static str) -> Self {
        Self { key: key.to_owned(), found: found.to_string(), required }
    }
}

impl Airframe {
    /// Checks that every value is inside its range.
    ///
    /// # Errors
    ///
    /// [`BadValue`] names the first key with a wrong value.
    pub fn validate(&self) -> Result<(), BadValue> {
        validate(self)
    }

    /// The fins' aerodynamic model.
    pub fn fin_model(&self) -> FinModel {
        FinModel {
            reference_area_m2: self.body.reference_area_m2,
            drag_coefficient: self.fins.drag_coefficient,
            lift_coefficient: self.fins.lift_coefficient,
            length_m: self.fins.length_m,
            body_diameter_m: self.body.diameter_m,
            from_y: sin_cos_deg(self.fins.from_y_deg - self.fins.hinge_off_deg),
        }
    }

    /// Drag area in a tail-first fall with all fins at one opening angle, m^2.
    pub fn drag_area_m2(&self, opening_rad: f64) -> f64 {
        self.unfinned_drag_area_m2(0.0) + self.fin_drag_area_m2(&[opening_rad; 4])
    }

    /// Drag area of body and legs in a tail-first fall, m^2, of which an exhaust takes a share of
    /// the body's: the legs stand outside of it.
    pub fn unfinned_drag_area_m2(&self, body_loss: f64) -> f64 {
        let body = &self.body;
        body.reference_area_m2 * body.axial_drag_coefficient * (1.0 - body_loss) + self.legs.drag_area_m2
    }

    /// Drag area of the fins together at their opening angles, m^2.
    pub fn fin_drag_area_m2(&self, openings_rad: &[f64; 4]) -> f64 {
        let each_m2 = self.fins.drag_coefficient * self.body.reference_area_m2;
        each_m2 * openings_rad.iter().map(|opening| libm::sin(*opening)).sum::<f64>()
    }

    /// Drag area of the fins, m^2, times their distance ahead of a centre of gravity, m, less that
    /// of the legs times their distance behind it: this turns the nose back into the wind in a
    /// tail-first fall, m^3. A drag `q A` along the wind has a moment of `q A x sin(lean)` about a
    /// point `x` away on the axis.
    pub fn restoring_m3(&self, fin_drag_area_m2: f64, cg_station_m: f64) -> f64 {
        fin_drag_area_m2 * (self.fins.station_m - cg_station_m)
            - self.legs.drag_area_m2 * (cg_station_m - self.legs.drag_station_m)
    }

    /// The same with the fins at their open stop, m^2.
    pub fn open_fin_drag_area_m2(&self) -> f64 {
        self.fin_drag_area_m2(&[self.fins.open_rad(); 4])
    }

    /// Arm of the thrust about a centre of gravity at a station, m: the motor swings about its
    /// pivot.
    pub fn thrust_arm_m(&self, cg_station_m: f64) -> f64 {
        cg_station_m - self.gimbal.pivot_station_m
    }

    /// Angular momentum that a swinging motor of this mass, kg, has for each rad/s of the gimbal,
    /// kg m^2: `m (k^2 + l a)`, with its radius of gyration `k` and the distances `l` from its
    /// middle up to the pivot and `a` up to the centre of gravity of all: its own, and that of its
    /// mass moving at `l` about a point `a` away (Koenig's theorem; H. Goldstein, Classical
    /// Mechanics, section 1.2). The body turns back by as much.
    pub fn swinging_kg_m2(&self, motor: &ThrustCurve, motor_kg: f64, cg_station_m: f64) -> f64 {
        let middle_m = self.mass.propellant_station_m;
        motor_kg
            * (motor.gyration_m2() + (self.gimbal.pivot_station_m - middle_m) * (cg_station_m - middle_m))
    }

    /// Angle at which the swinging motor touches the inside of the tube, rad: one of its rims, the
    /// one farther from the pivot, has `max(p, L - p) sin a + r cos a` to the side.
    pub fn gimbal_clearance_rad(&self, motor: &ThrustCurve) -> f64 {
        let above_m = motor.length_m() - self.gimbal.pivot_station_m;
        let (along_m, across_m) = (self.gimbal.pivot_station_m.max(above_m), 0.5 * motor.diameter_m());
        let reach_m = libm::hypot(along_m, across_m);
        libm::asin((0.5 * self.gimbal.inside_diameter_m / reach_m).min(1.0)) - libm::atan2(across_m, along_m)
    }

    /// Standard deviation of the earliest of the igniters' delays over that of one, if they are
    /// normal: sqrt(1 - 1 / pi) of two (H. A. David and H. N. Nagaraja, Order Statistics, 3rd
    /// edition, table 4.9.1 has the rest).
    pub fn igniter_scatter(&self) -> f64 {
        match self.igniters {
            0 | 1 => 1.0,
            2 => 0.825_645,
            _ => 0.747_975,
        }
    }

    /// Height of a station above the feet when upright, m.
    pub fn above_feet_m(&self, station_m: f64) -> f64 {
        station_m - self.legs.foot_station_m
    }
}

// Mass, centre of gravity and inertia as the propellant burns.

/// The mass properties at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    pub mass_kg: f64,
    /// Centre of gravity, m above the nozzle.
    pub cg_station_m: f64,
    /// Moment of inertia about the pitch or yaw axis through the centre of gravity, kg m^2.
    pub pitch_inertia_kg_m2: f64,
    /// Moment of inertia about the roll axis, kg m^2.
    pub roll_inertia_kg_m2: f64,
    /// Change of the pitch inertia per kilogram burnt, m^2; negative.
    pub pitch_inertia_slope_m2: f64,
}

/// The vehicle without propellant, and the place of the propellant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassModel {
    dry_mass_kg: f64,
    dry_cg_station_m: f64,
    dry_pitch_inertia_kg_m2: f64,
    roll_inertia_kg_m2: f64,
    propellant_mass_kg: f64,
    propellant_station_m: f64,
}

impl MassModel {
    /// Removes the propellant, a point mass on the axis, from the loaded vehicle (parallel axes: H.
    /// Goldstein, C. Poole and J. Safko, Classical Mechanics, 3rd edition, chapter 5).
    pub fn new(mass: &Mass, propellant_mass_kg: f64) -> Self {
        let dry_mass_kg = mass.loaded_kg - propellant_mass_kg;
        let moment_kg_m = mass.loaded_kg * mass.loaded_cg_station_m;
        let dry_cg_station_m = (moment_kg_m - propellant_mass_kg * mass.propellant_station_m) / dry_mass_kg;
        let reduced_kg = dry_mass_kg * propellant_mass_kg / mass.loaded_kg;
        let apart_m = dry_cg_station_m - mass.propellant_station_m;
        Self {
            dry_mass_kg,
            dry_cg_station_m,
            dry_pitch_inertia_kg_m2: mass.loaded_pitch_inertia_kg_m2 - reduced_kg * apart_m * apart_m,
            roll_inertia_kg_m2: mass.roll_inertia_kg_m2,
            propellant_mass_kg,
            propellant_station_m: mass.propellant_station_m,
        }
    }

    /// Mass without propellant, kg.
    pub fn dry_mass_kg(&self) -> f64 {
        self.dry_mass_kg
    }

    /// The same vehicle with all masses and inertias scaled.
    #[must_use]
    pub fn scaled(self, scale: f64) -> Self {
        Self {
            dry_mass_kg: self.dry_mass_kg * scale,
            dry_pitch_inertia_kg_m2: self.dry_pitch_inertia_kg_m2 * scale,
            roll_inertia_kg_m2: self.roll_inertia_kg_m2 * scale,
            propellant_mass_kg: self.propellant_mass_kg * scale,
            ..self
        }
    }

    /// The mass properties after some propellant has burnt, kg (limited to between none and all).
    pub fn at(&self, burnt_kg: f64) -> MassProperties {
        let left_kg = self.propellant_mass_kg - burnt_kg.clamp(0.0, self.propellant_mass_kg);
        let mass_kg = self.dry_mass_kg + left_kg;
        let moment_kg_m = self.dry_mass_kg * self.dry_cg_station_m + left_kg * self.propellant_station_m;
        let apart_m = self.dry_cg_station_m - self.propellant_station_m;
        let dry_share = self.dry_mass_kg / mass_kg;
        MassProperties {
            mass_kg,
            cg_station_m: moment_kg_m / mass_kg,
            pitch_inertia_kg_m2: self.dry_pitch_inertia_kg_m2 + left_kg * dry_share * apart_m * apart_m,
            roll_inertia_kg_m2: self.roll_inertia_kg_m2,
            pitch_inertia_slope_m2: -dry_share * dry_share * apart_m * apart_m,
        }
    }
}

// The sections of an airframe, one struct each, with their accessors in SI and radians.

/// Masses with the landing motor full, and the place of the propellant.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Mass {
    /// Mass with the landing motor full, kg.
    pub loaded_kg: f64,
    /// Centre of gravity with the landing motor full, m above the nozzle.
    pub loaded_cg_station_m: f64,
    /// Moment of inertia about the pitch or yaw axis through that centre of gravity, kg m^2.
    pub loaded_pitch_inertia_kg_m2: f64,
    /// Moment of inertia about the roll axis, kg m^2; the propellant's part is neglected.
    pub roll_inertia_kg_m2: f64,
    /// Middle of the propellant, m above the nozzle.
    #[serde(default)]
    pub propellant_station_m: f64,
}

/// The fuselage: a cylinder from the nozzle to the nose.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Length from nozzle to nose, m.
    pub length_m: f64,
    pub diameter_m: f64,
    /// Reference area of the axial drag coefficient and of the fins' coefficients, m^2.
    #[serde(default)]
    pub reference_area_m2: f64,
    /// Axial drag coefficient on the reference area.
    pub axial_drag_coefficient: f64,
    /// Crossflow drag coefficient on length times diameter.
    pub crossflow_drag_coefficient: f64,
}

impl Body {
    /// Its drag area when the air comes from the side, m^2.
    pub fn crossflow_area_m2(&self) -> f64 {
        self.crossflow_drag_coefficient * self.length_m * self.diameter_m
    }
}

/// The four fins and their servos. Opening angle from the body: 0 closed, 90 degrees deployed.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct FinData {
    /// Position of the hinges, m above the nozzle.
    pub station_m: f64,
    /// Length of a fin, m (the paper's L_f).
    pub length_m: f64,
    /// Width of a fin along the body's skin, m.
    #[serde(default)]
    pub width_m: f64,
    /// Angle from the y axis to the middle of a closed fin, degrees: 45 is a quarter of the skin
    /// for each.
    pub from_y_deg: f64,
    /// Angle from a fin's middle to its hinge, towards the y axis, degrees: where an open fin
    /// stands, and why it has a lift.
    pub hinge_off_deg: f64,
    /// Drag coefficient of an open fin on the body's reference area (Eq. 2).
    #[serde(default)]
    pub drag_coefficient: f64,
    /// Lift coefficient of an open fin on the body's reference area (Eq. 2).
    #[serde(default)]
    pub lift_coefficient: f64,
    /// Opening angle at the closed stop, degrees.
    pub closed_deg: f64,
    /// Opening angle at the open stop, degrees.
    pub open_deg: f64,
    /// Smallest opening angle used for control, degrees.
    pub control_min_deg: f64,
    /// The servo of each fin.
    pub servo: Servo,
}

impl FinData {
    /// Opening angle at the closed stop, rad.
    pub fn closed_rad(&self) -> f64 {
        self.closed_deg.to_radians()
    }

    /// Opening angle at the open stop, rad.
    pub fn open_rad(&self) -> f64 {
        self.open_deg.to_radians()
    }

    /// Smallest opening angle used for control, rad.
    pub fn control_min_rad(&self) -> f64 {
        self.control_min_deg.to_radians()
    }
}

/// The thrust-vectoring actuator: two axes with the same servo.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Gimbal {
    /// Mechanical stop on either side, degrees.
    pub limit_deg: f64,
    /// Where its two axes cross, m above the nozzle of the centred motor.
    #[serde(default)]
    pub pivot_station_m: f64,
    /// Inside diameter of the tube in which the motor swings, m.
    pub inside_diameter_m: f64,
    /// The servo of each axis.
    pub servo: Servo,
}

impl Gimbal {
    /// Mechanical stop on either side, rad.
    pub fn limit_rad(&self) -> f64 {
        self.limit_deg.to_radians()
    }
}

/// A servo: a pure delay, then a rate limit, then play between its horn and its load.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Servo {
    /// Slew rate under load, degrees per second.
    pub rate_deg_s: f64,
    /// Delay between a command and the first motion, s.
    pub delay_s: f64,
    /// Total play (backlash) between horn and load, degrees.
    pub slop_deg: f64,
}

impl Servo {
    /// Slew rate under load, rad/s.
    pub fn rate_rad_s(&self) -> f64 {
        self.rate_deg_s.to_radians()
    }

    /// Total play between horn and load, rad.
    pub fn slop_rad(&self) -> f64 {
        self.slop_deg.to_radians()
    }
}

/// Directions of the four legs from the axis, along body y and z.
pub const LEGS_AT: [[f64; 2]; 4] = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];

/// Four legs ([`LEGS_AT`]). Each has a spring and a damper along the vertical, and a foot with
/// friction.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Legs {
    /// Station of the feet, m above the nozzle; negative.
    pub foot_station_m: f64,
    /// Distance of each foot from the axis, m.
    pub foot_radius_m: f64,
    /// Stiffness of one leg, N/m.
    pub stiffness_n_m: f64,
    /// Damping of one leg, N s/m.
    pub damping_n_s_m: f64,
    /// Friction coefficient between foot and ground.
    pub friction_coefficient: f64,
    /// Drag area of the four together when they stand out, m^2.
    pub drag_area_m2: f64,
    /// Station at which it acts, m above the nozzle.
    pub drag_station_m: f64,
    /// The crushable element of each leg; without it the spring takes any load without a stop.
    pub crush: Option<Crush>,
}

/// A block above each foot that crushes at a nearly constant force, like foam, without recovery.
/// The foot slides along the body's axis in a guide, which a transverse force jams a little: the
/// foot moves when the axial force exceeds `force_n` plus `guide_share` times the transverse force.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Crush {
    /// Force along the body's axis that crushes the block, N.
    pub force_n: f64,
    /// Friction along the axis that the guide adds, over the force across it.
    pub guide_share: f64,
    /// Crush stroke of the foot, m.
    pub stroke_m: f64,
    /// Largest force at the foot that the leg bears in the plane of leg and axis, N.
    pub strength_n: f64,
    /// Largest force at the foot that it bears across that plane, N.
    pub strength_across_n: f64,
}

/// The recovery parachute, attached at the nose.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Parachute {
    /// Canopy area, m^2.
    pub area_m2: f64,
    /// Drag coefficient on the canopy area.
    pub drag_coefficient: f64,
    /// Time from the command until the lines are taut, s.
    pub ejection_delay_s: f64,
    /// Distance through the air from taut lines to the fully open canopy, m.
    #[serde(default)]
    pub inflation_distance_m: f64,
}

// Range checks of an airframe: one line for each key.

/// Longest servo delay, s: the length of the simulation's delay line.
const DELAY_MAX_S: f64 = 0.1;

const POSITIVE: &str = "a finite number above 0";
const NOT_NEGATIVE: &str = "a finite number, 0 or more,";

/// A key, its value, whether it is accepted, and the accepted range.
type RangeCheck = (&'static str, f64, bool, &'static str);

#[rustfmt::skip]
fn validate(airframe: &Airframe) -> Result<(), BadValue> {
    let Airframe { mass, body, fins, gimbal, legs, parachute, .. } = airframe;
    let positive = |key, value: f64| (key, value, value.is_finite() && value > 0.0, POSITIVE);
    let not_negative = |key, value: f64| (key, value, value.is_finite() && value >= 0.0, NOT_NEGATIVE);
    let row = |key, value: f64, ok: bool, words| (key, value, ok, words);
    let opening = |key, deg: f64| row(key, deg, (0.0..=90.0).contains(&deg), "0 (closed) to 90 (open)");
    let delay = |key, servo: &Servo| row(key, servo.delay_s, (0.0..=DELAY_MAX_S).contains(&servo.delay_s), "0 to 0.1");
    let slop = |key, servo: &Servo| row(key, servo.slop_deg, (0.0..10.0).contains(&servo.slop_deg), "0 or more and below 10");
    let in_front = |value: f64| (0.0..mass.loaded_cg_station_m).contains(&value);
    let (length_m, from_y_deg, foot_m) = (body.length_m, fins.from_y_deg, legs.foot_station_m);
    let apart_rad = (2.0 * from_y_deg).min(180.0 - 2.0 * from_y_deg).to_radians();
    let control_deg = fins.control_min_deg;
    let rows: [RangeCheck; 42] = [
        row("igniters", f64::from(airframe.igniters), (1..=3).contains(&airframe.igniters), "1 to 3"),
        positive("mass.loaded_kg", mass.loaded_kg),
        positive("mass.loaded_cg_station_m", mass.loaded_cg_station_m),
        positive("mass.loaded_pitch_inertia_kg_m2", mass.loaded_pitch_inertia_kg_m2),
        positive("mass.roll_inertia_kg_m2", mass.roll_inertia_kg_m2),
        row("mass.propellant_station_m", mass.propellant_station_m, in_front(mass.propellant_station_m),
            "0 or more and below mass.loaded_cg_station_m"),
        row("body.length_m", length_m, length_m > 0.0 && length_m <= 3.0, "above 0 to 3"),
        positive("body.diameter_m", body.diameter_m),
        positive("body.reference_area_m2", body.reference_area_m2),
        not_negative("body.axial_drag_coefficient", body.axial_drag_coefficient),
        not_negative("body.crossflow_drag_coefficient", body.crossflow_drag_coefficient),
        row("fins.station_m", fins.station_m, (0.0..=length_m).contains(&fins.station_m), "0 (the nozzle) to body.length_m"),
        positive("fins.length_m", fins.length_m),
        row("fins.from_y_deg", from_y_deg, from_y_deg > 0.0 && from_y_deg < 90.0, "above 0 and below 90"),
        row("fins.hinge_off_deg", fins.hinge_off_deg, fins.hinge_off_deg > 0.0 && fins.hinge_off_deg < from_y_deg,
            "above 0 (a fin hinged at its middle has no lift, and the roll no control) and below fins.from_y_deg"),
        row("fins.width_m", fins.width_m, fins.width_m > 0.0 && fins.width_m <= 0.5 * body.diameter_m * apart_rad,
            "above 0 and at most the arc between the middles of closed neighbours (wider fins overlap)"),
        not_negative("fins.drag_coefficient", fins.drag_coefficient),
        not_negative("fins.lift_coefficient", fins.lift_coefficient),
        opening("fins.closed_deg", fins.closed_deg),
        opening("fins.open_deg", fins.open_deg),
        opening("fins.control_min_deg", control_deg),
        row("fins.control_min_deg", control_deg, fins.closed_deg <= control_deg && control_deg < fins.open_deg,
            "fins.closed_deg or more and below fins.open_deg"),
        row("gimbal.limit_deg", gimbal.limit_deg, gimbal.limit_deg > 0.0 && gimbal.limit_deg < 90.0, "above 0 and below 90"),
        row("gimbal.pivot_station_m", gimbal.pivot_station_m, in_front(gimbal.pivot_station_m),
            "0 or more and below mass.loaded_cg_station_m"),
        row("gimbal.inside_diameter_m", gimbal.inside_diameter_m,
            gimbal.inside_diameter_m > 0.0 && gimbal.inside_diameter_m < body.diameter_m, "above 0 and below body.diameter_m"),
        positive("fins.servo.rate_deg_s", fins.servo.rate_deg_s),
        delay("fins.servo.delay_s", &fins.servo),
        slop("fins.servo.slop_deg", &fins.servo),
        positive("gimbal.servo.rate_deg_s", gimbal.servo.rate_deg_s),
        delay("gimbal.servo.delay_s", &gimbal.servo),
        slop("gimbal.servo.slop_deg", &gimbal.servo),
        row("legs.foot_station_m", foot_m, foot_m >= -length_m && foot_m < 0.0,
            "-body.length_m or more and below 0 (under the nozzle)"),
        positive("legs.foot_radius_m", legs.foot_radius_m),
        positive("legs.stiffness_n_m", legs.stiffness_n_m),
        not_negative("legs.drag_area_m2", legs.drag_area_m2),
        row("legs.drag_station_m", legs.drag_station_m, (foot_m..=length_m).contains(&legs.drag_station_m),
            "legs.foot_station_m to body.length_m"),
        not_negative("legs.damping_n_s_m", legs.damping_n_s_m),
        not_negative("legs.friction_coefficient", legs.friction_coefficient),
        positive("parachute.area_m2", parachute.area_m2),
        positive("parachute.drag_coefficient", parachute.drag_coefficient),
        not_negative("parachute.ejection_delay_s", parachute.ejection_delay_s),
        positive("parachute.inflation_distance_m", parachute.inflation_distance_m),
    ];
    let crush = legs.crush.iter().flat_map(|crush| {
        let half_weight_n = 0.5 * mass.loaded_kg * STANDARD_GRAVITY_M_S2;
        [
            row("legs.crush.force_n", crush.force_n, crush.force_n.is_finite() && crush.force_n > half_weight_n,
                "a finite number above half the loaded weight (the vehicle may stand on two feet)"),
            row("legs.crush.guide_share", crush.guide_share,
                crush.guide_share >= 0.0 && crush.guide_share * legs.friction_coefficient < 1.0,
                "0 or more and below 1 / legs.friction_coefficient (a foot that slides does not jam)"),
            row("legs.crush.stroke_m", crush.stroke_m, crush.stroke_m > 0.0 && crush.stroke_m < -foot_m,
                "above 0 and below -foot_station_m (the nozzle stays above the ground)"),
            row("legs.crush.strength_n", crush.strength_n, crush.strength_n.is_finite() && crush.strength_n > crush.force_n,
                "a finite number above legs.crush.force_n (the block gives way before the leg breaks)"),
            positive("legs.crush.strength_across_n", crush.strength_across_n),
        ]
    });
    match rows.into_iter().chain(crush).find(|(_, _, ok, _)| !ok) {
        Some((key, found, _, required)) => Err(BadValue::new(key, &found, required)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicles::mission::test_missions::TEST_MISSIONS;
    use crate::vehicles::mission::{BUILTIN, from_toml};
    use crate::vehicles::motors;

    #[test]
    fn every_airframe_is_sound_and_has_its_motor() {
        for (name, text) in BUILTIN.iter().chain(&TEST_MISSIONS) {
            let airframe = from_toml(text, name).unwrap().airframe;
            let motor = motors::builtin(&airframe.motor).unwrap();
            let propellant_kg = motor.propellant_mass_kg();
            let model = MassModel::new(&airframe.mass, propellant_kg);
            let (full, empty) = (model.at(0.0), model.at(propellant_kg));
            assert!(empty.pitch_inertia_kg_m2 > 0.0 && empty.pitch_inertia_kg_m2 < full.pitch_inertia_kg_m2);
            // A vehicle that falls for long is turned by its fins; one that is dropped must not be.
            let turned_by_fins = !name.starts_with("vlr");
            assert!(empty.cg_station_m > full.cg_station_m, "{name}");
            assert!(!turned_by_fins || empty.cg_station_m < airframe.fins.station_m, "{name}");
        }
    }

    /// The terminal speed with open fins is the landing paper's 39.4 m/s at 3 kg and sea level.
    #[test]
    fn val_landing_paper_terminal_speed_with_open_fins() {
        let (name, text) = TEST_MISSIONS[0];
        let airframe = from_toml(text, name).unwrap().airframe;
        let area_m2 = airframe.drag_area_m2(core::f64::consts::FRAC_PI_2);
        let speed_m_s = (2.0 * airframe.mass.loaded_kg * 9.806_65 / (1.225 * area_m2)).sqrt();
        assert!((speed_m_s - 39.4).abs() < 0.05, "{speed_m_s}");
    }

    #[test]
    fn a_bad_value_is_named_in_the_error() {
        let mut airframe = crate::vehicles::mission::builtin_airframe("mk2").unwrap();
        airframe.gimbal.limit_deg = -3.0;
        let error = airframe.validate().unwrap_err().to_string();
        assert_eq!(error, "gimbal.limit_deg is -3; above 0 and below 90 is accepted");
    }

    /// Quarters of the skin of a body of 74 mm are 58.1 mm wide. Turned by 15 degrees, neighbours
    /// are 38.7 mm apart on one side.
    #[test]
    fn val_hand_closed_fins_must_not_overlap() {
        let mk3 = crate::vehicles::mission::builtin_airframe("mk3").unwrap();
        for (width_m, from_y_deg, hinge_off_deg, wrong) in [
            (0.0581, 45.0, 15.0, None),
            (0.0582, 45.0, 15.0, Some("fins.width_m")),
            (0.0387, 30.0, 15.0, None),
            (0.0387, 60.0, 15.0, None),
            (0.0388, 30.0, 15.0, Some("fins.width_m")),
            (0.0388, 60.0, 15.0, Some("fins.width_m")),
            (0.0, 45.0, 15.0, Some("fins.width_m")),
            (0.058, 0.0, 15.0, Some("fins.from_y_deg")),
            (0.058, 90.0, 15.0, Some("fins.from_y_deg")),
            (0.058, f64::NAN, 15.0, Some("fins.from_y_deg")),
            (0.058, 45.0, 0.0, Some("fins.hinge_off_deg")),
            (0.058, 45.0, 45.0, Some("fins.hinge_off_deg")),
        ] {
            let mut airframe = mk3.clone();
            airframe.fins = FinData { width_m, from_y_deg, hinge_off_deg, ..airframe.fins };
            let found = airframe.validate().err().map(|bad| bad.key);
            assert_eq!(found.as_deref(), wrong, "{width_m} {from_y_deg}");
        }
    }

    /// It crushes under half the weight, jams, lets the nozzle touch the ground, or its leg breaks
    /// first.
    #[test]
    fn a_foot_that_cannot_give_way_is_named_in_the_error() {
        let mut airframe = crate::vehicles::mission::builtin_airframe("mk3").unwrap();
        let sound = airframe.legs.crush.unwrap();
        for (key, crush) in [
            ("legs.crush.force_n", Crush { force_n: 16.0, ..sound }),
            ("legs.crush.guide_share", Crush { guide_share: 1.7, ..sound }),
            ("legs.crush.guide_share", Crush { guide_share: -0.1, ..sound }),
            ("legs.crush.stroke_m", Crush { stroke_m: 0.1, ..sound }),
            ("legs.crush.strength_n", Crush { strength_n: 90.0, ..sound }),
            ("legs.crush.strength_across_n", Crush { strength_across_n: 0.0, ..sound }),
        ] {
            airframe.legs.crush = Some(crush);
            assert_eq!(airframe.validate().unwrap_err().key, key);
        }
    }

    /// The earlier of two independent delays of unit deviation: deviation sqrt(1 - 1 / pi). Of
    /// three: variance 1 + sqrt(3) / (2 pi) - 9 / (4 pi).
    #[test]
    fn val_order_statistics_the_earliest_of_several_igniters() {
        use core::f64::consts::PI;
        let scatter = |igniters| {
            let airframe = crate::vehicles::mission::builtin_airframe("mk2").unwrap();
            Airframe { igniters, ..airframe }.igniter_scatter()
        };
        assert!((scatter(1) - 1.0).abs() < 1e-12);
        assert!((scatter(2) - (1.0 - 1.0 / PI).sqrt()).abs() < 1e-6);
        assert!((scatter(3) - (1.0 + 3_f64.sqrt() / (2.0 * PI) - 9.0 / (4.0 * PI)).sqrt()).abs() < 1e-6);
    }

    #[test]
    fn a_single_igniter_is_the_default_and_the_number_has_a_range() {
        let mut airframe = crate::vehicles::mission::builtin_airframe("mk2").unwrap();
        assert_eq!(airframe.igniters, 1);
        for (igniters, ok) in [(0, false), (1, true), (3, true), (4, false)] {
            airframe.igniters = igniters;
            assert_eq!(airframe.validate().is_ok(), ok, "{igniters}");
        }
    }

    /// A 2 kg vehicle at 1 m with 1 kg of propellant at 0.25 m, worked by hand.
    #[test]
    fn val_hand_parallel_axes() {
        let loaded = Mass {
            loaded_kg: 3.0,
            loaded_cg_station_m: 0.75,
            loaded_pitch_inertia_kg_m2: 0.5,
            roll_inertia_kg_m2: 0.01,
            propellant_station_m: 0.25,
        };
        let model = MassModel::new(&loaded, 1.0);
        let full = model.at(0.0);
        assert!((full.mass_kg - 3.0).abs() < 1e-15 && (full.cg_station_m - 0.75).abs() < 1e-15);
        assert!((full.pitch_inertia_kg_m2 - 0.5).abs() < 1e-15);
        let empty = model.at(1.0);
        assert!((empty.mass_kg - 2.0).abs() < 1e-15 && (empty.cg_station_m - 1.0).abs() < 1e-15);
        // 0.5 - 2 (0.25)^2 - 1 (0.5)^2
        assert!((empty.pitch_inertia_kg_m2 - 0.125).abs() < 1e-15);
        let half = model.at(0.5);
        assert!((half.cg_station_m - 2.125 / 2.5).abs() < 1e-15);
        // 0.125 + 2 (0.15)^2 + 0.5 (0.6)^2
        assert!((half.pitch_inertia_kg_m2 - 0.35).abs() < 1e-15);
        let slope = (model.at(0.5001).pitch_inertia_kg_m2 - model.at(0.4999).pitch_inertia_kg_m2) / 2e-4;
        assert!((half.pitch_inertia_slope_m2 - slope).abs() < 1e-6);
    }
}
