//! Everything that is computed from a mission is computed for its site: altitude and temperature.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use flight::vehicle::mission::StartPoint;
use onboard_sim::card::Card;
use onboard_sim::check::check;
use onboard_sim::hazard::{Case, Flights, fly};
use sim::recipe::Recipe;

/// mk3 from its pad at an altitude, m, and a temperature, degrees Celsius.
fn recipe(altitude_m: f64, temperature_c: Option<f64>) -> Recipe {
    let recipe = Recipe::built_in("mk3", "real").unwrap();
    let temperature = temperature_c.map(|pad_c| format!("temperature_c = {pad_c:?}\n")).unwrap_or_default();
    let site = format!("altitude_m = {altitude_m:?}\n{temperature}");
    let text = recipe.mission_toml.replace("altitude_m = 625.0\n", &site);
    let recipe = Recipe::from_texts(("mk3", &text), ("real", &recipe.dispersion_toml)).unwrap();
    recipe.starting_at(StartPoint::Pad).unwrap()
}

/// The density over that at sea level of these sites is 1, 0.86 and 0.78.
#[test]
fn thinner_air_changes_apogee_hazard_radius_card_check_and_campaign() {
    let sites = [(0.0, None), (1_500.0, None), (1_500.0, Some(35.0))];
    let found = sites.map(|(altitude_m, temperature_c)| {
        let recipe = recipe(altitude_m, temperature_c);
        let impacts = fly(&recipe, &[Case::AsPlanned, Case::BallisticWithBooster, Case::Booster], 3).unwrap();
        let row = onboard_sim::run::fly(&recipe, 0..1, &|_| {}).unwrap().remove(0);
        let page = check(&recipe, &[], 0, &|_| {}).unwrap().to_string();
        let flights = Flights { survey: 1, of_widest: 1 };
        let card = Card::new(&recipe, vec![(4.0, recipe.clone())], flights, None, &|_, _| {}).unwrap().text();
        let site = recipe.mission.site.to_string();
        assert!(page.contains(&site) && card.contains(&site), "{page}{card}");
        let canopy = card.split(" m/s under the canopy").next().unwrap();
        let canopy_m_s: f64 = canopy.rsplit(' ').next().unwrap().parse().unwrap();
        let changes = [impacts[1].distance_m(), impacts[2].distance_m(), row.onset_height_m.unwrap()];
        (impacts[0].course.highest_m, canopy_m_s, changes, page)
    });
    for ([thick, thin], at) in found.array_windows().zip(1..) {
        let context = format!("{:?}: {thick:?} {thin:?}", sites[at]);
        assert!(thick.0 < thin.0 && thick.1 < thin.1, "apogee and canopy at {context}");
        let differ = thick.2.iter().zip(&thin.2).all(|(thick, thin)| (thick - thin).abs() > 0.01);
        assert!(differ, "hazards and ignition at {context}");
        assert!(thick.3 != thin.3, "check at {context}");
    }
}
