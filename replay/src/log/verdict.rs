//! The landing verdict of a log: recorded by the vehicle, or heard by a ground station.

use protocol::dialect::{
    MavMessage, TD_LANDING_VERDICT_DATA, TD_TOUCHDOWN_LIMITS_DATA, TdInterlock, TdPhase,
};
use protocol::frame::{Frame, Framer};
use protocol::log::reader::LogChannel;
use protocol::log::record::TOPIC_RAW_RX;
use protocol::log::v1;
use sim::ending::{FlightEnding, UNDER_PARACHUTE};

use serde::Serialize;

use super::{Clock, ClockTime, Entry, StampedEntry};

/// A value of the verdict whose limit no message has given.
const NOT_TOLD: f64 = f64::NAN;
/// Limits up to these are the landing paper's Table 2: m/s along and across the axis.
const TABLE_2_M_S: [f64; 2] = [0.4, 0.1];
const ROUNDING: f64 = 1e-6;

/// The landing verdict, as recorded or heard.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerdictFacts {
    /// Whether the vehicle landed within the limits that decide.
    pub landed: bool,
    /// How the flight ended, in one sentence.
    pub ending: String,
    /// Time of contact, s.
    pub time_s: f64,
    /// What the time counts from: T+0, or power-up if a ground station heard the verdict.
    pub clock: Clock,
    /// The limits that decide: those of the legs.
    pub limits: Vec<VerdictLimit>,
    /// The landing paper's Table 2, if `limits` are those of the legs and the log has it.
    pub table_2: Vec<VerdictLimit>,
}

/// A limit of the landing verdict.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerdictLimit {
    /// Name of the judged quantity.
    pub name: String,
    pub value: f64,
    /// The lowest allowed.
    pub minimum: f64,
    /// The highest allowed.
    pub maximum: f64,
    /// Unit of value and limits.
    pub unit: String,
    /// Whether the value is inside the limits.
    pub passed: bool,
}

impl VerdictLimit {
    /// The value over the limit on its side of 0: above 1 it is outside. A limit of 0 has no shares: outside of it the value
    /// counts over the width of the range.
    pub fn share(&self) -> f64 {
        let limit = if self.value < 0.0 { self.minimum } else { self.maximum };
        if limit == 0.0 && self.value != 0.0 {
            return 1.0 + (self.value / (self.maximum - self.minimum)).abs();
        }
        if self.value == 0.0 { 0.0 } else { (self.value / limit).abs() }
    }
}

impl VerdictFacts {
    /// A recorded verdict.
    pub fn of(verdict: &v1::LandingVerdict) -> Self {
        let facts = |limits: &[v1::LimitResult]| -> Vec<VerdictLimit> {
            let limits = limits.iter().map(|limit| VerdictLimit {
                name: limit.name.clone(),
                value: limit.value,
                minimum: limit.minimum,
                maximum: limit.maximum,
                unit: limit.unit.clone(),
                passed: limit.passed,
            });
            limits.collect()
        };
        Self {
            landed: verdict.landed,
            ending: verdict.ending.clone().unwrap_or_default(),
            time_s: verdict.time_s,
            clock: Clock::Flight,
            limits: facts(&verdict.limits),
            table_2: facts(&verdict.table_2),
        }
    }

    /// The verdict that was found in a log.
    pub(crate) fn found(found: &Found) -> Self {
        let clock = if found.heard { Clock::Boot } else { Clock::Flight };
        Self { clock, ..Self::of(&found.verdict) }
    }

    /// Its time of contact with its clock.
    pub fn contact(&self) -> ClockTime {
        ClockTime { clock: self.clock, time_s: self.time_s }
    }
}

/// The verdict as the vehicle told it over the air.
#[derive(Debug, Default)]
pub(crate) struct Heard {
    limits: Option<TD_TOUCHDOWN_LIMITS_DATA>,
    verdict: Option<TD_LANDING_VERDICT_DATA>,
    aborted: bool,
    under_parachute: bool,
}

/// Collects the verdict while a log is read.
#[derive(Debug, Default)]
pub(crate) struct Verdicts {
    recorded: Option<v1::LandingVerdict>,
    heard: Heard,
    has_frames: bool,
}

