//! The parts list of docs/build-mk3.md adds up to the airframe's mass, centre of gravity and
//! inertias.

use flight::vehicles::mission::builtin;

/// A row of the list.
struct Part {
    mass_kg: f64,
    station_m: f64,
    length_m: f64,
    /// Distance of its mass from the axis.
    radius_m: f64,
}

/// The first table of parts behind a heading in docs/build-mk3.md.
fn parts(heading: &str) -> Vec<Part> {
    let page = include_str!("../../../../docs/build-mk3.md");
    let table = page.split(heading).nth(1).unwrap().split("| part |").nth(1).unwrap();
    let rows = table.lines().skip(2).take_while(|line| line.starts_with('|'));
    rows.map(|row| {
        let numbers: Vec<f64> = row.split('|').skip(2).map_while(|cell| cell.trim().parse().ok()).collect();
        let [mass_kg, station_m, length_m, radius_m] = numbers[..] else { panic!("{row}") };
        Part { mass_kg, station_m, length_m, radius_m }
    })
    .collect()
}

/// Mass, kg, centre of gravity, m, pitch and roll inertia, kg m^2. Each part is a thin tube of its
/// length and radius.
fn sums(parts: &[Part]) -> [f64; 4] {
    let sum = |of: &dyn Fn(&Part) -> f64| parts.iter().map(of).sum::<f64>();
    let mass_kg = sum(&|part| part.mass_kg);
    let cg_m = sum(&|part| part.mass_kg * part.station_m) / mass_kg;
    let pitch_kg_m2 = sum(&|part| {
        let own_m2 = part.length_m.powi(2) / 12.0 + part.radius_m.powi(2) / 2.0;
        part.mass_kg * ((part.station_m - cg_m).powi(2) + own_m2)
    });
    [mass_kg, cg_m, pitch_kg_m2, sum(&|part| part.mass_kg * part.radius_m.powi(2))]
}

#[test]
fn the_parts_list_adds_up_to_the_airframe() {
    let mass = builtin("mk3").unwrap().unwrap().airframe.mass;
    let [mass_kg, cg_m, pitch_kg_m2, roll_kg_m2] = sums(&parts("\n## Parts\n"));
    assert!((mass_kg - mass.loaded_kg).abs() < 0.005, "{mass_kg}");
    assert!((cg_m - mass.loaded_cg_station_m).abs() < 0.001, "{cg_m}");
    assert!((pitch_kg_m2 - mass.loaded_pitch_inertia_kg_m2).abs() < 0.001, "{pitch_kg_m2}");
    assert!((roll_kg_m2 - mass.roll_inertia_kg_m2).abs() < 0.0002, "{roll_kg_m2}");
}

/// And its two motors need a flyer of level 2.
#[test]
fn the_booster_adds_up_to_the_mission() {
    let mission = builtin("mk3").unwrap().unwrap();
    let booster = mission.launch.unwrap().booster;
    let [mass_kg, cg_m, pitch_kg_m2, _] = sums(&parts("\n### Booster\n"));
    assert!((mass_kg - booster.dry_kg).abs() < 0.0005, "{mass_kg}");
    assert!((cg_m - booster.cg_station_m).abs() < 0.002, "{cg_m}");
    assert!((pitch_kg_m2 - booster.pitch_inertia_kg_m2).abs() < 0.001, "{pitch_kg_m2}");
    let impulse_n_s = mission.motor_curve.total_impulse_n_s() + booster.motor_curve.total_impulse_n_s();
    assert!((impulse_n_s - 706.0).abs() < 1.0, "{impulse_n_s}");
}
