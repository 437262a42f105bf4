//! The sender's side of the command protocol: when to send again, and which answer belongs to what.

use std::time::Duration;

use super::CommandAnswer;
use crate::dialect::{COMMAND_LONG_DATA, MavCmd, MavMessage, MavResult};
use crate::identity::Address;

/// How often an unanswered command is sent again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resend {
    /// Once. For arming: a late duplicate must never arm a vehicle that the crew believes safe.
    Never,
    /// This many further times.
    Times(u8),
    /// Until it is withdrawn, whatever is answered: twenty a second for the first second, then five. For aborting: of
    /// twenty that each have one chance in two, all are lost once in a million times.
    UntilWithdrawn,
}

/// An abort's first second, in which it is sent often.
const HURRIED_FOR: Duration = Duration::from_secs(1);
/// How often it is sent in that second.
const HURRIED_EVERY: Duration = Duration::from_millis(50);
/// How often it is sent after it.
const STEADY_EVERY: Duration = Duration::from_millis(200);

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
    submitted_at: Duration,
    due_at: Duration,
    in_progress: bool,
    /// Of what is sent whatever is answered: the last answer.
    answered: Option<u8>,
}

impl Pending {
    /// When it is due again, once it was sent now.
    fn due_after(&self, now: Duration) -> Duration {
        match self.resend {
            Resend::UntilWithdrawn if now < self.submitted_at + HURRIED_FOR => {
                // From the time that it was due: a clock that looks late now and then makes it no rarer.
                (self.due_at + HURRIED_EVERY).max(now + HURRIED_EVERY / 2)
            }
            Resend::UntilWithdrawn => now + STEADY_EVERY,
            Resend::Never | Resend::Times(_) => now + ANSWER_TIMEOUT,
        }
    }

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
/// What is sent until it is withdrawn may be answered many times; each answer that differs from the one before is told.
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
        self.pending.push(Pending {
            ticket,
            message,
            resend,
            attempts: 0,
            submitted_at: now,
            due_at: now,
            in_progress: false,
            answered: None,
        });
        ticket
    }

    /// Stops sending this one.
    pub fn withdraw_one(&mut self, ticket: Ticket, now: Duration) {
        self.withdraw(now, |pending| pending.ticket == ticket);
    }

    /// When [`CommandSender::poll`] has something to do next; `None` while nothing is under way.
    pub fn due_at(&self) -> Option<Duration> {
        self.pending.iter().map(|pending| pending.due_at).min()
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
            let waits = pending.in_progress && pending.resend != Resend::UntilWithdrawn;
            let may_send = !waits
                && match pending.resend {
                    Resend::Never => pending.attempts == 0,
                    Resend::Times(times) => pending.attempts <= u32::from(times),
                    Resend::UntilWithdrawn => true,
                };
            let command = pending.message.command as u16;
            if !may_send {
                events.push(CommandEvent::TimedOut { command, attempts: pending.attempts });
                return true;
            }
            pending.message.confirmation = u8::try_from(pending.attempts).unwrap_or(u8::MAX);
            pending.attempts += 1;
            pending.due_at = pending.due_after(now);
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
        if self.pending[index].resend == Resend::UntilWithdrawn {
            self.note_answer(index, *answer, final_answer);
        } else if final_answer {
            self.pending.remove(index);
            self.events.push(CommandEvent::Answered { command: answer.command, result: answer.result });
        } else {
            self.pending[index].in_progress = true;
            self.pending[index].due_at = now + PROGRESS_TIMEOUT;
            self.events.push(CommandEvent::InProgress { command: answer.command, progress: answer.progress });
        }
        true
    }

    /// An answer to what goes on being sent: told when it differs from the one before. Once accepted it stays so: the
    /// copies that arrive later find nothing left to do.
    fn note_answer(&mut self, index: usize, answer: CommandAnswer, final_answer: bool) {
        let known = &mut self.pending[index].answered;
        if *known == Some(answer.result) || *known == Some(MavResult::MAV_RESULT_ACCEPTED as u8) {
            return;
        }
        *known = Some(answer.result);
        let CommandAnswer { command, result, progress, .. } = answer;
        self.events.push(if final_answer {
            CommandEvent::Answered { command, result }
        } else {
            CommandEvent::InProgress { command, progress }
        });
    }

    /// Whether this command is still under way.
    pub fn is_pending(&self, command: MavCmd) -> bool {
        self.pending.iter().any(|pending| pending.message.command == command)
    }

    /// What happened since the last call.
    pub fn take_events(&mut self) -> Vec<CommandEvent> {
        std::mem::take(&mut self.events)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identity::{GROUND, VEHICLE};

    const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;

    fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    /// An arming at 0, whose answer does not come, and a disarming at `disarmed_ms`; answers at these times.
    fn events(disarmed_ms: u64, answers_ms: &[u64]) -> Vec<CommandEvent> {
        let answer = CommandAnswer { command: ARM as u16, result: 0, progress: 0, target: GROUND };
        let mut sender = CommandSender::new();
        sender.submit(VEHICLE, ARM, [1.0; 7], Resend::Never, ms(0));
        for now in (0..20_000).step_by(100) {
            if now == disarmed_ms {
                sender.submit(VEHICLE, ARM, [0.0; 7], Resend::Times(3), ms(now));
            }
            sender.poll(ms(now));
            if answers_ms.contains(&now) {
                sender.on_answer(&answer, ms(now));
            }
        }
        let is_answer = |event: &CommandEvent| {
            !matches!(event, CommandEvent::Sent { .. } | CommandEvent::TimedOut { attempts: 1, .. })
        };
        sender.take_events().into_iter().filter(is_answer).collect()
    }

    /// Polled every 10 ms; the times of each sending, ms.
    fn aborts_ms(answered: &[(u64, MavResult)], withdrawn_ms: u64) -> (Vec<u64>, Vec<CommandEvent>) {
        let abort = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION;
        let mut sender = CommandSender::new();
        let ticket = sender.submit(VEHICLE, abort, [1.0; 7], Resend::UntilWithdrawn, ms(0));
        let mut sent = Vec::new();
        for now in (0..3_000).step_by(10) {
            if now == withdrawn_ms {
                sender.withdraw_one(ticket, ms(now));
            }
            sent.extend(sender.poll(ms(now)).iter().map(|_| now));
            for (_, result) in answered.iter().filter(|(at, _)| *at == now) {
                let (command, result) = (abort as u16, *result as u8);
                let answer = CommandAnswer { command, result, progress: 0, target: GROUND };
                assert!(sender.on_answer(&answer, ms(now)) || now >= withdrawn_ms);
            }
        }
        let events = sender.take_events().into_iter();
        (sent, events.filter(|event| !matches!(event, CommandEvent::Sent { .. })).collect())
    }

    #[test]
    fn an_abort_goes_out_twenty_times_in_its_first_second_and_five_times_in_each_after_it() {
        let (sent, events) = aborts_ms(&[], u64::MAX);
        let within = |from, to| sent.iter().filter(|at| (from..to).contains(*at)).count();
        assert_eq!((within(0, 1_000), within(1_000, 2_000), within(2_000, 3_000)), (20, 5, 5), "{sent:?}");
        assert!(events.is_empty());
    }

    #[test]
    fn an_answer_does_not_end_an_abort_and_its_copies_are_told_once() {
        let accepted = MavResult::MAV_RESULT_ACCEPTED;
        let (sent, events) =
            aborts_ms(&[(100, accepted), (150, accepted), (160, MavResult::MAV_RESULT_FAILED)], 500);
        assert_eq!(sent.len(), 10, "{sent:?}");
        let command = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION as u16;
        assert_eq!(events, [CommandEvent::Answered { command, result: 0 }]);
    }

    #[test]
    fn the_answer_to_a_replaced_arming_is_its_own() {
        let (command, result) = (ARM as u16, 0);
        let late = CommandEvent::AnsweredLate { command, result, ticket: Ticket(1) };
        let answered = CommandEvent::Answered { command, result };
        for disarmed_ms in [200, 3_000] {
            let (first, second) = (disarmed_ms + 100, disarmed_ms + 700);
            assert_eq!(events(disarmed_ms, &[first, second]), [late, answered]);
            let given_up = CommandEvent::TimedOut { command, attempts: 4 };
            assert_eq!(events(disarmed_ms, &[first]), [late, given_up]);
        }
        assert_eq!(events(12_000, &[12_100]), [answered], "lost by then");
    }
}
