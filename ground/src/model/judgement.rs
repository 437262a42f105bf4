//! Judges a landing by two standards, from its values at contact: Table 2 of the landing paper, and what the landing
//! legs withstand.
//!
//! The vehicle judges by one of the two or by limits of its own. Its verdict is the one that counts, because it knows
//! more than it sends. The screens mark the verdicts of this module as computed.
//!
//! A planar vehicle reports its velocity along its body axes; a vehicle in space reports it over the ground
//! (vertical, horizontal, total rotation rate). In space the direction of the lean is unknown, so a speed along the
//! body axis is known only to lie between two bounds, and a verdict may be unknown. Whether the vehicle stays upright
//! on its legs cannot be seen from these values.

use std::f64::consts::FRAC_PI_2;

use protocol::dialect::TD_TOUCHDOWN_LIMITS_DATA;

use super::touchdown::Touchdown;

/// Limits sent as `f32` match a standard within this relative error.
const SAME_SHARE: f64 = 1e-5;

/// The limits that a landing must keep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standard {
    pub name: &'static str,
    /// Greatest distance from the pad, m; `None` if any distance is accepted.
    pub distance_m: Option<f64>,
    /// Lowest and greatest altitude, m.
    pub altitude_m: (f64, f64),
    /// Greatest angle from upright, rad.
    pub tilt_rad: f64,
    /// Greatest axial speed, m/s; vertical speed if `by_axis` is false.
    pub along_m_s: f64,
    /// Greatest lateral speed, m/s; horizontal speed if `by_axis` is false.
    pub across_m_s: f64,
    /// Greatest rotation rate, rad/s: of the axis; of the whole vehicle if `by_axis` is false.
    pub rate_rad_s: f64,
    /// Whether the speeds are along and across the body axis, not over the ground.
    by_axis: bool,
}

/// Table 2 of the landing paper; speeds along the body axis.
pub const TABLE_2: Standard = Standard {
    name: "Table 2",
    distance_m: Some(20.0),
    altitude_m: (0.0, 0.2),
    tilt_rad: 5.0 * DEGREE,
    along_m_s: 0.4,
    across_m_s: 0.1,
    rate_rad_s: 2.0 * DEGREE,
    by_axis: true,
};

/// What the landing legs withstand, at any distance from the pad; speeds over the ground.
pub const LEGS: Standard = Standard {
    name: "legs",
    distance_m: None,
    altitude_m: (0.0, 0.2),
    tilt_rad: 10.0 * DEGREE,
    along_m_s: 1.0,
    across_m_s: 0.7,
    rate_rad_s: 30.0 * DEGREE,
    by_axis: false,
};

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Whether a limit is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compliance {
    Kept,
    Broken,
    /// The reported values do not decide it.
    Unknown,
}

impl Standard {
    /// The standard that matches a vehicle's limits, if one does.
    pub fn of(limits: &TD_TOUCHDOWN_LIMITS_DATA) -> Option<Self> {
        let same = |sent: f32, own: f64| (f64::from(sent) - own).abs() <= SAME_SHARE * own;
        [TABLE_2, LEGS].into_iter().find(|standard| {
            same(limits.pitch_error_rad, standard.tilt_rad)
                && same(limits.u_m_s, standard.along_m_s)
                && same(limits.w_m_s, standard.across_m_s)
                && same(limits.q_rad_s, standard.rate_rad_s)
        })
    }

    /// The name of what a vehicle with these limits judges by.
    pub fn whose(limits: Option<&TD_TOUCHDOWN_LIMITS_DATA>) -> String {
        match limits.map(Self::of) {
            Some(Some(standard)) if standard == LEGS => "the legs".to_owned(),
            Some(Some(standard)) => standard.name.to_owned(),
            Some(None) => "its own".to_owned(),
            None => "the vehicle".to_owned(),
        }
    }

