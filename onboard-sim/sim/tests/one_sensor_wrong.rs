//! One sensor wrong in each way and each phase: no event out of its phase, no parachute above its
//! speed, and nothing lost that two other sensors could have saved.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use flight::vehicle::mission::StartPoint;
use sim::recipe::Recipe;
use sim::sortie::Sortie;

/// A defect of each kind and size, in the sensor's unit (deg/s, mg, m).
const DEFECTS: &[&str] = &[
    "gyro-step:20",
    "gyro-ramp:10",
    "gyro-spike:200",
    "gyro-stuck",
    "gyro-noise:7",
    "gyro-out",
    "gyro-nan",
    "accelerometer-step:500",
    "accelerometer-step:-500",
    "accelerometer-ramp:500",
    "accelerometer-spike:4000",
    "accelerometer-stuck",
    "accelerometer-dead",
    "accelerometer-noise:90",
    "accelerometer-out",
    "accelerometer-nan",
    "barometer-step:55",
    "barometer-step:-55",
    "barometer-ramp:40",
    "barometer-ramp:-80",
    "barometer-spike:100",
    "barometer-spike:-100",
    "barometer-stuck",
    "barometer-noise:0.8",
    "barometer-out",
    "barometer-nan",
    "gnss-step:50",
    "gnss-ramp:30",
    "gnss-ramp:-30",
    "gnss-spike:200",
    "gnss-stuck",
    "gnss-noise:10",
    "gnss-out",
    "gnss-nan",
    "lidar-step:2",
    "lidar-ramp:2",
    "lidar-spike:5",
    "lidar-stuck",
    "lidar-noise:0.6",
    "lidar-blocked:0.3",
    "lidar-blocked:5",
    "lidar-out",
    "lidar-nan",
];

const WHEN: &[&str] =
    &["boost+0.1", "boost+0.5", "coast+0.5", "coast+3", "apogee", "descent+2", "armed", "powered+0.5"];

/// How a flight went, by the truth: vertical speeds, m/s, up.
struct Flown {
    /// When the vehicle took itself for past its apogee.
    apogee_m_s: f64,
    ejected_m_s: Option<f64>,
    impact_m_s: f64,
    landed: bool,
}

fn fly(mission: &str, dispersion: &str, fault: &str, seed: u64) -> Flown {
    fly_with(mission, dispersion, &[fault.to_owned()], seed)
}

fn fly_with(mission: &str, dispersion: &str, faults: &[String], seed: u64) -> Flown {
    let mut recipe = Recipe::built_in(mission, dispersion).unwrap().starting_at(StartPoint::Pad).unwrap();
    recipe.seed = seed;
    recipe.faults = faults.iter().map(|fault| fault.parse().unwrap()).collect();
    let mut flight = Sortie::new(&recipe, 0).unwrap();
    let (mut apogee_m_s, mut ejected_m_s) = (None, None);
    while flight.goes_on() {
        flight.step();
        let up_m_s = flight.world().state().velocity_m_s.z;
        if !flight.computer().mode().phase.before_apogee() {
            apogee_m_s.get_or_insert(up_m_s);
        }
        if flight.world().parachute_ejected_s().is_some() {
            ejected_m_s.get_or_insert(up_m_s);
        }
    }
    Flown {
        apogee_m_s: apogee_m_s.unwrap(),
        ejected_m_s,
        impact_m_s: flight
            .world()
            .touchdown()
            .map_or(f64::NAN, |touchdown| touchdown.over_ground.vertical_m_s),
        landed: flight.outcome().failure.is_none(),
    }
}

/// Where nothing else can help: in the burn the gyro alone knows the attitude, and an accelerometer
/// that is wrong by half a g on every axis passes for motion. One that says nothing is replaced by
/// what is known of the motor and the air.
fn may_be_lost(defect: &str, when: &str) -> bool {
    let of_the_unit = defect.starts_with("gyro") || defect.starts_with("accelerometer");
    let pushes = defect.starts_with("accelerometer-step") || defect.starts_with("accelerometer-spike");
    // 7 deg/s of noise in every sample: 1 or 2 of 60 flights from the pad tip over.
    let shakes = defect.starts_with("gyro-noise");
    // Detected when a parachute has hardly room to fill: of 60 flights of mk3 18 with a ramp meet
    // the ground at more than 10 m/s, and 1 with a step.
    let drifts = (defect.starts_with("gyro-ramp") || defect.starts_with("gyro-step")) && when == "armed";
    let replaced = ["stuck", "dead", "out", "nan"].iter().any(|how| defect == format!("accelerometer-{how}"));
    of_the_unit && (when.starts_with("powered") && !replaced || pushes || shakes || drifts)
}

fn fly_all(mission: &str, dispersion: &str) {
    let mut lost = 0;
    for defect in DEFECTS {
        for when in WHEN {
            let Flown { apogee_m_s, ejected_m_s, impact_m_s, landed } =
                fly(mission, dispersion, &format!("{defect}@{when}"), 1);
            let context = format!("{mission} {dispersion} {defect}@{when}: {impact_m_s} m/s");
            // A second before or after the apogee; the parachute bears the speed of a fall on open
            // fins.
            assert!((-10.0..10.0).contains(&apogee_m_s), "{context}, apogee at {apogee_m_s} m/s");
            assert!(ejected_m_s.is_none_or(|m_s| (-50.0..10.0).contains(&m_s)), "{context}, {ejected_m_s:?}");
            let saved = landed || impact_m_s.abs() < 10.0;
            assert!(saved || may_be_lost(defect, when), "{context}");
            lost += u32::from(!saved);
        }
    }
    // One flight each: of mk3 15 are lost. Such a count scatters by 4 between worlds that differ in
    // rounding alone.
    assert!(lost <= 19, "{lost} lost in the burn");
}

