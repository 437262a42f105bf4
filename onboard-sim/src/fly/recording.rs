//! What of a flight goes into its log.

use std::path::Path;

use flight::phase::Phase;
use protocol::frame::Frame;
use protocol::log::record::{Direction, Event, EventLevel, RawFrame, Record};
use protocol::log::recorder::Recorder;
use protocol::log::v1;

use crate::vehicle::{LogState, Severity, Snapshot, VehicleEvent};

pub(super) fn nanoseconds(time_s: f64) -> u64 {
    (1e9 * time_s) as u64
}

pub(super) fn record_raw(
    recorder: Option<&Recorder>,
    direction: Direction,
    link: &str,
    frame: &Frame,
    time_s: f64,
) {
    if let Some(recorder) = recorder
        && let Some(bytes) = frame.for_log()
    {
        let frame = RawFrame { direction, endpoint: "vehicle", link: link.to_owned(), bytes };
        recorder.record(Record::RawFrame(frame), nanoseconds(time_s));
    }
}

pub(super) fn note(recorder: Option<&Recorder>, time_s: f64, words: &str) {
    if let Some(recorder) = recorder {
        let event = Event { level: EventLevel::Info, name: "vehicle".to_owned(), message: words.to_owned() };
        recorder.record(Record::Event(event), nanoseconds(time_s));
    }
}

pub(super) fn record(recorder: &Recorder, snapshot: &Snapshot, events: &[VehicleEvent]) {
    let time_ns = nanoseconds(snapshot.time_s);
    for event in events {
        let record = match event {
            VehicleEvent::Tick(tick) => Record::from(tick_log::tick_to_log(
                &tick.input,
                &tick.output,
                tick.state_digest,
                tick.solve_time_s,
                tick.deadline_s,
            )),
            VehicleEvent::Verdict { impact, verdict } => Record::LandingVerdict(Box::new(
                tick_log::verdict_to_log(impact.time_s, &impact.state, verdict),
            )),
            VehicleEvent::Text { severity, text } => Record::Event(Event {
                level: match severity {
                    Severity::Info | Severity::Notice => EventLevel::Info,
                    Severity::Warning => EventLevel::Warning,
                    Severity::Error => EventLevel::Error,
                    Severity::Critical => EventLevel::Fatal,
                },
                name: "vehicle".to_owned(),
                message: text.clone(),
            }),
            VehicleEvent::PhaseChanged { from, to } => Record::Event(Event {
                level: EventLevel::Info,
                name: "vehicle".to_owned(),
                message: format!("phase {} to {}", from.name(), to.name()),
            }),
        };
        recorder.record(record, time_ns);
        if matches!(event, VehicleEvent::PhaseChanged { .. }) {
            recorder.sync_soon();
        }
    }
    // The waiting vehicle does not move: once a second and at every change of phase is enough to see that.
    let moving = !snapshot.phase.on_pad() && snapshot.phase != Phase::Safed;
    let changed = events.iter().any(|event| matches!(event, VehicleEvent::PhaseChanged { .. }));
    if moving || changed || (snapshot.time_s.fract() < 0.015) {
        recorder.record(Record::PlantTruth(Box::new(truth(snapshot))), time_ns);
    }
}

fn truth(snapshot: &Snapshot) -> v1::PlantTruth {
    v1::PlantTruth {
        time_s: snapshot.time_s,
        phase: u32::from(snapshot.phase.index()),
        state: tick_log::state_to_log(&snapshot.state),
        gimbal_commanded_rad: snapshot.gimbal_rad.0,
        gimbal_actual_rad: snapshot.gimbal_rad.1,
        fin_commanded_rad: snapshot.fins_rad.0.to_vec(),
        fin_actual_rad: snapshot.fins_rad.1.to_vec(),
        thrust_n: snapshot.thrust_n,
        mass_kg: snapshot.mass_kg,
        in_contact: snapshot.in_contact,
    }
}

/// A flight without a log is the operator's choice, not a failed log.
pub(super) fn log_state(recorder: Option<&Recorder>) -> LogState {
    let Some(recorder) = recorder else {
        return LogState { running: true, space_bytes: u64::MAX };
    };
    let directory = recorder.path().parent().filter(|path| !path.as_os_str().is_empty());
    let space_bytes = fs4::available_space(directory.unwrap_or(Path::new("."))).unwrap_or(0);
    LogState { running: recorder.is_running() && recorder.dropped() == 0, space_bytes }
}
