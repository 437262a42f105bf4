//! Ranks the built-in motors and broken ones, and looks at what comes out.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::fs;
use std::path::Path;

use campaign::motors::choice::{Choice, Limits, Obstacle, Refusal, StartHeight, Team, choose};
use campaign::motors::frame::Frame;
use campaign::motors::ranking::{Landing, Ranked, Request, rank};
use campaign::motors::source::{self, Candidate, SourceError};
use campaign::motors::table;
use campaign::run::threads;
use flight::guidance::vertical::Column;
use flight::vehicle::atmosphere::Air;
use flight::vehicle::burn::Burn;
use flight::vehicle::mission::Mission;
use flight::vehicle::thrust_curve::ThrustCurve;
use sim::recipe::Recipe;

fn mission(name: &str) -> Mission {
    flight::vehicles::mission::builtin(name).unwrap().unwrap()
}

/// The limits of a mission's airframe with a motor and some ballast, kg.
fn limits(mission: &Mission, frame: &Frame, curve: &ThrustCurve, ballast_kg: [f64; 2]) -> Limits {
    let recipe = Recipe { mission: mission.clone(), ..Recipe::built_in("mk2", "none").unwrap() };
    Team::new(recipe, ballast_kg).limits(frame, curve)
}

fn chosen(mission: &Mission, motor: &str, ballast_kg: [f64; 2]) -> Result<Choice, Refusal> {
    let curve = flight::vehicles::motors::builtin(motor).unwrap();
    let frame = Frame::of(mission).unwrap();
    choose(mission, &frame, &curve, &limits(mission, &frame, &curve, ballast_kg))
}

/// The mission's mass and height were found by thousands of flights, and this search knows neither.
#[test]
fn val_mk2_the_best_mass_and_height_are_those_of_the_mission() {
    let mk2 = mission("mk2");
    let choice = chosen(&mk2, "H45W", [-0.4, 0.4]).unwrap();
    assert!((choice.mass.loaded_kg - 3.10).abs() < 0.06, "{choice:?}");
    assert!((choice.start_height_m - 300.0).abs() < 20.0, "{choice:?}");
    assert!(choice.window.scatter > 1.0, "{choice:?}");
}

/// A drop is short: the thrust begins a second or two after the release. The missions' masses were found by flights.
#[test]
fn val_vlr_drops_land_on_their_motors_from_their_height() {
    for (name, motor) in [("vlr", "F13-RCT"), ("vlr-f16", "F16-RCJ")] {
        let dropped = mission(name);
        let from_m = dropped.start_height_m();
        let frame = Frame::of(&dropped).unwrap();
        let curve = flight::vehicles::motors::builtin(motor).unwrap();
        let usual = limits(&dropped, &frame, &curve, [-0.2, 0.2]);
        let choose = |start| choose(&dropped, &frame, &curve, &Limits { start, ..usual }).unwrap();
        let own_kg = dropped.airframe.mass.loaded_kg;
        let exactly = choose(StartHeight::Exactly(from_m));
        assert!((exactly.mass.loaded_kg - own_kg).abs() < 0.06, "{exactly:?}");
        let lower = choose(StartHeight::AtMost(from_m));
        assert!(lower.start_height_m <= from_m && lower.start_height_m > 15.0, "{lower:?}");
        assert!((lower.window.scatter - exactly.window.scatter).abs() < 0.05, "{lower:?} {exactly:?}");
    }
}

#[test]
fn regress_mini_f10_on_its_own_motor() {
    let choice = chosen(&mission("mini-f10"), "F10", [0.0, 0.2]).unwrap();
    let window = choice.window;
    let found = [
        choice.mass.loaded_kg,
        choice.start_height_m,
        window.scatter,
        window.onset_m,
        window.impulse_scales[0],
        window.impulse_scales[1],
    ];
    for (found, expected) in found.into_iter().zip([0.855, 100.0, 0.883, 24.3, 0.930, 1.069]) {
        assert!((found / expected - 1.0).abs() < 0.005, "{found} {expected}");
    }
}