    /// Judges each limit in the order of the state: distance, altitude, pitch, axial speed, lateral speed, rate.
    pub fn judge(&self, contact: &Touchdown, in_space: bool) -> [Compliance; 6] {
        let (along, across) = self.speeds_m_s(contact, in_space);
        let rate = match (in_space, self.by_axis) {
            // The reported rate includes an unknown share of roll.
            (true, true) => Between { least: 0.0, most: contact.q_rad_s.abs() },
            _ => Between::just(contact.q_rad_s.abs()),
        };
        let (lowest_m, highest_m) = self.altitude_m;
        let altitude = if (lowest_m..=highest_m).contains(&contact.altitude_m) {
            Compliance::Kept
        } else {
            Compliance::Broken
        };
        [
            self.distance_m
                .map_or(Compliance::Kept, |most_m| Between::just(contact.x_m.abs()).at_most(most_m)),
            altitude,
            Between::just((contact.pitch_rad - FRAC_PI_2).abs()).at_most(self.tilt_rad),
            along.at_most(self.along_m_s),
            across.at_most(self.across_m_s),
            rate.at_most(self.rate_rad_s),
        ]
    }

    /// The magnitudes of the two speeds that the standard limits.
    fn speeds_m_s(&self, contact: &Touchdown, in_space: bool) -> (Between, Between) {
        let (u, w) = (contact.u_m_s, contact.w_m_s);
        let (sin, cos) = libm::sincos(contact.pitch_rad);
        match (in_space, self.by_axis) {
            (true, false) | (false, true) => (Between::just(u.abs()), Between::just(w.abs())),
            // In the plane the pitch alone converts between the two.
            (false, false) => {
                (Between::just((u * sin - w * cos).abs()), Between::just((u * cos + w * sin).abs()))
            }
            // In space the angle between lean and drift is not reported, so it can have any value.
            (true, true) => {
                let (one, other) = ((u * sin + w * cos).abs(), (u * sin - w * cos).abs());
                let crosses_zero = (u * sin).abs() <= (w * cos).abs();
                let along =
                    Between { least: if crosses_zero { 0.0 } else { one.min(other) }, most: one.max(other) };
                // Rounding may give a small negative number, which counts as zero; NaN stays NaN.
                let rest = |along: f64| match u * u + w * w - along * along {
                    below if below < 0.0 => 0.0,
                    squared => squared.sqrt(),
                };
                (along, Between { least: rest(along.most), most: rest(along.least) })
            }
        }
    }
}

/// The verdict over several limits: broken if one is broken, kept if all are kept.
pub fn overall(held: &[Compliance]) -> Compliance {
    if held.contains(&Compliance::Broken) {
        Compliance::Broken
    } else if held.contains(&Compliance::Unknown) {
        Compliance::Unknown
    } else {
        Compliance::Kept
    }
}

/// A magnitude that is known to lie between two values.
#[derive(Debug, Clone, Copy)]
struct Between {
    least: f64,
    most: f64,
}

impl Between {
    fn just(size: f64) -> Self {
        Self { least: size, most: size }
    }