/// A verdict of a log.
pub(crate) struct Found {
    pub(crate) verdict: v1::LandingVerdict,
    /// Its time counts from power-up, because it was heard by a ground station.
    pub(crate) heard: bool,
}

impl Heard {
    /// Takes a message of the vehicle.
    pub(crate) fn take(&mut self, message: &MavMessage) {
        match message {
            MavMessage::TD_TOUCHDOWN_LIMITS(limits) => self.limits = Some(limits.clone()),
            MavMessage::TD_LANDING_VERDICT(verdict) => {
                self.verdict.get_or_insert_with(|| verdict.clone());
            }
            MavMessage::TD_FLIGHT_STATUS(status) => {
                self.aborted |= status.interlocks.contains(TdInterlock::TD_INTERLOCK_ABORT_LATCHED);
                self.under_parachute |= status.phase == TdPhase::TD_PHASE_CHUTE;
            }
            _ => {}
        }
    }

    /// The verdict as a record; its time counts from power-up.
    pub(crate) fn verdict(&self) -> Option<v1::LandingVerdict> {
        let verdict = self.verdict.as_ref()?;
        let limits = self.limits.as_ref();
        let told = |limit: fn(&TD_TOUCHDOWN_LIMITS_DATA) -> f32| {
            limits.map_or(NOT_TOLD, |all| f64::from(limit(all)))
        };
        let [u_m_s, w_m_s] = [told(|l| l.u_m_s), told(|l| l.w_m_s)];
        let is_table_2 = u_m_s <= TABLE_2_M_S[0] + ROUNDING && w_m_s <= TABLE_2_M_S[1] + ROUNDING;
        let names = if is_table_2 {
            ["x", "altitude", "pitch error", "u", "w", "pitch rate"]
        } else {
            ["distance", "altitude", "tilt", "vertical speed", "lateral speed", "rotation rate"]
        };
        let upright_deg = (f64::from(verdict.pitch_rad) - core::f64::consts::FRAC_PI_2).to_degrees();
        let turning_deg_s = f64::from(verdict.q_rad_s).to_degrees();
        let (tilt_deg, rate_deg_s) =
            (told(|l| l.pitch_error_rad).to_degrees(), told(|l| l.q_rad_s).to_degrees());
        // In the order of the verdict's bits.
        let rows: [(&str, f64, f64, f64); 6] = [
            ("m", f64::from(verdict.x_m), -told(|l| l.x_m), told(|l| l.x_m)),
            ("m", f64::from(verdict.altitude_m), told(|l| l.altitude_min_m), told(|l| l.altitude_max_m)),
            ("deg", if is_table_2 { upright_deg } else { upright_deg.abs() }, -tilt_deg, tilt_deg),
            ("m/s", f64::from(verdict.u_m_s), -u_m_s, u_m_s),
            ("m/s", f64::from(verdict.w_m_s), -w_m_s, w_m_s),
            ("deg/s", turning_deg_s, -rate_deg_s, rate_deg_s),
        ];
        let limit =
            |(place, (unit, value, minimum, maximum)): (usize, (&str, f64, f64, f64))| v1::LimitResult {
                name: names[place].to_owned(),
                value,
                minimum,
                maximum,
                unit: unit.to_owned(),
                passed: verdict.limits_violated.bits() & (1 << place) == 0,
            };
        let limits: Vec<v1::LimitResult> = rows.into_iter().enumerate().map(limit).collect();
        let broken = limits.iter().find(|limit| !limit.passed).map(|limit| limit.name.as_str());
        let landed = verdict.landed != 0;
        let ending = FlightEnding {
            aborted: self.aborted,
            landed,
            table_2: is_table_2.then_some(landed),
            failure: if self.under_parachute { Some(UNDER_PARACHUTE) } else { broken },
        };
        Some(v1::LandingVerdict {
            time_s: f64::from(verdict.contact_ms) / 1e3,
            state: v1::PlanarState {
                x_m: f64::from(verdict.x_m),
                z_m: f64::from(verdict.altitude_m),
                theta_rad: f64::from(verdict.pitch_rad),
                u_m_s: f64::from(verdict.u_m_s),
                w_m_s: f64::from(verdict.w_m_s),
                q_rad_s: f64::from(verdict.q_rad_s),
            },
            ending: Some(ending.to_string()),
            limits,
            landed,
            table_2: Vec::new(),
        })
    }
}

