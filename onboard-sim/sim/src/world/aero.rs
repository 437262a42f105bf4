//! The force of the air on body, fins and parachute, each computed from the relative wind where it
//! acts.
//!
//! Rotation changes the wind at those places, so the model contains damping. It contains static
//! stability, too: in a tail-first fall the fins drag behind the centre of gravity. The fins follow
//! Eq. 2, 3, 13 and 14 of the landing paper (coefficients, areas, radius), with the force turned
//! into the local wind. The body follows the paper's Eq. 8 along the axis and the crossflow of a
//! cylinder across it (strip by strip, S. F. Hoerner, Fluid-Dynamic Drag, chapter 3). The legs drag
//! along the wind where each of them is, ahead of the centre of gravity in the flow: they turn the
//! tail away from it.
#![expect(clippy::inline_always, reason = "what is to be compiled for wide vectors must be inlined there")]

use core::array::from_fn;

use flight::vehicle::airframe::{Airframe, Parachute as ParachuteData};
use flight::vehicle::fins::{FinModel, ROLL};
use nalgebra::Vector3;
use pulp::{Arch, Simd, WithSimd};

use crate::world::STEP_S;
use crate::world::truth::Truth;

/// Strips of the body's crossflow.
const STRIPS: usize = 8;

/// Legs, then fins, and a number of each.
const POINTS: usize = 8;
type Each = [f64; POINTS];

/// The vehicle's shape.
#[derive(Debug, Clone)]
pub(crate) struct Shape {
    axial_area_m2: f64,
    /// Crossflow drag area of one strip, m^2.
    strip_area_m2: f64,
    strip_stations_m: [f64; STRIPS],
    fins: FinModel,
    fin_radial: f64,
    fin_station_m: f64,
    /// Directions from the axis to the fins, in body axes.
    fin_directions: [Vector3<f64>; 4],
    nose_station_m: f64,
    leg_drag_m2: f64,
    /// Middles of the legs, from the nozzle.
    legs_m: [Vector3<f64>; 4],
    fin_scale: f64,
    scale: f64,
}

/// Fractions of the drag that the exhaust leaves: of the body along its axis, and of the fins.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plume {
    pub(crate) body: f64,
    pub(crate) fins: f64,
}

impl Plume {
    /// The jet points upstream and pushes the air aside: wholly when its thrust exceeds the dynamic
    /// pressure on the base, and in proportion below that. The ratio is the usual one for jets
    /// against the wind; that the effect is full at 1 is an assumption (this vehicle burns at about
    /// 15 until the tail-off).
    pub(crate) fn new(truth: &Truth, thrust_n: f64, on_base_n: f64) -> Self {
        if thrust_n <= 0.0 {
            return Self { body: 1.0, fins: 1.0 };
        }
        let strength = if thrust_n > on_base_n { 1.0 } else { thrust_n / on_base_n };
        Self { body: 1.0 - truth.plume_body_loss * strength, fins: 1.0 - truth.plume_fin_loss * strength }
    }
}

/// The air and the vehicle's moving parts at one instant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Flow {
    /// Air density, kg/m^3.
    pub(crate) density_kg_m3: f64,
    /// Velocity of the centre of gravity through the air, in body axes, m/s.
    pub(crate) velocity_m_s: Vector3<f64>,
    /// Rotation rate in body axes, rad/s.
    pub(crate) rate_rad_s: Vector3<f64>,
}

/// The parts of the shape that move.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Configuration {
    /// Sines of the fins' opening angles.
    pub(crate) fin_sines: [f64; 4],
    /// The legs are deployed: on the booster they are folded.
    pub(crate) legs_out: bool,
    /// Parachute's drag area, m^2.
    pub(crate) parachute_area_m2: f64,
    pub(crate) plume: Plume,
    /// Centre of gravity: x is its station (above the nozzle), y and z its distance from the axis,
    /// m.
    pub(crate) cg_m: Vector3<f64>,
}

/// A force and its moment about the centre of gravity, in body axes, N and N m.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Load {
    pub(crate) force_n: Vector3<f64>,
    pub(crate) moment_n_m: Vector3<f64>,
}

