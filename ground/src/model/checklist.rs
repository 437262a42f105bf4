//! The checklist of a mission: its steps, who signs each, and what has been signed.
//!
//! The station keeps it; every screen of the station shows the same. The vehicle is not armed from here before every
//! step is done.

use std::time::Duration;

use protocol::dialect::TdRole;

use super::Model;
use super::quantity::Quantity;
use super::vehicle::is_flight;

/// The most steps of a checklist.
pub const STEPS_MAX: usize = 40;
/// The longest text of a step, in characters.
pub const WORDS_MAX: usize = 60;

/// The steps of one mission and how far they are done.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Checklist {
    pub name: String,
    /// The name of the only mission that it is for, as the vehicle tells it; `None` for any.
    pub mission: Option<String>,
    /// The first sixteen hexadecimal digits of the SHA-256 of its text. Signatures count for this text only.
    pub hash: String,
    pub steps: Vec<Step>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// What is to be done or seen.
    pub words: String,
    /// The role that signs; `None` for anybody who may command.
    pub role: Option<TdRole>,
    /// A value of the vehicle that must keep its limits, when the step is signed and as long as it counts.
    pub value: Option<Limits>,
    pub mark: Mark,
}

/// A value that the vehicle sends, and what it must keep.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    pub quantity: &'static Quantity,
    pub least: Option<f64>,
    pub most: Option<f64>,
}

impl Limits {
    pub fn hold(&self, value: f64) -> bool {
        self.least.is_none_or(|least| value >= least) && self.most.is_none_or(|most| value <= most)
    }

    /// As in `7.4 to 8.5 V`.
    pub fn words(&self) -> String {
        let unit = self.quantity.unit;
        match (self.least, self.most) {
            (Some(least), Some(most)) => format!("{least} to {most} {unit}"),
            (Some(least), None) => format!("at least {least} {unit}"),
            (None, Some(most)) => format!("at most {most} {unit}"),
            (None, None) => "any value".to_owned(),
        }
    }
}

/// What has become of a step.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum Mark {
    #[default]
    Open,
    Signed(Signature),
    /// The signature was taken back: the step must be signed again.
    Voided(Signature),
}

/// Who signed or voided a step, and when.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Signature {
    pub by: String,
    /// The signer's role in the crew; `None` without a crew.
    pub role: Option<TdRole>,
    /// Seconds since 1970, UTC.
    pub unix_s: u64,
    /// The value found at that moment.
    pub found: Option<f64>,
}

/// Whether a step counts now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepState {
    Open,
    Done,
    Voided,
    /// Signed, but the value has left its limits since.
    Outside,
    /// Signed, but the value is no longer received.
    Unknown,
}

/// A change of a checklist, for the file that keeps it.
#[derive(Debug, Clone, PartialEq)]
pub enum ChecklistEntry {
    Signed {
        step: usize,
        signature: Signature,
    },
    Voided {
        step: usize,
        signature: Signature,
    },
    /// The vehicle has left the pad: every step is open for the next flight.
    Flown {
        unix_s: u64,
    },
}

impl Checklist {
    /// Applies a change. Returns false if there is no such step.
    pub fn apply(&mut self, entry: &ChecklistEntry) -> bool {
        match entry {
            ChecklistEntry::Signed { step, signature } => self.mark(*step, Mark::Signed(signature.clone())),
            ChecklistEntry::Voided { step, signature } => self.mark(*step, Mark::Voided(signature.clone())),
            ChecklistEntry::Flown { .. } => {
                for step in &mut self.steps {
                    step.mark = Mark::Open;
                }
                true
            }
        }
    }

    fn mark(&mut self, step: usize, mark: Mark) -> bool {
        self.steps.get_mut(step).map(|step| step.mark = mark).is_some()
    }

    pub fn is_touched(&self) -> bool {
        self.steps.iter().any(|step| step.mark != Mark::Open)
    }
}

