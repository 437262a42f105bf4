//! What the vehicle hears of this station. That the vehicle is heard says nothing about it.

use std::time::Duration;

use protocol::dialect::{TD_UPLINK_DATA, TdFrameRefusal};
use protocol::identity::Address;

use super::link::LinkState;

/// An uplink that was not proven for this long is proven no more: the time within which the vehicle wants to have heard the
/// station that arms it.
pub const PROVEN_WITHIN: Duration = Duration::from_secs(2);

/// The last frame that the vehicle did not accept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refused {
    /// Why.
    pub why: TdFrameRefusal,
    /// Whose frame it says it was.
    pub source: Address,
    /// When it came there.
    pub at: Duration,
    /// How many since the vehicle's boot.
    pub count: u16,
}

/// What the vehicle tells of its uplink, and what its answers prove.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Uplink {
    /// When the vehicle last told of this station.
    told_at: Option<Duration>,
    /// When it accepted a frame of this station last, by what it told.
    accepted_at: Option<Duration>,
    /// When the last question was asked that it has answered: proof enough for a vehicle that tells nothing.
    answered_at: Option<Duration>,
    /// This station armed the vehicle.
    pub commands: bool,
    /// Another station did.
    pub other: Option<Address>,
    /// The last frame that was not accepted.
    pub refused: Option<Refused>,
}

impl Uplink {
    /// Takes what the vehicle told of this station, or of nobody because it has accepted nothing yet.
    pub(crate) fn hear(&mut self, told: &TD_UPLINK_DATA, now: Duration) {
        let ago = |age_ms: u16| {
            (age_ms != u16::MAX).then(|| now.saturating_sub(Duration::from_millis(age_ms.into())))
        };
        self.told_at = Some(now);
        self.accepted_at = ago(told.accepted_age_ms);
        self.commands = told.commands == 1;
        if self.commands {
            self.other = None;
        }
        self.refused = ago(told.refused_age_ms).map(|at| Refused {
            why: told.refusal,
            source: Address { system_id: told.refused_system, component_id: told.refused_component },
            at,
            count: told.refused_count,
        });
    }

    /// Takes what the vehicle told another station.
    pub(crate) fn overhear(&mut self, told: &TD_UPLINK_DATA) {
        let station = Address { system_id: told.target_system, component_id: told.target_component };
        if told.commands == 1 {
            self.other = Some(station);
        } else if self.other == Some(station) {
            self.other = None;
        }
    }

    /// A question that was asked then was answered.
    pub(crate) fn answered(&mut self, asked_at: Duration) {
        self.answered_at = self.answered_at.max(Some(asked_at));
    }

    /// Whether the vehicle tells of its uplink at all.
    pub fn is_told(&self) -> bool {
        self.told_at.is_some()
    }

    /// Whether this station is heard: the direction up.
    pub fn state(&self, now: Duration) -> LinkState {
        LinkState::of(if self.is_told() { self.accepted_at } else { self.answered_at }, now)
    }

    /// Whether it is proven that this station is heard.
    pub fn is_proven(&self, now: Duration) -> bool {
        match self.state(now) {
            LinkState::Alive(age) | LinkState::Doubtful(age) => age <= PROVEN_WITHIN,
            LinkState::NeverHeard | LinkState::Lost(_) => false,
        }
    }

    /// Why the vehicle does not hear this station, as far as it says.
    pub fn why_unheard(&self) -> String {
        let Some(refused) = self.refused else { return "it reports no frame of it".to_owned() };
        let Address { system_id, component_id } = refused.source;
        format!("it refuses frames of {system_id}/{component_id}: {}", refusal(refused.why))
    }
}

/// In words for the crew.
pub fn refusal(why: TdFrameRefusal) -> &'static str {
    match why {
        TdFrameRefusal::TD_FRAME_REFUSAL_NONE => "it does not say why",
        TdFrameRefusal::TD_FRAME_REFUSAL_UNSIGNED => "not signed, is the key missing here?",
        TdFrameRefusal::TD_FRAME_REFUSAL_WRONG_KEY => "signed with another key",
        TdFrameRefusal::TD_FRAME_REFUSAL_REPLAYED => "heard before, or its stamp is",
        TdFrameRefusal::TD_FRAME_REFUSAL_TOO_OLD => "stamp too old, is the clock here slow?",
        TdFrameRefusal::TD_FRAME_REFUSAL_TOO_NEW => "stamp too far ahead, is the clock here fast?",
    }
}
