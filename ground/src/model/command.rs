//! Commands and their three separate facts: commanded, acknowledged, observed.

use std::time::Duration;

use protocol::command::{CommandSender, Resend, Ticket};
use protocol::dialect::{MavCmd, MavResult, TdInterlock, TdPhase};

use super::seat::Seat;
use super::vehicle::Vehicle;

/// The effect of an accepted command should show in the vehicle's state within this time: a little over two
/// heartbeats.
pub const OBSERVE_WITHIN: Duration = Duration::from_millis(2_500);

/// A command that the crew can give.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandKind {
    Arm,
    Disarm,
    Start,
    Abort,
    /// Confirm what another operator asks.
    ConfirmArm,
    ConfirmStart,
    /// Hold the countdown.
    Hold,
    /// Whoever confirmed the start is still there.
    Tap,
    /// Take command from a station that is silent.
    TakeCommand,
    /// Check the vehicle on its pad; gimbal and fins move.
    Check,
    /// The same without motion.
    CheckStill,
    /// End the running check.
    EndCheck,
}

impl CommandKind {
    pub const ALL: [Self; 12] = [
        Self::Arm,
        Self::Disarm,
        Self::Start,
        Self::Abort,
        Self::ConfirmArm,
        Self::ConfirmStart,
        Self::Hold,
        Self::Tap,
        Self::TakeCommand,
        Self::Check,
        Self::CheckStill,
        Self::EndCheck,
    ];

    /// The name on screens and in the log.
    pub fn name(self) -> &'static str {
        match self {
            Self::Arm => "ARM",
            Self::Disarm => "DISARM",
            Self::Start => "START",
            Self::Abort => "ABORT",
            Self::ConfirmArm => "CONFIRM ARM",
            Self::ConfirmStart => "CONFIRM START",
            Self::Hold => "HOLD",
            Self::Tap => "TAP",
            Self::TakeCommand => "TAKE COMMAND",
            Self::Check => "CHECK",
            Self::CheckStill => "CHECK WITHOUT MOTION",
            Self::EndCheck => "END OF CHECK",
        }
    }

    /// The MAVLink command and its first parameter.
    pub fn mav_command(self) -> (MavCmd, f32) {
        match self {
            Self::Arm | Self::ConfirmArm => (MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 1.0),
            Self::Disarm => (MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 0.0),
            Self::Start | Self::ConfirmStart => (MavCmd::MAV_CMD_MISSION_START, 0.0),
            Self::Hold => (MavCmd::MAV_CMD_DO_PAUSE_CONTINUE, 0.0),
            Self::Tap => (MavCmd::MAV_CMD_TD_TAP, 0.0),
            Self::TakeCommand => (MavCmd::MAV_CMD_TD_TAKE_COMMAND, 0.0),
            Self::EndCheck => (MavCmd::MAV_CMD_TD_PAD_CHECK, 0.0),
            Self::Check => (MavCmd::MAV_CMD_TD_PAD_CHECK, 1.0),
            Self::CheckStill => (MavCmd::MAV_CMD_TD_PAD_CHECK, 2.0),
            Self::Abort => (MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, 1.0),
        }
    }

    /// Whether it can make something move or light: then it names the boot that it is meant for, and is sent only to
    /// the vehicle that is shown.
    pub fn moves(self) -> bool {
        match self {
            Self::Arm
            | Self::ConfirmArm
            | Self::Start
            | Self::ConfirmStart
            | Self::Tap
            | Self::TakeCommand
            | Self::Check
            | Self::CheckStill => true,
            Self::Disarm | Self::Hold | Self::Abort | Self::EndCheck => false,
        }
    }

    /// Whether only the owner of the station's key gives it: everything but what anybody may do to stop something.
    pub fn needs_the_owner(self) -> bool {
        !matches!(self, Self::Hold | Self::Abort | Self::EndCheck)
    }

    /// How often the command is resent. ARM never is: a late duplicate could arm a vehicle believed to be safe. A
    /// confirmation is for one ask, and a tap for one moment. A check is not repeated either: it would move what somebody
    /// has just laid hands on.
    pub fn resend(self) -> Resend {
        match self {
            Self::Arm
            | Self::ConfirmArm
            | Self::ConfirmStart
            | Self::Tap
            | Self::Check
            | Self::CheckStill => Resend::Never,
            Self::Disarm | Self::Start | Self::Hold | Self::TakeCommand | Self::EndCheck => Resend::Times(3),
            Self::Abort => Resend::UntilWithdrawn,
        }
    }

    /// Whether the vehicle's own state, received after `since`, shows the command's effect.
    pub fn is_observed(self, vehicle: &Vehicle, since: Duration) -> bool {
        let heartbeat = vehicle.heartbeat.filter(|heartbeat| heartbeat.received_at >= since);
        let status = vehicle.status.as_ref().filter(|status| status.received_at >= since);
        match self {
            Self::Arm | Self::ConfirmArm => heartbeat.is_some_and(|heartbeat| heartbeat.value.armed),
            Self::Disarm => heartbeat.is_some_and(|heartbeat| !heartbeat.value.armed),
            Self::Start | Self::ConfirmStart => status.is_some_and(|status| {
                let counting = status.value.countdown_ms != i32::MAX;
                counting || status.value.phase as u32 > TdPhase::TD_PHASE_PAD_ARMED as u32
            }),
            Self::Hold => status.is_some_and(|status| status.value.countdown_ms == i32::MAX),
            // The answer is all there is to see.
            Self::Tap | Self::TakeCommand | Self::Check | Self::CheckStill | Self::EndCheck => false,
            // Only the latch counts: the stabiliser may also fly, and show DEGRADED, without an abort.
            Self::Abort => {
                let latched = TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
                heartbeat.is_some_and(|heartbeat| heartbeat.value.terminated)
                    || status.is_some_and(|status| status.value.interlocks.contains(latched))
            }
        }
    }

    /// Whether nothing in the vehicle's own state shows the effect, so that its answer has to do.
    pub fn shows_nothing(self) -> bool {
        matches!(self, Self::Tap | Self::TakeCommand | Self::Check | Self::CheckStill | Self::EndCheck)
    }

    /// What shows the effect, for the event "observed".
    pub fn observed_words(self) -> &'static str {
        match self {
            Self::Arm | Self::ConfirmArm => "HEARTBEAT says armed",
            Self::Disarm => "HEARTBEAT says disarmed",
            Self::Start | Self::ConfirmStart => "countdown runs",
            Self::Hold => "no countdown",
            Self::Tap | Self::TakeCommand | Self::Check | Self::CheckStill | Self::EndCheck => "accepted",
            Self::Abort => "abort latched",
        }
    }
}

