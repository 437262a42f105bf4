//! The sender's side of the command protocol: decides when to send a command again, and which
//! answer belongs to which command.

use alloc::vec::Vec;
use core::time::Duration;

use super::{CommandAnswer, FIRST_NUMBER, NUMBERS_END, number_in};
use crate::dialect::{COMMAND_LONG_DATA, MavCmd, MavMessage, MavResult};
use crate::identity::Address;

/// How often an unanswered command is sent again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resend {
    /// Sent once, for a command that is valid for one moment.
    Never,
    /// Sent this many further times, under one number: the vehicle does it once.
    Times(u8),
    /// Sent under one number until it is answered or withdrawn: twenty times, fifty milliseconds
    /// apart, then five times a second. For what makes a vehicle safer.
    UntilAnswered,
    /// Sent until it is withdrawn, whatever the answer is: twenty times a second until it is
    /// accepted, then five times a second. For aborting: if half of the frames are lost, all twenty
    /// of a second are lost once in a million times, and after an outage one of them arrives within
    /// 50 ms.
    UntilWithdrawn,
}

impl Resend {
    /// Returns whether it is sent however long the answer takes.
    pub fn is_persistent(self) -> bool {
        matches!(self, Self::UntilAnswered | Self::UntilWithdrawn)
    }
}

/// Sendings before an unanswered command that is repeated until its answer becomes less frequent.
const URGENT_SENDINGS: u32 = 20;
/// Interval between the sendings of an abort that is not accepted yet.
const URGENT_INTERVAL: Duration = Duration::from_millis(50);
/// Silence after which a received frame may mark the end of an outage.
const SILENCE: Duration = Duration::from_millis(100);
/// Interval between the sendings of an accepted abort.
const STEADY_INTERVAL: Duration = Duration::from_millis(200);

/// Progress of a command. Acknowledged is not observed: only the vehicle's state proves that a
/// command was executed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandEvent {
    Sent {
        command: u16,
        /// Number of the attempt, from 1.
        attempt: u32,
    },
    /// Acknowledged as in progress.
    InProgress { command: u16 },
    /// The final answer.
    Answered {
        command: u16,
        result: u8,
        /// A second person must confirm.
        open: bool,
    },
    /// The final answer to a command that is no longer waited for, because it was given up or
    /// replaced by another command with its number.
    AnsweredLate {
        command: u16,
        result: u8,
        open: bool,
        /// The ticket that [`CommandSender::submit`] returned.
        ticket: Ticket,
    },
    /// It was given up without an answer.
    TimedOut { command: u16, attempts: u32 },
}

/// An unanswered command is sent again after this time.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(500);
/// After the answer "in progress" a command waits this long for the final answer.
const PROGRESS_TIMEOUT: Duration = Duration::from_secs(3);
/// Time limit of the answer to a command that is no longer pending.
const LATE_ANSWER_WITHIN: Duration = Duration::from_secs(10);

/// Identifies one submitted command among others with the same number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ticket(u64);

/// A command that is no longer pending, but may still be answered.
#[derive(Debug)]
struct Late {
    command: MavCmd,
    number: Option<u32>,
    ticket: Ticket,
    until: Duration,
    /// Its repetitions may be answered again.
    is_answered: bool,
}

#[derive(Debug)]
struct Pending {
    ticket: Ticket,
    message: COMMAND_LONG_DATA,
    resend: Resend,
    attempts: u32,
    due_at: Duration,
    sent_at: Duration,
    in_progress: bool,
    /// The last answer to a command that is sent until it is withdrawn.
    answered: Option<u8>,
}

impl Pending {
    /// Returns when it is due again after it was sent now.
    fn due_after(&self, now: Duration) -> Duration {
        match self.resend {
            Resend::UntilWithdrawn if self.is_accepted() => now + STEADY_INTERVAL,
            Resend::UntilAnswered if self.attempts >= URGENT_SENDINGS => now + STEADY_INTERVAL,
            // Counted from the time at which it was due, so that a poll that comes late now and
            // then does not lower the rate.
            Resend::UntilAnswered | Resend::UntilWithdrawn => {
                (self.due_at + URGENT_INTERVAL).max(now + URGENT_INTERVAL / 2)
            }
            Resend::Never | Resend::Times(_) => now + ANSWER_TIMEOUT,
        }
    }

