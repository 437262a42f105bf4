//! The peak arithmetic of this machine, with the same portable code and vector width as the solver.

use core::array::from_fn;
use core::fmt;
use std::hint::black_box;

use crate::clock::best_of;

/// Numbers in a vector register of the target.
const WIDTH: usize = if cfg!(target_feature = "avx") { 4 } else { 2 };

/// Number of independent chains: enough to hide the latency, few enough for sixteen registers.
const CHAINS: usize = 12;

const STEPS: u32 = 20_000;

/// Throughput of multiplication and addition, and latencies.
pub(crate) struct Peak {
    gflop_per_s: f64,
    add_ns: f64,
    multiply_ns: f64,
    divide_ns: f64,
    root_ns: f64,
}

impl fmt::Display for Peak {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { gflop_per_s, add_ns, multiply_ns, divide_ns, root_ns } = self;
        write!(f, "{gflop_per_s} {add_ns} {multiply_ns} {divide_ns} {root_ns}")
    }
}

pub(crate) fn measured() -> Peak {
    let per_step = |work: &mut dyn FnMut()| best_of(60, 1, work) / f64::from(STEPS);
    let flops = (2 * WIDTH * CHAINS) as f64;
    let (factor, term) = (black_box(0.999_999), black_box(1e-6));
    Peak {
        gflop_per_s: flops / per_step(&mut || multiply_add(factor, term)),
        add_ns: per_step(&mut || chain(|value| value + term)),
        multiply_ns: per_step(&mut || chain(|value| value * factor)),
        divide_ns: per_step(&mut || chain(|value| value / factor)),
        root_ns: per_step(&mut || chain(f64::sqrt)),
    }
}

/// Equal numbers of multiplications and additions; every result is the operand of the next step.
fn multiply_add(factor: f64, term: f64) {
    let mut sums: [[f64; WIDTH]; CHAINS] = from_fn(|chain| [chain as f64; WIDTH]);
    for _ in 0..STEPS {
        for sum in &mut sums {
            *sum = from_fn(|lane| sum[lane] * factor + term);
        }
    }
    black_box(sums);
}

/// A chain of dependent operations.
fn chain(operation: impl Fn(f64) -> f64) {
    let mut value = black_box(1.5);
    for _ in 0..STEPS {
        value = operation(value);
    }
    black_box(value);
}
