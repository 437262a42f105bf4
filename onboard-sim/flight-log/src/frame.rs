//! Converts the flight computer's frames between its own types and log records, bit for bit.

use alloc::vec::Vec;

use flight::computer::crew::{Asked, Ending, People, Request};
use flight::computer::pilot::Sensed;
use flight::computer::{Commander, Commands, Computer, Input, LogState, Output, Rehearsed};
use flight::guidance::powered::ControlLevel;
use flight::rules::arming::{PredictedLanding, Uplink};
use flight::rules::operator::{Name, Operator, Role};
use flight::rules::outputs::{Line, Outputs};
use flight::rules::phase::Phase;
use flight::rules::two_person::Station;
use flight::vehicle::mission::StartPoint;
use protocol::records::computer_v1 as v1;

use crate::estimate::{
    RecordError, estimate_from_log, estimate_to_log, list, measurements_from_log, measurements_to_log,
    state_to_log, vector_to_log,
};

/// Requests, by their number in the log.
const ASKED: [Asked; 10] = [
    Asked::Arm,
    Asked::Disarm,
    Asked::Start,
    Asked::Hold,
    Asked::Abort,
    Asked::Tap,
    Asked::TakeCommand,
    Asked::Check,
    Asked::CheckStill,
    Asked::EndCheck,
];

/// A frame's input that owns its lists: read from a log, or by a board.
#[derive(Debug, Clone, PartialEq)]
pub struct LoggedInput {
    requests: Vec<Request>,
    rehearsed: Option<Rehearsed>,
    rest: Input<'static>,
}

impl LoggedInput {
    /// `rest` is everything but requests and rehearsal.
    pub fn new(rest: Input<'static>, requests: Vec<Request>, rehearsed: Option<Rehearsed>) -> Self {
        Self { requests, rehearsed, rest }
    }

    /// The input, as the flight computer takes it.
    pub fn input(&self) -> Input<'_> {
        Input { requests: &self.requests, rehearsed: self.rehearsed.as_ref(), ..self.rest }
    }

    /// The same input with what a board has heard itself.
    #[must_use]
    pub fn hearing(self, uplink: Uplink, commander: Option<Commander>, requests: Vec<Request>) -> Self {
        Self { requests, rest: Input { uplink, commander, ..self.rest }, ..self }
    }
}

/// A computer as it is now: at power-up or at its release, before its first frame there.
pub fn start_to_log(computer: &Computer) -> v1::ComputerStart {
    let mission = computer.pilot().mission();
    let released = computer.released_at_s().is_some();
    let estimate = computer.pilot().estimator().estimate();
    let stood = released && mission.start.at == StartPoint::Pad;
    v1::ComputerStart {
        frame: if released { computer.frame() } else { 0 },
        believed: state_to_log(&estimate.state),
        gyro_bias_rad_s: stood.then(|| vector_to_log(&estimate.gyro_bias_rad_s)),
        steered: mission.steered,
        fixed_ignition_height_m: mission.ignition.fixed_height_m,
        released,
    }
}

/// A whole frame as a record; `computer` has just flown it. The result of the rehearsal is recorded in one frame only:
/// `rehearsed_before` says that an earlier frame has it.
pub fn frame_to_log(
    input: &Input<'_>,
    output: &Output,
    computer: &Computer,
    rehearsed_before: bool,
) -> v1::ComputerFrame {
    let mut input = input_to_log(input);
    if rehearsed_before {
        input.rehearsed = None;
    }
    v1::ComputerFrame { input, output: output_to_log(output, computer), state_digest: computer.digest() }
}

