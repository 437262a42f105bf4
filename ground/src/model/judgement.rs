//! The two verdicts that every landing gets, computed from the figures of its contact: by the landing paper's Table 2, and by
//! what the legs take.
//!
//! The vehicle judges by one of the two, or by limits of its own, and its verdict is the one that counts: it knows more
//! than it sends. What is computed here stands beside it and is called so.
//!
//! A vehicle in the plane reports its velocity along its axes, a vehicle in space over the ground (vertical,
//! horizontal, whole rotation). From one to the other the direction of the lean is missing in space; a
//! figure is then known only to lie between two values, and a verdict may not be known at all. That the vehicle stays
//! upright on its legs cannot be seen from these figures.

use std::f64::consts::FRAC_PI_2;

use protocol::dialect::TD_TOUCHDOWN_LIMITS_DATA;

use crate::limits::Touchdown;

/// Limits sent as `f32` are these if they are no further off than this share.
const SAME_SHARE: f64 = 1e-5;

/// What counts as a landing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standard {
    /// For people.
    pub name: &'static str,
    /// Greatest distance from the pad, m; `None` where it does not matter.
    pub distance_m: Option<f64>,
    /// Lowest and greatest altitude, m.
    pub altitude_m: (f64, f64),
    /// Greatest angle from upright, rad.
    pub tilt_rad: f64,
    /// Greatest speed along, m/s: along the axis, or vertical.
    pub along_m_s: f64,
    /// Greatest speed across, m/s: across the axis, or horizontal.
    pub across_m_s: f64,
    /// Greatest rate, rad/s: of the axis, or whole.
    pub rate_rad_s: f64,
    /// The speeds are those along and across the body's axis.
    by_axis: bool,
}

/// Table 2 of the landing paper: speeds by the body's axis.
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

/// What the legs take, wherever they stand: speeds over the ground.
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

/// What is known of a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Held {
    /// Kept.
    Kept,
    /// Not kept.
    Broken,
    /// The figures do not tell.
    Unknown,
}

impl Standard {
    /// The standard that a vehicle's limits are, if they are one of the two.
    pub fn of(limits: &TD_TOUCHDOWN_LIMITS_DATA) -> Option<Self> {
        let same = |sent: f32, own: f64| (f64::from(sent) - own).abs() <= SAME_SHARE * own;
        [TABLE_2, LEGS].into_iter().find(|standard| {
            same(limits.pitch_error_rad, standard.tilt_rad)
                && same(limits.u_m_s, standard.along_m_s)
                && same(limits.w_m_s, standard.across_m_s)
                && same(limits.q_rad_s, standard.rate_rad_s)
        })
    }

    /// By what a vehicle of these limits judges, in words.
    pub fn whose(limits: Option<&TD_TOUCHDOWN_LIMITS_DATA>) -> String {
        match limits.map(Self::of) {
            Some(Some(standard)) if standard == LEGS => "the legs".to_owned(),
            Some(Some(standard)) => standard.name.to_owned(),
            Some(None) => "its own".to_owned(),
            None => "the vehicle".to_owned(),
        }
    }

    /// Limit by limit, in state order: distance, altitude, pitch, speed along, speed across, rate.
    pub fn judge(&self, contact: &Touchdown, in_space: bool) -> [Held; 6] {
        let (along, across) = self.speeds_m_s(contact, in_space);
        let rate = match (in_space, self.by_axis) {
            // The rotation about the axis is part of what is reported, and how much of it is not said.
            (true, true) => Between { least: 0.0, most: contact.q_rad_s.abs() },
            _ => Between::just(contact.q_rad_s.abs()),
        };
        let (lowest_m, highest_m) = self.altitude_m;
        let altitude =
            if (lowest_m..=highest_m).contains(&contact.altitude_m) { Held::Kept } else { Held::Broken };
        [
            self.distance_m.map_or(Held::Kept, |most_m| Between::just(contact.x_m.abs()).at_most(most_m)),
            altitude,
            Between::just((contact.pitch_rad - FRAC_PI_2).abs()).at_most(self.tilt_rad),
            along.at_most(self.along_m_s),
            across.at_most(self.across_m_s),
            rate.at_most(self.rate_rad_s),
        ]
    }

