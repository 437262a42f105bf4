//! Whether the vehicle hears this station. Hearing the vehicle does not prove it.

use std::time::Duration;

use protocol::dialect::{TD_UPLINK_DATA, TdFrameRefusal};
use protocol::identity::Address;

use super::link_state::LinkState;

/// How long a proof of the uplink is valid: the vehicle must have heard the station that arms it within this time.
pub const PROVEN_WITHIN: Duration = Duration::from_secs(2);

/// The last frame that the vehicle refused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refused {
    pub why: TdFrameRefusal,
    /// The sender, as given in the frame.
    pub source: Address,
    /// When it arrived at the vehicle.
    pub at: Duration,
    /// How many frames were refused since the vehicle's boot.
    pub count: u16,
}

/// What the vehicle reports about its uplink, and what its answers prove.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Uplink {
    /// When the vehicle last reported about this station.
    told_at: Option<Duration>,
    /// When it last accepted a frame of this station, as it reports.
    accepted_at: Option<Duration>,
    /// When the last TIMESYNC was sent that it has answered: the proof for a vehicle that does not report its uplink.
    answered_at: Option<Duration>,
    /// Whether this station armed the vehicle.
    pub armed_by_us: bool,
    /// The station that armed the vehicle, if it is another. It may have our address.
    pub armed_by_other: Option<Address>,
    /// The session of that station.
    other_session: u32,
    /// Whether this vehicle tells the sessions of its stations.
    pub(crate) tells_sessions: bool,
    /// The last refused frame.
    pub refused: Option<Refused>,
}

impl Uplink {
    /// Takes a report about this station, or about no station because the vehicle has accepted nothing yet.
    pub(crate) fn hear(&mut self, told: &TD_UPLINK_DATA, now: Duration) {
        let ago = |age_ms: u16| {
            (age_ms != u16::MAX).then(|| now.saturating_sub(Duration::from_millis(age_ms.into())))
        };
        self.told_at = Some(now);
        self.accepted_at = ago(told.accepted_age_ms);
        self.armed_by_us = told.commands == 1;
        if self.armed_by_us {
            self.armed_by_other = None;
        }
        self.refused = ago(told.refused_age_ms).map(|at| Refused {
            why: told.refusal,
            source: Address { system_id: told.refused_system, component_id: told.refused_component },
            at,
            count: told.refused_count,
        });
    }

    /// Takes a report about another station.
    pub(crate) fn overhear(&mut self, told: &TD_UPLINK_DATA) {
        let station = Address { system_id: told.target_system, component_id: told.target_component };
        if told.commands == 1 {
            (self.armed_by_other, self.other_session) = (Some(station), told.session);
        } else if self.armed_by_other == Some(station) && self.other_session == told.session {
            self.armed_by_other = None;
        }
    }

    /// A TIMESYNC that was sent at this time was answered.
    pub(crate) fn answered(&mut self, asked_at: Duration) {
        self.answered_at = self.answered_at.max(Some(asked_at));
    }

    /// Whether the vehicle reports its uplink at all.
    pub fn is_told(&self) -> bool {
        self.told_at.is_some()
    }

    /// The state of the uplink: whether the vehicle hears this station.
    pub fn state(&self, now: Duration) -> LinkState {
        LinkState::of(if self.is_told() { self.accepted_at } else { self.answered_at }, now)
    }

    /// Whether it is proven that the vehicle hears this station.
    pub fn is_proven(&self, now: Duration) -> bool {
        match self.state(now) {
            LinkState::Alive(age) | LinkState::Doubtful(age) => age <= PROVEN_WITHIN,
            LinkState::NeverHeard | LinkState::Lost(_) => false,
        }
    }

    /// Why the vehicle does not hear this station, as far as it reports.
    pub fn why_unheard(&self) -> String {
        let Some(refused) = self.refused else { return "it reports no frame".to_owned() };
        let Address { system_id, component_id } = refused.source;
        format!("it refuses frames of {system_id}/{component_id}: {}", refusal(refused.why))
    }
}

pub fn refusal(why: TdFrameRefusal) -> &'static str {
    match why {
        TdFrameRefusal::TD_FRAME_REFUSAL_NONE => "no reason reported",
        TdFrameRefusal::TD_FRAME_REFUSAL_UNSIGNED => "not signed, is the key missing here?",
        TdFrameRefusal::TD_FRAME_REFUSAL_WRONG_KEY => "signed with another key",
        TdFrameRefusal::TD_FRAME_REFUSAL_REPLAYED => "replay of a used time stamp",
        TdFrameRefusal::TD_FRAME_REFUSAL_TOO_OLD => "stamp too old, is the clock here slow?",
        TdFrameRefusal::TD_FRAME_REFUSAL_TOO_NEW => "stamp too far ahead, is the clock here fast?",
    }
}