fn input_to_log(input: &Input<'_>) -> v1::ComputerInput {
    let &Input {
        frame,
        time_s,
        ref sensed,
        gimbal_rad,
        fins_rad,
        contact,
        igniter_continuity,
        booster_attached,
        pin_out,
        battery_v,
        log: LogState { running: log_running, space_bytes: log_space_bytes },
        uplink,
        ref commander,
        people,
        requests,
        rehearsed,
    } = input;
    let (measured, known) = match sensed {
        Sensed::Measured(measurements) => (Some(measurements_to_log(measurements)), None),
        Sensed::Known(estimate) => (None, Some(estimate_to_log(estimate))),
    };
    v1::ComputerInput {
        frame,
        time_s,
        measured,
        known,
        gimbal_rad: gimbal_rad.to_vec(),
        fins_rad: fins_rad.to_vec(),
        contact,
        igniter_continuity,
        pin_out,
        log_running,
        log_space_bytes,
        uplink: uplink_to_log(uplink),
        commander: commander.as_ref().map(commander_to_log),
        requests: requests.iter().map(request_to_log).collect(),
        rehearsed: rehearsed.map(|rehearsed| v1::Rehearsed {
            warm: rehearsed.warm,
            found: rehearsed.found.clone(),
            lands: rehearsed.landing.as_ref().map(|landing| landing.lands),
            landing_found: rehearsed.landing.as_ref().map(|landing| landing.found.clone()),
        }),
        booster_attached: booster_attached.then_some(true),
        people: people.map(people_to_log),
        battery_v,
    }
}

/// A recorded input.
///
/// # Errors
/// This build does not know some value of it.
pub fn input_from_log(input: &v1::ComputerInput) -> Result<LoggedInput, RecordError> {
    let frame = input.frame;
    let sensed = match (&input.measured, &input.known) {
        (Some(measurements), None) => Sensed::Measured(measurements_from_log(measurements)),
        (None, Some(estimate)) => Sensed::Known(estimate_from_log(estimate, frame)?),
        _ => return Err(RecordError::Sensed { frame }),
    };
    let commander = input.commander.as_ref().map(|commander| commander_from_log(commander, frame));
    let rest = Input {
        frame,
        time_s: input.time_s,
        sensed,
        gimbal_rad: list(&input.gimbal_rad, frame, "gimbal angles")?,
        fins_rad: list(&input.fins_rad, frame, "fin angles")?,
        contact: input.contact,
        igniter_continuity: input.igniter_continuity,
        pin_out: input.pin_out,
        battery_v: input.battery_v,
        log: LogState { running: input.log_running, space_bytes: input.log_space_bytes },
        uplink: uplink_from_log(input.uplink.as_ref()),
        commander: commander.transpose()?,
        requests: &[],
        rehearsed: None,
        booster_attached: input.booster_attached.unwrap_or(false),
        people: input.people.as_ref().map(|people| people_from_log(people, frame)).transpose()?,
    };
    let requests = input.requests.iter().map(|request| request_from_log(request, frame));
    let rehearsed = input.rehearsed.as_ref().map(|rehearsed| Rehearsed {
        warm: rehearsed.warm,
        found: rehearsed.found.clone(),
        landing: rehearsed
            .lands
            .zip(rehearsed.landing_found.clone())
            .map(|(lands, found)| PredictedLanding { lands, found }),
    });
    Ok(LoggedInput { requests: requests.collect::<Result<_, _>>()?, rehearsed, rest })
}

/// Whether a frame accepted an abort.
pub fn accepts_abort(frame: &v1::ComputerFrame) -> bool {
    let aborts = |request: &v1::Request| ASKED.get(request.asked as usize) == Some(&Asked::Abort);
    let mut answered = frame.input.requests.iter().zip(&frame.output.answers);
    answered.any(|(request, answer)| aborts(request) && *answer == ending_to_log(Ending::Accepted))
}

fn ending_to_log(ending: Ending) -> u32 {
    match ending {
        Ending::Accepted => 0,
        Ending::NotNow => 1,
        Ending::Denied => 2,
        Ending::Failed => 3,
        Ending::Asked => 4,
    }
}

