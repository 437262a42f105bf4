//! After an abort with the landing motor burning the vehicle still lands. The motor has no cut-off,
//! so it lands on the ground below.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use flight::computer::AbortEffect;
use flight::rules::phase::Phase;
use onboard_sim::row::Row;
use onboard_sim::tally::{self, Tally};
use sim::recipe::Recipe;

/// An abort at a random moment of the burn, which lasts at least 4.4 s from the command to the
/// ground.
const IN_THE_BURN: &str = "abort@ignition+0..4.4";
const LATEST_S: f64 = 4.4;
/// A seed whose flights were not used for tuning.
const SEED: u64 = 21;

const FLIGHTS: u64 = 120;

fn recipe(fault: Option<&str>) -> Recipe {
    let faults = fault.map(|fault| fault.parse().unwrap()).into_iter().collect();
    Recipe { seed: SEED, faults, ..Recipe::built_in("mk2", "field").unwrap() }
}

fn landed(rows: &[Row]) -> usize {
    rows.iter().filter(|row| row.stands).count()
}

/// Number of flights, each with and without an abort at a random moment of its burn.
#[test]
fn regress_flights_with_an_abort_in_the_burn_land_as_often_as_without() {
    let fly = |fault| {
        let recipe = recipe(fault);
        (0..FLIGHTS).map(|number| tally::fly(&recipe, number).unwrap()).collect::<Vec<Row>>()
    };
    let (alone, aborted) = (fly(None), fly(Some(IN_THE_BURN)));
    assert!(aborted.iter().all(|row| !row.parachute));
    for (alone, aborted) in alone.iter().zip(&aborted).filter(|(_, aborted)| aborted.faults != 1) {
        // A flight that crashes may reach the ground before its abort.
        let early = aborted.burn_time_at_contact_s.is_some_and(|at_s| at_s < LATEST_S);
        assert!(early && !alone.stands, "{}", aborted.number);
        assert_eq!(aborted.touchdown_time_s, alone.touchdown_time_s, "{}", aborted.number);
    }
    assert!(aborted.iter().filter(|row| row.faults == 1).count() >= 119);
    assert!(landed(&alone) >= 3 * 38, "{} of 120 left alone", landed(&alone));
    // A difference of one in forty may be chance.
    assert!(landed(&aborted) + 3 >= landed(&alone), "{} aborted, {}", landed(&aborted), landed(&alone));
    let otherwise = alone.iter().zip(&aborted).filter(|(alone, aborted)| {
        alone.touchdown_x_m != aborted.touchdown_x_m || alone.touchdown_y_m != aborted.touchdown_y_m
    });
    assert!(otherwise.count() >= 3 * 35, "an abort ends the homing to the pad");
}

/// Too low for the parachute, at the first moment with the gate open: the motor ignites at the
/// chosen height. A fall would end at about 37 m/s.
#[test]
fn an_abort_before_the_ignition_with_the_gate_open_burns_at_its_height_and_lands_in_place() {
    let recipe = recipe(None);
    let burns = AbortEffect::Burn;
    let effect = |tally: &Tally| tally.flight().computer().abort_effect();
    let mut rows = Vec::new();
    for number in 0..8 {
        let mut tally = Tally::new(&recipe, number).unwrap();
        // A nose that swings through the gate's limit opens it for a moment.
        let mut lasted = 0;
        while lasted < 3 {
            assert!(tally.step(), "flight {number} never had an abort that burns");
            lasted = if effect(&tally) == burns { lasted + 1 } else { 0 };
        }
        assert_eq!(tally.flight().computer().mode().phase, Phase::LandArmed);
        tally.flight_mut().abort();
        tally.step();
        let falls = *tally.flight().computer().mode();
        assert!(falls.phase == Phase::LandArmed && falls.interlocks.lands_in_place, "{falls:?}");
        while tally.step() {}
        rows.push(tally.row());
    }
    let slow = |row: &Row| row.touchdown_vertical_m_s.is_some_and(|m_s| m_s.abs() < 12.0);
    assert!(rows.iter().all(|row| row.ignited && !row.parachute && slow(row)));
    assert!(landed(&rows) >= 7, "{} of 8", landed(&rows));
}
