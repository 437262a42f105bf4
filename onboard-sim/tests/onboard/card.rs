//! Content of a card for the range safety officer.

use flight::rules::verdict::Landing;
use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use flight::vehicle::mission::StartPoint;
use onboard_sim::card::Card;
use onboard_sim::card::range_safety::{
    FEWEST, InWind, aborts, calibres, in_winds, limit_m_s, plan, thrust_to_weight,
};
use onboard_sim::hazard::{Case, Course, Flights, Impact, Rule, fly, lift_off_kg, studies};
use proptest::prelude::*;
use protocol::motion::Degrees;
use sim::recipe::Recipe;
use sim::sortie::Sortie;

const PAD: Degrees = Degrees { latitude: 35.347_2, longitude: -117.808_6 };

fn rule() -> Rule {
    Rule { feet: 200.0, impulse_n_s: 673.0, complex: true, model: false }
}

fn impact(case: Case, number: usize, along_m: f64, across_m: f64, landed: bool) -> Impact {
    let (place_m, course) = (Some([along_m, across_m]), Course::default());
    let landing = Landing { stands: landed, ..Landing::default() };
    Impact { case, number: number as u64, place_m, downwind_rad: 0.0, landing, course }
}

/// Flights in winds from 0 m/s on, each with its places in two cases.
fn flown(of: impl Into<proptest::collection::SizeRange>) -> impl Strategy<Value = Vec<(f64, Vec<Impact>)>> {
    let one = (-900.0..900.0, -300.0..300.0, any::<bool>());
    let in_wind = prop::collection::vec(one, of).prop_map(|flights| {
        let numbered = flights.into_iter().enumerate();
        let each = numbered.flat_map(|(number, (along_m, across_m, landed))| {
            [
                impact(Case::AsPlanned, number, 0.1 * along_m, 0.1 * across_m, landed),
                impact(Case::Uncommanded, number, along_m, across_m, false),
            ]
        });
        each.collect::<Vec<_>>()
    });
    prop::collection::vec(in_wind, 1..4).prop_map(|winds| {
        winds.into_iter().enumerate().map(|(wind, impacts)| (3.0 * wind as f64, impacts)).collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn nobody_stands_where_more_than_one_flight_in_a_hundred_comes_down(flown in flown(FEWEST as usize..500)) {
        let winds = in_winds(&flown, &rule());
        let mut least_m = 0.0;
        for ((wind_m_s, impacts), wind) in flown.iter().zip(&winds) {
            prop_assert_eq!(wind.wind_m_s.to_bits(), wind_m_s.to_bits());
            let circle = wind.circle.unwrap();
            for case in [Case::AsPlanned, Case::Uncommanded] {
                let of_case = || impacts.iter().filter(|impact| impact.case == case);
                let inside = |radius_m: f64| of_case().filter(|impact| impact.distance_m() <= radius_m).count();
                prop_assert!(100 * inside(circle.exclusion_m) >= 99 * of_case().count());
                prop_assert!(case != circle.case || 100 * inside(circle.radius.holds_m) >= 99 * of_case().count());
            }
            // Never less than in less wind, nor than the rule.
            prop_assert!(circle.exclusion_m >= least_m && circle.exclusion_m >= rule().distance_m());
            prop_assert!(circle.crew_m() > circle.exclusion_m, "the launch crew stands outside");
            least_m = circle.exclusion_m;
        }
    }

    #[test]
    fn a_rate_is_the_share_of_the_flights_as_planned_and_nothing_else(flown in flown(FEWEST as usize..200)) {
        for ((_, impacts), wind) in flown.iter().zip(in_winds(&flown, &rule())) {
            let landed = wind.landed.unwrap().stands;
            let planned = impacts.iter().filter(|impact| impact.case == Case::AsPlanned);
            prop_assert_eq!(landed.of, planned.clone().count() as u64);
            prop_assert_eq!(landed.count, planned.filter(|impact| impact.landing.stands).count() as u64);
            prop_assert!(landed.low <= landed.share && landed.share <= landed.high);
        }
    }

    #[test]
    fn fewer_than_a_hundred_flights_give_no_rate_no_radius_and_no_wind_limit(flown in flown(0..FEWEST as usize)) {
        let winds = in_winds(&flown, &rule());
        prop_assert!(winds.iter().all(|wind| wind.landed.is_none() && wind.circle.is_none()));
        prop_assert_eq!(limit_m_s(&winds), None);
        prop_assert_eq!(plan(&winds, None, &[], PAD), None);
    }

    /// Wind from the west blows to the east: right, with north up.
    #[test]
    fn the_line_points_downwind_and_the_crew_stands_upwind_outside_for_every_direction(from_deg in 0.0..360.0_f64) {
        let winds = [circle(0.0, 110.0), circle(3.0, 310.0), circle(6.0, 610.0)];
        let svg = plan(&winds, Some(from_deg), &[], PAD).unwrap();
        let (sin, cos) = libm::sincos((from_deg + 180.0).to_radians());
        let document = roxmltree::Document::parse(&svg).unwrap();
        let number = |node: roxmltree::Node<'_, '_>, name| node.attribute(name).unwrap().parse::<f64>().unwrap();
        let of_class = |class| document.descendants().filter(move |node| node.attribute("class") == Some(class));
        let line = of_class("downwind").next().unwrap();
        prop_assert!(["x1", "y1"].into_iter().all(|name| number(line, name).abs() < 1e-9), "from the pad");
        let (x, y) = (number(line, "x2"), number(line, "y2"));
        let length = libm::hypot(x, y);
        prop_assert!((x / length - sin).abs() < 0.01 && (y / length + cos).abs() < 0.01, "{} {} {}", from_deg, x, y);
        let circles = document.descendants().filter(|node| node.has_tag_name("circle") && !node.has_attribute("class"));
        let radii: Vec<f64> = circles.map(|circle| number(circle, "r")).collect();
        prop_assert!(radii.iter().all(|radius| *radius < length), "the line leaves every circle");
        prop_assert_eq!((radii.len(), of_class("crew").count()), (3, 3));
        for (crew, radius) in of_class("crew").zip(radii) {
            let (x, y) = (number(crew, "cx"), number(crew, "cy"));
            prop_assert!(libm::hypot(x, y) > radius);
            prop_assert!(x * sin - y * cos < 0.0, "upwind");
        }
    }
}

fn circle(wind_m_s: f64, exclusion_m: f64) -> InWind {
    let impacts: Vec<Impact> =
        (0..400).map(|number| impact(Case::AsPlanned, number, exclusion_m - 5.0, 0.0, true)).collect();
    in_winds(&[(wind_m_s, impacts)], &rule()).remove(0)
}

/// Without enough flights for a rate and for the upper end of a radius nobody flies, and the card
/// says how many are needed.
#[test]
fn too_few_flights_are_counted_and_give_no_wind_to_fly_in() {
    for (flights, too_few) in [
        (0, Some([0, 100])),
        (1, Some([1, 100])),
        (99, Some([99, 100])),
        (100, Some([100, 368])),
        (367, Some([367, 368])),
        (368, None),
    ] {
        let impacts = (0..flights).map(|number| impact(Case::AsPlanned, number, 90.0, 0.0, true)).collect();
        let winds = in_winds(&[(3.0, impacts)], &rule());
        assert_eq!(winds[0].too_few, too_few, "{flights}");
        assert_eq!(limit_m_s(&winds).is_none(), too_few.is_some(), "{flights}");
    }
}

/// Also of circles that are close to each other.
#[test]
fn every_circle_is_named_whatever_the_direction_of_the_wind() {
    for from_deg in (0..360).step_by(45) {
        let winds: Vec<_> =
            [(0.0, 110.0), (3.0, 250.0), (6.0, 390.0), (8.9, 450.0)].map(|(wind, m)| circle(wind, m)).into();
        let svg = plan(&winds, Some(f64::from(from_deg)), &[], PAD).unwrap();
        for name in [">0 m/s<", ">3 m/s<", ">6 m/s<", ">8.9 m/s<"] {
            assert!(svg.contains(name), "{name} from {from_deg}: {svg}");
        }
        let dashes = ["none", "7 2", "2 2", "7 2 2 2"];
        assert!(dashes.iter().all(|dashes| svg.contains(&format!("stroke-dasharray=\"{dashes}\""))), "{svg}");
        assert!(svg.contains(">pad 35.34720, -117.80860<"), "{svg}");
    }
}

/// Wind from the west: the line goes to the right, with north up. Without a direction downwind is
/// up.
#[test]
fn val_compass_the_line_of_a_west_wind_points_east() {
    let winds = [circle(3.0, 310.0)];
    let west = plan(&winds, Some(270.0), &[], PAD).unwrap();
    let tip = |svg: &str| {
        svg.split("x2=").nth(1).unwrap().split("/>").next().unwrap().replace('"', "").replace("y2=", "")
    };
    assert!(tip(&west).starts_with("84.0 ") && west.contains(">N<"), "{west}");
    let unknown = plan(&winds, None, &[], PAD).unwrap();
    assert_eq!(tip(&unknown), "0.0 -84.0");
    assert!(
        unknown.contains(">downwind<") && unknown.contains(">3 m/s<") && !unknown.contains(">N<"),
        "{unknown}"
    );
}

/// 360 of 400 in calm air: 324 is nine tenths of it, 323 is less. 100 flights give a radius without
/// an upper bound, and no distance is outside of that.
#[test]
fn val_hand_the_wind_limit_leaves_nine_tenths_of_the_landings() {
    let of = |flights: usize, landed: usize| -> Vec<Impact> {
        (0..flights).map(|number| impact(Case::AsPlanned, number, 50.0, 0.0, number < landed)).collect()
    };
    let limit = |flights: usize, landed: [usize; 3]| {
        let flown: Vec<(f64, Vec<Impact>)> =
            [0.0, 3.0, 6.0].into_iter().zip(landed.map(|landed| of(flights, landed))).collect();
        limit_m_s(&in_winds(&flown, &rule()))
    };
    assert_eq!(limit(400, [360, 324, 324]), Some(6.0));
    assert_eq!(limit(400, [360, 324, 323]), Some(3.0));
    assert_eq!(limit(400, [360, 323, 360]), Some(0.0), "no wind beyond one that is not flown");
    assert_eq!(limit(100, [90, 90, 90]), None);
    let mut never_down: Vec<Impact> = of(400, 360);
    for impact in &mut never_down {
        impact.place_m = None;
    }
    assert_eq!(limit_m_s(&in_winds(&[(0.0, never_down)], &rule())), None);
}

/// 20 mph are 8.94 m/s.
#[test]
fn val_nar_no_wind_above_20_mph_is_permitted() {
    let flown = |wind_m_s| {
        let impacts = (0..400).map(|number| impact(Case::AsPlanned, number, 50.0, 0.0, true));
        (wind_m_s, impacts.collect::<Vec<_>>())
    };
    assert_eq!(limit_m_s(&in_winds(&[flown(0.0), flown(8.9), flown(9.0)], &rule())), Some(8.9));
}

/// The words of the card are those of the page for the range safety officer.
#[test]
fn val_safety_md_the_abort_table_is_the_same() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/safety.md")).unwrap();
    let table = page.split("| when | what happens |\n|---|---|\n").nth(1).unwrap();
    let rows: Vec<Vec<&str>> = table
        .lines()
        .take_while(|line| line.starts_with('|'))
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect();
    let all = aborts(None, "its card says from where");
    assert_eq!(rows, all);
    let shown = [StartPoint::Pad, StartPoint::Apogee, StartPoint::Drone]
        .map(|start| aborts(Some(start), "its card says from where"));
    assert_eq!(shown.iter().map(Vec::len).collect::<Vec<_>>(), [6, 4, 4]);
    assert!(all.iter().all(|row| shown.iter().any(|shown| shown.contains(row))), "{all:?}");
    assert!(!shown[0].contains(&all[1]) && shown[2].contains(&all[1]), "a drone's row on its own card alone");
}

/// The mission of mk3 gives 2.4 calibres; the rest by hand: 3.70 + 1.1195 + 0.2121 kg, and I243's
/// first half second.
#[test]
fn val_hand_the_range_officer_values_of_mk3() {
    let mission = flight::vehicles::mission::builtin("mk3").unwrap().unwrap();
    let launch = mission.launch.as_ref().unwrap();
    assert!((calibres(&mission, launch) - 2.4).abs() < 0.05, "{}", calibres(&mission, launch));
    let mass_kg = lift_off_kg(&mission, Some(launch));
    let curve = &launch.booster.motor_curve;
    assert!((mass_kg - 4.8195 - curve.propellant_mass_kg()).abs() < 1e-9, "{mass_kg}");
    let impulse_n_s = thrust_to_weight(&mission, launch) * mass_kg * STANDARD_GRAVITY_M_S2 * 0.5;
    assert!((impulse_n_s - curve.impulse_to_n_s(0.5)).abs() < 1e-6, "{impulse_n_s}");
}

fn card_of(recipe: &Recipe, flights: Flights) -> Card {
    let mut windy = recipe.clone();
    windy.dispersion.wind_m_s = [4.0; 2];
    Card::new(recipe, vec![(4.0, windy)], flights, Some(270.0), &|_, _| {}).expect("a card")
}

#[test]
fn a_card_is_of_the_mission_that_was_given_byte_for_byte() {
    for (name, text) in flight::vehicles::mission::BUILTIN.iter().chain(&crate::missions::TEST_MISSIONS) {
        let recipe = crate::recipe_of(name, "field");
        let card = card_of(&recipe, Flights { survey: 1, of_widest: 1 });
        assert_eq!(card.recipe.mission_toml, *text, "{name}");
        let sheet = card.text();
        let own = format!("{:.3} kg", recipe.mission.airframe.mass.loaded_kg);
        let hash = protocol::mission::MissionHash::of(text).to_string();
        assert!(sheet.contains(&own) && sheet.contains(&hash), "{name}: {sheet}");
        assert!(!sheet.contains(['{', '}']), "a value is missing: {sheet}");
        assert!(!sheet.contains("not the standard one"), "{sheet}");
        assert!(!sheet.contains("mk2") || *name == "mk2" || name.starts_with("mk2"), "{name}: {sheet}");
    }
}

#[test]
fn a_card_lists_the_keys_that_differ_from_the_standard_controller() {
    let mut recipe = crate::recipe_of("mini-f10", "none");
    recipe.mission.changed = ["powered.weights.theta", "soft_tilt_deg"].map(str::to_owned).to_vec();
    let sheet = card_of(&recipe, Flights { survey: 1, of_widest: 1 }).text();
    let words = ["Controller", "not the standard one", "powered.weights.theta, soft_tilt_deg"];
    let row = sheet.lines().find(|line| line.contains(words[0])).unwrap();
    assert!(words.iter().all(|words| row.contains(words)), "{row}");
}

/// `hazard` on the written mission flies the flights of the card, from the pad.
#[test]
fn a_card_is_reproduced_from_its_mission() {
    let recipe = Recipe { seed: 5, ..Recipe::built_in("mk3", "real").unwrap() };
    let flights = Flights { survey: 1, of_widest: 2 };
    let card = card_of(&recipe, flights);
    let mut windy = recipe.clone();
    windy.dispersion.wind_m_s = [4.0; 2];
    let flown = windy.starting_at(StartPoint::Pad).unwrap();
    assert_eq!(card.flown[0].1, studies(core::slice::from_ref(&flown), flights, &|_, _| {}).unwrap()[0]);
    let text = card.text();
    let planned = card.flown[0].1.iter().find(|impact| impact.case == Case::AsPlanned).unwrap().course;
    // The same flight, observed in its world.
    let (mut flight, mut highest_m, mut rail_m_s) = (Sortie::new(&flown, 0).unwrap(), 0.0_f64, 0.0);
    let stood_m = flight.world().state().position_m;
    let rail_m = flight.mission().launch.as_ref().unwrap().rail.length_m;
    while flight.goes_on() {
        let state = flight.world().state();
        highest_m = highest_m.max(state.position_m.z);
        if flight.world().booster_attached() && (state.position_m - stood_m).norm() < rail_m {
            rail_m_s = state.velocity_m_s.norm();
        }
        flight.step();
    }
    assert!((planned.highest_m - highest_m).abs() < 1e-9, "{planned:?} {highest_m}");
    assert!((planned.rail_m_s.unwrap() - rail_m_s).abs() < 1e-9 && rail_m_s > 15.0, "{planned:?} {rail_m_s}");
    let [lit_m, chute_m] = [planned.ignition_m, planned.chute_down_to_m].map(Option::unwrap);
    assert!(15.0 < lit_m && lit_m < chute_m && chute_m < 150.0, "{planned:?}");
    for words in [
        "Too few flights were flown, or one did not come down: no radius, no rate",
        "DO NOT FLY: too few flights (1, 100 needed)",
        "Lay the landing pad downwind of the rail: 7 m for each m/s of that wind.",
        &format!("as planned in the least wind {highest_m:.0} to {highest_m:.0} m"),
        "Thrust to weight at lift-off",
        "LIFT-OFF that nobody commanded",
        "MAY BE IN THE AIR",
        "ONE PERSON: PIN IN",
        "Misfire",
        "Fire",
        "[ ] Range test (U) passed",
        "PROVEN",
    ] {
        assert!(text.contains(words), "{words} in\n{text}");
    }
    for cell in aborts(Some(StartPoint::Pad), &format!("feet above {chute_m:.0} to {chute_m:.0} m")).concat()
    {
        assert!(text.contains(&cell), "{cell} in\n{text}");
    }
}

#[test]
fn a_parachute_ends_with_a_live_motor_and_often_on_its_side() {
    let recipe = Recipe::built_in("mk3", "real").unwrap().starting_at(StartPoint::Pad).unwrap();
    let down = |number| fly(&recipe, &[Case::AbortInAscent, Case::Uncommanded], number).unwrap();
    let courses: Vec<Course> = (0..4).flat_map(down).map(|impact| impact.course).collect();
    for course in &courses {
        assert!(
            course.ignition_m.is_none() && (20.0..90.0).contains(&course.canopy_s.unwrap()),
            "{course:?}"
        );
    }
    assert!(courses.iter().any(|course| course.lies), "{courses:?}");
}

#[test]
fn a_card_states_at_which_masses_nine_of_ten_land() {
    let recipe = crate::recipe_of("mini-f10", "none");
    let flights = Flights { survey: 4, of_widest: 4 };
    let masses = card_of(&recipe, flights).masses;
    assert!(masses.len() > 2 && masses.is_sorted_by(|a, b| a.0 < b.0), "{masses:?}");
    let own_kg = recipe.mission.airframe.mass.loaded_kg;
    let own = masses.iter().position(|(kg, _)| (kg - own_kg).abs() < 1e-12).unwrap();
    assert!(masses[own].1.stands.share >= 0.9, "{masses:?}");
    // Only the ends of the range may be masses with fewer landings.
    assert!(masses[1..masses.len() - 1].iter().all(|(_, landed)| landed.stands.share >= 0.9), "{masses:?}");
}