/// A frame's output as a record; `computer` has just flown it.
pub fn output_to_log(output: &Output, computer: &Computer) -> v1::ComputerOutput {
    let Output { commands, released, answers, news: _, planned } = output;
    let &Commands { gimbal_rad, fins_rad, outputs } = commands;
    v1::ComputerOutput {
        gimbal_rad: gimbal_rad.to_vec(),
        fins_rad: fins_rad.to_vec(),
        ignite: outputs.is_on(Line::LandingIgniter),
        parachute: outputs.is_on(Line::Parachute),
        released: *released,
        planned: *planned,
        phase: u32::from(computer.mode().phase.index()),
        level: u32::from(computer.level().index()),
        over: computer.is_over(),
        answers: answers.iter().map(|answer| ending_to_log(answer.ending)).collect(),
        ignite_booster: outputs.is_on(Line::AscentIgniter).then_some(true),
        separate_booster: outputs.is_on(Line::Separation).then_some(true),
    }
}

/// The commands of a recorded frame.
///
/// # Errors
/// A list has the wrong length.
pub fn commands_from_log(output: &v1::ComputerOutput, frame: u64) -> Result<Commands, RecordError> {
    Ok(Commands {
        gimbal_rad: list(&output.gimbal_rad, frame, "gimbal angles")?,
        fins_rad: list(&output.fins_rad, frame, "fin angles")?,
        outputs: Outputs::of(|line| match line {
            Line::LandingIgniter => output.ignite,
            Line::Parachute => output.parachute,
            Line::AscentIgniter => output.ignite_booster.unwrap_or(false),
            Line::Separation => output.separate_booster.unwrap_or(false),
        }),
    })
}

/// The control level of a recorded frame; `None` if this build does not know it.
pub fn level_of(output: &v1::ComputerOutput) -> Option<ControlLevel> {
    u8::try_from(output.level).ok().and_then(ControlLevel::from_index)
}

/// The phase after a recorded frame; `None` if this build does not know it.
pub fn phase_of(output: &v1::ComputerOutput) -> Option<Phase> {
    u8::try_from(output.phase).ok().and_then(Phase::from_index)
}

/// The station that armed the vehicle as a record.
pub fn commander_to_log(commander: &Commander) -> v1::Commander {
    let Commander { station, age_s, by, deaf } = commander;
    v1::Commander {
        system: u32::from(station.system),
        component: u32::from(station.component),
        age_s: *age_s,
        by: by.as_ref().map(operator_to_log),
        station: (station.number != 0).then_some(station.number),
        deaf: deaf.then_some(true),
    }
}

/// A recorded station that armed the vehicle.
///
/// # Errors
/// This build does not know some value of it.
pub fn commander_from_log(commander: &v1::Commander, frame: u64) -> Result<Commander, RecordError> {
    let station = station_from_log((commander.system, commander.component, commander.station), frame)?;
    let by = commander.by.as_ref().map(|by| operator_from_log(by, frame)).transpose()?;
    Ok(Commander { station, age_s: commander.age_s, by, deaf: commander.deaf.unwrap_or(false) })
}

/// How well a station is heard, as a record; `None` where nobody has to be heard.
pub fn uplink_to_log(uplink: Uplink) -> Option<v1::Uplink> {
    match uplink {
        Uplink::NotNeeded => None,
        Uplink::NeverHeard => Some(v1::Uplink { age_s: None }),
        Uplink::Heard { age_s } => Some(v1::Uplink { age_s: Some(age_s) }),
    }
}

/// How well a station was heard.
pub fn uplink_from_log(uplink: Option<&v1::Uplink>) -> Uplink {
    match uplink {
        None => Uplink::NotNeeded,
        Some(v1::Uplink { age_s: None }) => Uplink::NeverHeard,
        Some(v1::Uplink { age_s: Some(age_s) }) => Uplink::Heard { age_s: *age_s },
    }
}

/// A request of the crew as a record.
pub fn request_to_log(request: &Request) -> v1::Request {
    // Every kind is in the list; a test checks that.
    let asked = ASKED.iter().position(|known| *known == request.asked).unwrap_or(ASKED.len());
    v1::Request {
        asked: asked as u32,
        uplink: uplink_to_log(request.uplink),
        system: request.station.map(|station| u32::from(station.system)),
        component: request.station.map(|station| u32::from(station.component)),
        by: request.by.as_ref().map(operator_to_log),
        confirms: request.confirms.map(u32::from),
        station: request.station.map(|station| station.number).filter(|number| *number != 0),
    }
}

