//! Builds telemetry records from the frames, as a ground station would know them.

use protocol::dialect::MavMessage;
use protocol::frame::Frame;
use protocol::log::record::{Event, EventLevel, Record};
use protocol::log::v1;
use protocol::text::Reassembler;
use std::time::Duration;

use crate::log::Heard;

/// Shortest interval between telemetry records, s.
const PERIOD_S: f64 = 0.1;

#[derive(Default)]
pub(super) struct Fold {
    known: v1::Telemetry,
    changed: bool,
    written_at_s: Option<f64>,
    heard: Heard,
    judged: bool,
    texts: Reassembler,
}

impl Fold {
    /// Takes a frame that the vehicle sent `time_s` after the first; returns a record when one is due.
    pub(super) fn take(&mut self, frame: &Frame, time_s: f64) -> Vec<Record> {
        let Ok(message) = frame.decode() else {
            return Vec::new();
        };
        let mut records = Vec::new();
        self.heard.take(&message);
        match &message {
            MavMessage::STATUSTEXT(chunk) => {
                let now = Duration::from_secs_f64(time_s.max(0.0));
                records.extend(self.texts.push(frame.source(), chunk, now).into_iter().map(|text| {
                    let level = match text.severity {
                        0..=2 => EventLevel::Fatal,
                        3 => EventLevel::Error,
                        4 => EventLevel::Warning,
                        _ => EventLevel::Info,
                    };
                    Record::Event(Event { level, name: "vehicle".to_owned(), message: text.text })
                }));
            }
            MavMessage::TD_LANDING_VERDICT(_) if !self.judged => {
                self.judged = true;
                records.extend(self.heard.verdict().map(|verdict| Record::LandingVerdict(Box::new(verdict))));
            }
            message => self.changed |= self.note(message),
        }
        let due = self.written_at_s.is_none_or(|at_s| time_s - at_s >= PERIOD_S);
        if self.changed && due {
            self.changed = false;
            self.written_at_s = Some(time_s);
            self.known.time_s = time_s;
            records.push(Record::Telemetry(Box::new(self.known.clone())));
        }
        records
    }

    /// Whether the message changed anything.
    fn note(&mut self, message: &MavMessage) -> bool {
        let known = &mut self.known;
        let centidegrees = |angle: &i16| (f64::from(*angle) / 100.0).to_radians();
        match message {
            MavMessage::TD_FLIGHT_STATUS(data) => {
                known.phase = Some(data.phase as u32);
                known.interlocks = Some(u32::from(data.interlocks.bits()));
                known.countdown_ms = (data.countdown_ms != i32::MAX).then_some(data.countdown_ms);
            }
            MavMessage::LOCAL_POSITION_NED(data) => {
                known.x_m = Some(f64::from(data.x));
                known.altitude_m = Some(-f64::from(data.z));
                if let Some(pitch_rad) = known.pitch_rad {
                    let (sin, cos) = libm::sincos(pitch_rad);
                    let (forward, up) = (f64::from(data.vx), -f64::from(data.vz));
                    known.u_m_s = Some(forward * cos + up * sin);
                    known.w_m_s = Some(forward * sin - up * cos);
                }
            }
            MavMessage::ATTITUDE_QUATERNION(data) => {
                // A rotation about the east axis: the quaternion holds half of the pitch angle.
                known.pitch_rad = Some(2.0 * libm::atan2(f64::from(data.q3), f64::from(data.q1)));
                known.q_rad_s = Some(f64::from(data.pitchspeed));
            }
            MavMessage::TD_FINS(data) => {
                known.fin_commanded_rad = data.commanded.iter().map(centidegrees).collect();
                known.fin_measured_rad = data.measured.iter().map(centidegrees).collect();
            }
            MavMessage::TD_GIMBAL(data) => {
                known.gimbal_commanded_rad = Some(centidegrees(&data.pitch_commanded));
                known.gimbal_measured_rad = Some(centidegrees(&data.pitch_measured));
            }
            MavMessage::TD_CONTROLLER(data) => {
                known.control_level = Some(data.level as u32);
                known.solver_status = Some(data.solver_status as u32);
                known.iterations = Some(u32::from(data.iterations));
                known.solve_time_s = Some(f64::from(data.solve_time_us) / 1e6);
            }
            _ => return false,
        }
        true
    }
}
