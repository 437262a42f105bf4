//! Tests that the whole flight computer is run again from power-up on: pin, arming, countdown,
//! hold, abort, restart.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

use flight::computer::crew::{CrewCommand, People, Request};
use flight::computer::messages::{CrewMessage, Severity};
use flight::computer::{Commander, LogState};
use flight::rules::arming::Uplink;
use flight::rules::operator::{Name, Operator, Role};
use flight::rules::phase::Phase;
use flight::rules::two_person::Station;
use flight::vehicle::mission::StartPoint;
use proptest::prelude::*;
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::writer::{LogHeader, LogWriter};
use replay::log::Gap;
use replay::verify::{Obstacle, Verification, VerifyReport, verify};
use sim::recipe::Recipe;
use sim::wire::vehicle::{RocketFlight, Vehicle, VehicleEvent};
use tempfile::TempDir;

use crate::tampered::Held;

/// More frames than any flight has.
const LONGEST: u64 = 30_000;

const STATION: Station = Station { system: 255, component: 190, number: 1 };

/// The inputs from the crew in one frame.
#[derive(Debug, Clone)]
pub(crate) struct Reached {
    frame: u64,
    request: Option<Request>,
    uplink: Uplink,
    commander_age_s: Option<f64>,
    pin_out: bool,
}

fn commanded(frame: u64, command: CrewCommand) -> Reached {
    let request = Some(Request::of_the_programme(command));
    Reached { frame, request, uplink: Uplink::NotNeeded, commander_age_s: None, pin_out: true }
}

/// A request of one of two operators.
fn of(frame: u64, role: Role, command: CrewCommand, confirms: Option<u16>) -> Reached {
    let by = Some(Operator { number: role as u8, role, name: Name::new("Ann") });
    let request = Request { command, uplink: Uplink::NotNeeded, station: Some(STATION), by, confirms };
    Reached { request: Some(request), ..commanded(frame, command) }
}

/// The frame in which the second one confirms the arming.
const CONFIRMED: u64 = 1_210;

/// Two people arm and start; then the second one taps this many times.
fn two_people(taps: u64) -> Vec<Reached> {
    let (flight, range) = (Role::Flight, Role::RangeSafety);
    let mut crew = vec![
        of(1_200, flight, CrewCommand::Arm, None),
        // The same role, and the number of another ask.
        of(1_205, flight, CrewCommand::Arm, Some(65_535)),
        of(1_206, range, CrewCommand::Arm, Some(7)),
        of(CONFIRMED, range, CrewCommand::Arm, Some(65_535)),
        of(1_220, flight, CrewCommand::Start, None),
        // The numbers have begun again.
        of(1_230, range, CrewCommand::Start, Some(1)),
    ];
    crew.extend((1..=taps).map(|nth| of(1_230 + 200 * nth, range, CrewCommand::Tap, None)));
    crew
}

/// A crew that arms, starts, and does nothing else.
pub(crate) fn armed_and_started(at: u64) -> Vec<Reached> {
    vec![
        commanded(0, CrewCommand::Hold),
        commanded(at, CrewCommand::Arm),
        commanded(at + 1, CrewCommand::Start),
    ]
}

/// A vehicle, and the header of its log. Of those on a rail the one whose crew places the rail
/// upwind.
fn vehicle(start: StartPoint, faults: &[&str]) -> (Vehicle, LogHeader) {
    let faults = faults.iter().map(|fault| fault.parse().unwrap()).collect();
    let name = if start == StartPoint::Pad { "mk3" } else { "mk2" };
    let recipe = Recipe { faults, ..Recipe::built_in(name, "field").unwrap().starting_at(start).unwrap() };
    let header = sim::wire::record::header("test", &recipe, 0, 0);
    (Vehicle::on_the_pad(&RocketFlight { recipe, number: 0 }).unwrap(), header)
}

/// A flight with its log.
pub(crate) struct Flown {
    folder: TempDir,
    records: Vec<(Record, u64)>,
    header: LogHeader,
    phases: Vec<Phase>,
}

impl Flown {
    /// Of a vehicle that two people arm and start.
    fn by_two(crew: &[Reached]) -> Self {
        let (vehicle, header) = vehicle(StartPoint::Apogee, &[]);
        Self::fly(vehicle.with_crew(People::Two { first: 65_534 }, Vec::new()), header, crew)
    }

    fn in_space(crew: &[Reached], faults: &[&str]) -> Self {
        Self::from(StartPoint::Apogee, crew, faults)
    }

    pub(crate) fn from(start: StartPoint, crew: &[Reached], faults: &[&str]) -> Self {
        let (vehicle, header) = vehicle(start, faults);
        Self::fly(vehicle, header, crew)
    }

