//! The ground: a plane through the pad, level or with a slope. The four legs are springs with
//! dampers, and their feet have friction. The vehicle is broken if any other part touches the
//! ground.
//!
//! A leg may have a crushable block in series with its spring and damper. Its foot then slides in a
//! guide along the body's axis and stays where it was pushed. The block crushes when the axial
//! force exceeds its crush force plus the guide's contribution: a share of the transverse force,
//! which friction on the ground and a tilt cause. A foot has no mass: the body carries it, and the
//! block absorbs slightly more than necessary. Its friction on the ground is that of a foot which
//! moves with the body, also while it slides in its guide. Legs do not bend.
//!
//! Contact by springs, dampers and Coulomb's friction: G. Gilardi and I. Sharf, "Literature survey
//! of contact dynamics modelling", Mechanism and Machine Theory 37, 2002.

use flight::rules::verdict::Touchdown;
use flight::vehicle::airframe::{Airframe, Crush, LEGS_AT};
use flight::vehicle::rigid::RigidState;
use nalgebra::{Rotation3, Vector3};

use crate::world::aero::Load;

/// Sliding speed below which friction fades out, m/s: the friction of a foot at rest has no
/// direction.
const SLIDING_M_S: f64 = 0.05;
/// Length of a part of a step, in time constants of the feet's friction; Runge-Kutta's fourth order
/// is stable to 2.78.
const STIFFEST: f64 = 1.5;
/// Most parts of a step. Legs that crush press mk3's feet with 470 N, and turn its slim body 34,000
/// times per second.
const MOST_PARTS: usize = 16;
/// Beyond this tilt, 45 degrees, the vehicle falls over, rad.
const TIPPED_RAD: f64 = core::f64::consts::FRAC_PI_4;
/// A vehicle with three feet on the ground that is slower than this, m/s and rad/s, for this time,
/// s, is at rest.
const STILL_M_S: f64 = 0.03;
const STILL_RAD_S: f64 = 0.05;
const STILL_S: f64 = 0.3;

/// The first contact with the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstContact {
    /// Time since the start, s.
    pub time_s: f64,
    /// The last state before contact, at most a quarter of a millisecond earlier.
    pub state: RigidState,
    /// The touchdown at the legs.
    pub over_ground: Touchdown,
    pub thrust_n: f64,
    pub weight_n: f64,
}

/// How a vehicle came to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// Time since the start, s.
    pub time_s: f64,
    /// Whether it stands, tipped over or struck the ground.
    pub outcome: RestOutcome,
    /// Angle between nose and vertical, rad.
    pub tilt_rad: f64,
    /// Loads of its legs, if they are crushable.
    pub strain: Option<Strain>,
}

/// Loads of crushable legs since the first contact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Strain {
    /// Largest share of its stroke that a leg has crushed; at 1 the block is solid.
    pub stroke_used: f64,
    /// Largest force at a foot over the leg's strength in that direction.
    pub strength_used: f64,
    /// Smallest distance of nozzle and body from the ground, m; 0 where they struck it.
    pub clearance_m: f64,
    /// Largest angle between nose and vertical, rad.
    pub tilt_rad: f64,
}

flight::numbered_enum! {
/// How a vehicle comes to rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RestOutcome {
    /// Standing on its legs.
    Upright = "upright",
    /// Tilted beyond 45 degrees after contact.
    TippedOver = "tipped over",
    /// Nozzle, fuselage or nose hit the ground.
    BodyStrike = "body strike",
}
}

/// Positions of a vehicle's legs and hull relative to its centre of gravity, in body axes.
#[derive(Debug, Clone)]
pub(crate) struct Ground {
    stiffness_n_m: f64,
    damping_n_s_m: f64,
    friction: f64,
    crush: Option<Crush>,
    /// Positions of the feet relative to the nozzle exit, m; a crushed leg has a higher foot.
    feet_m: [Vector3<f64>; 4],
    /// Crushed length of each leg, m.
    pub(crate) given_m: [f64; 4],
    strain: Strain,
    /// Positions of the rims at nozzle and nose relative to the nozzle exit, m.
    hull_m: [Vector3<f64>; 8],
    /// Its product with a place in the world is the place's height above the ground.
    upwards: Vector3<f64>,
    /// The same direction, of length 1.
    normal: Vector3<f64>,
    /// Sum of the forces on the feet at their last evaluation, N.
    pressed_n: f64,
    still_s: f64,
}