impl Load {
    pub(crate) fn none() -> Self {
        Self { force_n: Vector3::zeros(), moment_n_m: Vector3::zeros() }
    }

    pub(crate) fn add_at(&mut self, place_m: &Vector3<f64>, force_n: &Vector3<f64>) {
        self.force_n += force_n;
        self.moment_n_m += place_m.cross(force_n);
    }
}

struct Blown<'a> {
    shape: &'a Shape,
    flow: &'a Flow,
    configuration: &'a Configuration,
}

impl WithSimd for Blown<'_> {
    type Output = Load;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Load {
        self.shape.blown(self.flow, self.configuration)
    }
}

impl Shape {
    /// The shape of an airframe, with its forces scaled by the truth.
    pub(crate) fn new(airframe: &Airframe, truth: &Truth) -> Self {
        let (body, fins) = (&airframe.body, airframe.fin_model());
        let strip_m = body.length_m / STRIPS as f64;
        Self {
            axial_area_m2: body.reference_area_m2 * body.axial_drag_coefficient * truth.body_drag_scale,
            strip_area_m2: body.crossflow_drag_coefficient
                * body.diameter_m
                * strip_m
                * truth.crossflow_scale,
            strip_stations_m: from_fn(|i| strip_m * (i as f64 + 0.5)),
            fins,
            fin_radial: truth.fin_radial,
            fin_station_m: airframe.fins.station_m,
            fin_directions: from_fn(|i| Vector3::from([0.0, fins.outward(i)[0], fins.outward(i)[1]])),
            nose_station_m: body.length_m,
            leg_drag_m2: airframe.legs.drag_area_m2 + truth.leg_drag_m2,
            legs_m: [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)].map(|(y, z)| {
                let radius_m = 0.5 * (0.5 * body.diameter_m + airframe.legs.foot_radius_m);
                Vector3::new(airframe.legs.drag_station_m, radius_m * y, radius_m * z)
            }),
            fin_scale: truth.fin_drag_scale,
            scale: truth.drag_scale,
        }
    }

    /// The total force and moment of the air, in the widest vectors that the machine has; the bits
    /// are the same.
    pub(crate) fn load(&self, flow: &Flow, configuration: &Configuration) -> Load {
        Arch::new().dispatch(Blown { shape: self, flow, configuration })
    }

    #[inline(always)]
    fn blown(&self, flow: &Flow, configuration: &Configuration) -> Load {
        let half_density = 0.5 * self.scale * flow.density_kg_m3;
        let axis_m = |station_m: f64| Vector3::new(station_m, 0.0, 0.0) - configuration.cg_m;
        let mut load = Load::none();
        self.add_body(&mut load, flow, half_density, configuration.plume.body, &axis_m);
        self.add_points(&mut load, flow, half_density, configuration);
        if configuration.parachute_area_m2 > 0.0 {
            let place_m = axis_m(self.nose_station_m);
            let local = flow.velocity_m_s + flow.rate_rad_s.cross(&place_m);
            let drag_n = local * (-half_density * configuration.parachute_area_m2 * length(&local));
            load.add_at(&place_m, &drag_n);
        }
        load
    }

    /// The drag along the axis, and across it strip by strip. The strips are on the axis: with `a`
    /// from the centre of gravity to the axis and `x` up to the strip, the wind there is `v + rate
    /// x (x, a)`.
    #[inline(always)]
    fn add_body(
        &self,
        load: &mut Load,
        flow: &Flow,
        half_density: f64,
        axial_share: f64,
        axis_m: &impl Fn(f64) -> Vector3<f64>,
    ) {
        let (velocity, rate) = (&flow.velocity_m_s, &flow.rate_rad_s);
        let axial_n = -half_density * axial_share * self.axial_area_m2 * length(velocity) * velocity.x;
        let tail_m = axis_m(0.0);
        load.add_at(&tail_m, &Vector3::new(axial_n, 0.0, 0.0));
        let (y_m_s, z_m_s) = (velocity.y - rate.x * tail_m.z, velocity.z + rate.x * tail_m.y);
        let (mut across_n, mut turning_n_m) = ([0.0; 2], [0.0; 2]);
        let per_strip = -half_density * self.strip_area_m2;
        let strips = self.strip_stations_m.map(|station_m| {
            let x_m = station_m + tail_m.x;
            let (y_m_s, z_m_s) = (y_m_s + rate.z * x_m, z_m_s - rate.y * x_m);
            let per_speed = per_strip * (y_m_s * y_m_s + z_m_s * z_m_s).sqrt();
            (x_m, per_speed * y_m_s, per_speed * z_m_s)
        });
        for (x_m, y_n, z_n) in strips {
            across_n = [across_n[0] + y_n, across_n[1] + z_n];
            turning_n_m = [turning_n_m[0] - x_m * z_n, turning_n_m[1] + x_m * y_n];
        }
        load.force_n += Vector3::new(0.0, across_n[0], across_n[1]);
        let roll_n_m = tail_m.y * across_n[1] - tail_m.z * across_n[0];
        load.moment_n_m += Vector3::new(roll_n_m, turning_n_m[0], turning_n_m[1]);
    }

    /// Legs and fins, each in the wind at its position. The drag is along the wind: legs are tubes
    /// and struts in every direction. The lift of a fin is across both the wind and the fin's
    /// direction from the axis.
    #[inline(always)]
    fn add_points(&self, load: &mut Load, flow: &Flow, half_density: f64, configuration: &Configuration) {
        let Configuration { fin_sines, legs_out, plume, cg_m, .. } = configuration;
        let leg = if *legs_out { -half_density * 0.25 * self.leg_drag_m2 } else { 0.0 };
        let fin = half_density * self.fin_scale * plume.fins * self.fins.reference_area_m2;
        let [drag, lift] = [self.fins.drag_coefficient, self.fins.lift_coefficient].map(|per| -fin * per);
        // Legs, then fins; every line is one operation on all, which the compiler makes one on
        // vectors.
        let outward: [Vector3<f64>; POINTS] = from_fn(|i| self.fin_directions[i % 4]);
        let (y_out, z_out): (Each, Each) = (from_fn(|i| outward[i].y), from_fn(|i| outward[i].z));
        let out_m: Each = from_fn(|i| if i < 4 { 0.0 } else { self.fins.radius_m(fin_sines[i - 4]) });
        let leg_m: [Vector3<f64>; POINTS] =
            from_fn(|i| if i < 4 { self.legs_m[i] } else { Vector3::new(self.fin_station_m, 0.0, 0.0) });
        let x_m: Each = from_fn(|i| leg_m[i].x - cg_m.x);
        let y_m: Each = from_fn(|i| leg_m[i].y + y_out[i] * out_m[i] - cg_m.y);
        let z_m: Each = from_fn(|i| leg_m[i].z + z_out[i] * out_m[i] - cg_m.z);
        let along: Each = from_fn(|i| if i < 4 { leg } else { drag * fin_sines[i - 4] });
        let across: Each = from_fn(|i| if i < 4 { 0.0 } else { lift * fin_sines[i - 4] * ROLL[i - 4] });
        let (v, w) = (&flow.velocity_m_s, &flow.rate_rad_s);
        let x_m_s: Each = from_fn(|i| v.x + (w.y * z_m[i] - w.z * y_m[i]));
        let y_m_s: Each = from_fn(|i| v.y + (w.z * x_m[i] - w.x * z_m[i]));
        let z_m_s: Each = from_fn(|i| v.z + (w.x * y_m[i] - w.y * x_m[i]));
        let speed_m_s: Each =
            from_fn(|i| (x_m_s[i] * x_m_s[i] + y_m_s[i] * y_m_s[i] + z_m_s[i] * z_m_s[i]).sqrt());
        let along: Each = from_fn(|i| along[i] * speed_m_s[i]);
        let across: Each = from_fn(|i| across[i] * speed_m_s[i]);
        let radial = -fin * self.fin_radial * self.fins.drag_coefficient;
        let away: Each = from_fn(|i| {
            let sine = fin_sines[i % 4];
            let cosine = (1.0 - sine * sine).max(0.0).sqrt();
            if i < 4 { 0.0 } else { radial * sine * cosine * speed_m_s[i] * x_m_s[i] }
        });
        let x_n: Each =
            from_fn(|i| x_m_s[i] * along[i] + (y_m_s[i] * z_out[i] - z_m_s[i] * y_out[i]) * across[i]);
        let y_n: Each =
            from_fn(|i| y_m_s[i] * along[i] - x_m_s[i] * z_out[i] * across[i] + y_out[i] * away[i]);
        let z_n: Each =
            from_fn(|i| z_m_s[i] * along[i] + x_m_s[i] * y_out[i] * across[i] + z_out[i] * away[i]);
        let sum = |each: Each| {
            let pairs: [f64; 4] = from_fn(|i| each[i] + each[i + 4]);
            (pairs[0] + pairs[2]) + (pairs[1] + pairs[3])
        };
        load.force_n += Vector3::new(sum(x_n), sum(y_n), sum(z_n));
        load.moment_n_m += Vector3::new(
            sum(from_fn(|i| y_m[i] * z_n[i] - z_m[i] * y_n[i])),
            sum(from_fn(|i| z_m[i] * x_n[i] - x_m[i] * z_n[i])),
            sum(from_fn(|i| x_m[i] * y_n[i] - y_m[i] * x_n[i])),
        );
    }
}

