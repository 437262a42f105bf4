//! Tests that one changed bit in one recorded output is found at its frame and field.

use protocol::log::computer_v1::ComputerFrame;
use replay::verify::Verification;

use crate::flown::{FLIGHT, verify_frames};

type Flip = fn(&mut ComputerFrame, u32);

fn flip_f64(number: &mut f64, bit: u32) {
    *number = f64::from_bits(number.to_bits() ^ (1 << (bit % 64)));
}

fn flip_u32(number: &mut u32, bit: u32) {
    *number ^= 1 << (bit % 32);
}

/// Every kind of field that is compared.
const FIELDS: [(&str, Flip); 10] = [
    ("output.gimbal_rad[0]", |frame, bit| flip_f64(&mut frame.output.gimbal_rad[0], bit)),
    ("output.gimbal_rad[1]", |frame, bit| flip_f64(&mut frame.output.gimbal_rad[1], bit)),
    ("output.fins_rad[3]", |frame, bit| flip_f64(&mut frame.output.fins_rad[3], bit)),
    ("output.ignite", |frame, _| frame.output.ignite ^= true),
    ("output.parachute", |frame, _| frame.output.parachute ^= true),
    ("output.phase", |frame, bit| flip_u32(&mut frame.output.phase, bit)),
    ("output.level", |frame, bit| flip_u32(&mut frame.output.level, bit)),
    ("output.ignite_booster", |frame, _| frame.output.ignite_booster = true),
    ("output.fins_rad.len", |frame, _| {
        frame.output.fins_rad.pop();
    }),
    ("state_digest", |frame, bit| frame.state_digest ^= 1 << (bit % 64)),
];

/// Every kind of field in a frame of its own, at its lowest and its highest bit.
#[test]
fn one_flipped_bit_is_reported_at_its_frame_and_field() {
    for (place, (path, flip)) in (0_usize..).zip(FIELDS) {
        for bit in [0, 63] {
            let mut frames = FLIGHT.frames[..25].to_vec();
            flip(&mut frames[2 * place], bit);
            let report = verify_frames(&frames);
            assert_eq!(report.outcome, Verification::Diverged, "{path}");
            assert_eq!((report.frames_different, report.fields_different), (1, 1), "{path}: nothing spreads");
            let first = report.first_divergence.unwrap();
            assert_eq!((first.frame, first.fields[0].path.as_str()), (2 * place as u64 + 1, path));
        }
    }
}

#[test]
fn minus_zero_is_not_zero() {
    let mut frames = FLIGHT.frames[..2].to_vec();
    let gimbal_rad = &mut frames[1].output.gimbal_rad[0];
    assert_eq!(gimbal_rad.to_bits(), 0.0_f64.to_bits(), "straight before the burn");
    *gimbal_rad = -0.0;
    let first = verify_frames(&frames).first_divergence.unwrap();
    assert_eq!(first.fields[0].path, "output.gimbal_rad[0]");
    assert_eq!(
        (first.fields[0].recorded.value.as_str(), first.fields[0].recomputed.value.as_str()),
        ("-0.0", "0.0")
    );
    assert_eq!(first.fields[0].ulps, Some(1));
}

/// A NaN input reaches the flight computer with its payload.
#[test]
fn an_input_that_is_not_a_number_is_replayed_like_any_other() {
    let payload = f64::from_bits(0x7ff8_dead_beef_0001);
    let mut frames = FLIGHT.frames[..8].to_vec();
    frames[7].input.measured.imu.gyro_rad_s.x = payload;
    let report = verify_frames(&frames);
    assert_eq!(report.frames_compared, 8);
    assert_eq!(report.first_divergence.unwrap().frame, 8, "the recorded output belonged to another input");
}
