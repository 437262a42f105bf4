//! Deviations of the true vehicle and weather of one flight from the nominal data, and their
//! faults. A campaign draws these values for each flight.

use std::borrow::Cow;

use flight::vehicle::mission::Mission;
use flight::vehicle::thrust_curve::ThrustCurve;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::plant::WorldError;

flight::with_defaults! {
    /// The true parameters of one flight. [`Truth::default`] is the nominal data in still air.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields, default)]
    pub struct Truth {
        /// True impulse over the motor file's.
        pub impulse_scale: f64 = 1.0,
        /// True burn time over the motor file's.
        pub burn_time_scale: f64 = 1.0,
        /// Position of the motor's curve between the mission's and the last of its other curves, 0
        /// to 1.
        pub other_curve: f64 = 0.0,
        /// Time from the ignition command to the first thrust, s. The nominal one is for thrust at
        /// once, and contains half of the rise that `draw` expects.
        pub ignition_delay_s: f64 = 0.24,
        /// The motor chuffs: it burns for the first time, goes out for the second, and then
        /// reignites, s.
        pub chuff_s: [f64; 2] = [0.0; 2],
        /// Time in which the thrust rises to the curve's, s.
        pub thrust_rise_s: f64 = 0.0,
        /// Thrust direction with the gimbal at its centre, as gimbal angles (pitch, yaw), rad.
        pub thrust_misalignment_rad: [f64; 2] = [0.0; 2],
        /// Offset of the thrust from the axis, along body (y, z), m.
        pub thrust_offset_m: [f64; 2] = [0.0; 2],
        /// True mass and inertia over the data's.
        pub mass_scale: f64 = 1.0,
        /// True aerodynamic force over the model's.
        pub drag_scale: f64 = 1.0,
        /// Offset of the true from the nominal centre of gravity, in body axes (x towards the
        /// nose), m.
        pub cg_offset_m: [f64; 3] = [0.0; 3],
        /// Mean wind 10 m above the ground, m/s.
        pub wind_m_s: f64 = 0.0,
        /// Direction that the wind blows to, from world x towards world y, rad.
        pub wind_towards_rad: f64 = 0.0,
        /// Gust intensity over that of the military standard; 0 is none.
        pub gust_scale: f64 = 1.0,
        /// Exponent of the mean wind's power law over height.
        pub wind_exponent: f64 = crate::world::wind::EXPONENT,
        /// Turn of the mean wind's direction with height, from world x towards world y, rad/m.
        pub wind_veer_rad_m: f64 = 0.0,
        /// Shape of the thrust curve: the file's thrust is multiplied by `1 + sum over k of a_k
        /// cos(k pi s)`, k from 1, where `s` is the fraction of the impulse already delivered. The
        /// impulse stays the same: over a complete burn each term's integral is zero.
        pub thrust_shape: [f64; SHAPE_TERMS] = [0.0; SHAPE_TERMS],
        /// Fractions of drag that the exhaust takes away while the motor burns: of the body along
        /// its axis, and of the fins.
        pub plume_body_loss: f64 = 0.0,
        pub plume_fin_loss: f64 = 0.0,
        /// Factors on the drag along the body, on the fins and on the drag across the body, each
        /// beside `drag_scale`.
        pub body_drag_scale: f64 = 1.0,
        pub fin_drag_scale: f64 = 1.0,
        pub crossflow_scale: f64 = 1.0,
        /// Force of a fin away from the axis, over its drag times the cosine of its opening.
        pub fin_radial: f64 = 0.0,
        /// Drag area of the legs beside the airframe's, m^2.
        pub leg_drag_m2: f64 = 0.0,
        /// True moments of inertia over those of the data, beside `mass_scale`.
        pub inertia_scale: f64 = 1.0,
        /// Inertia about pitch over that about yaw is one and this, over one less this.
        pub inertia_split: f64 = 0.0,
        /// Lean of the principal axis of inertia against the body's axis, about body y and z, rad.
        pub principal_axis_rad: [f64; 2] = [0.0; 2],
        /// Turn of the nozzle over the turn of its servo.
        pub gimbal_gain: f64 = 1.0,
        /// Play between the gimbal's servos and the nozzle that is not in the data, rad.
        pub gimbal_slop_rad: f64 = 0.0,
        /// Misalignment of each fin against its servo, rad.
        pub fin_offset_rad: [f64; 4] = [0.0; 4],
        /// Play between the fins' servos and the fins that is not in the data, rad.
        pub fin_slop_rad: f64 = 0.0,
        /// Rise of the ground, metre per metre along world x and y; its height at their origin,
        /// where the vehicle is to land, is 0.
        pub ground_rise: [f64; 2] = [0.0; 2],
    }
}