    fn fly(mut vehicle: Vehicle, header: LogHeader, crew: &[Reached]) -> Self {
        vehicle.set_log_state(LogState { running: true, space_bytes: 1 << 40 });
        let mut flown =
            Self { folder: tempfile::tempdir().unwrap(), records: Vec::new(), header, phases: Vec::new() };
        let mut crew = crew.iter().peekable();
        let last = crew.clone().last().map_or(0, |reached| reached.frame);
        for frame in 0..LONGEST {
            let mut requests = Vec::new();
            while let Some(reached) = crew.next_if(|reached| reached.frame <= frame) {
                requests.extend(reached.request);
                let commander = reached.commander_age_s.map(|age_s| Commander {
                    station: STATION,
                    age_s,
                    by: None,
                    deaf: false,
                });
                vehicle.set_uplink(reached.uplink, commander);
                vehicle.set_pin_out(reached.pin_out);
            }
            let events = vehicle.step(&requests).events;
            flown.record(&vehicle, &events);
            let waits = vehicle.phase().on_pad() && frame > last + 3_000;
            if vehicle.is_over() || waits {
                return flown;
            }
        }
        panic!("the flight has not ended: {:?}", vehicle.phase());
    }

    /// Its log, whole.
    pub(crate) fn log(&self) -> PathBuf {
        self.written(self.records.iter().cloned())
    }

    /// Records a frame as the run loop does.
    fn record(&mut self, vehicle: &Vehicle, events: &[VehicleEvent]) {
        let time_ns = (1e9 * vehicle.time_s()) as u64;
        let mut record_at = |record| self.records.push((record, time_ns));
        vehicle.computer_records().into_iter().for_each(&mut record_at);
        for event in events {
            match event {
                VehicleEvent::Verdict => {
                    record_at(Record::LandingVerdict(Box::new(vehicle.verdict_record().unwrap())));
                }
                VehicleEvent::Message(CrewMessage::PhaseChanged { to, .. }) => self.phases.push(*to),
                VehicleEvent::Message(CrewMessage::Text { severity, text })
                    if *severity >= Severity::Warning =>
                {
                    record_at(Record::Event(Event {
                        level: EventLevel::Warning,
                        name: "vehicle".to_owned(),
                        message: text.to_string(),
                    }));
                }
                _ => {}
            }
        }
        vehicle.records().into_iter().for_each(&mut record_at);
    }

    fn written(&self, records: impl Iterator<Item = (Record, u64)>) -> PathBuf {
        // Tests at the same time write the same flight, each in its own way.
        static WRITTEN: AtomicU32 = AtomicU32::new(0);
        let number = WRITTEN.fetch_add(1, Ordering::Relaxed);
        let path = self.folder.path().join(format!("flight-{number}.mcap"));
        let mut writer = LogWriter::new(std::fs::File::create(&path).unwrap(), &self.header).unwrap();
        for (record, time_ns) in records {
            writer.write(&record, time_ns).unwrap();
        }
        writer.finish().unwrap();
        path
    }

    fn verified(&self) -> VerifyReport {
        self.verified_with(|_| true, |_| ())
    }

    /// The report on the flight after records were left out or changed.
    fn verified_with(&self, kept: impl Fn(&Record) -> bool, change: impl Fn(&mut Record)) -> VerifyReport {
        let records = self.records.iter().filter(|(record, _)| kept(record)).cloned();
        let path = self.written(records.map(|(mut record, time_ns)| {
            change(&mut record);
            (record, time_ns)
        }));
        let mut reports = verify(&path).unwrap();
        assert_eq!(reports.len(), 1, "one flight");
        reports.remove(0)
    }

    fn frames(&self) -> u64 {
        self.records.iter().filter(|(record, _)| matches!(record, Record::ComputerFrame(_))).count() as u64
    }
}

fn all_frames_identical(report: &VerifyReport) -> u64 {
    assert!(report.from_power_up);
    assert_eq!((report.frames_recorded, report.frames_different), (report.frames_compared, 0), "{report:?}");
    assert_eq!(report.obstacle, None);
    report.frames_compared
}

/// A fix is timed from the release on, and the frames from power-up.
#[test]
fn after_minutes_on_the_pad_no_input_of_the_flight_is_impossible() {
    for start in [StartPoint::Apogee, StartPoint::Pad] {
        let flown = Flown::from(start, &armed_and_started(14_000), &[]);
        assert!(flown.phases.contains(&Phase::Powered), "{:?}", flown.phases);
        let report = flown.verified();
        assert_eq!(report.outcome, Verification::Identical, "{start:?}: {report:?}");
        assert_eq!(all_frames_identical(&report), flown.frames());
    }
}

