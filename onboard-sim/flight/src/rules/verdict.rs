//! Outcome of a landing, in four words that all programs use, with the limits behind two of them.

use alloc::borrow::ToOwned as _;
use alloc::string::{String, ToString as _};
use alloc::vec::Vec;
use core::fmt;

use serde::Serialize;

use crate::vehicle::mission::LegLimits;
use crate::vehicle::rigid::RigidState;

/// A vehicle at its first contact, or at the end of a plan. Its target is the origin of the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touchdown {
    /// Level distance of the centre of gravity from the target, m.
    pub distance_m: f64,
    /// Height of the feet above the ground, m.
    pub height_m: f64,
    /// Velocity of the centre of gravity, up, m/s; [`along_axis`](Self::along_axis): towards the
    /// nose.
    pub vertical_m_s: f64,
    /// Speed of the centre of gravity over the ground, m/s; [`along_axis`](Self::along_axis):
    /// across the axis.
    pub lateral_m_s: f64,
    /// Angle between nose and vertical, rad.
    pub tilt_rad: f64,
    /// Size of the rotation rate, roll included, rad/s; [`along_axis`](Self::along_axis): without
    /// roll.
    pub rate_rad_s: f64,
}

impl Touchdown {
    /// Loads on the legs: velocities over the ground, and the full rotation.
    pub fn over_ground(state: &RigidState, height_m: f64) -> Self {
        let (place_m, velocity_m_s) = (&state.position_m, &state.velocity_m_s);
        Self {
            distance_m: libm::hypot(place_m.x, place_m.y),
            height_m,
            vertical_m_s: velocity_m_s.z,
            lateral_m_s: libm::hypot(velocity_m_s.x, velocity_m_s.y),
            tilt_rad: state.tilt_rad(),
            rate_rad_s: libm::sqrt(state.rate_rad_s.norm_squared()),
        }
    }

    /// Quantities limited by [`TABLE_2`]: velocities along and across the axis, and the rotation
    /// across it.
    pub fn along_axis(state: &RigidState, height_m: f64) -> Self {
        let (velocity_m_s, rate_rad_s) = (state.velocity_in_body_m_s(), &state.rate_rad_s);
        Self {
            vertical_m_s: velocity_m_s.x,
            lateral_m_s: libm::hypot(velocity_m_s.y, velocity_m_s.z),
            rate_rad_s: libm::hypot(rate_rad_s.y, rate_rad_s.z),
            ..Self::over_ground(state, height_m)
        }
    }
}

/// The largest values of a [`Touchdown`]; infinite: not limited. Nothing is below the ground.
pub type Limits = Touchdown;

/// Table 2 of the landing paper, for a [`Touchdown::along_axis`]: x, altitude, u, w, pitch error,
/// pitch rate.
pub const TABLE_2: Limits = Limits {
    distance_m: 20.0,
    height_m: 0.2,
    vertical_m_s: 0.4,
    lateral_m_s: 0.1,
    tilt_rad: f64::to_radians(5.0),
    rate_rad_s: f64::to_radians(2.0),
};

impl From<&LegLimits> for Limits {
    /// The design envelope of legs, for a [`Touchdown::over_ground`].
    fn from(legs: &LegLimits) -> Self {
        Self {
            distance_m: f64::INFINITY,
            height_m: f64::INFINITY,
            vertical_m_s: legs.vertical_m_s,
            lateral_m_s: legs.lateral_m_s,
            tilt_rad: legs.tilt_deg.to_radians(),
            rate_rad_s: legs.rate_deg_s.to_radians(),
        }
    }
}

/// How far below the ground a plan may end and still count as ending on it, m.
const PLAN_HEIGHT_TOLERANCE_M: f64 = 1e-3;

/// One limit and the value that was compared with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitResult {
    /// The name of the quantity.
    pub name: &'static str,
    /// The value, in [`unit`](Self::unit).
    pub value: f64,
    /// The lowest value allowed.
    pub lowest: f64,
    /// The highest value allowed; infinite: not limited.
    pub highest: f64,
    /// The unit of the three; angles are in degrees, for people.
    pub unit: &'static str,
    /// Whether the value lies inside; NaN does not.
    pub passed: bool,
}

/// A value over the limit on its side of 0: above 1 it is outside. A limit of 0 has no shares:
/// outside of it the value counts over the width of the range.
pub fn share_of_limit(value: f64, lowest: f64, highest: f64) -> f64 {
    let end = if value < 0.0 { lowest } else { highest };
    if end == 0.0 && value != 0.0 {
        return 1.0 + (value / (highest - lowest)).abs();
    }
    if value == 0.0 { 0.0 } else { (value / end).abs() }
}

impl fmt::Display for LimitResult {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, value, lowest, highest, unit, .. } = self;
        write!(out, "{name} {value:.3} {unit} (limit {lowest:.3} to {highest:.3})")
    }
}