/// Whether the interlocks show an abort, on the pad, in the air or under thrust.
pub fn is_aborted(interlocks: TdInterlock) -> bool {
    interlocks.intersects(TdInterlock::TD_INTERLOCK_ABORT_LATCHED | TdInterlock::TD_INTERLOCK_DEGRADED)
}

/// The vehicle's answer to a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acknowledgement {
    Waiting,
    /// The vehicle is executing the command.
    InProgress,
    /// Noted by the vehicle: a second person has to confirm it.
    Asked,
    /// Answered with this `MAV_RESULT`.
    Answered(u8),
    /// No answer came, and none is expected any more.
    GivenUp,
}

/// One command with its three facts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TrackedCommand {
    pub kind: CommandKind,
    /// Who gave the command, and from which screen.
    pub by: Seat,
    /// When it was commanded.
    pub commanded_at: Duration,
    /// How many times it was sent.
    pub attempts: u32,
    /// The vehicle's answer to a command.
    pub acknowledged: Acknowledgement,
    pub acknowledged_at: Option<Duration>,
    /// When the vehicle's own state first showed the effect.
    pub observed_at: Option<Duration>,
    pub(crate) ticket: Ticket,
    pub(crate) not_observed_reported: bool,
}

impl TrackedCommand {
    pub fn accepted(&self) -> bool {
        self.acknowledged == Acknowledgement::Answered(MavResult::MAV_RESULT_ACCEPTED as u8)
    }

    /// Commanded, and neither refused nor given up nor observed.
    pub fn is_on_its_way(&self, now: Duration) -> bool {
        let open = matches!(self.acknowledged, Acknowledgement::Waiting | Acknowledgement::InProgress);
        self.observed_at.is_none() && (open || (self.accepted() && !self.disagrees(now)))
    }

    /// Accepted, but the vehicle's state does not show the effect in time.
    pub fn disagrees(&self, now: Duration) -> bool {
        self.accepted()
            && self.observed_at.is_none()
            && self.acknowledged_at.is_some_and(|at| now.saturating_sub(at) >= OBSERVE_WITHIN)
    }
}

/// The latest command of each kind.
#[derive(Debug, Default)]
pub struct Commands {
    pub(crate) sender: CommandSender,
    /// In the order in which they were given.
    pub tracks: Vec<TrackedCommand>,
}

impl Commands {
    pub fn latest(&self) -> Option<&TrackedCommand> {
        self.tracks.last()
    }

    /// The latest command of a kind.
    pub fn of(&self, kind: CommandKind) -> Option<&TrackedCommand> {
        self.tracks.iter().find(|track| track.kind == kind)
    }

    /// Whether an abort is still being sent.
    pub fn is_aborting(&self) -> bool {
        self.sender.is_pending(CommandKind::Abort.mav_command().0)
    }

    /// When the next command is to be sent or resent.
    pub(crate) fn due_at(&self) -> Option<Duration> {
        self.sender.due_at()
    }
}