/// The parts that touch the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Contact {
    pub(crate) feet: usize,
    pub(crate) hull: bool,
}

impl Ground {
    pub(crate) fn new(airframe: &Airframe, rise: [f64; 2]) -> Self {
        let (legs, body) = (&airframe.legs, &airframe.body);
        let upwards = Vector3::new(-rise[0], -rise[1], 1.0);
        // The hull's rims are touched in the same directions.
        let ring = |station_m: f64, radius_m: f64| {
            LEGS_AT.map(|[y, z]| Vector3::new(station_m, radius_m * y, radius_m * z))
        };
        let (tail, nose) = (ring(0.0, 0.5 * body.diameter_m), ring(body.length_m, 0.5 * body.diameter_m));
        Self {
            stiffness_n_m: legs.stiffness_n_m,
            damping_n_s_m: legs.damping_n_s_m,
            friction: legs.friction_coefficient,
            crush: legs.crush,
            feet_m: ring(legs.foot_station_m, legs.foot_radius_m),
            given_m: [0.0; 4],
            strain: Strain { clearance_m: f64::INFINITY, ..Strain::default() },
            hull_m: core::array::from_fn(|i| if i < 4 { tail[i] } else { nose[i - 4] }),
            upwards,
            normal: upwards / upwards.norm(),
            pressed_n: 0.0,
            still_s: 0.0,
        }
    }

    /// Height of the vehicle's lowest point above the ground, m.
    pub(crate) fn clearance_m(&self, state: &RigidState, cg_m: &Vector3<f64>) -> f64 {
        self.lowest_m(&self.feet_m, state, cg_m).min(self.lowest_m(&self.hull_m, state, cg_m))
    }

    /// Height of the lowest of some places of the vehicle above the ground, m.
    fn lowest_m(&self, places_m: &[Vector3<f64>], state: &RigidState, cg_m: &Vector3<f64>) -> f64 {
        let up_in_body = state.world_from_body.inverse_transform_vector(&self.upwards);
        let below_cg =
            places_m.iter().fold(f64::INFINITY, |low, place| low.min((place - cg_m).dot(&up_in_body)));
        state.position_m.dot(&self.upwards) + below_cg
    }

    /// The parts that touch the ground.
    pub(crate) fn contact(&self, state: &RigidState, cg_m: &Vector3<f64>) -> Contact {
        let up_in_body = state.world_from_body.inverse_transform_vector(&self.upwards);
        let cg_height_m = state.position_m.dot(&self.upwards);
        let below = |place: &&Vector3<f64>| cg_height_m + (**place - cg_m).dot(&up_in_body) <= 0.0;
        Contact {
            feet: self.feet_m.iter().filter(below).count(),
            hull: self.hull_m.iter().any(|place| below(&place)),
        }
    }

    /// Adds the forces of the ground on the feet.
    pub(crate) fn add_load(
        &self,
        load: &mut Load,
        state: &RigidState,
        world_from_body: &Rotation3<f64>,
        cg_m: &Vector3<f64>,
    ) {
        for foot in 0..self.feet_m.len() {
            if let Some((_, force_n, _)) = self.on_foot(foot, state, world_from_body, cg_m) {
                let place_m = self.feet_m[foot] - cg_m;
                load.add_at(&place_m, &world_from_body.inverse_transform_vector(&force_n));
            }
        }
    }

