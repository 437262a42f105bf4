//! Tests the shadow on the telemetry of simulated flights, as the vehicle's own endpoint sends it over a radio.

use std::num::NonZeroU32;
use std::process::Command;
use std::time::Duration;

use flight::computer::LogState;
use flight::computer::crew::{Asked, Request};
use flight::rules::arming;
use flight::rules::phase::Phase;
use protocol::dialect::MavMessage;
use replay::shadow::{Check, Flag, Shadow};
use sim::recipe::Recipe;
use simulated_vehicle::endpoint::{VehicleEndpoint, step};
use simulated_vehicle::vehicle::{RocketFlight, Vehicle};

use crate::command_line::run;
use crate::simulated::MK2;

/// Bounds were set on flights of seed 2026.
const SEED: u64 = 2027;

/// Frames that are heard after the end.
const LINGERS: u32 = 40;
/// No flight is longer, s.
const LONGEST_S: f64 = 200.0;
/// Time from the thrust to the fault that a flight has, s.
const BREAKS_AFTER_S: [f64; 5] = [0.5, 0.8, 1.1, 1.4, 1.7];

/// What a shadow saw of one flight.
struct Seen {
    /// Each flag, and when its frame was sent after the frame that shows the fault, s.
    flags: Vec<(Flag, Option<f64>)>,
    shadow: Shadow,
}

/// The frame of the vehicle in which it shows that its gimbal does not follow: the second in a row in which the angle of an
/// axis is the same to the last digit, while its command is elsewhere and 3 degrees away at last.
#[derive(Default)]
struct ShownByGimbal {
    last: Option<[(i16, i16); 2]>,
    at_s: Option<f64>,
}

impl ShownByGimbal {
    fn look(&mut self, message: &MavMessage, time_s: f64) {
        let MavMessage::TD_GIMBAL(told) = message else { return };
        let axes = [(told.pitch_commanded, told.pitch_measured), (told.yaw_commanded, told.yaw_measured)];
        let shows = self.last.is_some_and(|last| {
            last.into_iter().zip(axes).any(|((wanted, before), (commanded, measured))| {
                wanted.abs_diff(before) > 60
                    && before.abs_diff(measured) <= 1
                    && commanded.abs_diff(measured) > 300
            })
        });
        if shows {
            self.at_s.get_or_insert(time_s);
        }
        self.last = Some(axes);
    }
}

/// What is wrong with a flight.
#[derive(Clone, Copy, Default)]
struct Trouble<'a> {
    fault: Option<&'a str>,
    /// Scatter of the impulse instead of the field's.
    impulse_share: Option<f64>,
}

impl<'a> Trouble<'a> {
    fn fault(fault: &'a str) -> Self {
        Self { fault: Some(fault), ..Self::default() }
    }
}

/// Flies one flight of a mission with a fault, and lets a shadow hear every frame.
fn flown(mission: &str, number: u64, Trouble { fault, impulse_share }: Trouble<'_>) -> Seen {
    let mut recipe = Recipe::built_in(mission, "field").unwrap();
    recipe.seed = SEED;
    recipe.dispersion.impulse_share = impulse_share.unwrap_or(recipe.dispersion.impulse_share);
    let after_s = BREAKS_AFTER_S[number as usize % BREAKS_AFTER_S.len()];
    recipe.faults = fault
        .map(|fault| fault.replace("AFTER", &after_s.to_string()).parse().unwrap())
        .into_iter()
        .collect();
    let mut shadow = Shadow::of_mission(&recipe.mission);
    let mut vehicle = Vehicle::in_space(&RocketFlight { recipe, number }).unwrap();
    vehicle.set_pin_out(true);
    vehicle.set_log_state(LogState { running: true, space_bytes: u64::MAX });
    let mut endpoint =
        VehicleEndpoint::sending(vehicle.standard()).booted(NonZeroU32::MIN.get()).starting_by_itself();
    let (mut started, mut after_end, mut flags) = (false, 0, Vec::new());
    let mut shown = ShownByGimbal::default();
    while after_end < LINGERS && vehicle.time_s() < LONGEST_S {
        let ready = !started && vehicle.phase() == Phase::PadIdle;
        let own = if ready && arming::first_refusal(&vehicle.arming_checks()).is_none() {
            started = true;
            [Asked::Arm, Asked::Start].map(Request::of_the_programme).to_vec()
        } else {
            Vec::new()
        };
        step(&mut endpoint, &mut vehicle, &own, &mut || Duration::ZERO);
        let now_s = vehicle.time_s();
        for sent in endpoint.poll(&vehicle) {
            let message = sent.frame.decode().unwrap();
            if vehicle.phase() == Phase::Powered {
                shown.look(&message, now_s);
            }
            let heard = shadow.heard(now_s, &message);
            flags.extend(heard.into_iter().map(|flag| (flag, shown.at_s.map(|shown_s| now_s - shown_s))));
        }
        after_end += u32::from(vehicle.is_over());
    }
    Seen { flags, shadow }
}