    /// Sizes of the speeds along and across, as the standard has them.
    fn speeds_m_s(&self, contact: &Touchdown, in_space: bool) -> (Between, Between) {
        let (u, w) = (contact.u_m_s, contact.w_m_s);
        let (sin, cos) = libm::sincos(contact.pitch_rad);
        match (in_space, self.by_axis) {
            (true, false) | (false, true) => (Between::just(u.abs()), Between::just(w.abs())),
            // In the plane the two are one rotation apart.
            (false, false) => {
                (Between::just((u * sin - w * cos).abs()), Between::just((u * cos + w * sin).abs()))
            }
            // In space it is not said which way the vehicle leans against the way it slides: any.
            (true, true) => {
                let (one, other) = ((u * sin + w * cos).abs(), (u * sin - w * cos).abs());
                let crosses_nought = (u * sin).abs() <= (w * cos).abs();
                let along = Between {
                    least: if crosses_nought { 0.0 } else { one.min(other) },
                    most: one.max(other),
                };
                // Rounded below nought it is nought; what is no number stays none.
                let rest = |along: f64| match u * u + w * w - along * along {
                    below if below < 0.0 => 0.0,
                    squared => squared.sqrt(),
                };
                (along, Between { least: rest(along.most), most: rest(along.least) })
            }
        }
    }
}

/// All of them: broken if one is, kept if all are.
pub fn together(held: &[Held]) -> Held {
    if held.contains(&Held::Broken) {
        Held::Broken
    } else if held.contains(&Held::Unknown) {
        Held::Unknown
    } else {
        Held::Kept
    }
}

/// A size that lies somewhere between two.
#[derive(Debug, Clone, Copy)]
struct Between {
    least: f64,
    most: f64,
}

impl Between {
    fn just(size: f64) -> Self {
        Self { least: size, most: size }
    }

    /// What is no number keeps no limit.
    fn at_most(self, limit: f64) -> Held {
        if self.most.is_nan() {
            Held::Broken
        } else if self.most <= limit {
            Held::Kept
        } else if self.least <= limit {
            Held::Unknown
        } else {
            Held::Broken
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
            ([-0.27, 87.28, 0.11, 0.040, 0.80], Held::Kept),
            ([-8.02, 90.47, -0.29, 0.011, 1.03], Held::Kept),
            ([0.41, 89.65, 0.019, 0.0020, -0.039], Held::Kept),
            ([-6.84, 88.18, 0.48, 0.010, 1.69], Held::Broken),
            ([6.35, 91.50, 0.46, 0.0039, -1.86], Held::Broken),
            ([-18.08, 93.96, -1.00, 0.083, -0.41], Held::Broken),
            ([19.85, 82.50, -0.99, -0.069, 1.77], Held::Broken),
        ];
        for (figures, expected) in rows {
            assert_eq!(together(&TABLE_2.judge(&contact(figures), false)), expected, "{figures:?}");
        }
    }

    /// In the plane: 0.9 m/s along an axis that leans by 9 degrees is 0.14 m/s over the ground.
    #[test]
    fn the_legs_are_asked_over_the_ground() {
        let leaning = contact([0.0, 81.0, -0.9, 0.0, 3.0]);
        assert_eq!(LEGS.judge(&leaning, false), [Held::Kept; 6]);
        let sliding = contact([0.0, 81.0, -0.9, -0.6, 3.0]);
        // 0.9 cos 81 + 0.6 sin 81 = 0.73 m/s.
        assert_eq!(LEGS.judge(&sliding, false)[4], Held::Broken);
        assert_eq!(LEGS.judge(&sliding, true)[4], Held::Kept, "in space it is reported over the ground");
    }

    #[test]
    fn what_the_figures_do_not_tell_is_not_made_up() {
        // 0.35 m/s down, 0.05 m/s aside, 3 deg of lean, 5 deg/s of rotation of which some is roll.
        let held = TABLE_2.judge(&contact([5.0, 87.0, -0.35, 0.05, 5.0]), true);
        assert_eq!(held, [Held::Kept, Held::Kept, Held::Kept, Held::Kept, Held::Kept, Held::Unknown]);
        assert_eq!(together(&held), Held::Unknown);
        assert_eq!(together(&[Held::Unknown, Held::Broken]), Held::Broken);
        let hard = TABLE_2.judge(&contact([5.0, 87.0, -0.8, 0.05, 5.0]), true);
        assert_eq!((hard[3], together(&hard)), (Held::Broken, Held::Broken));
        assert_eq!(TABLE_2.judge(&contact([f64::NAN; 5]), true)[2..], [Held::Broken; 4]);
    }

    #[test]
    fn a_vehicles_limits_are_known_by_their_numbers() {
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
        /// Whichever way the vehicle leans, its true speeds by the axis lie where they are said to lie.
        #[test]
        fn the_speeds_by_the_axis_lie_between_their_bounds(
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
