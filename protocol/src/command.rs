//! Commands: reading a request off the wire, answering it, and the sender's side with its retries.
//!
//! Protocol: <https://mavlink.io/en/services/command.html>. Requests and answers are kept as numbers
//! rather than as the dialect's enums, because a command that the dialect does not know must still be
//! answered UNSUPPORTED.

use std::time::Duration;

use crate::dialect::{COMMAND_LONG_DATA, MavCmd, MavMessage, MavResult};
use crate::frame::{Encoder, Frame};
use crate::identity::Address;

const COMMAND_INT_ID: u32 = 75;
const COMMAND_LONG_ID: u32 = 76;
const COMMAND_ACK_ID: u32 = 77;

/// A command as received, from COMMAND_LONG or COMMAND_INT.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommandRequest {
    /// Who asks.
    pub source: Address,
    /// Who is asked; 0 means all.
    pub target: Address,
    /// MAV_CMD number, perhaps unknown.
    pub command: u16,
    /// Parameters 1 to 7; unused ones may be NaN. COMMAND_INT's integers are converted.
    pub params: [f32; 7],
    /// Resends counted by the sender.
    pub confirmation: u8,
}

impl CommandRequest {
    /// The request in a COMMAND_LONG or COMMAND_INT frame; `None` for any other message.
    pub fn from_frame(frame: &Frame) -> Option<Self> {
        let payload = frame.padded_payload();
        let float =
            |at: usize| f32::from_le_bytes([payload[at], payload[at + 1], payload[at + 2], payload[at + 3]]);
        let integer = |at: usize| {
            i32::from_le_bytes([payload[at], payload[at + 1], payload[at + 2], payload[at + 3]]) as f32
        };
        let (params, confirmation) = match frame.message_id() {
            COMMAND_LONG_ID => {
                ([float(0), float(4), float(8), float(12), float(16), float(20), float(24)], payload[32])
            }
            COMMAND_INT_ID => {
                ([float(0), float(4), float(8), float(12), integer(16), integer(20), float(24)], 0)
            }
            _ => return None,
        };
        Some(Self {
            source: frame.source(),
            target: Address { system_id: payload[30], component_id: payload[31] },
            command: u16::from_le_bytes([payload[28], payload[29]]),
            params,
            confirmation,
        })
    }

    /// The MAV_CMD, if it is this one.
    pub fn is(&self, command: MavCmd) -> bool {
        self.command == command as u16
    }
}

/// An answer to a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CommandAnswer {
    /// MAV_CMD number as asked.
    pub command: u16,
    /// MAV_RESULT number.
    pub result: u8,
    /// Percent done while the result is MAV_RESULT_IN_PROGRESS; 255 unknown.
    pub progress: u8,
    /// Whom the answer is for.
    pub target: Address,
}

impl CommandAnswer {
    /// The answer to `request`.
    pub fn to(request: &CommandRequest, result: MavResult) -> Self {
        Self { command: request.command, result: result as u8, progress: 0, target: request.source }
    }

    /// The COMMAND_ACK frame.
    pub fn encode(&self, encoder: &mut Encoder) -> Option<Frame> {
        let command = self.command.to_le_bytes();
        let payload = [
            command[0],
            command[1],
            self.result,
            self.progress,
            0,
            0,
            0,
            0,
            self.target.system_id,
            self.target.component_id,
        ];
        encoder.encode_payload(COMMAND_ACK_ID, &payload)
    }

    /// The answer in a COMMAND_ACK frame; `None` for any other message.
    pub fn from_frame(frame: &Frame) -> Option<Self> {
        if frame.message_id() != COMMAND_ACK_ID {
            return None;
        }
        let payload = frame.padded_payload();
        Some(Self {
            command: u16::from_le_bytes([payload[0], payload[1]]),
            result: payload[2],
            progress: payload[3],
            target: Address { system_id: payload[8], component_id: payload[9] },
        })
    }