#[test]
fn one_sensor_wrong_in_any_way_in_any_phase_makes_no_event_out_of_its_phase_and_loses_nothing_in_field() {
    fly_all("mk2", "field");
}

#[test]
fn one_sensor_wrong_in_any_way_in_any_phase_makes_no_event_out_of_its_phase_and_loses_nothing_in_real() {
    fly_all("mk3", "real");
}

/// A bay that opens, or a charge: the pressure jumps half a second into the boost.
#[test]
fn a_pressure_that_jumps_under_thrust_opens_no_parachute_there() {
    for mission in ["mk2", "mk3"] {
        for step_m in [-50, -55, -60] {
            for seed in 1..=8 {
                let flown = fly(mission, "real", &format!("barometer-step:{step_m}@boost+0.5"), seed);
                assert!(
                    flown.apogee_m_s.abs() < 3.0,
                    "{mission} {step_m} m, seed {seed}: {}",
                    flown.apogee_m_s
                );
            }
        }
    }
}

/// Number of the first flights of mk3 from its pad, of seed 2002, that land with these faults.
fn landed(faults: &[&str], flights: u64) -> usize {
    let mut recipe = Recipe::built_in("mk3", "real").unwrap().starting_at(StartPoint::Pad).unwrap();
    recipe.seed = 2002;
    recipe.faults = faults.iter().map(|fault| fault.parse().unwrap()).collect();
    let stands = |number| Sortie::new(&recipe, number).unwrap().run().failure.is_none();
    (0..flights).filter(|number| stands(*number)).count()
}

/// Faults that recorded flights show in receivers, barometers and lidars. Of 240 flights with each
/// lidar fault (seeds 771 and 4021) 225 to 234 stand.
#[test]
fn faults_of_recorded_sensors_are_survived() {
    for fault in [
        "gnss-stale:1.6@boost",
        "gnss-stale:6@boost",
        "barometer-scale:0.9@0",
        "barometer-scale:1.1@0",
        "barometer-spike:3000@descent+2",
        "lidar-stuck@descent+2",
        "lidar-dead@coast",
        "lidar-blocked:0.3@descent",
        "lidar-step:5@coast",
        "lidar-step:-5@coast",
    ] {
        let found = landed(&[fault], 24);
        assert!(found >= 22, "{fault}: {found} of 24");
    }
}

/// Faults too small for a monitor to reject, with sizes around its threshold: kind, moment, sizes
/// in the sensor's unit, and the share of the vehicles that must stand. All others come down under
/// the parachute or fall over slowly.
const SMALL: &[(&str, &str, &[f64], f64)] = &[
    // A rattling leg or the igniter's pop looks like thrust before the motor ignites.
    ("accelerometer-spike", "ignition", &[200.0, 300.0, 500.0, 1000.0], 0.9),
    // A static port that is blocked, or nearly: the pressure stays that of the pad.
    ("barometer-scale", "boost", &[0.01, 0.03, 0.05], 0.0),
    // A receiver that is off by less than a vehicle moves.
    ("gnss-ramp", "coast+3", &[-1.0, -0.7, 0.7, 1.0, 2.0], 0.8),
    ("gnss-ramp", "coast", &[-2.0, 2.0], 0.8),
];

#[test]
fn a_fault_too_small_to_be_rejected_loses_no_vehicle() {
    for (kind, when, sizes, share) in SMALL {
        let (mut flown, mut stand) = (0, 0);
        for size in *sizes {
            for (mission, seed) in [("mk2", 1), ("mk2", 2), ("mk3", 1), ("mk3", 2), ("mk3", 3)] {
                let fault = format!("{kind}:{size}@{when}");
                let Flown { impact_m_s, landed, .. } = fly(mission, "field", &fault, seed);
                assert!(landed || impact_m_s.abs() < 8.0, "{mission} {fault}, {seed}: {impact_m_s} m/s");
                (flown, stand) = (flown + 1, stand + i32::from(landed));
            }
        }
        assert!(f64::from(stand) >= share * f64::from(flown), "{kind}@{when}: {stand} of {flown} stand");
    }
}

/// One sensor that is stuck and one that spikes: no event on the way up.
#[test]
fn a_stuck_and_a_spiking_sensor_fire_nothing_on_the_way_up() {
    let spikes = ["gyro-spike:200", "accelerometer-spike:4000", "barometer-spike:-10", "gnss-spike:200"];
    for mission in ["mk2", "mk3"] {
        for stuck in ["gyro", "accelerometer", "barometer", "gnss"] {
            for spike in spikes.iter().filter(|spike| !spike.starts_with(stuck)) {
                for seed in 1..=2 {
                    let faults = [format!("{stuck}-stuck@boost"), format!("{spike}@coast+2")];
                    let flown = fly_with(mission, "real", &faults, seed);
                    let context = format!("{mission} {faults:?}, seed {seed}");
                    assert!(flown.apogee_m_s < 10.0, "{context}: apogee at {} m/s", flown.apogee_m_s);
                    assert!(
                        flown.ejected_m_s.is_none_or(|m_s| m_s < 10.0),
                        "{context}: {:?}",
                        flown.ejected_m_s
                    );
                }
            }
        }
    }
}
