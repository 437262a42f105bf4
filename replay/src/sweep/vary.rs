//! The varied settings, and the points that follow from them.

use std::str::FromStr;

use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha12Rng;

use crate::settings::Setting;

/// Most points of one sweep: more would take days.
const POINTS_MAX: usize = 1_000_000;

/// A setting and the values it takes.
#[derive(Debug, Clone, PartialEq)]
pub struct Vary {
    /// The setting, as in `powered.weights.theta`.
    pub path: String,
    pub values: Values,
}

/// The values of a varied setting.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// A list of values.
    Listed(Vec<toml::Value>),
    /// A range: evenly spaced values for a grid, or random values inside it.
    Range {
        /// The first.
        from: f64,
        /// The last.
        to: f64,
        /// Number of values; ignored for random points.
        count: usize,
    },
}

/// Why the values cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum VaryError {
    /// The text cannot be parsed.
    #[error(
        "`{given}`: must be PATH=FROM:TO:COUNT, PATH=FROM:TO or PATH=A,B,C, as in powered.weights.theta=50:110:7"
    )]
    Form { given: String },
    /// Too many points.
    #[error("{points} points; at most {POINTS_MAX} are allowed in one sweep")]
    TooMany { points: usize },
    /// Random points need a range, not a list.
    #[error("{path}: random points need a range PATH=FROM:TO, not a list")]
    NoRange {
        /// The setting.
        path: String,
    },
}

/// The settings of one point.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Choice {
    /// Settings of controller and plant.
    pub settings: Vec<Setting>,
    /// Settings of the plant only.
    pub plant_settings: Vec<Setting>,
}

impl FromStr for Vary {
    type Err = VaryError;

    fn from_str(given: &str) -> Result<Self, VaryError> {
        let form = || VaryError::Form { given: given.to_owned() };
        let (path, text) = given.split_once('=').ok_or_else(form)?;
        let (path, text) = (path.trim().to_owned(), text.trim());
        if path.is_empty() || text.is_empty() {
            return Err(form());
        }
        let parts: Vec<&str> = text.split(':').collect();
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        let values = match parts.as_slice() {
            [_] => {
                let listed = text.split(',').map(|value| format!("{path}={value}").parse::<Setting>());
                let listed = listed.map(|setting| setting.ok().filter(|setting| setting.at_s.is_none()));
                Values::Listed(
                    listed
                        .map(|setting| Some(setting?.value))
                        .collect::<Option<Vec<_>>>()
                        .ok_or_else(form)?,
                )
            }
            [from, to] => Values::Range {
                from: number(from).ok_or_else(form)?,
                to: number(to).ok_or_else(form)?,
                count: 2,
            },
            [from, to, count] => Values::Range {
                from: number(from).ok_or_else(form)?,
                to: number(to).ok_or_else(form)?,
                count: count.trim().parse().ok().filter(|count| *count >= 1).ok_or_else(form)?,
            },
            _ => return Err(form()),
        };
        Ok(Self { path, values })
    }
}

impl Vary {
    fn count(&self) -> usize {
        match &self.values {
            Values::Listed(values) => values.len(),
            Values::Range { count, .. } => *count,
        }
    }

    /// The value at this index of the grid.
    fn at(&self, place: usize) -> Setting {
        let value = match &self.values {
            Values::Listed(values) => values.get(place).cloned().unwrap_or(toml::Value::Boolean(false)),
            Values::Range { from, to, count } => {
                let share = if *count > 1 { place as f64 / (*count - 1) as f64 } else { 0.0 };
                toml::Value::Float(from + share * (to - from))
            }
        };
        Setting { path: self.path.clone(), value, at_s: None }
    }
}

/// Every combination; the last setting changes fastest.
///
/// # Errors
/// There are too many points.
pub fn grid(vary: &[Vary], plant: &[Vary]) -> Result<Vec<Choice>, VaryError> {
    let all: Vec<&Vary> = vary.iter().chain(plant).collect();
    let points = all.iter().map(|vary| vary.count()).fold(1, usize::saturating_mul);
    if points > POINTS_MAX {
        return Err(VaryError::TooMany { points });
    }
    let choice = |point: usize| {
        let mut rest = point;
        let mut settings: Vec<Setting> = Vec::new();
        for vary in all.iter().rev() {
            settings.push(vary.at(rest % vary.count()));
            rest /= vary.count();
        }
        settings.reverse();
        let plant_settings = settings.split_off(vary.len());
        Choice { settings, plant_settings }
    };
    Ok((0..points).map(choice).collect())
}

/// Uniformly random points in the ranges; the same seed gives the same points.
///
/// # Errors
/// There are too many points, or a setting has a list instead of a range.
pub fn random(vary: &[Vary], plant: &[Vary], points: usize, seed: u64) -> Result<Vec<Choice>, VaryError> {
    if points > POINTS_MAX {
        return Err(VaryError::TooMany { points });
    }
    let mut numbers = ChaCha12Rng::seed_from_u64(seed);
    let mut draw = |vary: &Vary| match vary.values {
        Values::Listed(_) => Err(VaryError::NoRange { path: vary.path.clone() }),
        Values::Range { from, to, .. } => {
            // 53 random bits.
            let share = (numbers.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
            let value = toml::Value::Float(from + share * (to - from));
            Ok(Setting { path: vary.path.clone(), value, at_s: None })
        }
    };
    (0..points)
        .map(|_| {
            let settings = vary.iter().map(&mut draw).collect::<Result<Vec<_>, _>>()?;
            let plant_settings = plant.iter().map(&mut draw).collect::<Result<Vec<_>, _>>()?;
            Ok(Choice { settings, plant_settings })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(choices: &[Choice]) -> Vec<String> {
        let words = |choice: &Choice| {
            let all = choice.settings.iter().chain(&choice.plant_settings);
            all.map(ToString::to_string).collect::<Vec<_>>().join(" ")
        };
        choices.iter().map(words).collect()
    }

    #[test]
    fn a_grid_has_every_combination_in_order() {
        let points = grid(&["a=1:3:3".parse().unwrap()], &["b=x,y".parse().unwrap()]).unwrap();
        assert_eq!(
            shown(&points),
            [
                "a=1.0 b=\"x\"",
                "a=1.0 b=\"y\"",
                "a=2.0 b=\"x\"",
                "a=2.0 b=\"y\"",
                "a=3.0 b=\"x\"",
                "a=3.0 b=\"y\""
            ]
        );
        assert!(points[0].plant_settings[0].path == "b");
        assert!(grid(&["a=0:1:2000".parse().unwrap(), "b=0:1:2000".parse().unwrap()], &[]).is_err());
    }

    #[test]
    fn random_points_lie_in_their_range_and_repeat() {
        let vary: [Vary; 1] = ["a=2:3".parse().unwrap()];
        let points = random(&vary, &[], 50, 7).unwrap();
        assert_eq!(points, random(&vary, &[], 50, 7).unwrap());
        assert_ne!(points, random(&vary, &[], 50, 8).unwrap());
        assert!(points.iter().all(|p| (2.0..3.0).contains(&p.settings[0].value.as_float().unwrap())));
        assert!(random(&["a=1,2".parse().unwrap()], &[], 1, 7).is_err());
    }

    #[test]
    fn a_malformed_range_is_refused() {
        for bad in ["a", "a=", "=1:2", "a=1:2:0", "a=1:x", "a=1:2:3:4", "a=1:inf"] {
            assert!(bad.parse::<Vary>().is_err(), "{bad}");
        }
    }
}
