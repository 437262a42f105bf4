//! Position, velocity and attitude of the vehicle, converted from north-east-down on the wire to north, east and up;
//! their trend and the path flown.

use std::collections::VecDeque;
use std::f64::consts::FRAC_PI_2;
use std::time::Duration;

use protocol::dialect::{ATTITUDE_QUATERNION_DATA, LOCAL_POSITION_NED_DATA, TdPhase};

/// Standard gravity, m/s2 (CGPM 1901).
pub const GRAVITY_M_S2: f64 = 9.806_65;

/// A direction or a velocity: north, east, up.
pub type NorthEastUp = [f64; 3];

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude {
    /// Pitch above the horizontal, seen from the east; pi/2 is upright.
    pub pitch_rad: f64,
    /// Angle between nose and vertical, 0 to pi.
    pub tilt_rad: f64,
    /// Rotation rate about the body y axis.
    pub pitch_rate_rad_s: f64,
    /// Rotation rate about the body z axis.
    pub yaw_rate_rad_s: f64,
    /// The body axes: x towards the nose, y, z.
    pub axes: [NorthEastUp; 3],
}

/// Position and velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// North of the pad.
    pub x_m: f64,
    /// East of the pad.
    pub y_m: f64,
    /// Altitude, up.
    pub altitude_m: f64,
    /// Speed towards north.
    pub vx_m_s: f64,
    /// Speed towards east.
    pub vy_m_s: f64,
    /// Vertical speed, up.
    pub climb_m_s: f64,
}

/// Speeds along the body's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodySpeed {
    /// Axial, towards the nose.
    pub u_m_s: f64,
    /// Lateral, along the body y axis.
    pub v_m_s: f64,
    /// Lateral, along the body z axis.
    pub w_m_s: f64,
}

impl Attitude {
    /// `None` if the quaternion is no rotation. Pitch and tilt come from the direction of the nose, which has no
    /// singularity at upright.
    pub fn of(data: &ATTITUDE_QUATERNION_DATA) -> Option<Self> {
        let [w, x, y, z] = [data.q1, data.q2, data.q3, data.q4].map(f64::from);
        let norm_squared = w * w + x * x + y * y + z * z;
        // Sent as f32 and perhaps never normalised; an all-zero or NaN quaternion means "unknown".
        if !(0.5..2.0).contains(&norm_squared) {
            return None;
        }
        let twice = 2.0 / norm_squared;
        // The columns of the rotation to north-east-down, with the sign of the down row changed.
        let nose = [1.0 - twice * (y * y + z * z), twice * (x * y + w * z), -twice * (x * z - w * y)];
        let body_y = [twice * (x * y - w * z), 1.0 - twice * (x * x + z * z), -twice * (y * z + w * x)];
        let body_z = [twice * (x * z + w * y), twice * (y * z - w * x), twice * (x * x + y * y) - 1.0];
        let [north, east, up] = nose;
        Some(Self {
            pitch_rad: libm::atan2(up, north),
            tilt_rad: libm::atan2(libm::hypot(north, east), up),
            pitch_rate_rad_s: f64::from(data.pitchspeed),
            yaw_rate_rad_s: f64::from(data.yawspeed),
            axes: [nose, body_y, body_z],
        })
    }

    /// How fast the nose turns, in any direction, rad/s.
    pub fn turn_rate_rad_s(&self) -> f64 {
        libm::hypot(self.pitch_rate_rad_s, self.yaw_rate_rad_s)
    }

    /// Elevation of the nose above the horizontal, rad; pi/2 is upright.
    pub fn elevation_rad(&self) -> f64 {
        FRAC_PI_2 - self.tilt_rad
    }
}

impl Motion {
    pub fn of(data: &LOCAL_POSITION_NED_DATA) -> Self {
        Self {
            x_m: f64::from(data.x),
            y_m: f64::from(data.y),
            altitude_m: -f64::from(data.z),
            vx_m_s: f64::from(data.vx),
            vy_m_s: f64::from(data.vy),
            climb_m_s: -f64::from(data.vz),
        }
    }

    /// A motion of which only altitude and climb rate are known.
    pub fn vertical(altitude_m: f64, climb_m_s: f64) -> Self {
        let unknown = f64::NAN;
        Self { x_m: unknown, y_m: unknown, altitude_m, vx_m_s: unknown, vy_m_s: unknown, climb_m_s }
    }