    /// Penetration of a foot, m, the force on it in the world, N, and the normal force at which its
    /// leg crushes, N; `None` in the air.
    fn on_foot(
        &self,
        foot: usize,
        state: &RigidState,
        world_from_body: &Rotation3<f64>,
        cg_m: &Vector3<f64>,
    ) -> Option<(f64, Vector3<f64>, f64)> {
        let normal = &self.normal;
        let place_m = self.feet_m[foot] - cg_m;
        let depth_m = -(state.position_m + world_from_body * place_m).dot(normal);
        if depth_m <= 0.0 {
            return None;
        }
        let mut sliding = state.velocity_m_s + world_from_body * state.rate_rad_s.cross(&place_m);
        let rising_m_s = sliding.dot(normal);
        sliding -= normal * rising_m_s;
        let fading = (sliding.norm_squared() + SLIDING_M_S * SLIDING_M_S).sqrt();
        let mut yields_n = f64::INFINITY;
        if let Some(crush) = self.crush.filter(|crush| self.given_m[foot] < crush.stroke_m) {
            // Per newton along the normal; a guide that holds all of it jams.
            let nose = world_from_body * Vector3::x();
            let push = normal - sliding * (self.friction / fading);
            let along = push.dot(&nose);
            let gives = along - crush.guide_share * (push - nose * along).norm();
            yields_n = crush.force_n / gives.max(0.0);
        }
        let sprung_n = self.stiffness_n_m * depth_m - self.damping_n_s_m * rising_m_s;
        let normal_n = sprung_n.max(0.0).min(yields_n);
        Some((depth_m, sliding * (-self.friction * normal_n / fading) + normal * normal_n, yields_n))
    }

    /// Records the forces on the feet. Legs that are compressed beyond their springs' travel at the
    /// crush force crush.
    pub(crate) fn give_way(&mut self, state: &RigidState, cg_m: &Vector3<f64>) {
        let world_from_body = state.world_from_body.to_rotation_matrix();
        self.pressed_n = 0.0;
        for foot in 0..self.feet_m.len() {
            let Some((depth_m, force_n, yields_n)) = self.on_foot(foot, state, &world_from_body, cg_m) else {
                continue;
            };
            self.pressed_n += force_n.norm();
            let Some(crush) = self.crush else { continue };
            let beyond_m =
                (depth_m - yields_n / self.stiffness_n_m) / state.nose_in_world().dot(&self.normal);
            let gives_m = beyond_m.min(crush.stroke_m - self.given_m[foot]).max(0.0);
            self.given_m[foot] += gives_m;
            let place_m = &mut self.feet_m[foot];
            place_m.x += gives_m;
            // Across the plane of leg and axis, and in it.
            let sideways = Vector3::x().cross(place_m).normalize();
            let force_n = world_from_body.inverse_transform_vector(&force_n);
            let across_n = force_n.dot(&sideways);
            let used = (across_n.abs() / crush.strength_across_n)
                .max((force_n - sideways * across_n).norm() / crush.strength_n);
            let strain = &mut self.strain;
            strain.stroke_used = strain.stroke_used.max(self.given_m[foot] / crush.stroke_m);
            strain.strength_used = strain.strength_used.max(used);
        }
        if self.crush.is_none() {
            return;
        }
        let hull_m = self.lowest_m(&self.hull_m, state, cg_m);
        self.strain.clearance_m = self.strain.clearance_m.min(hull_m.max(0.0));
        self.strain.tilt_rad = self.strain.tilt_rad.max(state.tilt_rad());
    }

    /// Into how many parts a step, s, is to be divided, because the friction of the pressed feet is
    /// stiff: at low speed it damps a roll by the force times friction, the square of their radius
    /// and `1 / SLIDING_M_S`, over the moment of inertia.
    pub(crate) fn parts(&self, state: &RigidState, roll_inertia_kg_m2: f64, step_s: f64) -> usize {
        let feet = self.feet_m.len() as f64;
        let more_n_s_m = feet * (self.damping_n_s_m + self.stiffness_n_m * step_s);
        let pressed_n = self.pressed_n + more_n_s_m * state.velocity_m_s.norm();
        let radius_m2 = self.feet_m.iter().map(|foot| foot.yz().norm_squared()).fold(0.0, f64::max);
        let damping_per_s = self.friction * pressed_n * radius_m2 / (roll_inertia_kg_m2 * SLIDING_M_S);
        (libm::ceil(damping_per_s * step_s / STIFFEST) as usize).clamp(1, MOST_PARTS)
    }

    /// Loads of the legs so far, if they are crushable and have touched the ground.
    pub(crate) fn strain(&self) -> Option<Strain> {
        self.strain.clearance_m.is_finite().then_some(self.strain)
    }