/// Guidance's own band, asked again: the onset lies in it for motors inside the window and for none outside.
#[test]
fn val_guidance_the_window_ends_where_guidances_band_does() {
    let mini = mission("mini-f10");
    let choice = chosen(&mini, "F10", [0.0, 0.2]).unwrap();
    let density_kg_m3 = Air::at_height_m(mini.pad_altitude_m).density_kg_m3;
    let column = Column::of_mission(&mini, choice.mass.loaded_kg, density_kg_m3, 1.0, mini.soft_tilt_deg);
    let lands = |impulse_scale: f64| {
        let burn = Burn { impulse_scale, ..Burn::nominal(&mini.motor_curve) };
        let band = column.band(&burn, 0.0, -choice.window.speed_m_s);
        band.is_some_and(|band| band.contains(choice.window.onset_m))
    };
    let [low, high] = choice.window.impulse_scales;
    assert!(lands(low) && lands(1.0) && lands(high));
    assert!(!lands(low - 0.005) && !lands(high + 0.005));
}

#[test]
fn what_cannot_land_is_refused_with_the_bound_and_the_mass_that_would() {
    let mk2 = mission("mk2");
    let weak = chosen(&mk2, "F10", [0.0, 0.5]).unwrap_err();
    assert!(matches!(weak.obstacle, Obstacle::Thrust { .. }), "{weak}");
    // 3.1 kg less 0.294784 and plus 0.0841 weigh 28.33 N.
    let words = weak.to_string();
    assert!(words.contains("at most 28.2 N is never above the weight of 28.3 N at 2.889 kg"), "{words}");
    assert!(words.contains("it would land at 0.7"), "{words}");
    let heavy = chosen(&mk2, "H42", [0.0, 0.5]).unwrap_err();
    assert!(matches!(heavy.obstacle, Obstacle::Mass { .. }), "{heavy}");
    let wide = chosen(&mission("mini-f10"), "H45W", [0.0, 0.1]).unwrap_err().to_string();
    assert_eq!(wide, "does not fit: its diameter is 38 mm; up to 29 mm is accepted");
    // The mass that would land does, once it can be had.
    let [least_kg, most_kg] = heavy.landing_kg.unwrap();
    let middle_kg = 0.5 * (least_kg + most_kg) - 3.047_216;
    assert!(chosen(&mk2, "H42", [middle_kg, middle_kg]).is_ok());
}

#[test]
fn a_low_ceiling_is_a_reason_and_names_the_height_that_is_needed() {
    let mk2 = mission("mk2");
    let curve = mk2.motor_curve.clone();
    let frame = Frame::of(&mk2).unwrap();
    let limits = limits(&mk2, &frame, &curve, [0.0, 0.0]);
    let low = Limits { start: StartHeight::AtMost(60.0), ..limits };
    let refusal = choose(&mk2, &frame, &curve, &low).unwrap_err();
    let Obstacle::Height { needed_m, most_m } = refusal.obstacle else { panic!("{refusal}") };
    assert!(most_m < needed_m && needed_m < 300.0, "{needed_m}");
    let high = Limits { start: StartHeight::AtMost(needed_m + 1.0), ..limits };
    assert!(choose(&mk2, &frame, &curve, &high).is_ok());
}

const GOOD: &str = "F10 29 93 4-6-8 0.0407 0.0841 Apogee\n0.015 28.22\n0.5 15\n6.8 10\n7.13 0\n";

fn broken_folder(folder: &Path) {
    for (name, text) in [
        ("good.eng", GOOD.to_owned()),
        ("grams.eng", GOOD.replace("0.0407 0.0841", "40.7 84.1")),
        ("overlap.eng", GOOD.replace("6.8 10", "0.4 10")),
        ("two.eng", format!("{GOOD};\nG20 29 93 4 0.04 0.08 X\n1 20\n2 0\n")),
        ("none.eng", "F0 29 93 4 0.0407 0.0841 Apogee\n1 0\n".to_owned()),
        ("notes.txt", "not a motor".to_owned()),
        (
            "kilograms.rse",
            "<engine code='T' mfg='M' dia='29' len='93' propWt='0.0407' initWt='0.0841'>\n<data>\n\
             <eng-data t='0' f='0'/><eng-data t='4' f='20'/><eng-data t='5' f='0'/></data></engine>"
                .to_owned(),
        ),
    ] {
        fs::write(folder.join(name), text).unwrap();
    }
}