    /// Horizontal speed, m/s.
    pub fn horizontal_m_s(&self) -> f64 {
        libm::hypot(self.vx_m_s, self.vy_m_s)
    }

    /// Horizontal distance from the pad, m.
    pub fn distance_m(&self) -> f64 {
        libm::hypot(self.x_m, self.y_m)
    }

    pub fn speed_m_s(&self) -> f64 {
        libm::hypot(self.horizontal_m_s(), self.climb_m_s)
    }
}

impl BodySpeed {
    /// Converts the velocity to the body axes.
    pub fn of(attitude: &Attitude, motion: &Motion) -> Self {
        let along = |axis: &NorthEastUp| {
            axis[0] * motion.vx_m_s + axis[1] * motion.vy_m_s + axis[2] * motion.climb_m_s
        };
        let [x, y, z] = &attitude.axes;
        Self { u_m_s: along(x), v_m_s: along(y), w_m_s: along(z) }
    }

    /// Speed across the body axis, m/s.
    pub fn lateral_m_s(&self) -> f64 {
        libm::hypot(self.v_m_s, self.w_m_s)
    }
}

// The mean acceleration over the last second of telemetry, gravity included.

/// Older velocities are dropped.
const SPAN_MS: u32 = 1_000;
/// Over a shorter time the difference of two velocities is mostly noise.
const SPAN_MIN_MS: u32 = 300;
/// How many samples are kept at most.
const TREND_KEPT: usize = 64;

/// The velocities of the last second under the same forces, by the vehicle's clock, so that radio delays do not look
/// like accelerations.
#[derive(Debug, Clone, Default)]
pub struct Trend {
    acting: Option<TdPhase>,
    velocities: VecDeque<(u32, NorthEastUp)>,
}

impl Trend {
    /// Adds a velocity. When a phase with other forces begins, older velocities are dropped.
    pub(crate) fn note(&mut self, boot_ms: u32, motion: &Motion, phase: Option<TdPhase>) {
        let acting = phase.map(phase_by_forces);
        if acting != self.acting {
            *self = Self { acting, ..Self::default() };
        }
        let velocity = [motion.vx_m_s, motion.vy_m_s, motion.climb_m_s];
        let newest = self.velocities.back().map(|(at_ms, _)| *at_ms);
        if newest.is_some_and(|newest| boot_ms <= newest) || velocity.iter().any(|part| !part.is_finite()) {
            return;
        }
        let is_old = |at_ms: u32| boot_ms - at_ms > SPAN_MS;
        while self.velocities.front().is_some_and(|(at_ms, _)| is_old(*at_ms))
            || self.velocities.len() >= TREND_KEPT
        {
            self.velocities.pop_front();
        }
        self.velocities.push_back((boot_ms, velocity));
    }

    /// The mean acceleration; `None` while too little has been received under the present forces.
    pub fn mean_change(&self) -> Option<Change> {
        let ((from_ms, from), (to_ms, to)) = (self.velocities.front()?, self.velocities.back()?);
        let span_ms = to_ms - from_ms;
        let span_s = f64::from(span_ms) / 1_000.0;
        (span_ms >= SPAN_MIN_MS).then(|| Change {
            acceleration_m_s2: std::array::from_fn(|axis| (to[axis] - from[axis]) / span_s),
            velocity_m_s: std::array::from_fn(|axis| f64::midpoint(from[axis], to[axis])),
        })
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    pub acceleration_m_s2: NorthEastUp,
    /// The mean velocity, m/s.
    pub velocity_m_s: NorthEastUp,
}

/// Maps phases with the same forces to one phase: arming the motor changes no force.
fn phase_by_forces(phase: TdPhase) -> TdPhase {
    match phase {
        TdPhase::TD_PHASE_LAND_ARMED | TdPhase::TD_PHASE_IGNITION => TdPhase::TD_PHASE_AERO_DESCENT,
        other => other,
    }
}

// The path that the vehicle flew, in a bounded number of points.

const PATH_KEPT: usize = 512;
/// A position further away than this is not believed.
const POSITION_MAX_M: f64 = 1e5;

/// A path: positions north, east and up from the pad, m.
#[derive(Debug, Clone, Default)]
pub struct FlownPath {
    points: Vec<NorthEastUp>,
    /// When each was received.
    times: Vec<Duration>,
}

impl FlownPath {
    /// The points, oldest first.
    pub fn points(&self) -> &[NorthEastUp] {
        &self.points
    }