/// Flies flights with a fault on two threads.
fn flights(mission: &str, count: u64, trouble: Trouble<'_>) -> Vec<Seen> {
    std::thread::scope(|scope| {
        let half = |from: u64| {
            scope.spawn(move || {
                (from..count).step_by(2).map(|number| flown(mission, number, trouble)).collect::<Vec<_>>()
            })
        };
        let halves = [half(0), half(1)];
        halves.into_iter().flat_map(|half| half.join().unwrap()).collect()
    })
}

fn flagged(seen: &[Seen], checks: &[Check]) -> u64 {
    let of = |seen: &&Seen| seen.flags.iter().any(|(flag, _)| checks.contains(&flag.check));
    seen.iter().filter(of).count() as u64
}

/// The figures of a number of flights, of each: nominal ones flagged; weak motors, sudden losses and jammed gimbals found.
#[expect(clippy::print_stdout, reason = "the figures are what the long test is run for")]
fn check(mission: &str, count: u64) {
    let nominal = flights(mission, count, Trouble::default());
    let false_flags: Vec<String> =
        nominal.iter().flat_map(|seen| &seen.flags).map(|(flag, _)| flag.to_string()).collect();
    println!("{mission}: {} flags in {count} nominal flights: {false_flags:#?}", false_flags.len());

    let motor = [Check::MotorStrength, Check::Thrust];
    let lost = flights(mission, count, Trouble::fault("weak-motor:0.9@powered+AFTER"));
    let lost = flagged(&lost, &motor);
    // Of 0.90 of its certified impulse: on top of the scatter the scatter is the limit (`replay::shadow`, strength).
    let certified = Trouble { impulse_share: Some(0.0), ..Trouble::fault("weak-motor:0.9@0") };
    let weak = flagged(&flights(mission, count, certified), &motor);
    println!("{mission}: of {count} motors 10 % weak flagged: {weak} from the light on, {lost} in the burn");

    let jammed = flights(mission, count, Trouble::fault("gimbal-jams:3@powered+AFTER"));
    let gimbal = [Check::Gimbal, Check::Turning];
    let found = flagged(&jammed, &gimbal);
    let late = jammed.iter().filter(|seen| {
        let first = seen.flags.iter().find(|(flag, _)| gimbal.contains(&flag.check));
        first.is_none_or(|(_, after_s)| after_s.is_some_and(|after_s| after_s > 0.2))
    });
    println!("{mission}: of {count} jammed gimbals {found} flagged, {} late", late.clone().count());

    // At most one in a hundred, and where fewer are flown one by chance.
    assert!(flagged(&nominal, &Check::ALL) <= (count / 100).max(1), "{false_flags:#?}");
    assert!(
        found * 100 >= 95 * count && late.count() as u64 * 100 <= 5 * count,
        "gimbal: {found} of {count}"
    );
    assert!(lost * 100 >= 95 * count, "lost in the burn: {lost} of {count}");
    assert!(weak * 100 >= 95 * count, "weak from the light on: {weak} of {count}");
}

#[test]
fn weak_motors_and_jammed_gimbals_are_flagged_and_nominal_flights_are_not() {
    check("mk2", 10);
    check("vlr-f15", 10);
}

#[test]
#[ignore = "1000 flights, some minutes"]
fn the_figures_of_a_hundred_flights_of_each() {
    check("mk2", 100);
    check("vlr-f15", 100);
}

#[test]
fn at_a_radio_s_rates_every_check_of_a_rocket_runs() {
    let seen = flown("mk2", 0, Trouble::default());
    for coverage in seen.shadow.coverage() {
        assert!(coverage.runs, "{coverage:?}");
    }
}

/// A radio that carries only the vital messages: nothing runs, nothing is flagged, and it is said.
#[test]
fn a_shadow_that_hears_nothing_but_the_phase_says_that_nothing_runs() {
    let recipe = Recipe::built_in("mk2", "field").unwrap();
    let shadow = Shadow::of_mission(&recipe.mission);
    assert!(shadow.coverage().iter().all(|coverage| !coverage.runs && coverage.words.contains("needed at")));
}

/// The program on a vehicle's log without frames: no answer, and words for it.
#[test]
fn a_log_without_frames_gives_no_answer() {
    let mut shadow = Command::new(env!("CARGO_BIN_EXE_replay"));
    let log = MK2.beside("heard-nothing.mcap");
    shadow.args(["shadow", "--connect"]).arg(&MK2.log).arg("--log").arg(&log);
    let (code, _, stderr) = run(&mut shadow);
    assert!(code == 2 && stderr.contains("no frame of system 1"), "{stderr}");
}