/// Why a recorded verdict cannot be one: it judges each limit, and the vehicle has landed if all are kept.
pub(super) fn contradiction(verdict: &v1::LandingVerdict) -> Option<String> {
    let v1::LandingVerdict { time_s, state, limits, landed, table_2, ending: _ } = verdict;
    let v1::PlanarState { x_m, z_m, theta_rad, u_m_s, w_m_s, q_rad_s } = state;
    let numbers = [time_s, x_m, z_m, theta_rad, u_m_s, w_m_s, q_rad_s];
    if numbers.into_iter().any(|number| !number.is_finite()) {
        return Some("its time and its state are not all numbers".to_owned());
    }
    if limits.is_empty() {
        return Some("it has no limits".to_owned());
    }
    let wrong = limits.iter().chain(table_2).find(|limit| {
        let v1::LimitResult { value, minimum, maximum, passed, .. } = limit;
        // What breaks at a limit may be outside in the moment it reaches it.
        let inside =
            if *passed { minimum <= value && value <= maximum } else { minimum < value && value < maximum };
        ![value, minimum, maximum].into_iter().all(|number| number.is_finite()) || inside != *passed
    });
    if let Some(v1::LimitResult { name, value, minimum, maximum, passed, .. }) = wrong {
        let said = if *passed { "inside" } else { "outside" };
        return Some(format!("{name} {value:?} is said to be {said} {minimum:?} to {maximum:?}"));
    }
    let kept = limits.iter().all(|limit| limit.passed);
    (*landed != kept).then(|| {
        let [landed, kept] =
            [(*landed, "landed", "not landed"), (kept, "every limit was kept", "a limit was broken")]
                .map(|(holds, yes, no)| if holds { yes } else { no });
        format!("it says {landed}, and {kept}")
    })
}

impl Verdicts {
    /// Notes a record, and the message of the vehicle in it ([`heard_message`]).
    pub(crate) fn note(&mut self, stamped: &StampedEntry, message: Option<&MavMessage>) {
        match &stamped.entry {
            Entry::Verdict(verdict) => self.recorded = Some((**verdict).clone()),
            Entry::ComputerFrame(_) => self.has_frames = true,
            Entry::RawFrame if !self.has_frames => {
                if let Some(message) = message {
                    self.heard.take(message);
                }
            }
            _ => {}
        }
    }

    /// The vehicle's own verdict; without its frames, the one that was heard.
    pub(crate) fn found(&self) -> Option<Found> {
        let heard = || self.heard.verdict().map(|verdict| Found { verdict, heard: true });
        let recorded = || self.recorded.clone().map(|verdict| Found { verdict, heard: false });
        if self.has_frames { recorded() } else { heard().or_else(recorded) }
    }
}

/// The message of a raw frame that a ground station has received, decoded once for everybody who wants it.
pub(crate) fn heard_message(channel: Option<&LogChannel>, stamped: &StampedEntry) -> Option<MavMessage> {
    let heard = stamped.entry == Entry::RawFrame && heard_by_ground(channel);
    if heard { frame_of(&stamped.data)?.decode().ok() } else { None }
}

/// Whether a ground station received the frames of a channel.
fn heard_by_ground(channel: Option<&LogChannel>) -> bool {
    channel.is_some_and(|channel| {
        channel.topic == TOPIC_RAW_RX
            && channel.metadata.get("endpoint").is_some_and(|endpoint| endpoint == "ground")
    })
}

/// A raw frame, if its checksum is right and the dialect has its message.
pub(crate) fn frame_of(bytes: &[u8]) -> Option<Frame> {
    let mut framer = Framer::new();
    framer.push_datagram(bytes);
    framer.next_frame()
}