#[test]
fn what_two_people_do_verifies() {
    let flown = Flown::by_two(&two_people(9));
    assert!(flown.phases.contains(&Phase::Powered), "{:?}", flown.phases);
    assert_eq!(all_frames_identical(&flown.verified()), flown.frames());
    // Without taps the countdown is held.
    let held = Flown::by_two(&two_people(0));
    assert_eq!(held.phases, [Phase::PadIdle, Phase::PadArmed]);
    assert_eq!(all_frames_identical(&held.verified()), held.frames());
    // A log from which a confirmation is taken is not what the computer would have done.
    let changed = flown.verified_with(
        |_| true,
        |record| {
            if let Record::ComputerFrame(frame) = record
                && frame.input.frame == CONFIRMED + 1
            {
                frame.input.requests.clear();
            }
        },
    );
    assert!(changed.from_power_up && changed.frames_different > 0);
}

/// The whole flight from the pad, with an abort, with a dead computer under the ascent motor, and
/// with a booster that stays; and from below a drone.
#[test]
fn flights_from_the_pad_and_from_a_drone_verify() {
    let started = armed_and_started(2_600);
    let mut aborted = started.clone();
    aborted.push(commanded(5_000, CrewCommand::Abort));
    for (start, crew, faults, passed) in [
        (StartPoint::Pad, &started, &[][..], Phase::Powered),
        (StartPoint::Pad, &aborted, &[], Phase::Chute),
        (StartPoint::Pad, &started, &["reboot:0.4@boost+0.5"], Phase::AeroDescent),
        (StartPoint::Pad, &started, &["separation-fails@0"], Phase::Chute),
        (StartPoint::Drone, &started, &[], Phase::AeroDescent),
    ] {
        let flown = Flown::from(start, crew, faults);
        assert!(flown.phases.contains(&passed), "{start:?} {faults:?}: {:?}", flown.phases);
        assert_eq!(flown.phases.contains(&Phase::Boost), start == StartPoint::Pad);
        all_frames_identical(&flown.verified());
        let counted = replay::info::info(&flown.log()).unwrap().frames.unwrap();
        assert_eq!(
            (counted.restarts == 1, counted.lost),
            (faults.iter().any(|fault| fault.starts_with("reboot")), 0)
        );
    }
}

#[test]
fn a_request_removed_from_a_log_is_a_divergence_in_its_frame() {
    let flown = &*FLOWN;
    let report = flown.verified_with(
        |_| true,
        |record| match record {
            Record::ComputerFrame(frame) if frame.input.frame == 1_201 => {
                assert_eq!(frame.input.requests.len(), 1);
                frame.input.requests.clear();
            }
            _ => {}
        },
    );
    assert_eq!(report.outcome, Verification::Diverged);
    let first = report.first_divergence.unwrap();
    assert_eq!((first.frame, first.in_flight, first.phase), (1_201, false, "PAD_IDLE"));
    assert!(first.fields.iter().any(|field| field.path == "output.phase"), "{first:?}");
}

#[test]
fn if_frames_on_the_pad_are_lost_the_pilot_is_still_verified_from_its_release() {
    for start in [StartPoint::Apogee, StartPoint::Pad] {
        let flown = Flown::from(start, &armed_and_started(2_600), &[]);
        // Left out by the writer's sequence number, as if a chunk were damaged.
        let mut held = Held::read(&flown.log());
        held.retain(|message| !message.is_frame() || !(500..510).contains(&message.sequence));
        let path = flown.folder.path().join("gap.mcap");
        held.write(&path);
        let report = verify(&path).unwrap().remove(0);
        assert_eq!(report.obstacle, Some(Obstacle::Gap(Gap { after: 500, before: 511 })));
        assert_eq!(report.outcome, Verification::NotReplayable);
        assert_eq!(report.frames_different, 0, "{start:?}");
        // Those before the loss, and those from the release on.
        assert!(report.frames_in_flight > 2_000);
        assert!(report.frames_compared >= 500 + report.frames_in_flight, "{report:?}");
    }
}

/// A writer that left it out looks like a computer that was dead.
#[test]
fn a_frame_missing_in_the_log_is_no_identical_flight() {
    let lost =
        |record: &Record| !matches!(record, Record::ComputerFrame(frame) if frame.input.frame == 2_000);
    assert_eq!(FLOWN.verified_with(lost, |_| ()).outcome, Verification::Diverged);
}