    /// The result in an operator's words.
    pub fn result_words(&self) -> &'static str {
        result_words(self.result)
    }
}

/// A MAV_RESULT number in an operator's words.
pub fn result_words(result: u8) -> &'static str {
    match result {
        0 => "accepted",
        1 => "temporarily rejected",
        2 => "denied",
        3 => "unsupported",
        4 => "failed",
        5 => "in progress",
        6 => "cancelled",
        _ => "answered with an unknown result",
    }
}

/// How often an unanswered command is sent again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resend {
    /// Once. For arming: a late duplicate must never arm a vehicle that the crew believes safe.
    Never,
    /// This many further times.
    Times(u8),
    /// Until answered. For aborting.
    UntilAnswered,
}

/// What became of a command. Acknowledged is not observed: the vehicle's own state says that.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandEvent {
    /// Sent for the n-th time (from 1).
    Sent {
        /// MAV_CMD number.
        command: u16,
        /// Which attempt.
        attempt: u32,
    },
    /// Answered: it is being done.
    InProgress {
        /// MAV_CMD number.
        command: u16,
        /// Percent done; 255 unknown.
        progress: u8,
    },
    /// Answered for good.
    Answered {
        /// MAV_CMD number.
        command: u16,
        /// MAV_RESULT number.
        result: u8,
    },
    /// Answered for good, but no longer waited for: given up, or replaced by another of its number.
    AnsweredLate {
        /// MAV_CMD number.
        command: u16,
        /// MAV_RESULT number.
        result: u8,
        /// Which one, as [`CommandSender::submit`] named it.
        ticket: Ticket,
    },
    /// Given up without an answer.
    TimedOut {
        /// MAV_CMD number.
        command: u16,
        /// How often it was sent.
        attempts: u32,
    },
}

/// Wait for an answer before sending again.
pub const ANSWER_TIMEOUT: Duration = Duration::from_millis(500);
/// Wait after an answer "in progress".
pub const PROGRESS_TIMEOUT: Duration = Duration::from_secs(3);
/// The answer to a command that was sent once may still be on its way for this long.
pub const LATE_ANSWER_WITHIN: Duration = Duration::from_secs(10);

/// One submission, told apart from others of the same number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ticket(u64);

/// An answer that may still come for a command that nobody waits for any more.
#[derive(Debug)]
struct Late {
    command: MavCmd,
    ticket: Ticket,
    until: Duration,
}

#[derive(Debug)]
struct Pending {
    ticket: Ticket,
    message: COMMAND_LONG_DATA,
    resend: Resend,
    attempts: u32,
    due_at: Duration,
    in_progress: bool,
}

impl Pending {
    /// The answer that is still to come when this is waited for no longer. Only of a command that is
    /// sent once is it known how many answers are outstanding.
    fn into_late(self, now: Duration) -> Option<Late> {
        let outstanding = self.resend == Resend::Never && self.attempts > 0;
        let late =
            Late { command: self.message.command, ticket: self.ticket, until: now + LATE_ANSWER_WITHIN };
        outstanding.then_some(late)
    }
}

/// The sender's side of the command protocol, without I/O: [`CommandSender::poll`] says what to send.
///
/// An answer names its command by number alone, and arming and disarming share one. So the late answer
/// to an arming is waited for even after a disarming has replaced it, and is never taken for the
/// disarming's own. If it was lost instead, the disarming is sent once more than needed.
#[derive(Debug, Default)]
pub struct CommandSender {
    pending: Vec<Pending>,
    late: Vec<Late>,
    events: Vec<CommandEvent>,
    submitted: u64,
}

impl CommandSender {
    /// No command under way.
    pub fn new() -> Self {
        Self::default()
    }