    fn is_accepted(&self) -> bool {
        self.answered == Some(MavResult::MAV_RESULT_ACCEPTED as u8)
    }

    fn number(&self) -> Option<u32> {
        number_in(self.message.param2)
    }

    /// The late answer still possible when this command is no longer pending.
    fn into_late(self, now: Duration) -> Option<Late> {
        let late = Late {
            command: self.message.command,
            number: self.number(),
            ticket: self.ticket,
            until: now + LATE_ANSWER_WITHIN,
            is_answered: false,
        };
        (late.number.is_some() && self.attempts > 0).then_some(late)
    }
}

/// The sender's side of the command protocol, without I/O: [`CommandSender::poll`] returns the
/// frames to send.
///
/// A command that is sent until it is withdrawn may be answered many times; each answer that
/// differs from the one before is reported.
///
/// MAVLink's answers name the kind of their command alone, and arming and disarming are one kind.
/// So each command but one that is sent until it is withdrawn has a number in parameter 2, which
/// our vehicles repeat in the answer: a late answer to an arming is not taken for that to the
/// disarming which has replaced it. Whoever answers without a number answers the command that
/// waits.
#[derive(Debug, Default)]
pub struct CommandSender {
    pending: Vec<Pending>,
    late: Vec<Late>,
    events: Vec<CommandEvent>,
    submitted: u64,
    received_at: Option<Duration>,
    /// Where the numbers begin: another station with the same address should begin elsewhere.
    begin: u32,
}

impl CommandSender {
    /// Commands get numbers that begin at a place that `seed` decides.
    pub fn new(seed: u32) -> Self {
        Self { begin: seed, ..Self::default() }
    }

    fn next_number(&self) -> u32 {
        let counted = u64::from(self.begin) + self.submitted;
        FIRST_NUMBER + (counted % u64::from(NUMBERS_END - FIRST_NUMBER)) as u32
    }

