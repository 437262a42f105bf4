//! Commands: commanded, acknowledged and observed are three facts and stay apart.

use std::time::Duration;

use protocol::command::{CommandSender, Resend, Ticket};
use protocol::dialect::{MavCmd, MavResult, TdInterlock, TdPhase};

use super::seat::Seat;
use super::vehicle::Vehicle;

/// An accepted command should show in the vehicle's own state within this time: two heartbeats and a bit.
pub const OBSERVE_WITHIN: Duration = Duration::from_millis(2_500);

/// What the crew can ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandKind {
    /// Arm.
    Arm,
    /// Disarm.
    Disarm,
    /// Start the countdown.
    Start,
    /// Abort.
    Abort,
}

impl CommandKind {
    /// The name on screen and in the log.
    pub fn name(self) -> &'static str {
        match self {
            Self::Arm => "ARM",
            Self::Disarm => "DISARM",
            Self::Start => "START",
            Self::Abort => "ABORT",
        }
    }

    /// The command's number and first parameter.
    pub fn wire(self) -> (MavCmd, f32) {
        match self {
            Self::Arm => (MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 1.0),
            Self::Disarm => (MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 0.0),
            Self::Start => (MavCmd::MAV_CMD_MISSION_START, 0.0),
            Self::Abort => (MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, 1.0),
        }
    }

    /// How often it is sent again. An arm never: a late duplicate could arm a vehicle believed safe.
    pub fn resend(self) -> Resend {
        match self {
            Self::Arm => Resend::Never,
            Self::Disarm | Self::Start => Resend::Times(3),
            Self::Abort => Resend::UntilWithdrawn,
        }
    }

    /// Whether the vehicle's own state, received after `since`, shows the command's effect.
    pub fn is_observed(self, vehicle: &Vehicle, since: Duration) -> bool {
        let heartbeat = vehicle.heartbeat.filter(|heartbeat| heartbeat.received_at >= since);
        let status = vehicle.status.as_ref().filter(|status| status.received_at >= since);
        match self {
            Self::Arm => heartbeat.is_some_and(|heartbeat| heartbeat.value.armed),
            Self::Disarm => heartbeat.is_some_and(|heartbeat| !heartbeat.value.armed),
            Self::Start => status.is_some_and(|status| {
                let counting = status.value.countdown_ms != i32::MAX;
                counting || status.value.phase as u32 > TdPhase::TD_PHASE_PAD_ARMED as u32
            }),
            // The latch itself: a stabiliser that flies without an abort shows the same degradation.
            Self::Abort => {
                let latched = TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
                heartbeat.is_some_and(|heartbeat| heartbeat.value.terminated)
                    || status.is_some_and(|status| status.value.interlocks.contains(latched))
            }
        }
    }

    /// Where the effect shows, for "observed".
    pub fn observed_words(self) -> &'static str {
        match self {
            Self::Arm => "HEARTBEAT says armed",
            Self::Disarm => "HEARTBEAT says disarmed",
            Self::Start => "countdown runs",
            Self::Abort => "abort latched",
        }
    }
}

/// Whether the interlocks show an abort, on the pad, in the air or under thrust.
pub fn is_aborted(interlocks: TdInterlock) -> bool {
    interlocks.intersects(TdInterlock::TD_INTERLOCK_ABORT_LATCHED | TdInterlock::TD_INTERLOCK_DEGRADED)
}

/// What came back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acknowledged {
    /// Nothing yet.
    Waiting,
    /// It is being done.
    InProgress,
    /// Answered with this `MAV_RESULT`.
    Answered(u8),
    /// Given up.
    Nothing,
}

/// One command and its three facts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Track {
    /// What was asked.
    pub kind: CommandKind,
    /// Who asked, and from which screen.
    pub by: Seat,
    /// When it was asked.
    pub commanded_at: Duration,
    /// How often it was sent.
    pub attempts: u32,
    /// What came back.
    pub acknowledged: Acknowledged,
    /// When that came.
    pub acknowledged_at: Option<Duration>,
    /// When the vehicle's own state showed it.
    pub observed_at: Option<Duration>,
    pub(crate) ticket: Ticket,
    pub(crate) not_observed_said: bool,
}

impl Track {
    /// Accepted by the vehicle.
    pub fn accepted(&self) -> bool {
        self.acknowledged == Acknowledged::Answered(MavResult::MAV_RESULT_ACCEPTED as u8)
    }

    /// Asked, and neither refused nor given up nor seen to be done.
    pub fn is_on_its_way(&self, now: Duration) -> bool {
        let open = matches!(self.acknowledged, Acknowledged::Waiting | Acknowledged::InProgress);
        self.observed_at.is_none() && (open || (self.accepted() && !self.disagrees(now)))
    }

    /// Accepted, and yet the vehicle's state does not show it.
    pub fn disagrees(&self, now: Duration) -> bool {
        self.accepted()
            && self.observed_at.is_none()
            && self.acknowledged_at.is_some_and(|at| now.saturating_sub(at) >= OBSERVE_WITHIN)
    }
}

/// Every command of the run: the latest of each kind.
#[derive(Debug, Default)]
pub struct Commands {
    pub(crate) sender: CommandSender,
    /// The latest of each kind, in the order they were asked.
    pub tracks: Vec<Track>,
}

impl Commands {
    /// The latest command.
    pub fn latest(&self) -> Option<&Track> {
        self.tracks.last()
    }

    /// The latest command of a kind.
    pub fn of(&self, kind: CommandKind) -> Option<&Track> {
        self.tracks.iter().find(|track| track.kind == kind)
    }

    /// Whether an abort is still being sent.
    pub fn is_aborting(&self) -> bool {
        self.sender.is_pending(CommandKind::Abort.wire().0)
    }

    /// When something is to be sent next.
    pub(crate) fn due_at(&self) -> Option<Duration> {
        self.sender.due_at()
    }
}