    /// Queues a command. One of the same number that is still under way is replaced.
    pub fn submit(
        &mut self,
        target: Address,
        command: MavCmd,
        params: [f32; 7],
        resend: Resend,
        now: Duration,
    ) -> Ticket {
        self.withdraw(now, |pending| pending.message.command == command);
        let message = COMMAND_LONG_DATA {
            param1: params[0],
            param2: params[1],
            param3: params[2],
            param4: params[3],
            param5: params[4],
            param6: params[5],
            param7: params[6],
            command,
            target_system: target.system_id,
            target_component: target.component_id,
            confirmation: 0,
        };
        self.submitted += 1;
        let ticket = Ticket(self.submitted);
        self.pending.push(Pending { ticket, message, resend, attempts: 0, due_at: now, in_progress: false });
        ticket
    }

    /// Stops sending whatever is under way. What was sent is sent: its answers may still come.
    pub fn withdraw_all(&mut self, now: Duration) {
        self.withdraw(now, |_| true);
    }

    fn withdraw(&mut self, now: Duration, which: impl Fn(&Pending) -> bool) {
        self.late.retain(|late| now < late.until);
        let withdrawn = self.pending.extract_if(.., |pending| which(pending));
        self.late.extend(withdrawn.filter_map(|pending| pending.into_late(now)));
    }

    /// What is to be sent now; call it a few times a second.
    pub fn poll(&mut self, now: Duration) -> Vec<MavMessage> {
        let mut messages = Vec::new();
        let events = &mut self.events;
        let given_up = self.pending.extract_if(.., |pending| {
            if now < pending.due_at {
                return false;
            }
            let may_send = !pending.in_progress
                && match pending.resend {
                    Resend::Never => pending.attempts == 0,
                    Resend::Times(times) => pending.attempts <= u32::from(times),
                    Resend::UntilAnswered => true,
                };
            let command = pending.message.command as u16;
            if !may_send {
                events.push(CommandEvent::TimedOut { command, attempts: pending.attempts });
                return true;
            }
            pending.message.confirmation = u8::try_from(pending.attempts).unwrap_or(u8::MAX);
            pending.attempts += 1;
            pending.due_at = now + ANSWER_TIMEOUT;
            events.push(CommandEvent::Sent { command, attempt: pending.attempts });
            messages.push(MavMessage::COMMAND_LONG(pending.message.clone()));
            false
        });
        self.late.extend(given_up.filter_map(|pending| pending.into_late(now)));
        self.late.retain(|late| now < late.until);
        messages
    }

    /// Takes note of an answer. Returns whether any command could still be answered by it.
    pub fn on_answer(&mut self, answer: &CommandAnswer, now: Duration) -> bool {
        let final_answer = answer.result != MavResult::MAV_RESULT_IN_PROGRESS as u8;
        let waiting = self.pending.iter().position(|p| p.message.command as u16 == answer.command);
        // Answers come in the order of their commands. A second arming is the same question again: the
        // first answer to come is its answer, too.
        let repeats = waiting.is_some_and(|index| self.pending[index].resend == Resend::Never);
        let late = self
            .late
            .iter()
            .position(|late| late.command as u16 == answer.command && now < late.until && !repeats);
        if let Some(index) = late {
            if final_answer {
                let Late { ticket, .. } = self.late.remove(index);
                let (command, result) = (answer.command, answer.result);
                self.events.push(CommandEvent::AnsweredLate { command, result, ticket });
            }
            return true;
        }
        let Some(index) = waiting else { return false };
        if final_answer {
            self.pending.remove(index);
            self.events.push(CommandEvent::Answered { command: answer.command, result: answer.result });
        } else {
            self.pending[index].in_progress = true;
            self.pending[index].due_at = now + PROGRESS_TIMEOUT;
            self.events.push(CommandEvent::InProgress { command: answer.command, progress: answer.progress });
        }
        true
    }

    /// Whether this command still waits for its answer.
    pub fn is_pending(&self, command: MavCmd) -> bool {
        self.pending.iter().any(|pending| pending.message.command == command)
    }

    /// What happened since the last call.
    pub fn take_events(&mut self) -> Vec<CommandEvent> {
        std::mem::take(&mut self.events)
    }
}
