//! Where flights come down that do not end on the pad.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use flight::rules::verdict::Landing;
use flight::vehicle::mission::StartPoint;
use onboard_sim::hazard::{Case, Course, Flights, Impact, Radius, fly, study, widest};
use onboard_sim::run::threads;
use sim::recipe::Recipe;
use sim::sortie::Sortie;

fn recipe(mission: &str, start: StartPoint) -> Recipe {
    Recipe { seed: 31, ..Recipe::built_in(mission, "real").unwrap() }.starting_at(start).unwrap()
}

/// The fence of mk2 is 120 m. What the card once said of people outside of it was not true.
#[test]
fn a_flight_from_the_pad_that_ends_otherwise_comes_down_beyond_the_fence() {
    let recipe = recipe("mk2", StartPoint::Pad);
    let cases = Case::of(&recipe.mission);
    let flights: Vec<Vec<Impact>> = (0..3).map(|number| fly(&recipe, &cases, number).unwrap()).collect();
    for impacts in &flights {
        assert_eq!(
            impacts.iter().map(|impact| impact.case).collect::<Vec<_>>(),
            cases,
            "every way, in its order"
        );
        assert!(impacts.iter().all(|impact| impact.place_m.is_some()), "{impacts:?}");
        let landed = impacts.iter().filter(|impact| impact.landing.stands);
        let may_land = [Case::AsPlanned, Case::AbortTooLow, Case::AbortUnderThrust];
        assert!(landed.clone().all(|impact| may_land.contains(&impact.case)), "{impacts:?}");
    }
    let farthest_m = |case: Case| {
        let of_case = flights.iter().flatten().filter(|impact| impact.case == case);
        of_case.map(Impact::distance_m).fold(0.0, f64::max)
    };
    for case in [Case::AbortInAscent, Case::NoSeparation, Case::Uncommanded] {
        assert!(farthest_m(case) > 120.0, "{case:?} {} m", farthest_m(case));
    }
    assert!(farthest_m(Case::AsPlanned) < 120.0);
}

/// The study holds the fins and moves the world alone once the parachute is out, in long strides.
/// In air without gusts, a flight with its computer to the end comes down at the same place; and an
/// abort in the boost where one in the coast does, to the bit.
#[test]
fn under_the_parachute_the_computer_changes_nothing() {
    let mut recipe = recipe("mk2", StartPoint::Pad);
    recipe.dispersion.gust_scale = 0.0;
    let flown = |fault: &str| {
        let faults = vec![fault.parse().unwrap()];
        let mut flight = Sortie::new(&Recipe { faults, ..recipe.clone() }, 1).unwrap();
        while flight.world().rest().is_none() {
            flight.step();
        }
        let place_m = flight.world().state().position_m;
        [place_m.x, place_m.y]
    };
    let found = fly(&recipe, &[Case::AbortInAscent, Case::NoSeparation], 1).unwrap();
    let [aborted, stays_on] = [0, 1].map(|place: usize| found[place].place_m.unwrap());
    let in_boost = flown("abort@boost+0.5");
    assert_eq!(in_boost.map(f64::to_bits), flown("abort@coast+2").map(f64::to_bits));
    for (one, other) in [(aborted, in_boost), (stays_on, flown("separation-fails@0"))] {
        assert!(libm::hypot(one[0] - other[0], one[1] - other[1]) < 0.5, "{one:?} {other:?}");
    }
}

#[test]
fn the_widest_way_is_flown_more_often_and_on_any_number_of_threads_alike() {
    let recipe = recipe("mk2", StartPoint::Apogee);
    let study = || study(&recipe, Flights { survey: 1, of_widest: 3 }, &|_, _| {}).unwrap();
    let flown = |jobs| threads(Some(jobs)).unwrap().install(study);
    let alone = flown(1);
    assert_eq!(alone, flown(2));
    // A parachute drifts with the wind; what falls without one does not.
    let (case, radius) = widest(&alone).unwrap();
    // From the apogee or a moment after it: which of the two reaches further is decided by metres.
    assert!(matches!(case, Case::ParachuteFromApogee | Case::AbortInDescent), "{case:?}");
    assert_eq!(radius.flights, 3);
    let falls = Radius::of_case(&alone, Case::Ballistic).unwrap();
    assert!(falls.flights == 1 && falls.farthest_m < radius.farthest_m, "{falls:?}");
}

#[test]
fn a_case_that_stays_near_ends_its_survey_and_the_planned_flights_do_not() {
    let mut recipe = recipe("mk2", StartPoint::Apogee);
    recipe.dispersion.wind_m_s = [8.0; 2];
    let impacts = study(&recipe, Flights { survey: 26, of_widest: 27 }, &|_, _| {}).unwrap();
    let flown = |case: Case| impacts.iter().filter(|impact| impact.case == case).count();
    assert_eq!([Case::Ballistic, Case::AsPlanned, Case::ParachuteFromApogee].map(flown), [25, 26, 27]);
}

/// The wind of each flight blows to another side. Whatever it is, a parachute drifts with it.
#[test]
fn a_parachute_drifts_downwind_whatever_the_direction_of_the_wind() {
    let mut recipe = recipe("mk2", StartPoint::Pad);
    recipe.dispersion.wind_m_s = [8.0; 2];
    let mut quarters = [false; 4];
    for number in 0..8 {
        let impact = fly(&recipe, &[Case::Uncommanded], number).unwrap()[0];
        let [along_m, left_m] = impact.in_wind_m().unwrap();
        assert!(along_m > 150.0 && left_m.abs() < 0.6 * along_m, "{number}: {along_m} {left_m}");
        quarters[(impact.downwind_rad / core::f64::consts::FRAC_PI_2) as usize % 4] = true;
    }
    assert!(quarters.iter().filter(|seen| **seen).count() >= 3, "{quarters:?}");
}

/// The wind blows to +y: 10 m there is 10 m downwind, and -x is left of it.
#[test]
fn val_hand_a_place_downwind_and_left_of_it() {
    let impact = Impact {
        case: Case::AsPlanned,
        number: 0,
        place_m: Some([-3.0, 10.0]),
        downwind_rad: core::f64::consts::FRAC_PI_2,
        landing: Landing::default(),
        course: Course::default(),
    };
    let [along_m, left_m] = impact.in_wind_m().unwrap();
    assert!((along_m - 10.0).abs() < 1e-12 && (left_m - 3.0).abs() < 1e-12, "{along_m} {left_m}");
    assert_eq!(Impact { place_m: None, ..impact }.in_wind_m(), None);
}

#[test]
fn without_a_booster_no_scenario_needs_one() {
    let apogee = Case::of(&recipe("mk2", StartPoint::Apogee).mission);
    assert!(!apogee.contains(&Case::AbortInAscent) && apogee.contains(&Case::ParachuteFromApogee));
    let drone = Case::of(&recipe("vlr", StartPoint::Drone).mission);
    assert!(!drone.contains(&Case::ParachuteFromApogee) && drone.contains(&Case::Ballistic));
}
