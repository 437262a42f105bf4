//! Winds aloft: the mean wind at several heights, as a balloon or a forecast gives it.

use std::fmt;
use std::sync::Arc;

use nalgebra::Vector3;
use serde::Deserialize;

use super::REFERENCE_HEIGHT_M;

/// Accepted heights above the pad, m, and speeds, m/s. Jet streams reach 110 m/s.
const HEIGHTS_M: [f64; 2] = [0.0, 50_000.0];
const SPEEDS_M_S: [f64; 2] = [0.0, 130.0];

/// The mean wind over height. Between two levels each horizontal component is linear in height.
/// Below the lowest and above the highest level the wind of that level holds.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "Vec<[f64; 3]>")]
pub struct WindsAloft(Arc<[Level]>);

/// Height above the pad, m, and wind there, in the world, m/s.
type Level = (f64, Vector3<f64>);

/// Why levels are not winds aloft.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WindsAloftError {
    #[error("no level has a wind; at least one is needed")]
    Empty,
    #[error("level {level}: {value} is {found}; accepted: {accepted}")]
    Level {
        /// From 1, upwards.
        level: usize,
        value: &'static str,
        found: f64,
        accepted: String,
    },
}

impl TryFrom<Vec<[f64; 3]>> for WindsAloft {
    type Error = WindsAloftError;

    /// From levels upwards: height above the pad, m; speed, m/s; direction that the wind comes
    /// from, degrees clockwise from north.
    fn try_from(levels: Vec<[f64; 3]>) -> Result<Self, Self::Error> {
        let mut below_m = f64::NEG_INFINITY;
        let read = |(place, [height_m, speed_m_s, from_deg]): (usize, &[f64; 3])| {
            let refuse = |value, found, accepted| {
                Err(WindsAloftError::Level { level: place + 1, value, found, accepted })
            };
            let accepted = [
                ("height_m", *height_m, HEIGHTS_M),
                ("speed_m_s", *speed_m_s, SPEEDS_M_S),
                ("from_deg", *from_deg, [0.0, 360.0]),
            ];
            for (value, found, [least, most]) in accepted {
                if !(least..=most).contains(&found) {
                    return refuse(value, found, format!("{least} to {most}"));
                }
            }
            if *height_m <= below_m {
                return refuse(
                    "height_m",
                    *height_m,
                    format!("above {below_m}, the height of the level before"),
                );
            }
            below_m = *height_m;
            // World x is north and y is west.
            let (sin, cos) = libm::sincos(from_deg.to_radians());
            Ok((*height_m, Vector3::new(-cos, sin, 0.0) * *speed_m_s))
        };
        let levels: Arc<[Level]> = levels.iter().enumerate().map(read).collect::<Result<_, _>>()?;
        if levels.is_empty() { Err(WindsAloftError::Empty) } else { Ok(Self(levels)) }
    }
}

impl WindsAloft {
    /// Mean wind at a height above the pad, in the world, m/s.
    pub fn at_m_s(&self, height_m: f64) -> Vector3<f64> {
        let above = self.0.partition_point(|(level_m, _)| *level_m <= height_m);
        match (above.checked_sub(1).and_then(|below| self.0.get(below)), self.0.get(above)) {
            (Some((low_m, low)), Some((high_m, high))) => {
                low + (high - low) * ((height_m - low_m) / (high_m - low_m))
            }
            (Some((_, level)), None) | (None, Some((_, level))) => *level,
            (None, None) => Vector3::zeros(),
        }
    }

    /// Speed, m/s, and direction of the mean wind 10 m above the pad: from world x towards world y,
    /// rad.
    pub fn near_ground(&self) -> (f64, f64) {
        let wind_m_s = self.at_m_s(REFERENCE_HEIGHT_M);
        (libm::hypot(wind_m_s.x, wind_m_s.y), libm::atan2(wind_m_s.y, wind_m_s.x))
    }

    /// Direction that the mean wind 10 m above the pad comes from, degrees clockwise from north.
    pub fn from_deg(&self) -> f64 {
        let from_deg = 180.0 - self.near_ground().1.to_degrees();
        if from_deg < 360.0 { from_deg } else { from_deg - 360.0 }
    }
}

impl fmt::Display for WindsAloft {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [lowest_m, highest_m] =
            [self.0.first(), self.0.last()].map(|level| level.map_or(0.0, |(height_m, _)| *height_m));
        write!(
            out,
            "{:.1} m/s from {:.0}° at 10 m; levels: {}, {lowest_m:.0} to {highest_m:.0} m above the pad; below and above, \
             the wind of the nearest level",
            self.near_ground().0,
            self.from_deg(),
            self.0.len()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn winds(levels: &[[f64; 3]]) -> Result<WindsAloft, WindsAloftError> {
        levels.to_vec().try_into()
    }

    /// 4 m/s from the west turn to 8 m/s from the north: half way up it is 2 m/s towards the east
    /// and 4 m/s towards the south.
    #[test]
    fn val_hand_components_are_linear_between_levels_and_constant_beyond() {
        let winds = winds(&[[10.0, 4.0, 270.0], [510.0, 8.0, 360.0]]).unwrap();
        for (height_m, north_m_s, west_m_s) in
            [(-5.0, 0.0, -4.0), (10.0, 0.0, -4.0), (260.0, -4.0, -2.0), (510.0, -8.0, 0.0), (9e3, -8.0, 0.0)]
        {
            let found = winds.at_m_s(height_m);
            assert!((found - Vector3::new(north_m_s, west_m_s, 0.0)).norm() < 1e-12, "{height_m} {found}");
        }
        assert!((winds.near_ground().0 - 4.0).abs() < 1e-12 && (winds.from_deg() - 270.0).abs() < 1e-9);
    }

    #[test]
    fn every_direction_is_stated_as_it_was_given() {
        for from_deg in [0.0, 45.0, 135.0, 180.0, 225.0, 315.0] {
            let found_deg = winds(&[[0.0, 3.0, from_deg]]).unwrap().from_deg();
            assert!((found_deg - from_deg).abs() < 1e-9, "{found_deg}");
        }
    }

    #[test]
    fn levels_that_are_no_winds_are_refused_with_the_value() {
        for (levels, words) in [
            (vec![], "no level has a wind; at least one is needed"),
            (vec![[-1.0, 2.0, 10.0]], "level 1: height_m is -1; accepted: 0 to 50000"),
            (vec![[1.0, 2.0, 370.0]], "level 1: from_deg is 370; accepted: 0 to 360"),
            (vec![[1.0, f64::NAN, 10.0]], "level 1: speed_m_s is NaN; accepted: 0 to 130"),
            (
                vec![[1.0, 2.0, 10.0], [1.0, 3.0, 10.0]],
                "level 2: height_m is 1; accepted: above 1, the height of the level before",
            ),
        ] {
            assert_eq!(winds(&levels).unwrap_err().to_string(), words);
        }
    }
}