    /// Queues a command. A pending command of the same kind is replaced. Parameter 2 is the number,
    /// unless it is sent until it is withdrawn.
    pub fn submit(
        &mut self,
        target: Address,
        command: MavCmd,
        params: [f32; 7],
        resend: Resend,
        now: Duration,
    ) -> Ticket {
        self.withdraw(now, |pending| pending.message.command == command);
        let numbered = resend != Resend::UntilWithdrawn;
        let message = COMMAND_LONG_DATA {
            param1: params[0],
            param2: if numbered { self.next_number() as f32 } else { params[1] },
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
            due_at: now,
            sent_at: now,
            in_progress: false,
            answered: None,
        });
        ticket
    }

    /// Stops sending this command.
    pub fn withdraw_one(&mut self, ticket: Ticket, now: Duration) {
        self.withdraw(now, |pending| pending.ticket == ticket);
    }

    /// Notes that a frame was received from the target. After a silence an unaccepted abort is due
    /// at once: an outage may be over, and the next one may begin soon. Returns whether that is so.
    pub fn on_received(&mut self, now: Duration) -> bool {
        let received_at = self.received_at.replace(now);
        let mut due = false;
        if received_at.is_none_or(|at| now.saturating_sub(at) >= SILENCE) {
            for pending in &mut self.pending {
                let urgent = pending.resend.is_persistent() && !pending.is_accepted();
                if urgent && pending.attempts > 0 {
                    pending.due_at = pending.due_at.min(now.max(pending.sent_at + URGENT_INTERVAL / 2));
                    due |= pending.due_at <= now;
                }
            }
        }
        due
    }

    /// Returns when [`CommandSender::poll`] has something to do next; `None` while no command is
    /// pending.
    pub fn due_at(&self) -> Option<Duration> {
        self.pending.iter().map(|pending| pending.due_at).min()
    }

    /// Stops sending all commands. Answers to sent commands may still arrive.
    pub fn withdraw_all(&mut self, now: Duration) {
        self.withdraw(now, |_| true);
    }

    fn withdraw(&mut self, now: Duration, which: impl Fn(&Pending) -> bool) {
        self.late.retain(|late| now < late.until);
        let withdrawn = self.pending.extract_if(.., |pending| which(pending));
        self.late.extend(withdrawn.filter_map(|pending| pending.into_late(now)));
    }

    /// Returns the messages to send now; call it a few times a second.
    pub fn poll(&mut self, now: Duration) -> Vec<MavMessage> {
        let mut messages = Vec::new();
        let events = &mut self.events;
        let given_up = self.pending.extract_if(.., |pending| {
            if now < pending.due_at {
                return false;
            }
            let waits = pending.in_progress && !pending.resend.is_persistent();
            let may_send = !waits
                && match pending.resend {
                    Resend::Never => pending.attempts == 0,
                    Resend::Times(times) => pending.attempts <= u32::from(times),
                    Resend::UntilAnswered | Resend::UntilWithdrawn => true,
                };
            let command = pending.message.command as u16;
            if !may_send {
                events.push(CommandEvent::TimedOut { command, attempts: pending.attempts });
                return true;
            }
            pending.message.confirmation = u8::try_from(pending.attempts).unwrap_or(u8::MAX);
            pending.attempts += 1;
            (pending.due_at, pending.sent_at) = (pending.due_after(now), now);
            events.push(CommandEvent::Sent { command, attempt: pending.attempts });
            messages.push(MavMessage::COMMAND_LONG(pending.message.clone()));
            false
        });
        self.late.extend(given_up.filter_map(|pending| pending.into_late(now)));
        self.late.retain(|late| now < late.until);
        messages
    }

    /// Notes an answer, and returns whether any command could still be answered by it.
    pub fn on_answer(&mut self, answer: &CommandAnswer, now: Duration) -> bool {
        let final_answer = answer.result != MavResult::MAV_RESULT_IN_PROGRESS as u8;
        let answers = |command: MavCmd, number: Option<u32>| {
            command as u16 == answer.command && (answer.number().is_none() || answer.number() == number)
        };
        let waiting =
            self.pending.iter().position(|pending| answers(pending.message.command, pending.number()));
        let late = |late: &&mut Late| answers(late.command, late.number) && now < late.until;
        if waiting.is_none()
            && let Some(late) = self.late.iter_mut().find(late)
        {
            if final_answer && !core::mem::replace(&mut late.is_answered, true) {
                let (open, ticket) = (answer.is_open(), late.ticket);
                let CommandAnswer { command, result, .. } = *answer;
                self.events.push(CommandEvent::AnsweredLate { command, result, open, ticket });
            }
            return true;
        }
        // A screen and a replay follow the commands of a station that has counted others before:
        // its numbers are not theirs.
        let of_its_kind = || self.pending.iter().position(|p| p.message.command as u16 == answer.command);
        let Some(index) = waiting.or_else(of_its_kind) else { return false };
        let pending = &mut self.pending[index];
        let CommandAnswer { command, result, .. } = *answer;
        if pending.resend == Resend::UntilWithdrawn {
            // It is reported if it differs from the one before. Once accepted the command stays
            // accepted: copies that arrive later find nothing left to do.
            if pending.is_accepted() || pending.answered.replace(result) == Some(result) {
                return true;
            }
        } else if final_answer {
            self.pending.remove(index);
        } else {
            pending.in_progress = true;
            pending.due_at = now + PROGRESS_TIMEOUT;
        }
        self.events.push(if final_answer {
            CommandEvent::Answered { command, result, open: answer.is_open() }
        } else {
            CommandEvent::InProgress { command }
        });
        true
    }

    /// Returns whether this command is pending.
    pub fn is_pending(&self, command: MavCmd) -> bool {
        self.pending.iter().any(|pending| pending.message.command == command)
    }

    /// Returns the events since the last call.
    pub fn take_events(&mut self) -> Vec<CommandEvent> {
        core::mem::take(&mut self.events)
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

    /// Submits an arming at 0 and a disarming at `disarmed_ms`; of the two, the first or the second
    /// is answered at these times, ms. Returns the events about answers.
    fn events(disarmed_ms: u64, answers_ms: &[(u64, i32)]) -> Vec<CommandEvent> {
        let mut sender = CommandSender::new(7);
        sender.submit(VEHICLE, ARM, [1.0; 7], Resend::Times(4), ms(0));
        for now in (0..20_000).step_by(100) {
            if now == disarmed_ms {
                sender.submit(VEHICLE, ARM, [0.0; 7], Resend::Times(3), ms(now));
            }
            sender.poll(ms(now));
            for (_, of) in answers_ms.iter().filter(|(at, _)| *at == now) {
                let detail = FIRST_NUMBER.cast_signed() + 7 + of;
                let answer = CommandAnswer { command: ARM as u16, result: 0, detail, target: GROUND };
                sender.on_answer(&answer, ms(now));
            }
        }
        let is_answer = |event: &CommandEvent| {
            !matches!(event, CommandEvent::Sent { .. } | CommandEvent::TimedOut { attempts: 5, .. })
        };
        sender.take_events().into_iter().filter(is_answer).collect()
    }

    /// Polls every 10 ms; returns the time of each sending, ms, and the other events.
    fn aborts_ms(answered: &[(u64, MavResult)], withdrawn_ms: u64) -> (Vec<u64>, Vec<CommandEvent>) {
        let abort = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION;
        let mut sender = CommandSender::new(0);
        let ticket = sender.submit(VEHICLE, abort, [1.0; 7], Resend::UntilWithdrawn, ms(0));
        let mut sent = Vec::new();
        for now in (0..3_000).step_by(10) {
            if now == withdrawn_ms {
                sender.withdraw_one(ticket, ms(now));
            }
            sent.extend(sender.poll(ms(now)).iter().map(|_| now));
            for (_, result) in answered.iter().filter(|(at, _)| *at == now) {
                let (command, result) = (abort as u16, *result as u8);
                let answer = CommandAnswer { command, result, detail: 0, target: GROUND };
                assert!(sender.on_answer(&answer, ms(now)) || now >= withdrawn_ms);
            }
        }
        let events = sender.take_events().into_iter();
        (sent, events.filter(|event| !matches!(event, CommandEvent::Sent { .. })).collect())
    }

    #[test]
    fn an_abort_is_sent_twenty_times_a_second_until_it_is_accepted_and_then_five_times() {
        let within = |sent: &[u64], from, to| sent.iter().filter(|at| (from..to).contains(*at)).count();
        let (sent, events) = aborts_ms(&[], u64::MAX);
        let a_second = |from| within(&sent, from, from + 1_000);
        assert_eq!((a_second(0), a_second(1_000), a_second(2_000)), (20, 20, 20), "{sent:?}");
        assert!(events.is_empty());
        let (sent, _) = aborts_ms(
            &[(990, MavResult::MAV_RESULT_TEMPORARILY_REJECTED), (1_990, MavResult::MAV_RESULT_ACCEPTED)],
            u64::MAX,
        );
        let a_second = |from| within(&sent, from, from + 1_000);
        assert_eq!((a_second(0), a_second(1_000)), (20, 20), "refused for now is not accepted: {sent:?}");
        assert!(a_second(2_000) <= 6, "{sent:?}");
    }

    #[test]
    fn abort_is_sent_immediately_when_the_link_returns() {
        let abort = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION;
        let mut sender = CommandSender::new(0);
        sender.submit(VEHICLE, abort, [1.0; 7], Resend::UntilWithdrawn, ms(0));
        let mut sent = Vec::new();
        // Frames arrive every 10 ms, except between 500 and 1,230 ms.
        for now in (0..2_000).step_by(10) {
            let receives = !(500..1_230).contains(&now);
            if now % 50 == 0 || (receives && sender.on_received(ms(now))) {
                sent.extend(sender.poll(ms(now)).iter().map(|_| now));
            }
        }
        assert!(sent.contains(&1_230), "{sent:?}");
        assert!(sent.windows(2).all(|pair| pair[1] - pair[0] >= 25), "{sent:?}");
        assert!(sent.len() <= 42, "continuous reception does not make it more frequent: {}", sent.len());
    }

    /// Dead air in bursts, both ways, for 30 % of the time.
    #[test]
    fn an_abort_arrives_within_a_moment_of_the_end_of_every_outage() {
        let abort = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION;
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / f64::from(1_u32 << 31)
        };
        let mut latest = 0;
        for _ in 0..2_000 {
            // Alternating spans, ms: dead 0.1 to 3 s, alive 7/3 of that on average; it begins
            // somewhere in a dead one.
            let mut spans = vec![(false, 1 + (3_000.0 * random()) as u64)];
            for _ in 0..6 {
                spans.push((true, 60 + (7_000.0 * random()) as u64));
                spans.push((false, 100 + (2_900.0 * random()) as u64));
            }
            let ended_at = spans[0].1;
            let alive = |now: u64| {
                let mut at = 0;
                spans.iter().find_map(|(alive, length)| {
                    at += length;
                    (now < at).then_some(*alive)
                })
            };
            let mut sender = CommandSender::new(0);
            sender.submit(VEHICLE, abort, [1.0; 7], Resend::UntilWithdrawn, ms(0));
            let arrived = (0..10_000).find(|now| {
                let up = alive(*now) == Some(true);
                // Frames arrive thirty times a second, and the station polls on reception or when
                // something is due.
                let due = sender.due_at().is_some_and(|at| at <= ms(*now));
                (due || (up && now % 33 == 0 && sender.on_received(ms(*now))))
                    && !sender.poll(ms(*now)).is_empty()
                    && up
            });
            latest = latest.max(arrived.expect("it arrives") - ended_at);
        }
        assert!(latest <= 50, "{latest} ms after the end of an outage");
    }

    #[test]
    fn an_answer_does_not_end_an_abort_and_is_reported_once() {
        let accepted = MavResult::MAV_RESULT_ACCEPTED;
        let (sent, events) =
            aborts_ms(&[(100, accepted), (150, accepted), (160, MavResult::MAV_RESULT_FAILED)], 500);
        assert_eq!(sent, [0, 50, 100, 150, 350], "less often once it is accepted");
        let command = MavCmd::MAV_CMD_DO_FLIGHTTERMINATION as u16;
        assert_eq!(events, [CommandEvent::Answered { command, result: 0, open: false }]);
    }

    #[test]
    fn each_answer_belongs_to_the_command_whose_number_it_has() {
        let (command, result) = (ARM as u16, 0);
        let late = CommandEvent::AnsweredLate { command, result, open: false, ticket: Ticket(1) };
        let answered = CommandEvent::Answered { command, result, open: false };
        for disarmed_ms in [200, 3_000] {
            let [first, second, third] = [100, 200, 700].map(|after| disarmed_ms + after);
            // A repeated arming is answered twice.
            assert_eq!(events(disarmed_ms, &[(first, 0), (second, 0), (third, 1)]), [late, answered]);
            assert_eq!(events(disarmed_ms, &[(first, 1), (second, 0)]), [answered, late]);
            let given_up = CommandEvent::TimedOut { command, attempts: 4 };
            assert_eq!(events(disarmed_ms, &[(first, 0)]), [late, given_up]);
        }
        assert_eq!(events(15_000, &[(15_100, 1)]), [answered], "the answer to the arming is lost by then");
    }
}
