//! The landing verdict of a log: recorded by the vehicle, or received by a ground station.

use flight::rules::verdict::{
    FlightEnding, Landing, LandingVerdict, Limits, Touchdown, UNDER_PARACHUTE, share_of_limit,
};
use protocol::dialect::{
    MavMessage, TD_LANDING_VERDICT_DATA, TD_TOUCHDOWN_LIMITS_DATA, TdInterlock, TdLanding, TdPhase,
};
use protocol::frame::{Frame, Framer};
use protocol::log::reader::LogChannel;
use protocol::log::record::TOPIC_RAW_RX;
use protocol::log::v1::{self, LimitResult};
use sim::wire::record::limits_to_log;

use serde::Serialize;

use super::{Clock, ClockTime, Entry, StampedEntry};

/// A value of the verdict whose limit no message has given.
const UNREPORTED: f64 = f64::NAN;

/// The landing verdict, as recorded or received.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    pub landing: Landing,
    /// How the flight ended, in one sentence.
    pub ending: String,
    /// Time of contact, s.
    pub time_s: f64,
    /// What the time counts from: T+0, or power-up if a ground station received the verdict.
    pub clock: Clock,
    /// At contact, by the design envelope of the legs.
    pub envelope: Vec<LimitResult>,
    /// What legs that can give way have borne, and what else went wrong; a ground station receives
    /// nothing of it.
    pub borne: Vec<LimitResult>,
    /// At contact, by the landing paper's Table 2; a ground station receives no limits of it.
    pub table_2: Vec<LimitResult>,
}

/// The value over its limit ([`share_of_limit`]).
pub fn share(limit: &LimitResult) -> f64 {
    share_of_limit(limit.value, limit.minimum, limit.maximum)
}

/// Limits with their shares, the worst first.
pub fn worst_first<'a>(limits: impl Iterator<Item = &'a LimitResult>) -> Vec<(&'a LimitResult, f64)> {
    let mut sorted: Vec<(&LimitResult, f64)> = limits.map(|limit| (limit, share(limit))).collect();
    sorted.sort_by(|a, b| b.1.total_cmp(&a.1));
    sorted
}

impl Verdict {
    /// A recorded verdict.
    pub fn of(verdict: &v1::LandingVerdict) -> Self {
        Self {
            landing: landing_of(verdict.landing),
            ending: verdict.ending.clone().unwrap_or_default(),
            time_s: verdict.time_s,
            clock: Clock::Flight,
            envelope: verdict.envelope.clone(),
            borne: verdict.borne.clone(),
            table_2: verdict.table_2.clone(),
        }
    }

    /// The limits that decide whether it stands undamaged: of legs that can give way what they
    /// bore, else their envelope.
    pub fn deciding(&self) -> impl Iterator<Item = &LimitResult> {
        let give_way = self.borne.iter().any(|limit| limit.maximum > limit.minimum);
        self.envelope.iter().filter(move |_| !give_way).chain(&self.borne)
    }

    /// The limits of the legs at contact, and what they bore then.
    pub(crate) fn of_the_legs(&self) -> impl Iterator<Item = &LimitResult> {
        self.envelope.iter().chain(&self.borne)
    }

    /// Its time of contact with its clock.
    pub fn contact(&self) -> ClockTime {
        ClockTime { clock: self.clock, time_s: self.time_s }
    }
}

/// Collects the verdict while a log is read.
#[derive(Debug, Default)]
pub(crate) struct Verdicts {
    recorded: Option<Verdict>,
    has_frames: bool,
    /// Messages received from the vehicle: its limits, its verdict, and whether it had aborted or
    /// was under its parachute.
    limits: Option<TD_TOUCHDOWN_LIMITS_DATA>,
    received: Option<TD_LANDING_VERDICT_DATA>,
    aborted: bool,
    under_parachute: bool,
}

impl Verdicts {
    /// Notes a record, and the message of the vehicle in it ([`received_message`]).
    pub(crate) fn note(&mut self, stamped: &StampedEntry, message: Option<&MavMessage>) {
        match &stamped.entry {
            Entry::Verdict(verdict) => self.recorded = Some(Verdict::of(verdict)),
            Entry::ComputerFrame(_) => self.has_frames = true,
            Entry::RawFrame if !self.has_frames => self.note_message(message),
            _ => {}
        }
    }

    fn note_message(&mut self, message: Option<&MavMessage>) {
        match message {
            Some(MavMessage::TD_TOUCHDOWN_LIMITS(limits)) => self.limits = Some(limits.clone()),
            Some(MavMessage::TD_LANDING_VERDICT(verdict)) => {
                self.received.get_or_insert_with(|| verdict.clone());
            }
            Some(MavMessage::TD_FLIGHT_STATUS(status)) => {
                self.aborted |= status.interlocks.contains(TdInterlock::TD_INTERLOCK_ABORT_LATCHED);
                self.under_parachute |= status.phase == TdPhase::TD_PHASE_CHUTE;
            }
            _ => {}
        }
    }

    /// The vehicle's own verdict; without its frames, the one that was received.
    pub(crate) fn found(&self) -> Option<Verdict> {
        self.received().filter(|_| !self.has_frames).or_else(|| self.recorded.clone())
    }