    /// NaN keeps no limit.
    fn at_most(self, limit: f64) -> Compliance {
        if self.most.is_nan() {
            Compliance::Broken
        } else if self.most <= limit {
            Compliance::Kept
        } else if self.least <= limit {
            Compliance::Unknown
        } else {
            Compliance::Broken
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use protocol::dialect::TdLimit;

    fn contact([x_m, pitch_deg, u_m_s, w_m_s, q_deg_s]: [f64; 5]) -> Touchdown {
        Touchdown {
            x_m,
            altitude_m: 0.0,
            pitch_rad: pitch_deg.to_radians(),
            u_m_s,
            w_m_s,
            q_rad_s: q_deg_s.to_radians(),
            violated: TdLimit::empty(),
        }
    }

    /// Tables 3 to 6 of the landing paper: by its own Table 2, 3 of its 7 distinct start states land.
    #[test]
    fn val_landing_paper_tables_3_to_6_judged_by_table_2() {
        let rows = [
            ([-0.27, 87.28, 0.11, 0.040, 0.80], Compliance::Kept),
            ([-8.02, 90.47, -0.29, 0.011, 1.03], Compliance::Kept),
            ([0.41, 89.65, 0.019, 0.0020, -0.039], Compliance::Kept),
            ([-6.84, 88.18, 0.48, 0.010, 1.69], Compliance::Broken),
            ([6.35, 91.50, 0.46, 0.0039, -1.86], Compliance::Broken),
            ([-18.08, 93.96, -1.00, 0.083, -0.41], Compliance::Broken),
            ([19.85, 82.50, -0.99, -0.069, 1.77], Compliance::Broken),
        ];
        for (figures, expected) in rows {
            assert_eq!(overall(&TABLE_2.judge(&contact(figures), false)), expected, "{figures:?}");
        }
    }

    /// In the plane: 0.9 m/s along an axis that leans by 9 degrees is 0.14 m/s over the ground.
    #[test]
    fn the_legs_are_judged_by_speeds_over_the_ground() {
        let leaning = contact([0.0, 81.0, -0.9, 0.0, 3.0]);
        assert_eq!(LEGS.judge(&leaning, false), [Compliance::Kept; 6]);
        let sliding = contact([0.0, 81.0, -0.9, -0.6, 3.0]);
        // 0.9 cos 81 + 0.6 sin 81 = 0.73 m/s.
        assert_eq!(LEGS.judge(&sliding, false)[4], Compliance::Broken);
        assert_eq!(
            LEGS.judge(&sliding, true)[4],
            Compliance::Kept,
            "in space it is reported over the ground"
        );
    }

    #[test]
    fn a_limit_that_the_values_do_not_decide_is_unknown() {
        // 0.35 m/s down, 0.05 m/s aside, 3 deg of lean, 5 deg/s of rotation of which some is roll.
        let held = TABLE_2.judge(&contact([5.0, 87.0, -0.35, 0.05, 5.0]), true);
        assert_eq!(
            held,
            [
                Compliance::Kept,
                Compliance::Kept,
                Compliance::Kept,
                Compliance::Kept,
                Compliance::Kept,
                Compliance::Unknown
            ]
        );
        assert_eq!(overall(&held), Compliance::Unknown);
        assert_eq!(overall(&[Compliance::Unknown, Compliance::Broken]), Compliance::Broken);
        let hard = TABLE_2.judge(&contact([5.0, 87.0, -0.8, 0.05, 5.0]), true);
        assert_eq!((hard[3], overall(&hard)), (Compliance::Broken, Compliance::Broken));
        assert_eq!(TABLE_2.judge(&contact([f64::NAN; 5]), true)[2..], [Compliance::Broken; 4]);
    }

    #[test]
    fn a_standard_is_recognised_by_its_limits() {
        let sent = |standard: &Standard| TD_TOUCHDOWN_LIMITS_DATA {
            x_m: 120.0,
            altitude_max_m: 0.2,
            pitch_error_rad: standard.tilt_rad as f32,
            u_m_s: standard.along_m_s as f32,
            w_m_s: standard.across_m_s as f32,
            q_rad_s: standard.rate_rad_s as f32,
            ..TD_TOUCHDOWN_LIMITS_DATA::default()
        };
        assert_eq!(Standard::of(&sent(&LEGS)), Some(LEGS));
        assert_eq!(Standard::of(&sent(&TABLE_2)), Some(TABLE_2));
        let stronger = Standard { along_m_s: 1.5, ..LEGS };
        assert_eq!(Standard::of(&sent(&stronger)), None);
    }

    proptest! {
        /// Whichever way the vehicle leans, its true axial and lateral speeds lie between the computed bounds.
        #[test]
        fn the_true_axial_and_lateral_speeds_lie_between_their_bounds(
            vertical in -2.0..0.5_f64,
            aside in 0.0..1.0_f64,
            tilt_deg in 0.0..20.0_f64,
            way_deg in 0.0..360.0_f64,
        ) {
            let (sin, cos) = libm::sincos(tilt_deg.to_radians());
            let axial = vertical * cos + aside * sin * libm::cos(way_deg.to_radians());
            let across = (vertical * vertical + aside * aside - axial * axial).max(0.0).sqrt();
            let reported = contact([0.0, 90.0 - tilt_deg, vertical, aside, 0.0]);
            let (along, beside) = TABLE_2.speeds_m_s(&reported, true);
            prop_assert!(along.least - 1e-9 <= axial.abs() && axial.abs() <= along.most + 1e-9);
            prop_assert!(beside.least - 1e-6 <= across && across <= beside.most + 1e-6);
        }
    }
}
