//! Keeps the stations' requests until the vehicle has decided. A command is acknowledged by the frame that carried it
//! out.

use alloc::vec::Vec;
use flight::computer::Commander;
use flight::computer::crew::{Answer, Asked, Ending, People, Request};
use flight::rules::arming::Uplink;
use flight::rules::operator::Operator;
use flight::rules::phase::Phase;
use flight::rules::two_person::Station;
use protocol::command::{CommandAnswer, CommandRequest};
use protocol::dialect::MavResult;

use super::VehicleEndpoint;
use crate::commands;
use crate::vehicle::Vehicle;

/// Most commands that may wait for one frame (some milliseconds); more are ignored.
const MAX_WAITING: usize = 64;

/// What a frame of the vehicle is told of its links, and asked by its crew.
#[derive(Debug, Clone, PartialEq)]
pub struct Heard {
    /// How well the best station is heard.
    pub uplink: Uplink,
    /// The station that armed the vehicle, if one did.
    pub commander: Option<Commander>,
    /// In order.
    pub requests: Vec<Request>,
}

/// A command that the vehicle decides in its next frame.
#[derive(Debug, Clone)]
pub(super) struct Waiting {
    link: usize,
    command: CommandRequest,
    request: Request,
}

impl VehicleEndpoint {
    /// Configures a vehicle that starts by itself: no station has to be heard, and the silence of a station does not
    /// hold it.
    #[must_use]
    pub fn starting_by_itself(self) -> Self {
        Self { starts_by_itself: true, ..self }
    }

    /// Gives a command to the vehicle's next frame.
    pub(super) fn put(
        &mut self,
        link: usize,
        (command, by, station): (&CommandRequest, Option<Operator>, Station),
        asked: Asked,
        vehicle: &dyn Vehicle,
    ) {
        // Other commands never displace an abort.
        if self.waiting.len() >= MAX_WAITING && asked != Asked::Abort {
            return;
        }
        let uplink = if self.starts_by_itself {
            Uplink::NotNeeded
        } else {
            self.stations.uplink(station, vehicle.time_s())
        };
        let confirms = commands::confirmed_ask(command);
        let request = Request { asked, uplink, station: Some(station), by, confirms };
        // A station that repeats an abort before the decision is answered once. Nobody else's abort makes it a
        // repetition: an observer may name the same address.
        let repeats =
            |waiting: &Waiting| waiting.command.source == command.source && waiting.request.by == by;
        if asked == Asked::Abort
            && self.waiting.iter().any(|waiting| repeats(waiting) && waiting.request.asked == asked)
        {
            return;
        }
        self.waiting.push(Waiting { link, command: *command, request });
    }

    /// What the vehicle's next frame is told of its links and asked by its crew.
    pub fn heard(&self, time_s: f64) -> Heard {
        let (uplink, commander) = self.uplink(time_s);
        let requests = self.waiting.iter().map(|waiting| waiting.request).collect();
        Heard { uplink, commander, requests }
    }

    /// Takes the vehicle's answers to the requests that it has [heard](Self::heard); `vehicle` has just decided. A dead
    /// flight computer gives no answers, and its requests are dropped.
    pub fn on_answers(&mut self, answers: &[Answer], vehicle: &dyn Vehicle) {
        let waiting = core::mem::take(&mut self.waiting);
        for (Waiting { link, command, request }, answer) in waiting.into_iter().zip(answers) {
            self.note_commander(&request, answer, vehicle);
            // A COMMAND_CANCEL has no parameters.
            let is_cancelled = request.asked == Asked::EndCheck && command.params[0].is_nan();
            let result = match commands::mav_result(answer.ending) {
                MavResult::MAV_RESULT_ACCEPTED if is_cancelled => MavResult::MAV_RESULT_CANCELLED,
                result => result,
            };
            if request.asked == Asked::Abort {
                self.lane(link).answer_abort(CommandAnswer::to(&command, result));
            } else {
                let asked = vehicle.computer().crew().two_person.waiting(vehicle.time_s());
                let asked = asked.filter(|_| answer.ending == Ending::Asked);
                self.acknowledge(link, &command, (result, asked.map_or(0, |ask| i32::from(ask.number))));
            }
        }
    }

    /// The first station that armed it is in command: of two people the one who asked. A station that takes over is
    /// next.
    fn note_commander(&mut self, request: &Request, answer: &Answer, vehicle: &dyn Vehicle) {
        let Some(station) = request.station.filter(|_| answer.ending == Ending::Accepted) else { return };
        let here = (station, request.by);
        match request.asked {
            Asked::Arm if vehicle.phase() == Phase::PadArmed && self.stations.armed_by().is_none() => {
                let asked = vehicle.computer().crew().two_person.armed_by();
                let asked = asked
                    .filter(|_| matches!(vehicle.people(), Some(People::Two { .. })))
                    .map(|ask| (ask.station, Some(ask.by)));
                self.stations.set_commander(Some(asked.unwrap_or(here)));
            }
            // Disarmed and armed again before the next frame: the next one is in command.
            Asked::Disarm => self.stations.set_commander(None),
            Asked::TakeCommand => self.stations.set_commander(Some(here)),
            _ => {}
        }
    }

    /// How well the best station and the station that armed the vehicle are heard now.
    fn uplink(&self, time_s: f64) -> (Uplink, Option<Commander>) {
        if self.starts_by_itself {
            return (Uplink::NotNeeded, None);
        }
        let commander = self.stations.commander().map(|(station, by)| Commander {
            station,
            age_s: self.stations.age_s(station, time_s).unwrap_or(f64::INFINITY),
            by,
        });
        (self.stations.best_uplink(time_s), commander)
    }
}