impl Model {
    /// Whether a step counts now.
    pub fn step_state(&self, step: &Step, now: Duration) -> StepState {
        match (&step.mark, &step.value) {
            (Mark::Open, _) => StepState::Open,
            (Mark::Voided(_), _) => StepState::Voided,
            (Mark::Signed(_), None) => StepState::Done,
            (Mark::Signed(_), Some(limits)) => match self.fresh(limits, now) {
                None => StepState::Unknown,
                Some(value) if limits.hold(value) => StepState::Done,
                Some(_) => StepState::Outside,
            },
        }
    }

    /// The value of a step, if it is still received.
    pub fn fresh(&self, limits: &Limits, now: Duration) -> Option<f64> {
        let sample = limits.quantity.read(self, now).filter(|sample| !sample.is_stale(now));
        sample.map(|sample| sample.value)
    }

    /// How many steps of the checklist are done, and of how many; `None` without a checklist.
    pub fn steps_done(&self, now: Duration) -> Option<(usize, usize)> {
        let checklist = self.checklist.as_ref()?;
        let done =
            checklist.steps.iter().filter(|step| self.step_state(step, now) == StepState::Done).count();
        Some((done, checklist.steps.len()))
    }

    /// The first step that does not count yet.
    pub fn first_open_step(&self, now: Duration) -> Option<usize> {
        let steps = &self.checklist.as_ref()?.steps;
        steps.iter().position(|step| self.step_state(step, now) != StepState::Done)
    }

    /// The step that the crew has chosen, otherwise the first that does not count yet.
    pub fn chosen_step(&self, now: Duration) -> Option<usize> {
        let count = self.checklist.as_ref()?.steps.len();
        let last = count.checked_sub(1)?;
        Some(self.pages.step.or_else(|| self.first_open_step(now)).unwrap_or(last).min(last))
    }

    /// Why the checklist is not done; `None` if it is, and without one.
    pub fn why_checklist(&self, now: Duration) -> Option<String> {
        let checklist = self.checklist.as_ref()?;
        if let Some(mission) = &checklist.mission {
            match &self.vehicle.mission {
                Some((_, flies)) if flies == mission => {}
                Some((_, flies)) => {
                    return Some(format!("the checklist is for {mission}, the vehicle flies {flies}"));
                }
                None => {
                    return Some(format!("the vehicle has not said whether it flies {mission} (checklist)"));
                }
            }
        }
        let first = self.first_open_step(now)?;
        let (done, all) = self.steps_done(now)?;
        let step = &checklist.steps[first];
        let state = match self.step_state(step, now) {
            StepState::Open | StepState::Done => "is open",
            StepState::Voided => "is void",
            StepState::Outside => "is outside its limits",
            StepState::Unknown => "has no value",
        };
        Some(format!("checklist {done} of {all}: step {} {state}: {}", first + 1, step.words))
    }

    /// Why this person may not sign or void steps now; the role of whoever may, if there is a crew.
    ///
    /// # Errors
    /// The reason.
    pub fn may_sign(&self, by: &str) -> Result<Option<TdRole>, String> {
        if self.vehicle.armed().is_some_and(|armed| armed.value) {
            return Err("the vehicle is armed: disarm first".to_owned());
        }
        if self.vehicle.phase().is_some_and(|phase| is_flight(phase.value)) {
            return Err("the vehicle is in flight".to_owned());
        }
        if self.settings.crew_roles.is_empty() {
            return Ok(None);
        }
        match self.settings.crew_roles.iter().find(|(name, _)| name == by) {
            None if by.is_empty() => Err("nobody is named (--operator)".to_owned()),
            None => Err(format!("{by} is not in the crew (--operator)")),
            Some((_, TdRole::TD_ROLE_OBSERVER)) => Err(format!("{by} is an observer")),
            Some((_, role)) => Ok(Some(*role)),
        }
    }
}