/// A recorded request of the crew.
///
/// # Errors
/// This build does not know some value of it.
pub fn request_from_log(request: &v1::Request, frame: u64) -> Result<Request, RecordError> {
    let unknown =
        RecordError::Unknown { frame, what: "request", found: request.asked, most: ASKED.len() - 1 };
    let ids = request.system.zip(request.component);
    let station =
        ids.map(|(system, component)| station_from_log((system, component, request.station), frame));
    Ok(Request {
        asked: *ASKED.get(request.asked as usize).ok_or(unknown)?,
        uplink: uplink_from_log(request.uplink.as_ref()),
        station: station.transpose()?,
        by: request.by.as_ref().map(|by| operator_from_log(by, frame)).transpose()?,
        confirms: request.confirms.map(|number| short(number, frame, "ask")).transpose()?,
    })
}

fn station_from_log(
    (system, component, number): (u32, u32, Option<u32>),
    frame: u64,
) -> Result<Station, RecordError> {
    Ok(Station {
        system: byte(system, frame, "system")?,
        component: byte(component, frame, "component")?,
        number: number.unwrap_or(0),
    })
}

fn operator_to_log(operator: &Operator) -> v1::Operator {
    v1::Operator {
        number: u32::from(operator.number),
        role: u32::from(operator.role as u8),
        name: operator.name.as_str().into(),
    }
}

fn operator_from_log(operator: &v1::Operator, frame: u64) -> Result<Operator, RecordError> {
    let most = Role::ALL.len() - 1;
    let unknown = RecordError::Unknown { frame, what: "role", found: operator.role, most };
    Ok(Operator {
        number: byte(operator.number, frame, "operator")?,
        role: *Role::ALL.get(operator.role as usize).ok_or(unknown)?,
        name: Name::new(&operator.name),
    })
}

fn people_to_log(people: People) -> v1::People {
    match people {
        People::One => v1::People { count: 1, first_ask: None },
        People::Two { first_ask } => v1::People { count: 2, first_ask: Some(u32::from(first_ask)) },
    }
}

fn people_from_log(people: &v1::People, frame: u64) -> Result<People, RecordError> {
    match (people.count, people.first_ask) {
        (1, _) => Ok(People::One),
        (2, Some(first_ask)) => Ok(People::Two { first_ask: short(first_ask, frame, "first ask")? }),
        (found, _) => Err(RecordError::Unknown { frame, what: "crew", found, most: 2 }),
    }
}

fn short(number: u32, frame: u64, what: &'static str) -> Result<u16, RecordError> {
    let most = usize::from(u16::MAX);
    u16::try_from(number).map_err(|_too_large| RecordError::Unknown { frame, what, found: number, most })
}

fn byte(number: u32, frame: u64, what: &'static str) -> Result<u8, RecordError> {
    let most = usize::from(u8::MAX);
    u8::try_from(number).map_err(|_too_large| RecordError::Unknown { frame, what, found: number, most })
}

#[cfg(test)]
mod tests {
    use super::*;
    use flight::estimation::estimator::{ImuSample, Measurements};
    use nalgebra::Vector3;
    use proptest::prelude::*;
    use prost::Message as _;

    use crate::estimate::tests::any_bits;

    fn any_uplink() -> impl Strategy<Value = Uplink> {
        prop_oneof![
            Just(Uplink::NotNeeded),
            Just(Uplink::NeverHeard),
            any_bits().prop_map(|age_s| Uplink::Heard { age_s }),
        ]
    }

    fn any_operator() -> impl Strategy<Value = Operator> {
        let any = (any::<u8>(), 0..Role::ALL.len(), any::<String>());
        any.prop_map(|(number, role, name)| Operator {
            number,
            role: Role::ALL[role],
            name: Name::new(&name),
        })
    }

    fn any_station() -> impl Strategy<Value = Station> {
        any::<(u8, u8, u32)>().prop_map(|(system, component, number)| Station { system, component, number })
    }