fn length(vector: &Vector3<f64>) -> f64 {
    vector.norm_squared().sqrt()
}

// The parachute: it is ejected by command, its lines are taut after a delay, and then it fills with
// the distance fallen through the air.

#[derive(Debug, Clone)]
pub(crate) struct Parachute {
    data: ParachuteData,
    commanded_s: Option<f64>,
    travelled_m: f64,
    fails: bool,
}

impl Parachute {
    pub(crate) fn new(data: &ParachuteData) -> Self {
        Self { data: *data, commanded_s: None, travelled_m: 0.0, fails: false }
    }

    /// Ejects the parachute; only the first command counts.
    pub(crate) fn eject(&mut self, time_s: f64) {
        if !self.fails {
            self.commanded_s.get_or_insert(time_s);
        }
    }

    /// From now on no command ejects it.
    pub(crate) fn break_down(&mut self) {
        self.fails = true;
    }

    pub(crate) fn ejected_s(&self) -> Option<f64> {
        self.commanded_s
    }

    /// One step at an airspeed, m/s.
    pub(crate) fn step(&mut self, time_s: f64, airspeed_m_s: f64) {
        if self.commanded_s.is_some_and(|commanded_s| time_s - commanded_s >= self.data.ejection_delay_s) {
            self.travelled_m += airspeed_m_s * STEP_S;
        }
    }

