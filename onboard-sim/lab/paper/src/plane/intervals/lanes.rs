//! Several shooting nodes at once: elementwise arithmetic that the compiler turns into vector instructions.
//!
//! Every lane executes the same IEEE operations in the same order on every machine, so the bits do not depend on the
//! width of the vectors.
#![expect(clippy::inline_always, reason = "each is one vector instruction")]

use core::array::from_fn;
use core::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};
use pulp::{Simd, bytemuck};

/// Nodes evaluated together: one vector register of AVX, two of SSE or NEON.
pub(super) const LANES: usize = 4;

/// One number for each of [`LANES`] nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lanes(pub(super) [f64; LANES]);

impl Lanes {
    pub(super) const ZERO: Self = Self([0.0; LANES]);

    #[inline(always)]
    pub(super) fn splat(value: f64) -> Self {
        Self([value; LANES])
    }

    /// Correctly rounded on every machine.
    #[inline(always)]
    pub(super) fn sqrt(self) -> Self {
        Self(from_fn(|lane| sqrt(self.0[lane])))
    }

    /// `1 / self` where `self` exceeds `least`, else 0.
    #[inline(always)]
    pub(super) fn reciprocal_above(self, least: f64) -> Self {
        Self(from_fn(|lane| if self.0[lane] > least { 1.0 / self.0[lane] } else { 0.0 }))
    }

    /// Sine and cosine, to one unit in the last place for angles up to a million.
    ///
    /// The angle is reduced to a quarter turn with a pi/2 in three parts (Cody and Waite); then follow the minimax
    /// polynomials of Sun's fdlibm, `k_sin.c` and `k_cos.c`. The sign bits correct the quadrant without a branch.
    #[inline(always)]
    pub(super) fn sin_cos(self) -> (Self, Self) {
        let mut sine = [0.0; LANES];
        let mut cosine = [0.0; LANES];
        for lane in 0..LANES {
            (sine[lane], cosine[lane]) = sin_cos(self.0[lane]);
        }
        (Self(sine), Self(cosine))
    }
}

#[inline(always)]
fn sin_cos(angle: f64) -> (f64, f64) {
    /// After its addition the lowest bits hold the nearest integer.
    const ROUNDER: f64 = 6_755_399_441_055_744.0;
    const QUARTER_TURN: [f64; 3] =
        [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];
    const SINE: [f64; 6] = [
        -1.666_666_666_666_663_2e-1,
        8.333_333_333_322_49e-3,
        -1.984_126_982_985_795e-4,
        2.755_731_370_707_006_8e-6,
        -2.505_076_025_340_686_3e-8,
        1.589_690_995_211_55e-10,
    ];
    const COSINE: [f64; 6] = [
        4.166_666_666_666_66e-2,
        -1.388_888_888_887_411e-3,
        2.480_158_728_947_673e-5,
        -2.755_731_435_139_066_3e-7,
        2.087_572_321_298_175e-9,
        -1.135_964_755_778_819_5e-11,
    ];
    let rounded = angle * core::f64::consts::FRAC_2_PI + ROUNDER;
    let turns = rounded - ROUNDER;
    let quadrant = rounded.to_bits();
    let r = ((angle - turns * QUARTER_TURN[0]) - turns * QUARTER_TURN[1]) - turns * QUARTER_TURN[2];
    let r2 = r * r;
    let r4 = r2 * r2;
    let sine_tail =
        (SINE[0] + r2 * SINE[1]) + r4 * ((SINE[2] + r2 * SINE[3]) + r4 * (SINE[4] + r2 * SINE[5]));
    let cosine_tail = (COSINE[0] + r2 * COSINE[1])
        + r4 * ((COSINE[2] + r2 * COSINE[3]) + r4 * (COSINE[4] + r2 * COSINE[5]));
    let sine = (r + r * r2 * sine_tail).to_bits();
    let cosine = (1.0 - (0.5 * r2 - r4 * cosine_tail)).to_bits();
    // An odd quadrant swaps the two.
    let swap = (quadrant & 1).wrapping_neg();
    let swapped = (sine ^ cosine) & swap;
    let sine_sign = (quadrant & 2) << 62;
    let cosine_sign = (quadrant.wrapping_add(1) & 2) << 62;
    (f64::from_bits(sine ^ swapped ^ sine_sign), f64::from_bits(cosine ^ swapped ^ cosine_sign))
}

macro_rules! elementwise {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl $trait for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(from_fn(|lane| self.0[lane] $operator other.0[lane]))
            }
        }
    };
}

elementwise!(Add, add, +);
elementwise!(Sub, sub, -);
elementwise!(Mul, mul, *);

impl Mul<f64> for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, scale: f64) -> Self {
        Self(from_fn(|lane| self.0[lane] * scale))
    }
}

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(from_fn(|lane| -self.0[lane]))
    }
}

impl AddAssign for Lanes {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Lanes {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

/// With this function the compiler computes the roots of all lanes at once, unlike with `libm`; the bits are the same.
#[inline(always)]
fn sqrt(value: f64) -> f64 {
    value.sqrt()
}

// Four numbers in one vector register, where the compiler would not choose vectors by itself.

/// Four numbers in the vectors of an instruction set; elementwise where its vectors are not of four. The bits are the same.
#[derive(Clone, Copy)]
pub(super) struct Four<S>(pub(super) S, pub(super) Lanes);

impl<S: Simd> Four<S> {
    const WHOLE: bool = S::F64_LANES == 4;

    #[inline(always)]
    fn vector(self) -> S::f64s {
        bytemuck::cast(self.1.0)
    }

    #[inline(always)]
    fn of(simd: S, vector: S::f64s) -> Self {
        Self(simd, Lanes(bytemuck::cast(vector)))
    }
}

macro_rules! whole {
    ($trait:ident, $method:ident, $operator:tt, $whole:ident) => {
        impl<S: Simd> $trait for Four<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                if Self::WHOLE {
                    Self::of(self.0, self.0.$whole(self.vector(), other.vector()))
                } else {
                    Self(self.0, self.1 $operator other.1)
                }
            }
        }
    };
}

whole!(Add, add, +, add_f64s);
whole!(Sub, sub, -, sub_f64s);

impl<S: Simd> Mul<f64> for Four<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, scale: f64) -> Self {
        if Self::WHOLE {
            Self::of(self.0, self.0.mul_f64s(self.vector(), self.0.splat_f64s(scale)))
        } else {
            Self(self.0, self.1 * scale)
        }
    }
}

impl<S: Simd> AddAssign for Four<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn val_libm_sine_and_cosine(angle in prop_oneof![-8.0..8.0_f64, -1e5..1e5_f64]) {
            let (sine, cosine) = sin_cos(angle);
            let (expected_sine, expected_cosine) = libm::sincos(angle);
            prop_assert!((sine - expected_sine).abs() < 2.3e-16, "{sine} {expected_sine}");
            prop_assert!((cosine - expected_cosine).abs() < 2.3e-16, "{cosine} {expected_cosine}");
        }
    }

    #[test]
    fn the_sine_of_an_infinite_or_nan_angle_is_nan() {
        for angle in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let (sine, cosine) = sin_cos(angle);
            assert!(sine.is_nan() && cosine.is_nan());
        }
    }
}