    /// The path up to a time.
    pub(crate) fn until(&self, at: Duration) -> Self {
        let count = self.times.partition_point(|time| *time <= at);
        Self { points: self.points[..count].to_vec(), times: self.times[..count].to_vec() }
    }

    /// Adds a position. When the path gets too long, every second point is dropped.
    pub(crate) fn extend(&mut self, motion: &Motion, now: Duration) {
        let point = [motion.x_m, motion.y_m, motion.altitude_m];
        let is_position = point.iter().all(|value| value.abs() < POSITION_MAX_M);
        if !is_position || self.points.last() == Some(&point) {
            return;
        }
        if self.points.len() >= PATH_KEPT {
            every_second(&mut self.points);
            every_second(&mut self.times);
        }
        self.points.push(point);
        self.times.push(now);
    }
}

/// Drops every second element.
pub(super) fn every_second<T>(list: &mut Vec<T>) {
    let mut keep = false;
    list.retain(|_| {
        keep = !keep;
        keep
    });
}

#[cfg(test)]
mod motion_tests {
    use super::*;
    use proptest::prelude::*;

    fn rotation([w, x, y, z]: [f64; 4]) -> Attitude {
        let [q1, q2, q3, q4] = [w, x, y, z].map(|part| part as f32);
        Attitude::of(&ATTITUDE_QUATERNION_DATA { q1, q2, q3, q4, ..Default::default() }).unwrap()
    }

    fn close(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-5, "{found} is not {expected}");
    }

    /// A rocket that leans 10 deg towards the east, which the plane of north and up does not show: a rotation about
    /// east by 90 deg, then about north by 10 deg.
    #[test]
    fn a_lean_towards_the_east_is_a_tilt() {
        let (sin, cos) = libm::sincos(5.0_f64.to_radians());
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let leaning = rotation([cos * half, sin * half, cos * half, sin * half]);
        close(leaning.tilt_rad.to_degrees(), 10.0);
        close(leaning.elevation_rad().to_degrees(), 80.0);
        let [north, east, up] = leaning.axes[0];
        close(north, 0.0);
        close(east, libm::sin(10.0_f64.to_radians()));
        close(up, libm::cos(10.0_f64.to_radians()));
        // Falling straight down, it moves along its axis and, across it, along its y axis.
        let falling = Motion { vx_m_s: 0.0, vy_m_s: 0.0, climb_m_s: -10.0, ..Motion::vertical(0.0, 0.0) };
        let speed = BodySpeed::of(&leaning, &falling);
        close(speed.u_m_s, -9.848_078);
        close(speed.lateral_m_s(), 1.736_482);
        close(speed.w_m_s, 0.0);
    }

    #[test]
    fn motion_towards_the_east_counts_in_speed_and_distance() {
        let wire = LOCAL_POSITION_NED_DATA {
            x: 3.0,
            y: -4.0,
            z: -7.0,
            vx: 1.0,
            vy: 2.0,
            vz: 2.0,
            ..Default::default()
        };
        let motion = Motion::of(&wire);
        close(motion.distance_m(), 5.0);
        close(motion.speed_m_s(), 3.0);
        close(motion.horizontal_m_s(), 2.236_068);
    }

    proptest! {
        /// A rotation keeps the length: the components along the body axes make up the whole speed.
        #[test]
        fn the_components_along_the_body_axes_make_up_the_whole_speed(
            q in prop::array::uniform4(-1.0..1.0_f64),
            v in prop::array::uniform3(-50.0..50.0_f64),
        ) {
            let norm = q.iter().map(|part| part * part).sum::<f64>().sqrt();
            prop_assume!(norm > 0.1);
            let attitude = rotation(q.map(|part| part / norm));
            let motion = Motion { vx_m_s: v[0], vy_m_s: v[1], climb_m_s: v[2], ..Motion::vertical(0.0, 0.0) };
            let speed = BodySpeed::of(&attitude, &motion);
            let whole = libm::hypot(speed.u_m_s, speed.lateral_m_s());
            prop_assert!((whole - motion.speed_m_s()).abs() < 1e-4);
            prop_assert!((attitude.tilt_rad - libm::acos(attitude.axes[0][2].clamp(-1.0, 1.0))).abs() < 1e-3);
        }
    }
}

