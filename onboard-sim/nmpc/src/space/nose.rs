//! The nose's direction and vectors in space.

pub(super) type Vector = [f64; 3];

pub(super) fn dot(a: &Vector, b: &Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a + f b`.
pub(super) fn plus(a: &Vector, f: f64, b: &Vector) -> Vector {
    [a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2]]
}

pub(super) fn times(f: f64, a: &Vector) -> Vector {
    [f * a[0], f * a[1], f * a[2]]
}

/// The nose and its derivatives by the leans.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nose {
    pub sin_p: f64,
    pub cos_p: f64,
    pub n: [f64; 3],
    pub e_p: [f64; 3],
    pub e_r: [f64; 3],
    /// Derivative of `e_r` by `r`.
    pub m: [f64; 3],
}

impl Nose {
    pub fn at(p: f64, r: f64) -> Self {
        let (sin_p, cos_p) = libm::sincos(p);
        let (sin_r, cos_r) = libm::sincos(r);
        Self {
            sin_p,
            cos_p,
            n: [sin_p, cos_p * sin_r, cos_p * cos_r],
            e_p: [cos_p, -sin_p * sin_r, -sin_p * cos_r],
            e_r: [0.0, cos_r, -sin_r],
            m: [0.0, -sin_r, -cos_r],
        }
    }
}
