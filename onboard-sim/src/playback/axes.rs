//! How an inertial unit is mounted: which of its axes lie along the body's.

use std::str::FromStr;

use nalgebra::{Matrix3, Vector3};

/// Rotates vectors of the inertial unit into body axes: x to the nose, right-handed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes(Matrix3<f64>);

/// Text that is not a mounting.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}`: the axes of the inertial unit along body x (to the nose), y and z are accepted, each once and right-handed, as `+z,-x,-y`"
)]
pub struct NotAxes(String);

impl Axes {
    pub(super) fn to_body(self, recorded: &Vector3<f64>) -> Vector3<f64> {
        self.0 * recorded
    }
}

impl FromStr for Axes {
    type Err = NotAxes;

    fn from_str(text: &str) -> Result<Self, NotAxes> {
        let row = |axis: &str| {
            let unsigned = axis.strip_prefix(['+', '-']).unwrap_or(axis);
            let place = ["x", "y", "z"].iter().position(|name| *name == unsigned)?;
            let sign = if axis.starts_with('-') { -1.0 } else { 1.0 };
            Some(Matrix3::identity().row(place) * sign)
        };
        let rows = text.split(',').map(|axis| row(axis.trim())).collect::<Option<Vec<_>>>();
        match rows.as_deref() {
            Some([x, y, z]) if x.cross(y) == *z => Ok(Self(Matrix3::from_rows(&[*x, *y, *z]))),
            _ => Err(NotAxes(text.to_owned())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_that_lies_on_its_side_measures_in_body_axes() {
        let axes: Axes = "+z, -x, -y".parse().unwrap();
        assert_eq!(axes.to_body(&Vector3::new(1.0, 2.0, 3.0)), Vector3::new(3.0, -1.0, -2.0));
        assert_eq!("x,y,z".parse(), Ok(Axes(Matrix3::identity())));
    }

    #[test]
    fn a_mounting_that_cannot_be_is_refused_with_what_is_accepted() {
        for text in ["+z,-x,+y", "+x,+x,+z", "+x,+y,-z", "+x,+y", "+x,+y,+w", "", "--x,+y,+z", "+x,+y,+z,+x"]
        {
            let words = text.parse::<Axes>().unwrap_err().to_string();
            assert!(words.starts_with(&format!("`{text}`")) && words.contains("right-handed"), "{words}");
        }
    }
}
