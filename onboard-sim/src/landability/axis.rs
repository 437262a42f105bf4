//! An axis of a map: a quantity and its values.

use std::fmt;
use std::str::FromStr;

/// A quantity that a map varies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Nominal thrust over weight.
    ThrustToWeight,
    /// Height at ignition in the plane, at the start of a mission, m.
    Height,
    /// Speed of descent at ignition, m/s.
    Speed,
    /// Tilt from upright at ignition in the plane, at the start of a mission (below a drone: of its swing), degrees.
    Tilt,
    /// Pitch rate at ignition, degrees per second.
    Rate,
    /// Lateral speed at ignition, m/s.
    LateralSpeed,
    /// Thrust over nominal; known to the controller in the plane, learnt in flight by that of a mission.
    ThrustScale,
    /// Height of the feet at which the thrust of a mission begins, m.
    IgnitionHeight,
    /// Mean wind 10 m above the ground, m/s.
    Wind,
}

impl Quantity {
    const ALL: [Self; 9] = [
        Self::ThrustToWeight,
        Self::Height,
        Self::Speed,
        Self::Tilt,
        Self::Rate,
        Self::LateralSpeed,
        Self::ThrustScale,
        Self::IgnitionHeight,
        Self::Wind,
    ];

    /// The name on a command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::ThrustToWeight => "thrust-to-weight",
            Self::Height => "height",
            Self::Speed => "speed",
            Self::Tilt => "tilt",
            Self::Rate => "rate",
            Self::LateralSpeed => "lateral-speed",
            Self::ThrustScale => "thrust-scale",
            Self::IgnitionHeight => "ignition-height",
            Self::Wind => "wind",
        }
    }

    /// The name in a table's heading, with its unit.
    pub fn column(self) -> &'static str {
        match self {
            Self::ThrustToWeight => "thrust_to_weight",
            Self::Height => "height_m",
            Self::Speed => "speed_m_s",
            Self::Tilt => "tilt_deg",
            Self::Rate => "rate_deg_s",
            Self::LateralSpeed => "lateral_speed_m_s",
            Self::ThrustScale => "thrust_scale",
            Self::IgnitionHeight => "ignition_height_m",
            Self::Wind => "wind_m_s",
        }
    }

    /// The name beside a picture's axis.
    pub fn label(self) -> &'static str {
        match self {
            Self::ThrustToWeight => "thrust / weight",
            Self::Height => "height, m",
            Self::Speed => "speed, m/s",
            Self::Tilt => "tilt, deg",
            Self::Rate => "rate, deg/s",
            Self::LateralSpeed => "lateral speed, m/s",
            Self::ThrustScale => "thrust / nominal",
            Self::IgnitionHeight => "ignition height, m",
            Self::Wind => "wind at 10 m, m/s",
        }
    }
}

/// A quantity over a range: `count` values, both ends among them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// What is varied.
    pub quantity: Quantity,
    /// Its first value.
    pub from: f64,
    /// Its last value.
    pub to: f64,
    /// How many values.
    pub count: usize,
}

impl Axis {
    /// The most values of one axis.
    pub const MAX_COUNT: usize = 500;

    /// The value at an index, counted from 0.
    pub fn value(&self, place: usize) -> f64 {
        let steps = self.count.saturating_sub(1).max(1);
        self.from + (self.to - self.from) * place as f64 / steps as f64
    }
}

/// Why an axis cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "axis `{given}`: {problem}; write QUANTITY=FROM:TO:COUNT with a quantity of {}",
    Quantity::ALL.map(Quantity::name).join(", ")
)]
pub struct AxisError {
    given: String,
    problem: &'static str,
}

impl FromStr for Axis {
    type Err = AxisError;

    fn from_str(given: &str) -> Result<Self, AxisError> {
        let refuse = |problem| AxisError { given: given.to_owned(), problem };
        let (name, range) = given.split_once('=').ok_or_else(|| refuse("no `=`"))?;
        let quantity = Quantity::ALL
            .into_iter()
            .find(|quantity| quantity.name() == name)
            .ok_or_else(|| refuse("unknown quantity"))?;
        let mut parts = range.split(':');
        let (Some(from), Some(to), Some(count), None) =
            (parts.next(), parts.next(), parts.next(), parts.next())
        else {
            return Err(refuse("the range is not FROM:TO:COUNT"));
        };
        let number = |text: &str| text.parse::<f64>().ok().filter(|value| value.is_finite());
        let (from, to) =
            number(from).zip(number(to)).ok_or_else(|| refuse("an end of the range is not a number"))?;
        let count = count
            .parse()
            .ok()
            .filter(|count| (2..=Self::MAX_COUNT).contains(count))
            .ok_or_else(|| refuse("the count is not a number from 2 to 500"))?;
        let positive = matches!(
            quantity,
            Quantity::ThrustToWeight | Quantity::Height | Quantity::ThrustScale | Quantity::IgnitionHeight
        );
        if quantity == Quantity::Wind && from.min(to) < 0.0 {
            return Err(refuse("the range must not be below 0"));
        }
        if positive && from.min(to) <= 0.0 {
            return Err(refuse("the range must be above 0"));
        }
        Ok(Self { quantity, from, to, count })
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}:{}:{}", self.quantity.name(), self.from, self.to, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_read_and_written_alike() {
        for text in ["height=5:30:26", "tilt=-30:30:7", "thrust-to-weight=0.9:1.4:26"] {
            assert_eq!(text.parse::<Axis>().unwrap().to_string(), text);
        }
        let axis: Axis = "height=5:30:26".parse().unwrap();
        assert!((axis.value(0) - 5.0).abs() < 1e-12 && (axis.value(25) - 30.0).abs() < 1e-12);
    }

    #[test]
    fn a_wrong_axis_is_refused_with_the_valid_forms() {
        for text in
            ["", "height", "depth=1:2:3", "height=1:2", "height=a:2:3", "height=1:2:1", "height=-1:2:3"]
        {
            let error = text.parse::<Axis>().unwrap_err().to_string();
            assert!(error.contains("QUANTITY=FROM:TO:COUNT") && error.contains("lateral-speed"), "{error}");
        }
    }
}
