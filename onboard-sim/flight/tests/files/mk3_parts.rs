//! The parts list of docs/build-mk3.md adds up to the airframe's mass, centre of gravity and
//! inertias.

use flight::vehicles::mission::builtin_airframe as builtin;

/// A row of the list.
struct Part {
    mass_kg: f64,
    station_m: f64,
    length_m: f64,
    /// Distance of its mass from the axis.
    radius_m: f64,
}

/// The rows of the table "Parts" in docs/build-mk3.md.
fn parts() -> Vec<Part> {
    let page = include_str!("../../../../docs/build-mk3.md");
    let table = page.split("## Parts").nth(1).unwrap().split("\n## ").next().unwrap();
    let rows = table.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| part"));
    rows.map(|row| {
        let numbers: Vec<f64> = row.split('|').skip(2).map_while(|cell| cell.trim().parse().ok()).collect();
        let [mass_kg, station_m, length_m, radius_m] = numbers[..] else { panic!("{row}") };
        Part { mass_kg, station_m, length_m, radius_m }
    })
    .collect()
}

#[test]
fn the_parts_list_adds_up_to_the_airframe() {
    let (parts, mass) = (parts(), builtin("mk3").unwrap().mass);
    let sum = |of: &dyn Fn(&Part) -> f64| parts.iter().map(of).sum::<f64>();
    let mass_kg = sum(&|part| part.mass_kg);
    let cg_m = sum(&|part| part.mass_kg * part.station_m) / mass_kg;
    let roll_kg_m2 = sum(&|part| part.mass_kg * part.radius_m.powi(2));
    // Each part is a thin tube of its length and radius.
    let pitch_kg_m2 = sum(&|part| {
        let own_m2 = part.length_m.powi(2) / 12.0 + part.radius_m.powi(2) / 2.0;
        part.mass_kg * ((part.station_m - cg_m).powi(2) + own_m2)
    });
    assert!((mass_kg - mass.loaded_kg).abs() < 0.005, "{mass_kg}");
    assert!((cg_m - mass.loaded_cg_station_m).abs() < 0.001, "{cg_m}");
    assert!((pitch_kg_m2 - mass.loaded_pitch_inertia_kg_m2).abs() < 0.001, "{pitch_kg_m2}");
    assert!((roll_kg_m2 - mass.roll_inertia_kg_m2).abs() < 0.0002, "{roll_kg_m2}");
}