    /// Takes a further time on the ground, s, and returns how the vehicle came to rest, if it has.
    /// It is not at rest while the thrust still carries half the weight.
    pub(crate) fn outcome(
        &mut self,
        state: &RigidState,
        contact: Contact,
        thrust_over_weight: f64,
        passed_s: f64,
    ) -> Option<RestOutcome> {
        if contact.hull {
            return Some(RestOutcome::BodyStrike);
        }
        if state.tilt_rad() > TIPPED_RAD {
            return Some(RestOutcome::TippedOver);
        }
        let still = contact.feet >= 3
            && state.velocity_m_s.norm_squared() < STILL_M_S * STILL_M_S
            && state.rate_rad_s.norm_squared() < STILL_RAD_S * STILL_RAD_S
            && thrust_over_weight < 0.5;
        self.still_s = if still { self.still_s + passed_s } else { 0.0 };
        (self.still_s >= STILL_S).then_some(RestOutcome::Upright)
    }
}

#[cfg(test)]
mod tests {
    use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::world::body::{Inertia, Loads, rk4_step};

    fn mk3() -> Airframe {
        flight::vehicles::mission::builtin_airframe("mk3").unwrap()
    }

    fn at_cg(airframe: &Airframe) -> Vector3<f64> {
        Vector3::x() * airframe.mass.loaded_cg_station_m
    }

    /// An upright mk3 with all feet 3 cm or more in the ground slides up a slope: the force along
    /// the normal at each foot, N.
    fn crushing_n(slope_deg: f64, uphill_m_s: f64) -> f64 {
        let airframe = mk3();
        let (sin, cos) = libm::sincos(slope_deg.to_radians());
        let ground = Ground::new(&airframe, [sin / cos, 0.0]);
        let lifted_m = airframe.above_feet_m(airframe.mass.loaded_cg_station_m);
        let mut state = RigidState::upright(lifted_m - 0.04 - airframe.legs.foot_radius_m * sin / cos);
        state.velocity_m_s = Vector3::new(cos, 0.0, sin) * uphill_m_s;
        let (mut load, world_from_body) = (Load::none(), state.world_from_body.to_rotation_matrix());
        ground.add_load(&mut load, &state, &world_from_body, &at_cg(&airframe));
        0.25 * (world_from_body * load.force_n).dot(&ground.normal)
    }

    /// A block of 90 N, a friction of 0.6, a guide that adds 0.4 of the force across. By hand, per
    /// newton along the normal of a slope of 10 degrees: sin 0.17365, cos 0.98481; uphill friction
    /// is 0.6 (cos, sin).
    #[test]
    fn val_hand_a_foot_gives_way_at_the_blocks_force_and_what_the_guide_adds() {
        for (slope_deg, uphill_m_s, yields_n) in [
            (0.0, 0.0, 90.0),
            // 90 / (1 - 0.4 x 0.6)
            (0.0, 3.0, 118.42),
            (0.0, -3.0, 118.42),
            // 90 / (0.98481 - 0.4 x 0.17365)
            (10.0, 0.0, 98.32),
            // Downhill: 90 / (0.98481 + 0.10419 - 0.4 x (0.59088 - 0.17365))
            (10.0, -3.0, 97.60),
            // Uphill: 90 / (0.98481 - 0.10419 - 0.4 x (0.59088 + 0.17365))
            (10.0, 3.0, 156.57),
        ] {
            let found_n = crushing_n(slope_deg, uphill_m_s);
            assert!((found_n - yields_n).abs() < 1e-3 * yields_n, "{slope_deg}, {uphill_m_s}: {found_n} N");
        }
    }

