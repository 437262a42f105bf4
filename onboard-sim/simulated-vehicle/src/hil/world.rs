//! The world's process: one flight in lockstep or in real time.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use hil::carried::CarriedCommands;
use hil::computer::Answer;
use hil::lockstep::{Due, Heard, Lockstep, Patience};
use hil::real_time::RealTime;
use hil::start::{Pace, Start};
use protocol::dialect::MavMessage;
use protocol::mission::MissionHash;
use sim::recipe::Recipe;
use sim::remote::RemoteFlight;
use sim::sortie::{SetUpError, Sortie};

use super::assembly::AnswerAssembly;
use super::link::{Brought, HilLink};
use super::messages::{of_frame, of_start};
use super::report::{FlightReport, Jitter, WireReport};
use crate::fly::Lateness;

/// In real time as many frames are remembered that wait for their answers.
const ASKED_LEN: usize = 4096;

/// Why a flight of hardware in the loop ended before its end.
#[derive(Debug, thiserror::Error)]
pub enum HilError {
    #[error(transparent)]
    SetUp(#[from] SetUpError),
    #[error("no flight computer answers the start of the flight; it must fly the mission {mission}")]
    NoComputer { mission: MissionHash },
    #[error("the flight computer has not answered frame {frame} for {waited:?}")]
    Silent { frame: u64, waited: Duration },
    #[error("the link has ended")]
    LinkEnded,
}

/// How flights are flown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Manner {
    pub pace: Pace,
    pub patience: Patience,
    /// Each flight is also flown in this process, and compared frame by frame. In lockstep only.
    pub compare: bool,
}

/// Flies one flight of a recipe with the computer at the other end of the link; `flight_id` is a random number.
///
/// # Errors
/// It cannot be set up, or the computer does not answer.
pub async fn fly(
    link: &mut HilLink,
    recipe: &Recipe,
    number: u64,
    flight_id: u32,
    manner: &Manner,
) -> Result<FlightReport, HilError> {
    let flight = RemoteFlight::new(recipe, number)?;
    let start = Start { flight_id, believed: *flight.believed(), pace: manner.pace };
    let mission = MissionHash::of(&recipe.mission_toml);
    let mut session =
        Session { link, flight, answers: AnswerAssembly::default(), flight_id, began: instant() };
    let (first, lockstep) = session.begin(&start, mission, manner.patience).await?;
    match manner.pace {
        Pace::Lockstep => {
            let shadow = manner.compare.then(|| Sortie::new(recipe, number)).transpose()?;
            Box::pin(session.in_lockstep(number, first, lockstep, shadow)).await
        }
        Pace::RealTime => Box::pin(session.in_real_time(number, first, manner.patience)).await,
    }
}

struct Session<'a> {
    link: &'a mut HilLink,
    flight: RemoteFlight,
    answers: AnswerAssembly,
    flight_id: u32,
    began: Instant,
}

#[expect(clippy::disallowed_methods, reason = "a process that waits for another one has a clock")]
fn instant() -> Instant {
    Instant::now()
}

