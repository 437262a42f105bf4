//! Finds the fields in which two records differ, bit for bit.

use prost::Message;
use prost_reflect::bytes::Bytes;
use prost_reflect::{DynamicMessage, MessageDescriptor, ReflectMessage as _, Value};
use protocol::log::computer_v1::ComputerFrame;
use serde::Serialize;

use super::VerifyReport;
use crate::controller::phase_name;
use crate::log::{LoggedFrame, frame_descriptor, misread_frame};

/// A field in which a recorded and a recomputed frame differ.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldDifference {
    /// Path of the field, as in `output.gimbal_rad[1]`.
    pub path: String,
    /// The value in the log.
    pub recorded: FieldValue,
    /// The value computed now.
    pub recomputed: FieldValue,
    /// Distance of the two in representable numbers; `None` if they have no order.
    pub ulps: Option<u64>,
}

/// A value as text, of a floating-point number with its bits: JSON has no NaN and no infinity, and
/// many readers have no -0.0.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FieldValue {
    /// The shortest text that reads back as the same number, with the sign of zero.
    pub value: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bits: Option<String>,
}

impl FieldValue {
    fn of(value: &Value) -> Self {
        let (value, bits) = match value {
            Value::F64(number) => (format!("{number:?}"), Some(format!("0x{:016x}", number.to_bits()))),
            Value::U32(number) => (number.to_string(), None),
            Value::U64(number) => (number.to_string(), None),
            Value::Bool(flag) => (flag.to_string(), None),
            _ => ("(bytes)".to_owned(), None),
        };
        Self { value, bits }
    }
}

/// Distance of two numbers in representable numbers: 0 for equal bits, 1 for neighbours; -0.0 and
/// 0.0 are 1 apart. `None` if either is NaN.
pub fn ulp_distance(a: f64, b: f64) -> Option<u64> {
    (!a.is_nan() && !b.is_nan()).then(|| rank(a).abs_diff(rank(b)))
}

/// Orders all numbers from -infinity to infinity.
fn rank(number: f64) -> u64 {
    const SIGN: u64 = 1 << 63;
    let bits = number.to_bits();
    if bits & SIGN == 0 { bits | SIGN } else { !bits }
}

/// Every field in which two encoded records of the same kind differ, in the record's order.
pub fn differences(
    descriptor: Option<&MessageDescriptor>,
    recorded: &[u8],
    recomputed: &[u8],
) -> Vec<FieldDifference> {
    let decoded = |bytes: &[u8]| DynamicMessage::decode(descriptor?.clone(), bytes).ok();
    let mut found = Vec::new();
    if let (Some(a), Some(b)) = (decoded(recorded), decoded(recomputed)) {
        compare_messages("", &a, &b, &mut found);
    }
    if found.is_empty() && recorded != recomputed {
        // Records with different bytes must not count as equal, even if no field differs.
        let bytes = Value::Bytes(Bytes::new());
        found.push(difference("(record)".to_owned(), &bytes, &bytes));
    }
    found
}

fn difference(path: String, recorded: &Value, recomputed: &Value) -> FieldDifference {
    let ulps = recorded.as_f64().zip(recomputed.as_f64()).and_then(|(a, b)| ulp_distance(a, b));
    FieldDifference { path, recorded: FieldValue::of(recorded), recomputed: FieldValue::of(recomputed), ulps }
}

fn compare_messages(path: &str, a: &DynamicMessage, b: &DynamicMessage, found: &mut Vec<FieldDifference>) {
    for field in a.descriptor().fields() {
        let name = if path.is_empty() { field.name().to_owned() } else { format!("{path}.{}", field.name()) };
        compare_values(&name, &a.get_field(&field), &b.get_field(&field), found);
    }
}

fn compare_values(path: &str, a: &Value, b: &Value, found: &mut Vec<FieldDifference>) {
    match (a, b) {
        (Value::Message(a), Value::Message(b)) => compare_messages(path, a, b, found),
        (Value::List(a), Value::List(b)) => {
            if a.len() != b.len() {
                let [ours, theirs] = [a.len(), b.len()].map(|length| Value::U64(length as u64));
                found.push(difference(format!("{path}.len"), &ours, &theirs));
            }
            for (index, (a, b)) in a.iter().zip(b).enumerate() {
                compare_values(&format!("{path}[{index}]"), a, b, found);
            }
        }
        // By bits: -0.0 is not 0.0, and a NaN equals itself.
        (Value::F64(x), Value::F64(y)) if x.to_bits() == y.to_bits() => {}
        (Value::F64(_), Value::F64(_)) => found.push(difference(path.to_owned(), a, b)),
        _ if a == b => {}
        _ => found.push(difference(path.to_owned(), a, b)),
    }
}

/// The path of the digest of a computer's memory.
const DIGEST: &str = "state_digest";

/// Most differing fields that are kept of the first diverged frame.
const FIELDS_MAX: usize = 32;

/// A frame that differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Divergence {
    /// Its number since power-up.
    pub frame: u64,
    /// In flight: its number since the release.
    pub in_flight: bool,
    /// Time since the release in flight, since power-up on the pad, s.
    pub time_s: f64,
    pub phase: &'static str,
    /// Number of fields that differ.
    pub fields_different: usize,
    /// The differing fields, in the record's order; only the first of them if there are many.
    pub fields: Vec<FieldDifference>,
}