    struct OnGround<'a>(&'a Ground, Vector3<f64>);

    impl Loads for OnGround<'_> {
        fn load(&self, state: &RigidState, world_from_body: &Rotation3<f64>) -> Load {
            let mut load = Load::none();
            self.0.add_load(&mut load, state, world_from_body, &self.1);
            load
        }
    }

    /// The energy lost in a landing is in the blocks, their guides, friction and bent legs.
    #[test]
    fn val_hand_blocks_guides_friction_and_springs_take_the_energy_of_a_landing() {
        const STEP_S: f64 = 2e-5;
        for number in 0..12 {
            let mut airframe = mk3();
            airframe.legs.friction_coefficient = [0.3, 0.6, 0.9][number % 3];
            airframe.legs.damping_n_s_m = 0.0;
            let (mass, crush, cg_m) = (airframe.mass, airframe.legs.crush.unwrap(), at_cg(&airframe));
            let towards = |turns: f64| {
                let (sin, cos) = libm::sincos(core::f64::consts::TAU * turns * number as f64);
                Vector3::new(cos, sin, 0.0)
            };
            let rise = towards(0.31) * 0.05;
            let mut ground = Ground::new(&airframe, [rise.x, rise.y]);
            let mut state = RigidState::upright(1.0);
            state.world_from_body =
                UnitQuaternion::from_scaled_axis(towards(0.17) * 0.1) * state.world_from_body;
            state.velocity_m_s = towards(0.43) * 0.7 - Vector3::z() * 1.5;
            state.rate_rad_s = Vector3::new(0.3, 0.5, -0.4);
            state.position_m.z -= ground.clearance_m(&state, &cg_m) - 1e-5;
            let inertia = Inertia {
                mass_kg: mass.loaded_kg,
                across_kg_m2: [mass.loaded_pitch_inertia_kg_m2; 2],
                roll_kg_m2: mass.roll_inertia_kg_m2,
                principal_rad: [0.0; 2],
            };
            let energy_j = |state: &RigidState| {
                let rate = &state.rate_rad_s;
                let turning_j = inertia.roll_kg_m2 * rate.x * rate.x
                    + inertia.across_kg_m2[0] * (rate.y * rate.y + rate.z * rate.z);
                let moving_j = inertia.mass_kg * state.velocity_m_s.norm_squared();
                0.5 * (turning_j + moving_j) + inertia.mass_kg * STANDARD_GRAVITY_M_S2 * state.position_m.z
            };
            let before_j = energy_j(&state);
            let (mut blocks_j, mut guides_j, mut friction_j) = (0.0, 0.0, 0.0);
            for _ in 0..10_000 {
                let loads = OnGround(&ground, cg_m);
                state = rk4_step(&state, &inertia, &loads, STANDARD_GRAVITY_M_S2, STEP_S).0;
                let (world_from_body, given_m) = (state.world_from_body.to_rotation_matrix(), ground.given_m);
                let forces = [0, 1, 2, 3].map(|foot| ground.on_foot(foot, &state, &world_from_body, &cg_m));
                let at_m = ground.feet_m.map(|foot| foot - cg_m);
                ground.give_way(&state, &cg_m);
                for (foot, forces) in forces.into_iter().enumerate() {
                    let Some((_, force_n, _)) = forces else { continue };
                    let gave_m = ground.given_m[foot] - given_m[foot];
                    let nose = state.nose_in_world();
                    let across_n = (force_n - nose * force_n.dot(&nose)).norm();
                    blocks_j += crush.force_n * gave_m;
                    guides_j += crush.guide_share * across_n * gave_m;
                    let moves_m_s =
                        state.velocity_m_s + world_from_body * state.rate_rad_s.cross(&at_m[foot]);
                    let along_ground_n = force_n - ground.normal * force_n.dot(&ground.normal);
                    friction_j -= along_ground_n.dot(&(moves_m_s * STEP_S + nose * gave_m));
                }
            }
            let world_from_body = state.world_from_body.to_rotation_matrix();
            let depths_m = (0..4).filter_map(|foot| ground.on_foot(foot, &state, &world_from_body, &cg_m));
            let springs_j: f64 =
                depths_m.map(|(depth_m, ..)| 0.5 * ground.stiffness_n_m * depth_m * depth_m).sum();
            let (lost_j, taken_j) =
                (before_j - energy_j(&state), blocks_j + guides_j + friction_j + springs_j);
            let message =
                format!("{number}: {lost_j} J lost; {blocks_j} {guides_j} {friction_j} {springs_j}");
            assert!((lost_j - taken_j).abs() < 0.01 * lost_j, "{message}");
            assert!(blocks_j > 0.2 * lost_j && guides_j > 0.0 && friction_j > 0.0, "{message}");
        }
    }
}
