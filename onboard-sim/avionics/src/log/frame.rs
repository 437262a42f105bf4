//! The flight computer's frames as log records, and back, bit for bit.

use flight::computer::crew::{CrewCommand, Ending, Requests};
use flight::computer::pilot::Pilot;
use flight::computer::{Commands, Computer, Input, Output, Rehearsed, SensedInput};
use flight::estimation::estimator::AidStatus;
use flight::guidance::powered::ControlLevel;
use flight::rules::outputs::{Outputs, PyroOutput};
use flight::rules::phase::Phase;
use flight::vehicle::mission::StartPoint;
use protocol::records::{computer_v1 as v1, flight_v1};

use crate::log::logged::{At, Logged, RecordError};

/// A frame's input that owns its lists: read from a log, or by a board.
#[derive(Debug, Clone, PartialEq)]
pub struct LoggedInput {
    pub sensed: SensedInput,
    pub requests: Requests,
    pub rehearsed: Option<Rehearsed>,
    pub plan_ready: bool,
}

impl LoggedInput {
    /// The input, as the flight computer takes it.
    pub fn input(&self) -> Input<'_> {
        let &Self { sensed, ref requests, ref rehearsed, plan_ready } = self;
        Input { sensed, requests, rehearsed: rehearsed.as_ref(), plan_ready }
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
        believed: estimate.state.to_log(),
        calibration: stood.then(|| computer.pilot().estimator().calibration().to_log()),
        rail_m: mission.launched().map(|launch| launch.rail.foot_m().to_log()),
        released,
        aborted_before_s: computer.mode().aborted_before_s,
    }
}

/// A complete frame as a record; `computer` has just flown it. The result of the rehearsal is
/// recorded in one frame only: with `rehearsed_before` an earlier frame has it. The lists of an
/// `earlier` record are used again.
pub fn frame_to_log(
    input: &Input<'_>,
    output: &Output,
    computer: &Computer,
    rehearsed_before: bool,
    earlier: v1::ComputerFrame,
) -> v1::ComputerFrame {
    let rehearsed = input.rehearsed.filter(|_| !rehearsed_before);
    v1::ComputerFrame {
        input: input_to_log(&Input { rehearsed, ..*input }, earlier.input),
        output: output_to_log(output, computer, earlier.output),
        state_digest: computer.digest(),
    }
}

fn input_to_log(input: &Input<'_>, mut record: v1::ComputerInput) -> v1::ComputerInput {
    let &Input { ref sensed, requests, rehearsed, plan_ready } = input;
    sensed.log_over(&mut record);
    record.requests.clear();
    record.requests.extend(requests.iter().map(Logged::to_log));
    v1::ComputerInput { rehearsed: rehearsed.map(Logged::to_log), plan_ready, ..record }
}

/// A recorded input.
///
/// # Errors
/// It has a value that is unknown to this build.
pub fn input_from_log(input: &v1::ComputerInput) -> Result<LoggedInput, RecordError> {
    let at = At { frame: input.frame, field: "input" };
    Ok(LoggedInput {
        sensed: Logged::from_log(input, at)?,
        requests: Logged::from_log(&input.requests, at)?,
        rehearsed: Logged::from_log(&input.rehearsed, at)?,
        plan_ready: input.plan_ready,
    })
}

/// Whether a frame accepted an abort.
pub fn accepts_abort(frame: &v1::ComputerFrame) -> bool {
    let (abort, accepted) = (CrewCommand::Abort.to_log(), Ending::Accepted.to_log());
    let mut answered = frame.input.requests.iter().zip(&frame.output.answers);
    answered.any(|(request, answer)| request.asked == abort && *answer == accepted)
}