/// The pin, and a check on the pad that passes, is ended or fails: all of them are the crew's, and
/// a sound flight after them has no finding. A vehicle that stays on its pad has the reason as one.
#[test]
fn what_a_check_on_the_pad_finds_is_no_finding_of_the_flight() {
    let by_hand = |frame, pin_out| Reached { request: None, pin_out, ..commanded(frame, CrewCommand::Hold) };
    let checked = [by_hand(0, false), by_hand(400, true), commanded(800, CrewCommand::Check)];
    let passes = (checked.to_vec(), &[][..], "check passed");
    let ended = ([&checked[..], &[commanded(1_200, CrewCommand::EndCheck)]].concat(), &[][..], "ended early");
    let fails = (checked.to_vec(), &["brown-out:4@pad+6"][..], "check FAILED");
    for (crew, faults, words) in [passes, ended, fails] {
        let released = [&crew[..], &armed_and_started(5_000)[1..]].concat();
        for (crew, is_released) in [(released, true), (crew, false)] {
            let flown = Flown::from(StartPoint::Pad, &crew, faults);
            let log = flown.log();
            let recording = replay::log::Recording::open(&log).unwrap();
            let was_reported = recording.events.iter().any(|(_, event)| event.message.contains(words));
            assert_eq!(was_reported, words != "check passed", "warnings alone are recorded here");
            let found = replay::info::info(&log).unwrap().findings.unwrap();
            let is_warning = !is_released && was_reported;
            assert_eq!(
                found.iter().any(|found| found.words.contains(words)),
                is_warning,
                "{words} {found:?}"
            );
            let is_sound = is_released && faults.is_empty();
            assert!(!is_sound || found.is_empty(), "{words}: {found:?}");
        }
    }
}

#[test]
fn a_vehicle_that_never_left_its_pad_verifies_and_counts_as_cut() {
    let flown = Flown::in_space(&[commanded(0, CrewCommand::Hold)], &[]);
    let report = flown.verified();
    assert_eq!(report.outcome, Verification::IdenticalReadablePart);
    let cut = report.cut.unwrap();
    assert_eq!(cut.phase, "PAD_IDLE");
    // It was never released, so it has no T+.
    let words = format!("ends on the pad, at boot {:.3} s in PAD_IDLE, without a verdict", cut.time_s);
    assert_eq!(cut.to_string(), words);
    assert!(all_frames_identical(&report) > 2_000);
}

fn any_uplink() -> impl Strategy<Value = Uplink> {
    prop_oneof![
        3 => Just(Uplink::NotNeeded),
        1 => Just(Uplink::NeverReceived),
        3 => (0.0..2.0).prop_map(|age_s| Uplink::Received { age_s }),
    ]
}

fn any_crew() -> impl Strategy<Value = Vec<Reached>> {
    let command = prop_oneof![
        4 => Just(CrewCommand::Arm),
        4 => Just(CrewCommand::Start),
        1 => Just(CrewCommand::Disarm),
        1 => Just(CrewCommand::Hold),
        1 => Just(CrewCommand::Abort),
    ];
    let one = (
        0_u64..1_500,
        prop::option::of(command),
        any_uplink(),
        prop::option::of(0.0..4.0),
        prop::bool::weighted(0.9),
        prop::option::of((any::<u8>(), any::<u8>(), any::<u32>())),
    );
    let one = one.prop_map(|(frame, command, uplink, commander_age_s, pin_out, ids)| Reached {
        frame,
        request: command.map(|command| {
            let station = ids.map(|(system, component, number)| Station { system, component, number });
            Request { command, uplink, station, by: None, confirms: None }
        }),
        uplink,
        commander_age_s,
        pin_out,
    });
    prop::collection::vec(one, 0..24).prop_map(|mut crew| {
        crew.sort_by_key(|reached| reached.frame);
        crew
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn whatever_a_crew_does_is_replayed(crew in any_crew()) {
        let flown = Flown::in_space(&crew, &[]);
        prop_assert_eq!(all_frames_identical(&flown.verified()), flown.frames());
    }

    /// Any number may be in a damaged or forged log: there is a report, and no panic.
    #[test]
    fn nonsense_is_answered(
        at in 0_usize..3_000,
        frame in prop_oneof![Just(u64::MAX), any::<u64>(), 0_u64..2_000],
        number in prop_oneof![any::<u64>().prop_map(f64::from_bits), Just(f64::NAN), Just(f64::INFINITY)],
        number_of_command: u32,
    ) {
        let nonsense = |record: &mut Record| {
            if let Record::ComputerFrame(found) = record
                && found.input.frame == at as u64
            {
                found.input.frame = frame;
                found.input.time_s = number;
                found.input.fins_rad[0] = number;
                for request in &mut found.input.requests {
                    request.asked = number_of_command;
                }
                found.input.measured.imu.gyro_rad_s.x = number;
            }
        };
        let report = FLOWN.verified_with(|_| true, nonsense);
        prop_assert!(report.from_power_up);
    }
}

static FLOWN: std::sync::LazyLock<Flown> =
    std::sync::LazyLock::new(|| Flown::in_space(&armed_and_started(1_200), &[]));
