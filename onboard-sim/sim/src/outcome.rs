//! How a flight ended, judged.

use crate::world::{FirstContact, Rest, RestOutcome, Strain};
use flight::rules::phase::Phase;
use flight::rules::verdict::{
    FlightEnding, Landing, LandingVerdict, Limits, TABLE_2, Touchdown, UNDER_PARACHUTE,
};
use flight::vehicle::mission::{LegLimits, Mission};

/// Why a vehicle does not stand undamaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Failure {
    /// The ignition gate never opened.
    NoIgnition,
    /// The flight computer took the vehicle for one on its pad.
    LiftOffDenied,
    /// The motor was commanded to light and did not light in time.
    NoLight,
    /// The vehicle came down under the parachute.
    Parachute,
    /// The limit exceeded by the largest share at contact, for legs that cannot crush.
    Limit(&'static str),
    /// The vehicle was within the limits at contact but fell over.
    TippedOver,
    /// Nozzle or body struck the ground, for a vehicle with crushable legs.
    Struck,
    /// A leg has used all of its stroke.
    StrokeUsedUp,
    /// A foot bore more than its leg's strength.
    Overload,
    /// The vehicle had not come to rest when the time limit of a flight ended.
    TimeOut,
    /// The state is NaN.
    NotANumber,
}

impl Failure {
    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoIgnition => "no ignition",
            Self::LiftOffDenied => "lift-off denied",
            Self::NoLight => "no light",
            Self::Parachute => UNDER_PARACHUTE,
            Self::Limit(name) => name,
            Self::TippedOver => "tipped over",
            Self::Struck => "body strike",
            Self::StrokeUsedUp => "stroke used up",
            Self::Overload => "leg overloaded",
            Self::TimeOut => "time-out",
            Self::NotANumber => "not a number",
        }
    }

    /// Whether the failure is of a limit of the legs, at contact or by their loads.
    pub const fn is_of_a_limit(self) -> bool {
        matches!(self, Self::Limit(_) | Self::StrokeUsedUp | Self::Overload)
    }
}

/// How a flight ended, judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The first contact.
    pub touchdown: Option<FirstContact>,
    /// How the vehicle came to rest.
    pub rest: Option<Rest>,
    /// Last phase.
    pub phase: Phase,
    pub landing: Landing,
    /// Why it does not stand undamaged.
    pub failure: Option<Failure>,
}

impl Outcome {
    /// How it ended, for people; `aborted`: an abort was latched.
    pub fn ending(&self, aborted: bool) -> FlightEnding<'static> {
        FlightEnding { aborted, landing: self.landing, failure: self.failure.map(Failure::name) }
    }
}

/// How a flight ended before it is judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ending {
    /// The first contact.
    pub touchdown: Option<FirstContact>,
    /// How the vehicle came to rest.
    pub rest: Option<Rest>,
    /// Last phase.
    pub phase: Phase,
    /// The motor was commanded to light.
    pub ignited: bool,
    /// The motor did light.
    pub motor_started: bool,
    /// The parachute was deployed.
    pub parachute: bool,
    /// Every state was finite.
    pub finite: bool,
}

/// Judges how a flight ended.
pub fn judge(mission: &Mission, ending: &Ending) -> Outcome {
    let upright = ending.rest.is_some_and(|rest| rest.outcome == RestOutcome::Upright);
    let envelope = ending.touchdown.map(|contact| by_envelope(&mission.leg_limits, &contact));
    let failure = match (&envelope, ending.rest) {
        _ if !ending.finite => Some(Failure::NotANumber),
        (None, _) => Some(Failure::TimeOut),
        _ if ending.parachute => Some(Failure::Parachute),
        _ if ending.phase.on_pad() => Some(Failure::LiftOffDenied),
        _ if !ending.ignited => Some(Failure::NoIgnition),
        _ if !ending.motor_started => Some(Failure::NoLight),
        (_, Some(Rest { outcome, strain: Some(strain), .. })) => damage(outcome, &strain),
        (Some(envelope), _) => {
            let broken = envelope.worst().map(|limit| Failure::Limit(limit.name));
            broken.or((!upright).then_some(Failure::TippedOver))
        }
    };
    let landing = Landing {
        stands: failure.is_none(),
        upright,
        envelope: envelope.is_some_and(|envelope| envelope.is_inside()),
        table_2: ending.touchdown.is_some_and(|contact| by_table_2(&contact).is_inside()),
    };
    Outcome { touchdown: ending.touchdown, rest: ending.rest, phase: ending.phase, landing, failure }
}

/// Judges a contact by the design envelope of the legs.
pub fn by_envelope(legs: &LegLimits, contact: &FirstContact) -> LandingVerdict {
    LandingVerdict::judge(&Limits::from(legs), &contact.over_ground)
}

/// Judges a contact by the landing paper's Table 2.
pub fn by_table_2(contact: &FirstContact) -> LandingVerdict {
    LandingVerdict::judge(&TABLE_2, &Touchdown::along_axis(&contact.state, 0.0))
}

/// The damage of a vehicle with crushable legs.
fn damage(rest: RestOutcome, strain: &Strain) -> Option<Failure> {
    match rest {
        RestOutcome::TippedOver => Some(Failure::TippedOver),
        RestOutcome::BodyStrike => Some(Failure::Struck),
        RestOutcome::Upright if strain.strength_used > 1.0 => Some(Failure::Overload),
        RestOutcome::Upright if strain.stroke_used >= 1.0 => Some(Failure::StrokeUsedUp),
        RestOutcome::Upright => None,
    }
}