/// A frame's output as a record; `computer` has just flown it. The lists of an `earlier` record are
/// used again.
pub fn output_to_log(
    output: &Output,
    computer: &Computer,
    mut earlier: v1::ComputerOutput,
) -> v1::ComputerOutput {
    let Output { commands, released, answers, messages: _, planned } = output;
    let &Commands { gimbal_rad, fins_rad, outputs } = commands;
    gimbal_rad.log_over(&mut earlier.gimbal_rad);
    fins_rad.log_over(&mut earlier.fins_rad);
    earlier.answers.clear();
    earlier.answers.extend(answers.iter().map(|answer| answer.ending.to_log()));
    v1::ComputerOutput {
        ignite: outputs.is_on(PyroOutput::LandingIgniter),
        parachute: outputs.is_on(PyroOutput::Parachute),
        released: *released,
        planned: *planned,
        phase: u32::from(computer.mode().phase.index()),
        level: u32::from(computer.level().index()),
        over: computer.is_over(),
        ignite_booster: outputs.is_on(PyroOutput::AscentIgniter),
        separate_booster: outputs.is_on(PyroOutput::Separation),
        ..earlier
    }
}

/// The commands of a recorded frame.
///
/// # Errors
/// A list has the wrong length.
pub fn commands_from_log(output: &v1::ComputerOutput, frame: u64) -> Result<Commands, RecordError> {
    Ok(Commands {
        gimbal_rad: Logged::from_log(&output.gimbal_rad, At { frame, field: "gimbal_rad" })?,
        fins_rad: Logged::from_log(&output.fins_rad, At { frame, field: "fins_rad" })?,
        outputs: Outputs::of(|which| match which {
            PyroOutput::LandingIgniter => output.ignite,
            PyroOutput::Parachute => output.parachute,
            PyroOutput::AscentIgniter => output.ignite_booster,
            PyroOutput::Separation => output.separate_booster,
        }),
    })
}

/// The control level of a recorded frame; `None` if unknown to this build.
pub fn level_of(output: &v1::ComputerOutput) -> Option<ControlLevel> {
    u8::try_from(output.level).ok().and_then(ControlLevel::from_index)
}

/// The phase after a recorded frame; `None` if unknown to this build.
pub fn phase_of(output: &v1::ComputerOutput) -> Option<Phase> {
    u8::try_from(output.phase).ok().and_then(Phase::from_index)
}

/// The estimate after a frame, with the motor's; `None` before there is one.
pub fn estimate_to_log(pilot: &Pilot) -> Option<flight_v1::Estimate> {
    let estimate = pilot.estimate()?;
    let aids = pilot.estimator().aids();
    Some(flight_v1::Estimate {
        motor: motor_to_log(pilot),
        barometer: aid_to_log(&aids.barometer),
        gnss_velocity: aid_to_log(&aids.gnss_velocity),
        gnss_position: aid_to_log(&aids.gnss_position),
        lidar: aid_to_log(&aids.lidar),
        wind: aid_to_log(&aids.wind),
        ..estimate.to_log()
    })
}

/// The status of an aid that measured in this frame.
fn aid_to_log(status: &AidStatus) -> Option<flight_v1::AidStatus> {
    let &AidStatus { innovation, test_ratio, used, refused, refused_in_a_row, fresh } = status;
    fresh.then_some(flight_v1::AidStatus { innovation, test_ratio, used, refused, refused_in_a_row })
}

