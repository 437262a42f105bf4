//! The controller lands vehicles that it was not tuned for. A generator draws them.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use flight::vehicle::thrust_curve::ThrustCurve;
use flight::vehicles::motors;
use onboard_sim::check::{Page, Verdict, check};
use onboard_sim::row::Row;
use onboard_sim::tally;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha12Rng;
use rayon::iter::{IntoParallelIterator as _, ParallelIterator as _};
use sim::dispersion::Dispersion;
use sim::recipe::Recipe;

const GRAVITY_M_S2: f64 = 9.806_65;

/// A number between two, evenly distributed.
fn between(rng: &mut ChaCha12Rng, [least, most]: [f64; 2]) -> f64 {
    least + (most - least) * rng.random::<f64>()
}

/// The mission of a vehicle as a club may build it: 0.6 to 6 kg on a real motor with 1.15 to 2.2
/// times its weight at ignition, which burns for 1 to 8 s; servos of hobby class, a gimbal of 3 to
/// 8 degrees as far as the tube has room, fins that steer or only brake, legs with blocks of mk3's
/// proportions; released at apogee or by a drone.
fn drawn(number: u64) -> String {
    let rng = &mut ChaCha12Rng::seed_from_u64(number);
    let (motor, curve, mass_kg) = loop {
        let (name, _) = motors::BUILTIN[rng.random_range(0..motors::BUILTIN.len())];
        let curve = motors::builtin(name).unwrap();
        let strength = between(rng, [1.15, 2.2]);
        let mass_kg = curve.mean_thrust_n(0.0, 0.5) / GRAVITY_M_S2 / strength;
        let burns = (1.0..=8.0).contains(&curve.burn_time_s());
        if burns && (0.6..=6.0).contains(&mass_kg) && mass_kg > 2.0 * curve.total_mass_kg() {
            break (name, curve, mass_kg);
        }
    };
    let drone = rng.random_range(0..3) == 0;
    let height_m =
        if drone { [30.0, 100.0][rng.random_range(0..2)] } else { [100.0, 300.0][rng.random_range(0..2)] };
    let steers = rng.random_range(0..4) > 0;
    body(rng, (motor, &curve), mass_kg, drone.then_some(height_m), height_m, steers)
}

fn body(
    rng: &mut ChaCha12Rng,
    (motor, curve): (&str, &ThrustCurve),
    mass_kg: f64,
    drop_m: Option<f64>,
    height_m: f64,
    steers: bool,
) -> String {
    let mut of = |range| between(rng, range);
    // A heavier vehicle is larger, with the same density.
    let size = libm::cbrt(mass_kg / 3.0);
    let diameter_m = (0.08 * size * of([0.9, 1.1])).max(1.6 * curve.diameter_m());
    let length_m = (0.75 * size * of([0.9, 1.25])).max(curve.length_m() + 0.35);
    let cg_m = (length_m * of([0.47, 0.58])).max(0.6 * curve.length_m());
    let pitch_kg_m2 = mass_kg * length_m * length_m / 12.0 * of([0.95, 1.3]);
    let feet_m = 0.1 * size;
    let radius_m = (cg_m + feet_m) * of([0.85, 1.1]);
    let roll_kg_m2 =
        mass_kg * (0.5 * diameter_m * diameter_m / 4.0 + 0.12 * radius_m * radius_m * of([0.3, 0.6]));
    let fin_station_m = if steers { length_m * of([0.85, 0.93]) } else { cg_m + length_m * of([0.01, 0.06]) };
    let fin_length_m = 0.11 * size * of([0.9, 1.3]);
    let inside_m = diameter_m - 0.002;
    let along_m = 0.5 * curve.length_m();
    let room_deg = (libm::asin((0.5 * inside_m / libm::hypot(along_m, 0.5 * curve.diameter_m())).min(1.0))
        - libm::atan2(0.5 * curve.diameter_m(), along_m))
    .to_degrees();
    let gimbal_deg = of([3.0, 8.0]).min(0.95 * room_deg);
    let (fin_rate, fin_delay, fin_slop) = (of([200.0, 400.0]), of([0.010, 0.025]), of([0.0, 0.8]));
    let (rate, delay, slop) = (of([200.0, 400.0]), of([0.010, 0.025]), of([0.3, 0.8]));
    let scale = mass_kg / 3.7;
    let (force_n, strength_n, across_n) = (90.0 * scale, 250.0 * scale, 118.0 * scale);
    let (stiffness_n_m, damping_n_s_m) = (30_000.0 * scale, 20.0 * scale);
    let stroke_m = 0.6 * feet_m;
    let canopy_m2 = mass_kg * GRAVITY_M_S2 / (0.5 * 1.225 * 36.0 * 0.8);
    let igniters = if of([0.0, 1.0]) < 0.5 { 1 } else { 2 };
    let start = drop_m.map_or_else(
        || format!("[start]\nheight_m = {height_m}\n"),
        |drop_m| format!("[start]\nat = \"drone\"\nheight_m = 200.0\n[drop]\nheight_m = {drop_m}\n"),
    );
    format!(
        r#"
name = "drawn"
summary = "A vehicle that nobody tuned for"
site = {{ latitude_deg = 0.0, longitude_deg = 0.0, altitude_m = 0.0 }}
[sensors]
imu_station_m = {cg_m}
gnss_station_m = {cg_m}
barometer_station_m = {cg_m}
lidar_station_m = 0.0
[airframe]
motor = "{motor}"
igniters = {igniters}
servos_report = true
[airframe.mass]
loaded_kg = {mass_kg}
loaded_cg_station_m = {cg_m}
loaded_pitch_inertia_kg_m2 = {pitch_kg_m2}
roll_inertia_kg_m2 = {roll_kg_m2}
[airframe.body]
length_m = {length_m}
diameter_m = {diameter_m}
[airframe.fins]
station_m = {fin_station_m}
length_m = {fin_length_m}
servo = {{ rate_deg_s = {fin_rate}, delay_s = {fin_delay}, slop_deg = {fin_slop} }}
[airframe.gimbal]
limit_deg = {gimbal_deg}
inside_diameter_m = {inside_m}
servo = {{ rate_deg_s = {rate}, delay_s = {delay}, slop_deg = {slop} }}
[airframe.legs]
foot_station_m = -{feet_m}
foot_radius_m = {radius_m}
stiffness_n_m = {stiffness_n_m}
damping_n_s_m = {damping_n_s_m}
[airframe.legs.crush]
force_n = {force_n}
guide_share = 0.4
stroke_m = {stroke_m}
strength_n = {strength_n}
strength_across_n = {across_n}
[airframe.parachute]
area_m2 = {canopy_m2}
{start}
[gate]
fence_radius_m = 120.0
"#
    )
}

