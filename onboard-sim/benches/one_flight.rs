//! Times one flight from apogee to rest with all parts in the loop.
#![expect(clippy::unwrap_used, reason = "a benchmark that cannot be set up ends")]

use sim::dispersion::Dispersion;
use sim::draw::draw;
use sim::sortie::Sortie;

fn main() {
    divan::main();
}

/// Flight 0 of a set of dispersions on mk2.
#[divan::bench(args = ["none", "field"], sample_count = 5)]
fn one_flight(bencher: divan::Bencher<'_, '_>, set: &str) {
    let mission = flight::vehicles::mission::builtin("mk2").unwrap().unwrap();
    let dispersion = Dispersion::builtin(set).unwrap();
    let draw = draw(&mission, &dispersion, 1, 0);
    bencher.bench_local(|| Sortie::drawn_as(&mission, &dispersion, &draw).unwrap().run());
}