#[test]
fn every_broken_file_of_a_folder_is_named_with_line_and_value() {
    let folder = tempfile::tempdir().unwrap();
    broken_folder(folder.path());
    let found = source::read(folder.path()).unwrap();
    assert_eq!(found.len(), 6, "{found:?}");
    let reason = |name: &str| {
        let broken = found.iter().filter_map(|found| found.as_ref().err());
        broken
            .filter(|broken| broken.origin.ends_with(name))
            .map(|broken| broken.reason.clone())
            .next()
            .unwrap()
    };
    let grams = reason("grams.eng");
    assert!(grams.starts_with("line 1: propellant mass is '40.7 kg for 91.1 N s'"), "{grams}");
    assert!(grams.ends_with("a .eng file has kilograms, a .rse file grams"), "{grams}");
    assert!(reason("kilograms.rse").starts_with("line 1: propellant mass is '0.0000407 kg for 50.0 N s'"));
    assert_eq!(reason("overlap.eng"), "line 4: time is '0.4'; times must increase from point to point");
    assert!(reason("two.eng").starts_with("line 7: a point is 'G20 29 93"), "{}", reason("two.eng"));
    assert!(reason("none.eng").starts_with("thrust is missing"), "{}", reason("none.eng"));
    let empty = tempfile::tempdir().unwrap();
    assert!(matches!(source::read(empty.path()), Err(SourceError::Empty(_))));
    assert!(matches!(source::read(&empty.path().join("x.eng")), Err(SourceError::Read { .. })));
}

fn ranking(jobs: usize) -> Vec<Ranked> {
    let folder = tempfile::tempdir().unwrap();
    broken_folder(folder.path());
    let mut found = source::built_in();
    // Names of the folder differ from run to run.
    for broken in source::read(folder.path()).unwrap().into_iter().filter(Result::is_err) {
        found.push(broken.map_err(|broken| source::Unusable { origin: "a folder".to_owned(), ..broken }));
    }
    let recipe = Recipe { seed: 7, ..Recipe::built_in("mini-f10", "field").unwrap() };
    let team = Team { start: StartHeight::AtMost(200.0), ..Team::new(recipe, [0.0, 0.25]) };
    let request = Request { team: &team, best: 2, flights: 2 };
    threads(Some(jobs)).unwrap().install(|| rank(&request, found, &|_| {}).unwrap())
}

#[test]
fn a_ranking_is_the_same_for_any_number_of_threads_and_loses_no_motor() {
    let ranked = ranking(1);
    assert_eq!(ranked, ranking(3));
    // Five broken files.
    let of = flight::vehicles::motors::names().count() + 5;
    assert_eq!(ranked.len(), of);
    let names: Vec<String> = ranked
        .iter()
        .filter_map(|ranked| match ranked {
            Ranked::Lands(landing) => Some(landing.candidate.curve.name().to_owned()),
            _ => None,
        })
        .collect();
    let lands = ["F10", "F15", "G12"];
    assert!(
        names.len() == lands.len() && lands.iter().all(|name| names.contains(&(*name).to_owned())),
        "{names:?}"
    );
    let text = table::text(&ranked, false);
    assert!(text.contains(&format!("{} of {of} motors cannot be landed on:", of - lands.len())), "{text}");
    assert!(text.contains("AT H45W") && text.contains("does not fit: its diameter is 38 mm"), "{text}");
    assert!(text.contains("line 4: time is '0.4'; times must increase"), "{text}");
    let mut csv = Vec::new();
    table::write_csv(&ranked, &mut csv).unwrap();
    let csv = String::from_utf8(csv).unwrap();
    assert_eq!(csv.lines().count(), of + 1);
    assert!(csv.lines().next().unwrap().starts_with("rank,manufacturer,motor,"), "{csv}");
    assert!(csv.lines().nth(1).unwrap().starts_with("1,"), "{csv}");
}

/// The flights of a ranking are those of a campaign on the mission that it would write.
#[test]
fn a_motor_of_a_list_flies_as_the_mission_that_is_written_for_it() {
    let mini = mission("mini-f10");
    let curve = flight::vehicles::motors::builtin("G12").unwrap();
    let motor = flight::vehicles::thrust_curve::to_rasp(&curve);
    let candidate =
        Candidate { origin: "a list".to_owned(), motor, curve: curve.clone(), in_production: None };
    let choice = chosen(&mini, "G12", [0.0, 0.25]).unwrap();
    let landing = Landing { candidate, choice, flown: None };
    let written = landing.recipe(&Recipe::built_in("mini-f10", "none").unwrap()).unwrap().mission;
    assert_eq!(written.airframe.mass, landing.choice.mass);
    assert_eq!(written.motor_curve.points(), curve.points());
    assert!((written.motor_curve.total_mass_kg() - curve.total_mass_kg()).abs() < 1e-15);
    assert!((written.start.height_m - landing.choice.start_height_m).abs() < 1e-12);
}
