//! Frames and answers survive their way through messages; a frame that misses a part is not used.

use flight::computer::pilot::BoosterCommands;
use flight::rules::phase::Phase;
use hil::carried::{CarriedCommands, CarriedFix, CarriedReadings};
use hil::computer::Answer;
use hil::readings::Switches;
use hil::start::Pace;
use proptest::prelude::*;
use protocol::dialect::MavMessage;
use protocol::frame::{Encoder, Framer};
use protocol::identity::VEHICLE;
use simulated_vehicle::hil::assembly::{AnswerAssembly, FrameAssembly, ToComputer};
use simulated_vehicle::hil::messages::{of_answer, of_frame};

/// The messages after a way through bytes.
fn through_bytes(messages: &[MavMessage]) -> Vec<MavMessage> {
    let mut encoder = Encoder::new(VEHICLE);
    let mut framer = Framer::new();
    messages
        .iter()
        .map(|message| {
            framer.push(encoder.encode(message).as_bytes());
            framer.next_frame().unwrap().decode().unwrap()
        })
        .collect()
}

fn fix() -> impl Strategy<Value = CarriedFix> {
    (any::<[i32; 3]>(), any::<[i16; 3]>(), 0..u64::MAX).prop_map(
        |([latitude_e7, longitude_e7, altitude_mm], velocity_cm_s, valid_at_us)| CarriedFix {
            latitude_e7,
            longitude_e7,
            altitude_mm,
            velocity_cm_s,
            valid_at_us,
        },
    )
}

prop_compose! {
    fn readings()(
        floats in proptest::array::uniform12(-1e6_f32..1e6),
        pressure_altitude_m in proptest::option::of(-1e4_f32..1e4),
        fix in proptest::option::of(fix()),
        range_cm in proptest::option::of(any::<u16>()),
        [contact, igniter_continuity, booster_attached, pin_out] in any::<[bool; 4]>(),
    ) -> CarriedReadings {
        let part = |first: usize| core::array::from_fn(|place| floats[first + place]);
        CarriedReadings {
            gyro_rad_s: part(0),
            specific_force_m_s2: part(3),
            pressure_altitude_m,
            fix,
            range_cm,
            gimbal_rad: [floats[6], floats[7]],
            fins_rad: [floats[8], floats[9], floats[10], floats[11]],
            switches: Switches { contact, igniter_continuity, booster_attached, pin_out },
        }
    }
}

fn whole(messages: &[MavMessage]) -> Vec<ToComputer> {
    let mut assembly = FrameAssembly::default();
    messages.iter().filter_map(|message| assembly.take(message)).collect()
}

proptest! {
    #[test]
    fn a_frame_arrives_as_it_was_sent(readings in readings(), frame in 1_u64..100_000, flight_id: u32) {
        let messages = through_bytes(&of_frame(flight_id, frame, &readings));
        prop_assert_eq!(whole(&messages), vec![ToComputer::Frame { flight_id, frame, readings }]);
    }

    #[test]
    fn a_frame_without_one_of_its_messages_is_not_used(readings in readings(), lost in 0_usize..4) {
        let mut messages = through_bytes(&of_frame(1, 9, &readings));
        messages.remove(lost % messages.len());
        prop_assert_eq!(whole(&messages), vec![]);
    }

    #[test]
    fn a_part_of_another_frame_is_not_taken_for_the_lost_one(readings in readings(), other in readings()) {
        let mut messages = through_bytes(&of_frame(1, 9, &readings));
        let strange: Vec<MavMessage> = through_bytes(&of_frame(1, 7, &other));
        let is_own = |message: &MavMessage| matches!(message, MavMessage::DISTANCE_SENSOR(_));
        prop_assume!(messages.iter().any(is_own));
        messages.retain(|message| !is_own(message));
        let at = messages.len() - 1;
        messages.splice(at..at, strange.into_iter().filter(is_own));
        prop_assert_eq!(whole(&messages), vec![]);
    }

    #[test]
    fn an_answer_arrives_as_it_was_sent(
        turns in proptest::array::uniform6(-1.0_f32..1.0),
        [ignite, parachute, booster, separate] in any::<[bool; 4]>(),
        phase in 0..Phase::ALL.len(),
        digest: u64,
        frame in 0_u64..100_000,
    ) {
        let answer = Answer {
            flight_id: 3,
            frame,
            commands: CarriedCommands {
                gimbal_quarter_turns: [turns[0], turns[1]],
                fins_quarter_turns: [turns[2], turns[3], turns[4], turns[5]],
                ignite,
                parachute,
                booster: BoosterCommands { ignite: booster, separate },
            },
            phase: Phase::ALL[phase],
            digest,
            held: 4,
        };
        let mut assembly = AnswerAssembly::default();
        let messages = through_bytes(&of_answer(&answer, Pace::Lockstep));
        let found: Vec<Answer> = messages.iter().filter_map(|message| assembly.take(message)).collect();
        prop_assert_eq!(found, vec![answer]);
        // Controls without what was said before them are no answer.
        prop_assert_eq!(assembly.take(&messages[1]), None);
    }
}