    /// Fraction of the canopy that is open, 0 to 1. The area grows with the square of the distance,
    /// because the diameter of the canopy grows linearly with it.
    pub(crate) fn open_share(&self) -> f64 {
        let filled = (self.travelled_m / self.data.inflation_distance_m).min(1.0);
        filled * filled
    }

    pub(crate) fn drag_area_m2(&self) -> f64 {
        self.data.area_m2 * self.data.drag_coefficient * self.open_share()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The paper's fins on mk2 (section 2.1 and Eq. 2).
    fn paper_fins() -> Airframe {
        let mut airframe = flight::vehicles::mission::builtin_airframe("mk2").unwrap();
        (airframe.body.reference_area_m2, airframe.body.diameter_m) = (0.0043, 0.074);
        let fins = &mut airframe.fins;
        (fins.drag_coefficient, fins.lift_coefficient, fins.length_m) = (1.55, 1.28, 0.10);
        airframe
    }

    /// What the fins at these sines add at 1,000 Pa, the wind at an angle to the axis in the x-z
    /// plane, about a point on the axis `arm_m` behind the hinges, nearer to the tail.
    fn by_fins(truth: &Truth, fin_sines: [f64; 4], angle_deg: f64, arm_m: f64) -> Load {
        let airframe = paper_fins();
        let shape = Shape::new(&airframe, truth);
        let (sin, cos) = libm::sincos(angle_deg.to_radians());
        let flow = Flow {
            density_kg_m3: 2.0,
            velocity_m_s: Vector3::new(-cos, 0.0, sin) * libm::sqrt(1000.0),
            rate_rad_s: Vector3::zeros(),
        };
        let at = |fin_sines| {
            let configuration = Configuration {
                fin_sines,
                legs_out: false,
                parachute_area_m2: 0.0,
                plume: Plume { body: 1.0, fins: 1.0 },
                cg_m: Vector3::new(airframe.fins.station_m - arm_m, 0.0, 0.0),
            };
            shape.load(&flow, &configuration)
        };
        let (with, without) = (at(fin_sines), at([0.0; 4]));
        Load { force_n: with.force_n - without.force_n, moment_n_m: with.moment_n_m - without.moment_n_m }
    }

    fn alone(fin: usize, sine: f64) -> [f64; 4] {
        from_fn(|i| if i == fin { sine } else { 0.0 })
    }

    /// Eq. 13 and 14: at 1,000 Pa an open fin has 0.0043 x 1.55 x 1000 = 6.665 N of drag and
    /// 5.504 N of lift; half of each at 30 degrees. In a wind from the side the drag turns with it
    /// and keeps its size, where Eq. 13 would halve it at 60 degrees.
    #[test]
    fn val_hand_drag_and_lift() {
        let nominal = Truth::default();
        for fin in 0..4 {
            for (sine, drag_n, lift_n) in [(1.0, 6.665, 5.504), (0.5, 3.3325, 2.752)] {
                let force_n = by_fins(&nominal, alone(fin, sine), 0.0, 0.0).force_n;
                assert!((force_n.x - drag_n).abs() < 1e-9, "{force_n}");
                assert!((libm::hypot(force_n.y, force_n.z) - lift_n).abs() < 1e-9, "{force_n}");
            }
        }
        // Of four equal fins the lifts cancel.
        let force_n = by_fins(&nominal, [1.0; 4], 60.0, 0.0).force_n;
        let against = Vector3::new(0.5, 0.0, -libm::sin(60_f64.to_radians()));
        assert!((force_n - against * (4.0 * 6.665)).norm() < 1e-9, "{force_n}");
    }

    /// Eq. 15 to 17: the hand values of the allocation's test of the same name, in the world.
    #[test]
    fn val_hand_moments_of_one_fin() {
        for (fin, roll) in ROLL.into_iter().enumerate() {
            let moment_n_m = by_fins(&Truth::default(), alone(fin, 1.0), 0.0, 0.0).moment_n_m;
            let expected = Vector3::new(
                roll * 0.478_848,
                flight::vehicle::fins::PITCH[fin] * 0.289_927_5,
                flight::vehicle::fins::YAW[fin] * 0.502_169_160_532,
            );
            assert!((moment_n_m - expected).norm() < 1e-9, "{moment_n_m}");
        }
    }

    /// A half of the drag's 6.665 sin 45 N times cos 45: 0.5 x 3.3325 N away from the axis,
    /// 0.23 m from the centre of gravity. None on an open fin, and none on four equal ones.
    #[test]
    fn val_hand_force_of_a_fin_away_from_the_axis() {
        let radial = Truth { fin_radial: 0.5, ..Truth::default() };
        let sine = libm::sqrt(0.5);
        let added = |fins, angle_deg, arm_m| {
            let [with, without] =
                [&radial, &Truth::default()].map(|truth| by_fins(truth, fins, angle_deg, arm_m));
            (with.force_n - without.force_n, with.moment_n_m - without.moment_n_m)
        };
        for fin in 0..4 {
            let (force_n, moment_n_m) = added(alone(fin, sine), 0.0, 0.23);
            let outward = Shape::new(&paper_fins(), &radial).fin_directions[fin];
            assert!((force_n - outward * (0.5 * 3.3325)).norm() < 1e-9, "{force_n}");
            assert!((moment_n_m - (Vector3::x() * 0.23).cross(&force_n)).norm() < 1e-9, "{moment_n_m}");
            assert!(added(alone(fin, 1.0), 20.0, 0.23).0.norm() < 1e-9);
        }
        assert!(added([sine; 4], 0.0, 0.23).0.norm() < 1e-9);
    }

    /// Contribution of legs of 0.01 m2 at 30 m/s from the tail, 20 degrees from the side, and in a
    /// roll.
    #[test]
    fn val_hand_air_on_the_legs() {
        let mut airframe = flight::vehicles::mission::builtin_airframe("mk2").unwrap();
        let bare = Shape::new(&airframe, &Truth::default());
        (airframe.legs.drag_area_m2, airframe.legs.drag_station_m) = (0.006, 0.05);
        let legged = Shape::new(&airframe, &Truth { leg_drag_m2: 0.004, ..Truth::default() });
        let configuration = |legs_out| Configuration {
            fin_sines: [1.0; 4],
            legs_out,
            parachute_area_m2: 0.0,
            plume: Plume { body: 1.0, fins: 1.0 },
            cg_m: Vector3::new(0.4, 0.0, 0.0),
        };
        let added = |flow: &Flow| {
            let [with, without] =
                [legged.load(flow, &configuration(true)), bare.load(flow, &configuration(true))];
            assert_eq!(legged.load(flow, &configuration(false)).force_n, without.force_n);
            (with.force_n - without.force_n, with.moment_n_m - without.moment_n_m)
        };
        let (sin, cos) = libm::sincos(20.0_f64.to_radians());
        let velocity_m_s = Vector3::new(-30.0 * cos, 0.0, 30.0 * sin);
        let (force_n, moment_n_m) =
            added(&Flow { density_kg_m3: 1.2, velocity_m_s, rate_rad_s: Vector3::zeros() });
        // 540 Pa times 0.01 m2 against the velocity; its part across the axis is 0.35 m behind the
        // centre of gravity.
        assert!((force_n + velocity_m_s * (5.4 / 30.0)).norm() < 1e-12, "{force_n}");
        assert!((moment_n_m - Vector3::new(0.0, -0.35 * 5.4 * sin, 0.0)).norm() < 1e-12, "{moment_n_m}");
        // Rolling at 10 rad/s moves the middle of a leg across at 10 times its radius.
        let velocity_m_s = Vector3::new(-30.0, 0.0, 0.0);
        let (_, moment_n_m) =
            added(&Flow { density_kg_m3: 1.2, velocity_m_s, rate_rad_s: Vector3::new(10.0, 0.0, 0.0) });
        let radius_m = 0.5 * (0.5 * airframe.body.diameter_m + airframe.legs.foot_radius_m);
        let across_m_s = 10.0 * radius_m;
        let roll_n_m = 0.6 * 0.01 * libm::hypot(30.0, across_m_s) * across_m_s * radius_m;
        assert!((moment_n_m.x + roll_n_m).abs() < 1e-9, "{moment_n_m} {roll_n_m}");
    }

    #[test]
    fn the_canopy_opens_after_delay_and_distance() {
        let data = ParachuteData {
            area_m2: 2.0,
            drag_coefficient: 0.8,
            ejection_delay_s: 1.0,
            inflation_distance_m: 10.0,
        };
        let mut parachute = Parachute::new(&data);
        parachute.step(100.0, 50.0);
        assert!(parachute.drag_area_m2().abs() < 1e-15 && parachute.ejected_s().is_none());
        parachute.eject(0.0);
        for (step, expected) in [(1000, 0.0), (1250, 0.25), (1500, 1.0), (3000, 1.0)] {
            let mut parachute = parachute.clone();
            for now in 0..step {
                parachute.step(f64::from(now) * STEP_S, 20.0);
            }
            assert!((parachute.open_share() - expected).abs() < 1e-9, "{step}: {}", parachute.open_share());
        }
        let mut broken = Parachute::new(&data);
        broken.break_down();
        broken.eject(0.0);
        broken.step(100.0, 50.0);
        assert!(broken.drag_area_m2().abs() < 1e-15 && broken.ejected_s().is_none());
    }
}