/// The comparisons so far, beside what their report says of them.
#[derive(Debug, Clone, Default)]
pub(super) struct Tally {
    /// Frames with another output, or with another digest.
    pub(super) outputs_different: u64,
    pub(super) digests_different: u64,
    /// Vehicle time of the first frame, s.
    first_s: Option<f64>,
    recorded: Vec<u8>,
    recomputed: Vec<u8>,
}

impl Tally {
    /// Compares a recorded frame, and the bytes of its record, with the recomputed one.
    ///
    /// # Errors
    /// The record cannot be understood exactly.
    pub(super) fn compare(
        &mut self,
        report: &mut VerifyReport,
        logged: &LoggedFrame,
        data: &[u8],
        again: &ComputerFrame,
    ) -> Result<(), String> {
        let recorded = &logged.record;
        encode_into(again, &mut self.recomputed);
        let same = self.recomputed == data;
        if !same && let Some(reason) = misread_frame(data) {
            return Err(reason);
        }
        let (frame, boot_s) = (recorded.input.frame, recorded.input.time_s);
        if !same {
            encode_into(recorded, &mut self.recorded);
            if self.recorded == self.recomputed {
                // A flag that is 3 instead of 1 reads as the same flag.
                return Err(format!(
                    "frame {frame} has the right values in other bytes than a recorder writes"
                ));
            }
        }
        report.frames_compared += 1;
        report.frames_in_flight += u64::from(logged.since_release.is_some());
        report.span = Some((report.span.map_or(frame, |(first, _)| first), frame));
        report.flight_s = Some(boot_s - *self.first_s.get_or_insert(boot_s));
        if same {
            return Ok(());
        }
        let mut fields = differences(frame_descriptor().as_ref(), &self.recorded, &self.recomputed);
        let fields_different = fields.len();
        let time_s = logged.flight_time_s().unwrap_or(boot_s);
        report.frames_different += 1;
        self.outputs_different +=
            u64::from(fields.iter().any(|field| !field.path.starts_with("input.") && field.path != DIGEST));
        self.digests_different += u64::from(recorded.state_digest != again.state_digest);
        report.fields_different += fields_different as u64;
        if report.first_divergence.is_none() {
            fields.truncate(FIELDS_MAX);
            let (in_flight, phase) = (logged.since_release.is_some(), phase_name(&again.output));
            report.first_divergence =
                Some(Divergence { frame, in_flight, time_s, phase, fields_different, fields });
        }
        Ok(())
    }
}

/// Into a buffer that is used again, and so has its room already.
pub(super) fn encode_into(record: &impl Message, bytes: &mut Vec<u8>) {
    bytes.clear();
    record.encode_raw(bytes);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn neighbours_are_one_apart_across_zero_and_up_to_infinity() {
        assert_eq!(ulp_distance(1.0, 1.0 + f64::EPSILON), Some(1));
        assert_eq!(ulp_distance(-0.0, 0.0), Some(1));
        assert_eq!(ulp_distance(f64::MAX, f64::INFINITY), Some(1));
        assert_eq!(ulp_distance(f64::NEG_INFINITY, f64::INFINITY), Some(2 * f64::INFINITY.to_bits() + 1));
        assert_eq!(ulp_distance(f64::NAN, 1.0), None);
    }

    proptest! {
        #[test]
        fn the_distance_is_symmetric_and_zero_only_for_equal_bits(a: u64, b: u64) {
            let (a, b) = (f64::from_bits(a), f64::from_bits(b));
            prop_assert_eq!(ulp_distance(a, b), ulp_distance(b, a));
            if let Some(distance) = ulp_distance(a, b) {
                prop_assert_eq!(distance == 0, a.to_bits() == b.to_bits());
            }
        }

        #[test]
        fn nans_with_different_payloads_differ(a: u64, b: u64) {
            const NAN: u64 = 0x7ff8_0000_0000_0000;
            let frame = |bits: u64| {
                let mut frame = ComputerFrame::default();
                frame.input.time_s = f64::from_bits(NAN | (bits & 0x7_ffff_ffff_ffff));
                frame.encode_to_vec()
            };
            let found = differences(frame_descriptor().as_ref(), &frame(a), &frame(b));
            if frame(a) == frame(b) {
                prop_assert!(found.is_empty());
            } else {
                prop_assert_eq!(found.len(), 1);
                prop_assert_eq!(&found[0].path, "input.time_s");
                prop_assert_eq!(found[0].ulps, None);
            }
        }
    }

    #[test]
    fn lists_of_different_lengths_differ_in_length() {
        let mut longer = ComputerFrame::default();
        longer.output.fins_rad = vec![1.0, 2.0];
        let mut shorter = longer.clone();
        shorter.output.fins_rad.pop();
        let descriptor = frame_descriptor();
        let found = differences(descriptor.as_ref(), &longer.encode_to_vec(), &shorter.encode_to_vec());
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].path, "output.fins_rad.len");
        assert_eq!(found[0].recorded.value, "2");
    }
}