    fn any_request() -> impl Strategy<Value = Request> {
        let by = prop::option::of(any_operator());
        let any = (0..ASKED.len(), any_uplink(), prop::option::of(any_station()), by, any::<Option<u16>>());
        any.prop_map(|(asked, uplink, station, by, confirms)| Request {
            asked: ASKED[asked],
            uplink,
            station,
            by,
            confirms,
        })
    }

    fn any_people() -> impl Strategy<Value = Option<People>> {
        prop_oneof![
            Just(None),
            Just(Some(People::One)),
            any::<u16>().prop_map(|first_ask| Some(People::Two { first_ask })),
        ]
    }

    proptest! {
        #[test]
        fn an_input_survives_the_log_bit_for_bit(
            frame: u64,
            numbers in prop::collection::vec(any_bits(), 18),
            flags: [bool; 8],
            space_bytes: u64,
            uplink in any_uplink(),
            commander in prop::option::of((any_station(), prop::option::of(any_operator()))),
            people in any_people(),
            requests in prop::collection::vec(any_request(), 0..4),
            rehearsed: Option<(bool, String, Option<(bool, String)>)>,
        ) {
            let number = |place: usize| numbers[place];
            let measured = Measurements {
                imu: ImuSample {
                    gyro_rad_s: Vector3::new(number(0), number(1), number(2)),
                    specific_force_m_s2: Vector3::new(number(3), number(4), number(5)),
                },
                pressure_altitude_m: flags[0].then_some(number(6)),
                gnss: None,
                lidar_range_m: flags[5].then_some(number(7)),
            };
            let rehearsed = rehearsed.map(|(warm, found, landing)| Rehearsed {
                warm,
                found,
                landing: landing.map(|(lands, found)| PredictedLanding { lands, found }),
            });
            let input = Input {
                frame,
                time_s: number(9),
                sensed: Sensed::Measured(measured),
                gimbal_rad: [number(10), number(11)],
                fins_rad: [12, 13, 14, 15].map(number),
                contact: flags[1],
                igniter_continuity: flags[2],
                pin_out: flags[3],
                battery_v: flags[7].then_some(number(17)),
                log: LogState { running: flags[4], space_bytes },
                uplink,
                commander: commander.map(|(station, by)| Commander {
                    station,
                    age_s: number(16),
                    by,
                    deaf: flags[1],
                }),
                people,
                requests: &requests,
                rehearsed: rehearsed.as_ref(),
                booster_attached: flags[6],
            };
            let bytes = input_to_log(&input).encode_to_vec();
            let read = input_from_log(&v1::ComputerInput::decode(bytes.as_slice()).unwrap()).unwrap();
            // Compared as bytes as well, because a NaN never equals itself.
            prop_assert_eq!(input_to_log(&read.input()).encode_to_vec(), bytes);
            prop_assert_eq!(read.rehearsed, rehearsed);
            prop_assert_eq!(read.requests.len(), requests.len());
            let asked = |requests: &[Request]| {
                let asked = |request: &Request| (request.asked, request.station, request.by, request.confirms);
                requests.iter().map(asked).collect::<Vec<_>>()
            };
            prop_assert_eq!(asked(&read.requests), asked(&requests));
        }
    }

    #[test]
    fn an_unknown_value_is_refused_with_the_number_of_its_frame() {
        let input = v1::ComputerInput {
            frame: 7,
            measured: Some(protocol::records::flight_v1::Measurements::default()),
            gimbal_rad: vec![0.0; 2],
            fins_rad: vec![0.0; 4],
            requests: vec![v1::Request { asked: 10, ..v1::Request::default() }],
            ..v1::ComputerInput::default()
        };
        let error = input_from_log(&input).unwrap_err().to_string();
        assert_eq!(error, "frame 7: request 10 is unknown; this build knows 0 to 9");
        let error =
            input_from_log(&v1::ComputerInput { gimbal_rad: vec![0.0], ..input.clone() }).unwrap_err();
        assert_eq!(error.to_string(), "frame 7: gimbal angles has 1 values and should have 2");
        let both =
            v1::ComputerInput { known: Some(protocol::records::flight_v1::Estimate::default()), ..input };
        assert_eq!(input_from_log(&both).unwrap_err(), RecordError::Sensed { frame: 7 });
    }
}