/// Every limit, judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LandingVerdict {
    /// In the order of [`Limits`].
    pub results: [LimitResult; 6],
}

impl LandingVerdict {
    /// Judges a touchdown.
    pub fn judge(limits: &Limits, at: &Touchdown) -> Self {
        let judged = |name, value: f64, lowest: f64, highest: f64, unit| LimitResult {
            name,
            value,
            lowest,
            highest,
            unit,
            passed: (lowest..=highest).contains(&value),
        };
        let size = |name, value, highest, unit| judged(name, value, 0.0, highest, unit);
        let angle =
            |name, value: f64, highest: f64, unit| size(name, value.to_degrees(), highest.to_degrees(), unit);
        let fastest_m_s = limits.vertical_m_s;
        Self {
            results: [
                size("distance", at.distance_m, limits.distance_m, "m"),
                size("height", at.height_m, limits.height_m, "m"),
                judged("vertical speed", at.vertical_m_s, -fastest_m_s, fastest_m_s, "m/s"),
                size("lateral speed", at.lateral_m_s, limits.lateral_m_s, "m/s"),
                angle("tilt", at.tilt_rad, limits.tilt_rad, "deg"),
                angle("rotation rate", at.rate_rad_s, limits.rate_rad_s, "deg/s"),
            ],
        }
    }

    /// Judges the end of a plan, which must be on the ground. A plan meets it only within its
    /// solver's tolerance, so an end within a millimetre below counts as on it.
    pub fn judge_plan(limits: &Limits, end: &Touchdown) -> Self {
        let limits = Limits { height_m: limits.height_m.min(TABLE_2.height_m), ..*limits };
        let on_ground = (-PLAN_HEIGHT_TOLERANCE_M..0.0).contains(&end.height_m);
        let height_m = if on_ground { 0.0 } else { end.height_m };
        Self::judge(&limits, &Touchdown { height_m, ..*end })
    }

    /// Whether every limit was met.
    pub fn is_inside(&self) -> bool {
        self.failures().next().is_none()
    }

    /// The limits that were not met.
    pub fn failures(&self) -> impl Iterator<Item = &LimitResult> {
        self.results.iter().filter(|result| !result.passed)
    }

    /// The limit exceeded by the largest share of itself; the first of equal ones.
    pub fn worst(&self) -> Option<&LimitResult> {
        let share = |limit: &LimitResult| share_of_limit(limit.value, limit.lowest, limit.highest);
        self.failures().min_by(|a, b| share(b).total_cmp(&share(a)))
    }

    /// One line: "inside every limit", or the broken limits with their values.
    pub fn summary(&self) -> String {
        let broken: Vec<String> = self.failures().map(LimitResult::to_string).collect();
        if broken.is_empty() { "inside every limit".to_owned() } else { broken.join(", ") }
    }
}

/// Outcome of a landing. No word implies another, except that a vehicle that stands undamaged is
/// upright.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Landing {
    /// It came to rest upright on its legs, undamaged. For crushable legs this follows from their
    /// loads; other legs were inside their limits at contact.
    pub stands: bool,
    /// It came to rest upright, whatever its touchdown.
    pub upright: bool,
    /// Inside the mission's `[leg_limits]` at contact, all at once.
    pub envelope: bool,
    /// Inside [`TABLE_2`] at contact.
    pub table_2: bool,
}

impl Landing {
    /// The names of the four in tables.
    pub const COLUMNS: [&str; 4] = ["stands", "upright", "envelope", "table_2"];
    /// The four as text.
    pub const WORDS: [&str; 4] =
        ["stands undamaged", "upright", "inside the design envelope of its legs", "inside Table 2"];

    /// The first that holds, where there is room for one only.
    pub fn word(self) -> &'static str {
        match self {
            Self { stands: true, .. } => "stands undamaged",
            Self { upright: true, .. } => "upright",
            _ => "not landed",
        }
    }

    /// The four in their order.
    pub fn flags(self) -> [bool; 4] {
        [self.stands, self.upright, self.envelope, self.table_2]
    }
}

/// Outcome of a flight that touched the ground; it is displayed as one sentence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FlightEnding<'a> {
    /// An abort was latched.
    pub aborted: bool,
    pub landing: Landing,
    /// Why it does not stand undamaged.
    pub failure: Option<&'a str>,
}

/// The failure of a vehicle that came down under its parachute.
pub const UNDER_PARACHUTE: &str = "parachute";

