//! Chooses what is recorded in the log of a flight.

use std::path::Path;

use protocol::frame::Frame;
use protocol::log::flight_v1::PilotTiming;
use protocol::log::record::{Direction, Event, EventLevel, RawFrame, Record};
use protocol::log::recorder::Recorder;

use flight::computer::LogState;
use flight::computer::news::Severity;

use crate::vehicle::{Vehicle, VehicleEvent};

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

pub(super) fn record(recorder: &Recorder, vehicle: &Vehicle, events: &[VehicleEvent]) {
    let time_ns = nanoseconds(vehicle.time_s());
    for record in vehicle.computer_records() {
        recorder.record(record, time_ns);
    }
    for event in events {
        let record = match event {
            VehicleEvent::Verdict { .. } => match vehicle.verdict_record() {
                Some(verdict) => Record::LandingVerdict(Box::new(verdict)),
                None => continue,
            },
            VehicleEvent::Planned { frame, time_s, took_s, deadline_s } => Record::PilotTiming(PilotTiming {
                frame: *frame,
                time_s: *time_s,
                solve_time_s: *took_s,
                deadline_s: *deadline_s,
            }),
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
    let changed = events.iter().any(|event| matches!(event, VehicleEvent::PhaseChanged { .. }));
    for record in vehicle.records(changed) {
        recorder.record(record, time_ns);
    }
}

/// A flight without a log is the operator's choice and not a failure.
pub(super) fn log_state(recorder: Option<&Recorder>) -> LogState {
    let Some(recorder) = recorder else {
        return LogState { running: true, space_bytes: u64::MAX };
    };
    let directory = recorder.path().parent().filter(|path| !path.as_os_str().is_empty());
    let space_bytes = fs4::available_space(directory.unwrap_or(Path::new("."))).unwrap_or(0);
    LogState { running: recorder.is_running() && recorder.dropped() == 0, space_bytes }
}
