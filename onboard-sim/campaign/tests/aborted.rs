//! An abort with the landing motor lit still lands: it has no cut-off, so the vehicle lands on the ground below it.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use campaign::baseline::Controller;
use campaign::dispersion::Dispersion;
use campaign::order::Order;
use campaign::row::Row;
use campaign::sortie::{self, Sortie};
use flight::mission::{self, Mission};
use flight::phase::{Event, Phase};

/// At a random moment of the burn: it lasts 4.4 s and more from the command to the ground.
const IN_THE_BURN: &str = "abort@ignition+0..4.4";
/// Nothing was tuned on these flights.
const SEED: u64 = 21;

fn order(fault: Option<&str>) -> Order {
    let mission_toml = mission::BUILTIN[0].1.to_owned();
    Order {
        mission: Mission::from_toml(&mission_toml, "test").unwrap(),
        mission_toml,
        dispersion: Dispersion::builtin("field").unwrap(),
        dispersion_name: "field".to_owned(),
        dispersion_toml: String::new(),
        seed: SEED,
        flights: 40,
        controller: Controller::Nmpc,
        faults: fault.map(|fault| fault.parse().unwrap()).into_iter().collect(),
    }
}

fn landed(rows: &[Row]) -> usize {
    rows.iter().filter(|row| row.legs).count()
}

/// Forty flights, each with an abort at a random moment of its burn and without.
#[test]
fn regress_flights_aborted_in_the_burn_land_as_often_as_the_same_flights_left_alone() {
    let fly = |fault| {
        let order = order(fault);
        (0..order.flights).map(|number| sortie::fly(&order, number).unwrap()).collect::<Vec<Row>>()
    };
    let (alone, aborted) = (fly(None), fly(Some(IN_THE_BURN)));
    assert!(aborted.iter().all(|row| row.faults == 1 && !row.parachute));
    assert!(landed(&alone) >= 38, "{} of 40 left alone", landed(&alone));
    assert!(landed(&aborted) + 1 >= landed(&alone), "{} aborted, {}", landed(&aborted), landed(&alone));
    let otherwise = alone.iter().zip(&aborted).filter(|(alone, aborted)| {
        alone.touchdown_x_m != aborted.touchdown_x_m || alone.touchdown_y_m != aborted.touchdown_y_m
    });
    assert!(otherwise.count() >= 35, "an abort ends the homing to the pad");
}

/// Right after the command to light, where the abort used to cost the landing most surely.
#[test]
fn an_abort_right_after_the_ignition_lands() {
    let order = order(Some("abort@ignition+0.3"));
    for number in 0..3 {
        let mut sortie = Sortie::new(&order, number).unwrap();
        while sortie.step() {}
        let locks = sortie.flight().pilot().mode().interlocks;
        assert!(locks.abort_latched && locks.lands_here);
        let row = sortie.row();
        assert!(row.legs, "{number}: {} {:?} m/s", row.failure, row.touchdown_vertical_m_s);
    }
}

/// Too low for the parachute, at the first moment that the gate is open: the highest place that a landing can begin
/// from, so that only half of these land (10 of the first 20); but each brakes, where a fall ends at some 37 m/s.
#[test]
fn an_abort_before_the_ignition_with_the_gate_open_burns_and_lands_here() {
    let order = order(None);
    let burns = Event::AbortRequested { above_commit_height: false, gate_open: true };
    let asked = |sortie: &Sortie| sortie.flight().pilot().abort_event(sortie.flight().input());
    let mut rows = Vec::new();
    for number in 0..8 {
        let mut sortie = Sortie::new(&order, number).unwrap();
        while asked(&sortie) != burns {
            assert!(sortie.step(), "flight {number} never came by");
        }
        assert_eq!(sortie.flight().pilot().mode().phase, Phase::LandArmed);
        sortie.abort();
        sortie.step();
        let lit = *sortie.flight().pilot().mode();
        assert!(lit.phase == Phase::Ignition && lit.interlocks.lands_here, "{lit:?}");
        while sortie.step() {}
        rows.push(sortie.row());
    }
    let slow = |row: &Row| row.touchdown_vertical_m_s.is_some_and(|m_s| m_s.abs() < 12.0);
    assert!(rows.iter().all(|row| row.ignited && !row.parachute && slow(row)));
    assert!(landed(&rows) >= 4, "{} of 8", landed(&rows));
}

/// What the crew is told of a fall is what the fall comes to.
#[test]
fn an_abort_that_lights_nothing_hits_the_ground_as_fast_as_predicted() {
    let order = order(Some("no-light@0"));
    let mut sortie = Sortie::new(&order, 0).unwrap();
    while !sortie.flight().pilot().mode().interlocks.no_light_latched {
        assert!(sortie.step());
    }
    let predicted_m_s = sortie.flight().pilot().impact_m_s().unwrap();
    sortie.step();
    // What the prediction goes by, and the phase table asks for.
    let open_rad = sortie.flight().mission().airframe.fins.open_rad();
    let fins_rad = sortie.flight().output().unwrap().fins_rad;
    assert_eq!(fins_rad.map(f64::to_bits), [open_rad.to_bits(); 4]);
    while sortie.step() {}
    let found_m_s = -sortie.row().touchdown_vertical_m_s.unwrap();
    assert!((predicted_m_s - found_m_s).abs() < 2.0, "{predicted_m_s} m/s predicted, {found_m_s} found");
}