impl fmt::Display for FlightEnding<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Landing { stands, upright, envelope, table_2 } = self.landing;
        if self.aborted {
            out.write_str("ABORTED, then ")?;
        }
        let failure = self.failure.unwrap_or("reason unknown");
        match failure {
            _ if stands => out.write_str("STANDS UNDAMAGED")?,
            UNDER_PARACHUTE => return out.write_str("DOWN UNDER THE PARACHUTE, not landed"),
            _ if upright => write!(out, "UPRIGHT, damaged: {failure}")?,
            _ => return write!(out, "NOT LANDED: {failure}"),
        }
        let side = |is_inside| if is_inside { "inside" } else { "outside" };
        write!(out, ", {} the design envelope of its legs, {} Table 2", side(envelope), side(table_2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};

    const AT_REST: Touchdown = Touchdown {
        distance_m: 0.0,
        height_m: 0.0,
        vertical_m_s: 0.0,
        lateral_m_s: 0.0,
        tilt_rad: 0.0,
        rate_rad_s: 0.0,
    };

    #[test]
    fn a_leaning_vehicle_moves_over_the_ground_as_along_its_axis_turned_by_its_tilt() {
        let tilt_rad = 0.2;
        let upright = RigidState::upright(1.0);
        let world_from_body =
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), tilt_rad) * upright.world_from_body;
        let state = RigidState {
            position_m: Vector3::new(-3.0, 0.0, 1.0),
            velocity_m_s: world_from_body * -Vector3::x(),
            world_from_body,
            rate_rad_s: Vector3::new(0.3, -0.1, 0.0),
        };
        let [ground, axis] = [Touchdown::over_ground, Touchdown::along_axis].map(|of| of(&state, 0.0));
        let near = |found: f64, expected: f64| (found - expected).abs() < 1e-12;
        assert!(near(axis.vertical_m_s, -1.0) && near(axis.lateral_m_s, 0.0), "{axis:?}");
        assert!(
            near(ground.vertical_m_s, -libm::cos(tilt_rad)) && near(ground.lateral_m_s, libm::sin(tilt_rad))
        );
        assert!(near(axis.rate_rad_s, 0.1) && near(ground.rate_rad_s, 0.1_f64.hypot(0.3)), "{ground:?}");
        assert!(near(ground.distance_m, 3.0) && near(ground.tilt_rad, tilt_rad), "{ground:?}");
    }

    #[test]
    fn a_plan_ends_on_the_ground_or_slightly_below_it() {
        let legs = LegLimits { vertical_m_s: 1.0, lateral_m_s: 0.7, tilt_deg: 10.0, rate_deg_s: 30.0 };
        for limits in [TABLE_2, Limits::from(&legs)] {
            let end = |height_m| Touchdown { height_m, ..AT_REST };
            let ends = |height_m| LandingVerdict::judge_plan(&limits, &end(height_m)).is_inside();
            assert!(ends(-1e-12) && ends(0.2));
            assert!(!ends(-0.002) && !ends(0.21) && !ends(f64::NAN));
            assert!(!LandingVerdict::judge(&limits, &end(-1e-12)).is_inside());
        }
    }

    #[test]
    fn each_limit_can_fail_alone() {
        let touchdowns = [
            ("distance", Touchdown { distance_m: 20.1, ..AT_REST }),
            ("height", Touchdown { height_m: 0.21, ..AT_REST }),
            ("height", Touchdown { height_m: -0.006, ..AT_REST }),
            ("vertical speed", Touchdown { vertical_m_s: -0.41, ..AT_REST }),
            ("vertical speed", Touchdown { vertical_m_s: f64::NAN, ..AT_REST }),
            ("lateral speed", Touchdown { lateral_m_s: 0.11, ..AT_REST }),
            ("tilt", Touchdown { tilt_rad: 0.1, ..AT_REST }),
            ("rotation rate", Touchdown { rate_rad_s: 0.036, ..AT_REST }),
        ];
        assert!(LandingVerdict::judge(&TABLE_2, &AT_REST).is_inside());
        for (name, at) in touchdowns {
            let verdict = LandingVerdict::judge(&TABLE_2, &at);
            let failed: Vec<_> = verdict.failures().map(|result| result.name).collect();
            assert_eq!(failed, [name]);
        }
    }

    #[test]
    fn an_ending_reports_whether_legs_were_inside_their_envelope() {
        let text = |[stands, upright, envelope, table_2]: [bool; 4], failure| {
            let landing = Landing { stands, upright, envelope, table_2 };
            FlightEnding { aborted: false, landing, failure }.to_string()
        };
        assert_eq!(
            text([true, true, false, false], None),
            "STANDS UNDAMAGED, outside the design envelope of its legs, outside Table 2"
        );
        assert_eq!(
            text([false, true, true, false], Some("leg overloaded")),
            "UPRIGHT, damaged: leg overloaded, inside the design envelope of its legs, outside Table 2"
        );
        assert_eq!(text([false, false, true, true], Some("tipped over")), "NOT LANDED: tipped over");
        let under = FlightEnding { aborted: true, failure: Some(UNDER_PARACHUTE), ..FlightEnding::default() };
        assert_eq!(under.to_string(), "ABORTED, then DOWN UNDER THE PARACHUTE, not landed");
    }
}