flight::with_defaults! {
    /// How the true ascent of one flight differs from its nominal data.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct AscentTruth {
        /// True impulse of the ascent motor over the motor file's.
        pub impulse_scale: f64 = 1.0,
        /// True burn time over the motor file's.
        pub burn_time_scale: f64 = 1.0,
        /// Time from the ignition command to the first thrust, s.
        pub ignition_delay_s: f64 = 0.15,
        /// Factor on the axial drag of the stack.
        pub drag_scale: f64 = 1.0,
        /// Lean of the rail beside its nominal one, about world x and y, rad.
        pub rail_lean_rad: [f64; 2] = [0.0; 2],
        /// Cant of the booster's fins, rad.
        pub fin_cant_rad: f64 = 0.0,
        /// Rotation rates (pitch, yaw) that the separation gives the vehicle, rad/s.
        pub tip_off_rad_s: [f64; 2] = [0.0; 2],
    }
}

/// Terms in the shape of a thrust curve.
pub const SHAPE_TERMS: usize = 5;

/// Largest size of a term: the sum of all stays below 1, so that no thrust falls below zero.
pub const SHAPE_MOST: f64 = 0.19;

impl Truth {
    /// The curve that the scales are over.
    ///
    /// # Errors
    /// [`WorldError::Truth`] if the share is not 0 to 1, or not 0 and the mission has no other
    /// curve.
    pub fn curve<'a>(&self, mission: &'a Mission) -> Result<Cow<'a, ThrustCurve>, WorldError> {
        let share = self.other_curve;
        let refuse = |required: &str| {
            Err(WorldError::Truth { key: "other_curve".into(), found: share, required: required.into() })
        };
        if share == 0.0 {
            return Ok(Cow::Borrowed(&mission.motor_curve));
        }
        let Some(other) = &mission.other_curve else {
            return refuse("0 (the mission has no other_motor)");
        };
        if !(0.0..=1.0).contains(&share) {
            return refuse("0 to 1");
        }
        Ok(Cow::Owned(mission.motor_curve.towards(other, share)))
    }

    /// Height of the ground below a place, m.
    pub fn ground_m(&self, x_m: f64, y_m: f64) -> f64 {
        self.ground_rise[0] * x_m + self.ground_rise[1] * y_m
    }

    /// Height of a place over the ground below it, m.
    pub fn over_ground_m(&self, place_m: &Vector3<f64>) -> f64 {
        place_m.z - self.ground_m(place_m.x, place_m.y)
    }
}

// The faults that can occur in flight. A fault acts from the step after its injection and never
// ends.

/// A fault of motor or actuators.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Fault {
    /// The motor never ignites.
    NoLight,
    /// The motor ignites late.
    LateLight {
        /// Added to the ignition delay, s.
        delay_s: f64,
    },
    /// The motor has less impulse, in the same time.
    WeakMotor {
        /// Thrust, as a fraction of the thrust without the fault.
        scale: f64,
    },
    /// The motor burns out early.
    EarlyBurnout {
        /// Time since the first thrust, s.
        after_s: f64,
    },
    /// The ascent motor never ignites.
    AscentNoLight,
    /// The ascent motor ignites without a command.
    AscentSelfLights,
    /// The ascent motor has less impulse, in the same time.
    AscentWeak {
        /// Thrust, as a fraction of the thrust without the fault.
        scale: f64,
    },
    /// The booster stays on the vehicle.
    SeparationFails,
    /// The charge of the parachute does not burn: the parachute stays in.
    ParachuteFails,
    /// Both gimbal axes are stuck.
    GimbalStuck,
    /// The servo of the pitch axis runs to an angle and stays there.
    GimbalJams {
        /// The angle, degrees; beyond the stop it is the stop.
        deg: f64,
    },
    /// The pack of servos and igniters gives no current: all surfaces stay where they are, and no
    /// igniter and no charge fires.
    BrownOut {
        /// Until the servos follow again, s.
        lasts_s: f64,
    },
    /// The gimbal servos turn slowly.
    GimbalSlow {
        /// Rate, as a fraction of the rate without the fault.
        scale: f64,
    },
    FinStuck {
        /// The fin, 0 to 3; another number has no effect.
        fin: usize,
    },
    /// A surface moves in reverse. Gimbal pitch and yaw are 0 and 1, the fins 2 to 5.
    Reversed { surface: usize },
    /// Two surfaces hang on each other's wires.
    Swapped { surfaces: [usize; 2] },
}