impl Session<'_> {
    fn now(&self) -> Duration {
        instant().saturating_duration_since(self.began)
    }

    async fn begin(
        &mut self,
        start: &Start,
        mission: MissionHash,
        patience: Patience,
    ) -> Result<(Answer, Lockstep), HilError> {
        let message = [of_start(start, mission)];
        self.link.send(&message);
        let mut lockstep = Lockstep::started(patience, self.now());
        match self.answered(&mut lockstep, &message).await {
            Err(HilError::Silent { .. }) => Err(HilError::NoComputer { mission }),
            Err(error) => Err(error),
            Ok(answer) => Ok((answer, lockstep)),
        }
    }

    /// Waits for the answer to the frame that was sent last, and sends it again as long as it takes.
    async fn answered(&mut self, lockstep: &mut Lockstep, sent: &[MavMessage]) -> Result<Answer, HilError> {
        loop {
            let until = match lockstep.due(self.now()) {
                Due::Wait(until) => until,
                Due::SendAgain => {
                    self.link.send(sent);
                    continue;
                }
                Due::GiveUp => {
                    let waited = lockstep.waited(self.now());
                    return Err(HilError::Silent { frame: lockstep.frame(), waited });
                }
            };
            let deadline = tokio::time::Instant::from_std(self.began + until);
            let brought = match tokio::time::timeout_at(deadline, self.link.receive()).await {
                Err(_elapsed) => continue,
                Ok(brought) => brought.ok_or(HilError::LinkEnded)?,
            };
            for answer in self.answers_in(brought) {
                if lockstep.heard(answer.frame) == Heard::Awaited {
                    return Ok(answer);
                }
            }
        }
    }

    /// The answers of this flight in what the link brought.
    fn answers_in(&mut self, brought: Brought) -> Vec<Answer> {
        let Brought::Messages(messages) = brought else { return Vec::new() };
        let answers = messages.iter().filter_map(|message| self.answers.take(message));
        answers.filter(|answer| answer.flight_id == self.flight_id).collect()
    }

    async fn in_lockstep(
        mut self,
        number: u64,
        first: Answer,
        mut lockstep: Lockstep,
        mut shadow: Option<Sortie>,
    ) -> Result<FlightReport, HilError> {
        self.flight.act(&first.commands.widen(), first.phase);
        let mut identical = 0;
        while self.flight.goes_on() {
            let readings = self.flight.sense();
            let frame = lockstep.sent_next(self.now());
            let messages = of_frame(self.flight_id, frame, &readings);
            self.link.send(&messages);
            if let Some(shadow) = &mut shadow {
                shadow.step();
            }
            let answer = self.answered(&mut lockstep, &messages).await?;
            self.flight.act(&answer.commands.widen(), answer.phase);
            let same =
                |shadow: &Sortie| decided_the_same(shadow, &answer) && same_truth(shadow, &self.flight);
            identical += u64::from(shadow.as_ref().is_some_and(same));
        }
        Ok(FlightReport {
            number,
            frames: self.flight.frame(),
            identical: shadow.map(|_| identical),
            outcome: self.flight.outcome(),
            wire: WireReport::Lockstep(*lockstep.counts()),
        })
    }

    async fn in_real_time(
        mut self,
        number: u64,
        first: Answer,
        patience: Patience,
    ) -> Result<FlightReport, HilError> {
        let mut real_time = RealTime::started(&first);
        let (mut begun_late, mut answered_after) = (Lateness::new(), Lateness::new());
        let mut asked: VecDeque<(u64, Duration)> = VecDeque::new();
        let mut unanswered = 0;
        let mut due = tokio::time::Instant::now();
        let mut heard_at = self.now();
        self.flight.act(&first.commands.widen(), first.phase);
        while self.flight.goes_on() {
            due += Duration::from_secs_f64(flight::computer::FRAME_S);
            // What arrives while the world waits is taken at once, so that its time is known.
            while let Ok(brought) = tokio::time::timeout_at(due, self.link.receive()).await {
                let brought = brought.ok_or(HilError::LinkEnded)?;
                for answer in self.answers_in(brought) {
                    heard_at = self.now();
                    real_time.heard(&answer);
                    if let Some(place) = asked.iter().position(|(frame, _)| *frame == answer.frame)
                        && let Some((_, at)) = asked.remove(place)
                    {
                        answered_after.add(heard_at.saturating_sub(at));
                    }
                }
            }
            begun_late.add(tokio::time::Instant::now().saturating_duration_since(due));
            let commands = real_time.commands(self.flight.frame() + 1);
            self.flight.act(&commands, real_time.phase());
            let readings = self.flight.sense();
            let frame = self.flight.frame();
            self.link.send(&of_frame(self.flight_id, frame, &readings));
            asked.push_back((frame, self.now()));
            if asked.len() > ASKED_LEN {
                asked.pop_front();
                unanswered += 1;
            }
            let waited = self.now().saturating_sub(heard_at);
            if waited >= patience.give_up_after {
                return Err(HilError::Silent { frame: real_time.answered() + 1, waited });
            }
        }
        // The last frame's answer comes after the end.
        unanswered += asked.iter().filter(|(frame, _)| *frame < self.flight.frame()).count() as u64;
        let jitter = Jitter {
            begun_late,
            answered_after,
            counts: real_time.counts().clone(),
            held: real_time.held(),
            unanswered,
        };
        Ok(FlightReport {
            number,
            frames: self.flight.frame(),
            identical: None,
            outcome: self.flight.outcome(),
            wire: WireReport::RealTime(Box::new(jitter)),
        })
    }
}

/// Whether the computer in this process remembers and commands the same after the frame, bit for bit.
pub fn decided_the_same(here: &Sortie, there: &Answer) -> bool {
    let computer = here.computer();
    computer.digest() == there.digest && CarriedCommands::narrow(computer.commands()) == there.commands
}

/// Whether the world of the flight in this process is in the same state, bit for bit.
pub fn same_truth(here: &Sortie, there: &RemoteFlight) -> bool {
    let bits = |world: &world::World| {
        let state = world.state();
        let attitude = state.world_from_body;
        let numbers = state.position_m.iter().chain(&state.velocity_m_s).chain(&state.rate_rad_s);
        let numbers = numbers.chain(attitude.as_ref().coords.iter());
        numbers.map(|number| number.to_bits()).collect::<Vec<_>>()
    };
    bits(here.world()) == bits(there.world())
}
