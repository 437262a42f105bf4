//! What has been called out to the crew so far, how much is called out, and the bells that are still to ring.

use std::time::Duration;

use protocol::dialect::TdPhase;

use super::ending::Ending;

/// How much is called out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Amount {
    Nothing,
    /// Liftoff, apogee, ignition, touchdown, verdict, parachute, whether people may approach, NO-GO, link lost.
    Few,
    /// Also every phase and every 50 m.
    #[default]
    Normal,
    /// Also every 10 m below 50 m.
    All,
}

/// How the crew wants to be talked to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Talk {
    pub amount: Amount,
    /// The least time between two heights; other callouts never wait.
    pub height_every: Duration,
    /// Whether a command speaks; without one, bells ring.
    pub has_voice: bool,
}

impl Default for Talk {
    fn default() -> Self {
        Self { amount: Amount::default(), height_every: Duration::from_millis(1_500), has_voice: false }
    }
}

/// What has been called out.
#[derive(Debug, Clone, Copy, Default)]
pub struct Called {
    pub(crate) phase: Option<TdPhase>,
    pub(crate) height_m: Option<f64>,
    pub(crate) height_at: Option<Duration>,
    /// Whether GO was the last that was called out on the pad.
    pub(crate) go: Option<bool>,
    pub(crate) lost: bool,
    pub(crate) ending: Option<Ending>,
    pub(crate) approach: Option<&'static str>,
    pub(crate) bells_left: u8,
}