/// The motor's estimate as a record; none before ignition.
fn motor_to_log(pilot: &Pilot) -> Option<flight_v1::MotorEstimate> {
    let motor = pilot.motor();
    let ignition_s = motor.ignition_s()?;
    // Of impulse, burn time, ignition, air and shape.
    let sigmas = motor.sigmas();
    Some(flight_v1::MotorEstimate {
        impulse_scale: motor.impulse_scale(),
        burn_time_scale: motor.burn_time_stretch(),
        ignition_s,
        air_scale: motor.air_scale(),
        shape_deviation: motor.shape_deviation(),
        impulse_scale_sigma: sigmas[0],
        burn_time_scale_sigma: sigmas[1],
        ignition_sigma_s: sigmas[2],
        air_scale_sigma: sigmas[3],
        shape_deviation_sigma: sigmas[4],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use flight::computer::crew::{CrewCommand, People, Request};
    use flight::computer::{Commander, LogState};
    use flight::estimation::estimator::{ImuSample, Measurements};
    use flight::rules::arming::{PredictedLanding, Uplink};
    use flight::rules::operator::{Name, Operator, Role};
    use flight::rules::two_person::Station;
    use flight::text::text;
    use nalgebra::Vector3;
    use proptest::prelude::*;
    use prost::Message as _;

    use crate::log::logged::tests::any_bits;

    fn any_uplink() -> impl Strategy<Value = Uplink> {
        prop_oneof![
            Just(Uplink::NotNeeded),
            Just(Uplink::NeverReceived),
            any_bits().prop_map(|age_s| Uplink::Received { age_s }),
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
        let any = (
            0..CrewCommand::ALL.len(),
            any_uplink(),
            prop::option::of(any_station()),
            by,
            any::<Option<u16>>(),
        );
        any.prop_map(|(command, uplink, station, by, confirms)| Request {
            command: CrewCommand::ALL[command],
            uplink,
            station,
            by,
            confirms,
        })
    }

    /// A new command must be added to the list before this compiles and passes.
    #[test]
    fn every_request_has_its_number() {
        let numbers = CrewCommand::ALL.map(|command| match command {
            CrewCommand::Arm => 0,
            CrewCommand::Disarm => 1,
            CrewCommand::Start => 2,
            CrewCommand::Hold => 3,
            CrewCommand::Abort => 4,
            CrewCommand::Tap => 5,
            CrewCommand::TakeCommand => 6,
            CrewCommand::Check => 7,
            CrewCommand::CheckStill => 8,
            CrewCommand::EndCheck => 9,
            CrewCommand::Seen => 10,
        });
        assert_eq!(numbers, core::array::from_fn(|number| number));
    }

    fn any_people() -> impl Strategy<Value = Option<People>> {
        prop_oneof![
            Just(None),
            Just(Some(People::One)),
            any::<u16>().prop_map(|first| Some(People::Two { first })),
        ]
    }

    proptest! {
        #[test]
        fn an_input_survives_the_log_bit_for_bit(
            frame: u64,
            numbers in prop::collection::vec(any_bits(), 18),
            flags: [bool; 9],
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
                found: text!("{found}"),
                landing: landing.map(|(lands, found)| PredictedLanding { lands, found: text!("{found}") }),
            });
            let sensed = SensedInput {
                frame,
                time_s: number(9),
                measured,
                gimbal_rad: [number(10), number(11)],
                fins_rad: [12, 13, 14, 15].map(number),
                contact: flags[1],
                igniter_continuity: flags[2],
                pin_out: flags[3],
                battery_v: flags[7].then_some(number(17)),
                servo_battery_v: flags[0].then_some(number(8)),
                log: LogState { running: flags[4], space_bytes },
                uplink,
                commander: commander.map(|(station, by)| Commander {
                    station,
                    age_s: number(16),
                    by,
                    deaf: flags[1],
                }),
                people,
                booster_attached: flags[6],
            };
            let input =
                Input { sensed, requests: &requests, rehearsed: rehearsed.as_ref(), plan_ready: flags[8] };
            let bytes = input_to_log(&input, v1::ComputerInput::default()).encode_to_vec();
            let read = input_from_log(&v1::ComputerInput::decode(bytes.as_slice()).unwrap()).unwrap();
            // Compared as bytes as well, because a NaN never equals itself.
            prop_assert_eq!(input_to_log(&read.input(), v1::ComputerInput::default()).encode_to_vec(), bytes);
            prop_assert_eq!(read.rehearsed, rehearsed);
            prop_assert_eq!(read.requests.len(), requests.len());
            let fields = |requests: &[Request]| {
                let fields = |request: &Request| (request.command, request.station, request.by, request.confirms);
                requests.iter().map(fields).collect::<Vec<_>>()
            };
            prop_assert_eq!(fields(&read.requests), fields(&requests));
        }
    }

    #[test]
    fn an_unknown_value_is_refused_with_the_number_of_its_frame() {
        let input = v1::ComputerInput {
            frame: 7,
            gimbal_rad: vec![0.0; 2],
            fins_rad: vec![0.0; 4],
            requests: vec![v1::Request { asked: 11, ..v1::Request::default() }],
            ..v1::ComputerInput::default()
        };
        let error = input_from_log(&input).unwrap_err().to_string();
        assert_eq!(error, "frame 7: asked 11 is unknown; this build knows 0 to 10");
        let error = input_from_log(&v1::ComputerInput { gimbal_rad: vec![0.0], ..input }).unwrap_err();
        assert_eq!(error.to_string(), "frame 7: gimbal_rad has 1 values and should have 2");
    }
}
