//! What a card tells the range safety officer.

use campaign::hazard::{Flights, Impact, Rule, Way, studies};
use campaign::motors::card::{Card, Day, Order};
use campaign::motors::choice::Team;
use campaign::motors::range_safety::{ABORTS, FEWEST, InWind, aborts, in_winds, limit_m_s, plan};
use campaign::motors::source::Candidate;
use flight::vehicle::mission::StartPoint;
use proptest::prelude::*;
use sim::recipe::Recipe;

fn rule() -> Rule {
    Rule { feet: 200.0, impulse_n_s: 673.0, complex: true, model: false }
}

fn impact(way: Way, number: usize, along_m: f64, across_m: f64, landed: bool) -> Impact {
    Impact { way, number: number as u64, place_m: Some([along_m, across_m]), downwind_rad: 0.0, landed }
}

/// Flights in winds from 0 m/s on, each with its places in two ways.
fn flown(of: impl Into<proptest::collection::SizeRange>) -> impl Strategy<Value = Vec<(f64, Vec<Impact>)>> {
    let one = (-900.0..900.0, -300.0..300.0, any::<bool>());
    let in_wind = prop::collection::vec(one, of).prop_map(|flights| {
        let numbered = flights.into_iter().enumerate();
        let each = numbered.flat_map(|(number, (along_m, across_m, landed))| {
            [
                impact(Way::AsPlanned, number, 0.1 * along_m, 0.1 * across_m, landed),
                impact(Way::Uncommanded, number, along_m, across_m, false),
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
            for way in [Way::AsPlanned, Way::Uncommanded] {
                let of_way = || impacts.iter().filter(|impact| impact.way == way);
                let inside = |radius_m: f64| of_way().filter(|impact| impact.distance_m() <= radius_m).count();
                prop_assert!(100 * inside(circle.keep_out_m) >= 99 * of_way().count());
                prop_assert!(way != circle.way || 100 * inside(circle.radius.holds_m) >= 99 * of_way().count());
            }
            // Never less than in less wind, nor than the rule.
            prop_assert!(circle.keep_out_m >= least_m && circle.keep_out_m >= rule().distance_m());
            prop_assert!(circle.crew_m() > circle.keep_out_m, "the launch crew stands outside");
            least_m = circle.keep_out_m;
        }
    }

    #[test]
    fn a_rate_is_the_share_of_the_flights_as_planned_and_nothing_else(flown in flown(FEWEST as usize..200)) {
        for ((_, impacts), wind) in flown.iter().zip(in_winds(&flown, &rule())) {
            let landed = wind.landed.unwrap();
            let planned = impacts.iter().filter(|impact| impact.way == Way::AsPlanned);
            prop_assert_eq!(landed.of, planned.clone().count() as u64);
            prop_assert_eq!(landed.count, planned.filter(|impact| impact.landed).count() as u64);
            prop_assert!(landed.low <= landed.share && landed.share <= landed.high);
        }
    }

    #[test]
    fn fewer_than_a_hundred_flights_tell_no_rate_no_radius_and_no_wind_to_fly_in(flown in flown(0..FEWEST as usize)) {
        let winds = in_winds(&flown, &rule());
        prop_assert!(winds.iter().all(|wind| wind.landed.is_none() && wind.circle.is_none()));
        prop_assert_eq!(limit_m_s(&winds), None);
        prop_assert_eq!(plan(&winds, None), None);
    }

    /// Wind from the west blows to the east: right, with north up.
    #[test]
    fn the_line_points_downwind_and_the_crew_stands_upwind_outside_for_every_direction(from_deg in 0.0..360.0_f64) {
        let winds = [circle(0.0, 110.0), circle(3.0, 310.0), circle(6.0, 610.0)];
        let svg = plan(&winds, Some(from_deg)).unwrap();
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

fn circle(wind_m_s: f64, keep_out_m: f64) -> InWind {
    let impacts: Vec<Impact> =
        (0..400).map(|number| impact(Way::AsPlanned, number, keep_out_m - 5.0, 0.0, true)).collect();
    in_winds(&[(wind_m_s, impacts)], &rule()).remove(0)
}

/// Wind from the west: the line goes to the right, with north up. Without a direction downwind is up.
#[test]
fn val_compass_the_line_of_a_west_wind_points_east() {
    let winds = [circle(3.0, 310.0)];
    let west = plan(&winds, Some(270.0)).unwrap();
    let tip = |svg: &str| {
        svg.split("x2=").nth(1).unwrap().split("/>").next().unwrap().replace('"', "").replace("y2=", "")
    };
    assert!(tip(&west).starts_with("84.0 ") && west.contains(">N<"), "{west}");
    let unknown = plan(&winds, None).unwrap();
    assert_eq!(tip(&unknown), "0.0 -84.0");
    assert!(
        unknown.contains(">downwind<") && unknown.contains(">3 m/s<") && !unknown.contains(">N<"),
        "{unknown}"
    );
}

/// 90 of 100 in calm air: 81 is nine tenths of it, 80 is less.
#[test]
fn val_hand_the_wind_to_fly_in_keeps_nine_tenths_of_the_landings() {
    let in_wind = |landed: usize| {
        (0..100).map(|number| impact(Way::AsPlanned, number, 50.0, 0.0, number < landed)).collect()
    };
    let limit = |landed: [usize; 3]| {
        let flown: Vec<(f64, Vec<Impact>)> = [0.0, 3.0, 6.0].into_iter().zip(landed.map(in_wind)).collect();
        limit_m_s(&in_winds(&flown, &rule()))
    };
    assert_eq!(limit([90, 81, 81]), Some(6.0));
    assert_eq!(limit([90, 81, 80]), Some(3.0));
    assert_eq!(limit([90, 80, 90]), Some(0.0), "no wind beyond one that is not flown");
    let mut never_down: Vec<Impact> = in_wind(90);
    for impact in &mut never_down {
        impact.place_m = None;
    }
    assert_eq!(limit_m_s(&in_winds(&[(0.0, never_down)], &rule())), None);
}

/// The words of the card are those of the page for the range safety officer.
#[test]
fn val_safety_md_the_abort_table_is_the_same() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../SAFETY.md")).unwrap();
    let table = page.split("| when | what happens |\n|---|---|\n").nth(1).unwrap();
    let rows: Vec<Vec<&str>> = table
        .lines()
        .take_while(|line| line.starts_with('|'))
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect();
    assert_eq!(rows, ABORTS.map(|row| row.to_vec()));
    let shown = [StartPoint::Pad, StartPoint::Apogee, StartPoint::Drone].map(aborts);
    assert_eq!(shown.iter().map(Vec::len).collect::<Vec<_>>(), [6, 4, 4]);
    for row in ABORTS {
        assert!(shown.iter().any(|shown| shown.contains(&row)), "{row:?}");
    }
    assert!(
        !shown[0].contains(&ABORTS[1]) && shown[2].contains(&ABORTS[1]),
        "a drone's row on its own card alone"
    );
}

/// `hazard` on the mission that is written flies the flights of the card, from the pad.
#[test]
fn what_a_card_says_is_flown_again_from_its_mission() {
    let recipe = Recipe { seed: 5, ..Recipe::built_in("mk3", "real").unwrap() };
    let mut windy = recipe.clone();
    windy.dispersion.wind_m_s = [4.0; 2];
    let (motor, curve) = (recipe.mission.airframe.motor.clone(), recipe.mission.motor_curve.clone());
    let motor = Candidate { origin: "the mission".to_owned(), motor, curve, in_production: None };
    let team = Team::new(recipe, [0.0, 0.0]);
    let flights = Flights { survey: 1, of_widest: 2 };
    let order = Order {
        team: &team,
        motor: &motor,
        mass_kg: None,
        winds: &[Day { wind_m_s: 4.0, recipe: windy.clone() }],
        flights,
        wind_from_deg: Some(270.0),
    };
    let card = Card::new(&order, &|_| {}).unwrap();
    let written =
        Recipe::from_texts(("card", &card.recipe.mission_toml), ("real", &windy.dispersion_toml)).unwrap();
    let written =
        Recipe { dispersion: windy.dispersion, seed: 5, ..written }.starting_at(StartPoint::Pad).unwrap();
    assert_eq!(card.flown[0].1, studies(&[written], flights, &|_, _| {}).unwrap()[0]);
    let text = card.text();
    assert!(
        text.contains(
            "Fewer than 100 flights were flown in each wind, or one did not come down: no radius, no rate"
        ),
        "{text}"
    );
    assert!(
        text.contains("Lay the landing pad downwind of the rail: 7 m for each m/s of that wind."),
        "{text}"
    );
    for row in aborts(StartPoint::Pad).concat() {
        assert!(text.contains(row), "{row} in\n{text}");
    }
}
