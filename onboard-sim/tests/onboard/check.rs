//! Checks vehicles that land and vehicles that do not.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use onboard_sim::check::{Page, Verdict, built_in, check};
use sim::recipe::Recipe;

/// A mission at another mass, kg.
fn recipe(name: &str, mass_kg: Option<f64>) -> Recipe {
    let recipe = crate::recipe_of(name, "field");
    let Some(mass_kg) = mass_kg else { return recipe };
    let own = format!("loaded_kg = {}", recipe.mission.airframe.mass.loaded_kg);
    assert!(recipe.mission_toml.contains(&own), "{own}");
    let text = recipe.mission_toml.replace(&own, &format!("loaded_kg = {mass_kg}"));
    Recipe::from_texts((name, &text), ("field", &recipe.dispersion_toml)).unwrap()
}

fn page(recipe: &Recipe) -> Page {
    let page = check(recipe, &built_in(), 0, &|_| {}).unwrap();
    let text = page.to_string();
    assert!(text.lines().count() <= 24, "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    page
}

#[test]
fn no_mission_is_refused() {
    for (name, _) in flight::vehicles::mission::BUILTIN.iter().chain(&crate::missions::TEST_MISSIONS) {
        let page = page(&recipe(name, None));
        assert!(page.verdict() < Verdict::No, "{page}");
        assert!(page.rows.iter().all(|row| row.change.is_none() || row.verdict > Verdict::Ok), "{page}");
    }
}

/// A vehicle of the mass that is proposed is not refused, and one of a step less change is.
#[test]
fn too_heavy_and_too_light_are_refused_with_the_mass_that_is_not() {
    for (name, mass_kg, words) in [
        ("mk3", 5.0, "too heavy for its motor"),
        ("mk3", 2.2, "too light for its motor"),
        ("vlr", 1.46, "too heavy for its motor"),
    ] {
        let refused = page(&recipe(name, Some(mass_kg)));
        assert_eq!(refused.verdict(), Verdict::No, "{refused}");
        let row = refused.rows.iter().find(|row| row.found.starts_with(words)).unwrap();
        let change = row.change.as_ref().unwrap();
        let mut parts = change.split([' ', ',']);
        let by_kg: f64 = parts.next().unwrap().parse().unwrap();
        assert_eq!(parts.next(), Some("kg"));
        let sign = if parts.next() == Some("less") { -1.0 } else { 1.0 };
        let at = |by_kg: f64| page(&recipe(name, Some(mass_kg + sign * by_kg))).verdict();
        assert!(at(by_kg) < Verdict::No && at(by_kg - 0.1) == Verdict::No, "{refused}");
    }
}

#[test]
fn flights_are_a_separate_row() {
    let page = check(&recipe("vlr", None), &[], 2, &|_| {}).unwrap();
    let row = page.rows.last().unwrap();
    assert!(row.what == "flights" && row.found.ends_with(" of 2 flights stand"), "{page}");
}