#[cfg(test)]
mod trend_tests {
    use super::*;

    fn falling(speed_m_s: f64) -> Motion {
        Motion { vx_m_s: 1.0, vy_m_s: 0.0, ..Motion::vertical(100.0, -speed_m_s) }
    }

    fn noted(velocities: &[(u32, f64)], phase: TdPhase) -> Trend {
        let mut trend = Trend::default();
        for (boot_ms, speed_m_s) in velocities {
            trend.note(*boot_ms, &falling(*speed_m_s), Some(phase));
        }
        trend
    }

    fn acceleration(trend: &Trend) -> Option<NorthEastUp> {
        trend.mean_change().map(|change| change.acceleration_m_s2)
    }

    #[test]
    fn it_is_the_change_over_the_last_second() {
        let trend = noted(&[(0, 90.0), (1_000, 10.0), (1_500, 14.0), (2_000, 18.0)], TdPhase::TD_PHASE_COAST);
        assert_eq!(acceleration(&trend), Some([0.0, 0.0, -8.0]));
        assert_eq!(trend.mean_change().map(|change| change.velocity_m_s), Some([1.0, 0.0, -14.0]));
    }

    #[test]
    fn too_short_a_time_gives_nothing_and_other_forces_start_over() {
        let mut trend = noted(&[(1_000, 10.0), (1_200, 12.0)], TdPhase::TD_PHASE_COAST);
        assert_eq!(acceleration(&trend), None);
        trend.note(1_400, &falling(14.0), Some(TdPhase::TD_PHASE_COAST));
        assert_eq!(acceleration(&trend), Some([0.0, 0.0, -10.0]));
        trend.note(1_500, &falling(14.0), Some(TdPhase::TD_PHASE_POWERED));
        assert_eq!(acceleration(&trend), None);
        let mut descending = noted(&[(1_000, 10.0), (1_200, 11.0)], TdPhase::TD_PHASE_AERO_DESCENT);
        descending.note(1_400, &falling(12.0), Some(TdPhase::TD_PHASE_LAND_ARMED));
        assert_eq!(acceleration(&descending), Some([0.0, 0.0, -5.0]));
    }

    #[test]
    fn late_and_non_finite_velocities_are_ignored() {
        let mut trend = noted(&[(1_000, 10.0), (1_500, 15.0), (1_400, 99.0)], TdPhase::TD_PHASE_COAST);
        trend.note(1_600, &falling(f64::NAN), Some(TdPhase::TD_PHASE_COAST));
        assert_eq!(acceleration(&trend), Some([0.0, 0.0, -10.0]));
    }
}

#[cfg(test)]
mod flown_path_tests {
    use super::*;

    #[test]
    fn a_long_path_keeps_its_ends_and_stays_bounded() {
        let mut flown = FlownPath::default();
        for k in 0..10_000_u32 {
            let motion = Motion { x_m: f64::from(k), y_m: 0.0, ..Motion::vertical(f64::from(k), 0.0) };
            flown.extend(&motion, Duration::from_secs(k.into()));
            flown.extend(&motion, Duration::from_secs(k.into()));
        }
        flown.extend(&Motion { x_m: f64::NAN, y_m: 0.0, ..Motion::vertical(1.0, 0.0) }, Duration::MAX);
        flown.extend(&Motion { x_m: 1e9, y_m: 0.0, ..Motion::vertical(1.0, 0.0) }, Duration::MAX);
        let points = flown.points();
        assert!(points.len() <= PATH_KEPT);
        assert_eq!((points.first(), points.last()), (Some(&[0.0; 3]), Some(&[9_999.0, 0.0, 9_999.0])));
        assert!(points.is_sorted_by(|before, after| before[0] < after[0]));
        let half = flown.until(Duration::from_secs(5_000));
        assert!(half.points().last().is_some_and(|point| point[0] <= 5_000.0));
        assert!(half.points().len() < points.len());
        assert!(flown.until(Duration::ZERO).points().len() == 1);
    }
}