    fn received(&self) -> Option<Verdict> {
        let verdict = self.received.as_ref()?;
        let reported = |limit: fn(&TD_TOUCHDOWN_LIMITS_DATA) -> f32| {
            self.limits.as_ref().map_or(UNREPORTED, |limits| f64::from(limit(limits)))
        };
        let limits = Limits {
            distance_m: f64::INFINITY,
            height_m: f64::INFINITY,
            vertical_m_s: reported(|l| l.vertical_m_s),
            lateral_m_s: reported(|l| l.lateral_m_s),
            tilt_rad: reported(|l| l.tilt_rad),
            rate_rad_s: reported(|l| l.rate_rad_s),
        };
        let at = Touchdown {
            distance_m: verdict.distance_m.into(),
            height_m: 0.0,
            vertical_m_s: verdict.vertical_m_s.into(),
            lateral_m_s: verdict.lateral_m_s.into(),
            tilt_rad: verdict.tilt_rad.into(),
            rate_rad_s: verdict.rate_rad_s.into(),
        };
        let mut envelope = LandingVerdict::judge(&limits, &at);
        for (place, limit) in envelope.results.iter_mut().enumerate() {
            limit.passed = verdict.limits_violated.bits() & (1 << place) == 0;
        }
        let landing = Landing {
            stands: verdict.landing.contains(TdLanding::TD_LANDING_STANDS),
            upright: verdict.landing.contains(TdLanding::TD_LANDING_UPRIGHT),
            envelope: verdict.landing.contains(TdLanding::TD_LANDING_ENVELOPE),
            table_2: verdict.landing.contains(TdLanding::TD_LANDING_TABLE_2),
        };
        let broken = envelope.worst().map(|limit| limit.name);
        let failure = if self.under_parachute { Some(UNDER_PARACHUTE) } else { broken };
        let ending = FlightEnding { aborted: self.aborted, landing, failure };
        Some(Verdict {
            landing,
            ending: ending.to_string(),
            time_s: f64::from(verdict.contact_ms) / 1e3,
            clock: Clock::Boot,
            envelope: limits_to_log(&envelope),
            borne: Vec::new(),
            table_2: Vec::new(),
        })
    }
}

fn landing_of(recorded: v1::Landing) -> Landing {
    let v1::Landing { stands, upright, envelope, table_2 } = recorded;
    Landing { stands, upright, envelope, table_2 }
}

/// Returns how a recorded verdict contradicts its limits.
pub(super) fn contradiction(verdict: &v1::LandingVerdict) -> Option<String> {
    let v1::LandingVerdict { time_s, landing, envelope, borne, table_2, ending: _ } = verdict;
    if !time_s.is_finite() {
        return Some("its time is no number".to_owned());
    }
    if envelope.is_empty() || table_2.is_empty() {
        return Some("it has no limits".to_owned());
    }
    let wrong = envelope.iter().chain(borne).chain(table_2).find(|limit| {
        let LimitResult { value, minimum, maximum, passed, .. } = limit;
        // What breaks at a limit may be outside in the moment it reaches it.
        let inside =
            if *passed { minimum <= value && value <= maximum } else { minimum < value && value < maximum };
        ![value, minimum, maximum].into_iter().all(|number| number.is_finite()) || inside != *passed
    });
    if let Some(LimitResult { name, value, minimum, maximum, passed, .. }) = wrong {
        let side = if *passed { "inside" } else { "outside" };
        return Some(format!("{name} {value:?} is said to be {side} {minimum:?} to {maximum:?}"));
    }
    let all_passed = |limits: &[LimitResult]| limits.iter().all(|limit| limit.passed);
    // Legs that cannot give way have no recorded load: their envelope decides.
    let sound = all_passed(borne) && (!borne.is_empty() || landing.envelope);
    let computed = [sound && landing.upright, landing.upright, all_passed(envelope), all_passed(table_2)];
    let recorded = landing_of(*landing).flags();
    let place = (0..4).find(|place| computed[*place] != recorded[*place])?;
    let is_not = if recorded[place] { "it says" } else { "it does not say" };
    Some(format!("{is_not} `{}`, against its limits", Landing::WORDS[place]))
}

/// The message of a raw frame that a ground station has received.
pub(crate) fn received_message(channel: Option<&LogChannel>, stamped: &StampedEntry) -> Option<MavMessage> {
    let is_received = stamped.entry == Entry::RawFrame && channel.is_some_and(|it| is_received(it, "ground"));
    if is_received { frame_of(&stamped.data)?.decode().ok() } else { None }
}

/// Whether an endpoint, `ground` or `vehicle`, received the frames of a channel.
pub(crate) fn is_received(channel: &LogChannel, by: &str) -> bool {
    channel.topic == TOPIC_RAW_RX && channel.metadata.get("endpoint").is_some_and(|endpoint| endpoint == by)
}

/// A raw frame, if its checksum is right and the dialect has its message.
pub(crate) fn frame_of(bytes: &[u8]) -> Option<Frame> {
    let mut framer = Framer::new();
    framer.push_datagram(bytes);
    framer.next_frame()
}
