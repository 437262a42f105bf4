//! How a flight ended, judged by the landing paper's Table 2 and by its legs: by their limits at contact, or, where they can give
//! way, by whether the vehicle stands undamaged.

use crate::world::{Rest, RestOutcome, Strain, Touchdown};
use flight::rules::phase::Phase;
use flight::vehicle::mission::Mission;

use crate::ending::{FlightEnding, UNDER_PARACHUTE};

/// Why a flight did not land: the first thing that went wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Failure {
    /// The ignition gate never opened.
    NoIgnition,
    /// The motor was commanded to light and did not light in time.
    NoLight,
    /// The vehicle came down under the parachute.
    Parachute,
    /// The vertical speed at contact was too high.
    Vertical,
    /// The horizontal speed at contact was too high.
    Lateral,
    /// The tilt at contact was too large.
    Tilt,
    /// The rotation rate at contact was too high.
    Rate,
    /// The vehicle was within the limits at contact but fell over.
    TippedOver,
    /// Nozzle or body struck the ground, of a vehicle whose legs can give way.
    Struck,
    /// A leg gave way by all of its stroke.
    StrokeUsedUp,
    /// A foot bore more than its leg's strength.
    Overload,
    /// The vehicle had not come to rest when the time limit of a flight ended.
    TimeOut,
    /// The state was not a number.
    NotANumber,
}

impl Failure {
    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoIgnition => "no ignition",
            Self::NoLight => "no light",
            Self::Parachute => UNDER_PARACHUTE,
            Self::Vertical => "vertical speed",
            Self::Lateral => "lateral speed",
            Self::Tilt => "tilt",
            Self::Rate => "rotation rate",
            Self::TippedOver => "tipped over",
            Self::Struck => "body strike",
            Self::StrokeUsedUp => "stroke used up",
            Self::Overload => "leg overloaded",
            Self::TimeOut => "time-out",
            Self::NotANumber => "not a number",
        }
    }

    /// A limit of the legs tells it: at contact, or of what they bear.
    pub const fn is_of_a_limit(self) -> bool {
        matches!(
            self,
            Self::Vertical | Self::Lateral | Self::Tilt | Self::Rate | Self::StrokeUsedUp | Self::Overload
        )
    }
}

/// How a flight ended, judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The first contact.
    pub touchdown: Option<Touchdown>,
    /// How the vehicle came to rest.
    pub rest: Option<Rest>,
    /// Last phase.
    pub phase: Phase,
    /// Inside Table 2 at contact and upright afterwards.
    pub strict: bool,
    /// Within the limits of the legs at contact and upright afterwards; of legs that can give way: it stands undamaged.
    pub legs: bool,
    /// Why it did not land on its legs.
    pub failure: Option<Failure>,
}

impl Outcome {
    /// How it ended, for people; `aborted`: an abort was latched.
    pub fn ending(&self, aborted: bool) -> FlightEnding<'static> {
        FlightEnding {
            aborted,
            landed: self.legs,
            table_2: Some(self.strict),
            failure: self.failure.map(Failure::name),
        }
    }
}

/// How a flight ended before it is judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ending {
    /// The first contact.
    pub touchdown: Option<Touchdown>,
    /// How the vehicle came to rest.
    pub rest: Option<Rest>,
    /// Last phase.
    pub phase: Phase,
    /// The motor was commanded to light.
    pub ignited: bool,
    /// The motor did light.
    pub lit: bool,
    /// The parachute was deployed.
    pub parachute: bool,
    /// Every state was finite.
    pub finite: bool,
}

/// Judges how a flight ended.
pub fn judge(mission: &Mission, ending: &Ending) -> Outcome {
    let upright = ending.rest.is_some_and(|rest| rest.outcome == RestOutcome::Upright);
    let (strict, failure) = match &ending.touchdown {
        _ if !ending.finite => (false, Some(Failure::NotANumber)),
        None => (false, Some(Failure::TimeOut)),
        Some(_) if ending.parachute => (false, Some(Failure::Parachute)),
        Some(_) if !ending.ignited => (false, Some(Failure::NoIgnition)),
        Some(_) if !ending.lit => (false, Some(Failure::NoLight)),
        Some(touchdown) => {
            let damage = match ending.rest {
                Some(Rest { outcome, strain: Some(strain), .. }) => damage(outcome, &strain),
                _ => beyond_limits(mission, touchdown).or((!upright).then_some(Failure::TippedOver)),
            };
            (upright && inside_table_2(mission, touchdown), damage)
        }
    };
    Outcome {
        touchdown: ending.touchdown,
        rest: ending.rest,
        phase: ending.phase,
        strict: strict && failure.is_none(),
        legs: failure.is_none(),
        failure,
    }
}

/// The first limit of the legs that the contact broke.
fn beyond_limits(mission: &Mission, touchdown: &Touchdown) -> Option<Failure> {
    let legs = &mission.leg_limits;
    let too_much = [
        (touchdown.vertical_m_s.abs(), legs.vertical_m_s, Failure::Vertical),
        (touchdown.lateral_m_s, legs.lateral_m_s, Failure::Lateral),
        (touchdown.tilt_rad, legs.tilt_deg.to_radians(), Failure::Tilt),
        (touchdown.rate_rad_s, legs.rate_deg_s.to_radians(), Failure::Rate),
    ];
    let first = too_much.iter().find(|(found, most, _)| found.is_nan() || found > most);
    first.map(|(_, _, failure)| *failure)
}

/// What is broken of a vehicle whose legs can give way.
fn damage(rest: RestOutcome, strain: &Strain) -> Option<Failure> {
    match rest {
        RestOutcome::TippedOver => Some(Failure::TippedOver),
        RestOutcome::BodyStrike => Some(Failure::Struck),
        RestOutcome::Upright if strain.strength_used > 1.0 => Some(Failure::Overload),
        RestOutcome::Upright if strain.stroke_used >= 1.0 => Some(Failure::StrokeUsedUp),
        RestOutcome::Upright => None,
    }
}

/// The landing paper's Table 2, in space: axial and lateral velocity in body axes, and the rate across the axis.
fn inside_table_2(mission: &Mission, touchdown: &Touchdown) -> bool {
    let limits = &mission.touchdown_limits;
    let body = touchdown.state.velocity_in_body_m_s();
    let place = touchdown.state.position_m;
    libm::hypot(place.x, place.y) <= limits.x_m
        && touchdown.tilt_rad <= limits.pitch_error_deg.to_radians()
        && body.x.abs() <= limits.u_m_s
        && libm::hypot(body.y, body.z) <= limits.w_m_s
        && touchdown.cross_rate_rad_s <= limits.pitch_rate_deg_s.to_radians()
}
