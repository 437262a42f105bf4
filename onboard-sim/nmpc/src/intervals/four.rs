//! Four numbers in one vector register, where the compiler would not choose vectors by itself.
#![expect(clippy::inline_always, reason = "each is one vector instruction")]

use core::ops::{Add, AddAssign, Mul, Sub};

use pulp::{Simd, bytemuck};

use super::lanes::Lanes;

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

macro_rules! elementwise {
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

elementwise!(Add, add, +, add_f64s);
elementwise!(Sub, sub, -, sub_f64s);

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