fn recipe(text: &str, set: &str, seed: u64) -> Recipe {
    let set = (set, Dispersion::builtin_toml(set).unwrap());
    Recipe { seed, ..Recipe::from_texts(("drawn", text), set).unwrap() }
}

/// Number of a vehicle's flights that land upright in a set of dispersions.
fn stand(text: &str, set: &str, seed: u64, flights: u64) -> u64 {
    let recipe = recipe(text, set, seed);
    let rows: Vec<Row> =
        (0..flights).into_par_iter().map(|number| tally::fly(&recipe, number).unwrap()).collect();
    rows.iter().filter(|row| row.landing().stands).count() as u64
}

/// The vehicles from a number on with this verdict of the check, each with its number, its text and
/// its page.
fn of_verdict(first: u64, verdict: Verdict) -> impl Iterator<Item = (u64, String, Page)> {
    (first..).filter_map(move |number| {
        let text = drawn(number);
        let page = check(&recipe(&text, "none", 1), &[], 0, &|_| ()).unwrap();
        (page.verdict() == verdict).then_some((number, text, page))
    })
}

/// Prints a table of many vehicles with a verdict (`VERDICT=no`): `VEHICLES=60 FLIGHTS=100 cargo
/// test --release -p onboard-sim --test onboard custom_vehicles -- --ignored --nocapture`.
#[test]
#[ignore = "takes minutes: the table of many vehicles"]
fn table() {
    let number = |name: &str, otherwise| std::env::var(name).map_or(otherwise, |text| text.parse().unwrap());
    let (first, vehicles, flights) = (number("FIRST", 1), number("VEHICLES", 60), number("FLIGHTS", 40));
    let verdict = match std::env::var("VERDICT").as_deref() {
        Ok("no") => Verdict::No,
        Ok("tight") => Verdict::Tight,
        _ => Verdict::Ok,
    };
    for (vehicle, text, page) in of_verdict(first, verdict).take(vehicles as usize) {
        if let Ok(folder) = std::env::var("FOLDER") {
            std::fs::write(format!("{folder}/{vehicle}.toml"), &text).unwrap();
        }
        print!("{vehicle:4} {} {}", page.verdict().name(), page.title);
        for set in ["field", "real"] {
            print!(" | {set} {}/{flights}", stand(&text, set, 7001, flights));
        }
        for row in page.rows.iter().filter(|row| row.verdict > Verdict::Ok) {
            print!("; {} {} ({} / {})", row.what, row.verdict.name(), row.found, row.beside);
        }
        println!();
    }
}

/// Of the flights of vehicles with the verdict ok nine tenths land. In the complete table, of 60
/// vehicles with 50 flights each, they are in the median of `field` 97 % of the landings with
/// perfect information.
#[test]
fn what_the_check_calls_ok_lands() {
    const FLIGHTS: u64 = 10;
    let mut all = 0;
    for (vehicle, text, _) in of_verdict(5001, Verdict::Ok).take(6) {
        let stands = stand(&text, "field", 7001, FLIGHTS);
        assert!(stands + 3 >= FLIGHTS, "{vehicle}: {stands} of {FLIGHTS}");
        all += stands;
    }
    assert!(10 * all >= 9 * 6 * FLIGHTS, "{all} of {}", 6 * FLIGHTS);
}

/// A vehicle that is too heavy, or has no band of heights, does not land.
#[test]
fn what_the_check_calls_no_does_not_land() {
    for (vehicle, text, _) in of_verdict(5001, Verdict::No).take(6) {
        let stands = stand(&text, "field", 7001, 6);
        assert!(stands < 3, "{vehicle}: {stands} of 6");
    }
}
