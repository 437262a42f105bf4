//! One flight from apogee to rest, everything in the loop.
#![expect(clippy::unwrap_used, reason = "a benchmark that cannot be set up ends")]

use campaign::dispersion::Dispersion;
use campaign::draw::draw;
use campaign::fly::Flight;
use flight::mission::Mission;

fn main() {
    divan::main();
}

/// Flight 0 of a set of dispersions on mk2.
#[divan::bench(args = ["none", "field"], sample_count = 5)]
fn one_flight(bencher: divan::Bencher<'_, '_>, set: &str) {
    let mission = Mission::builtin("mk2").unwrap().unwrap();
    let dispersion = Dispersion::builtin(set).unwrap();
    let draw = draw(&mission, &dispersion, 1, 0);
    bencher.bench_local(|| Flight::new(&mission, &dispersion, &draw).unwrap().run());
}
