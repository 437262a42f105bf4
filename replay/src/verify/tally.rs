//! Compares records of any kind and counts the differences.

use prost::Message;
use prost_reflect::MessageDescriptor;
use serde::Serialize;

use super::difference::{FieldDifference, differences};
use super::growth::{Growth, GrowthStep};
use crate::controller::{Moment, Replayed};

/// Most differing fields that are kept of the first diverged tick.
const FIELDS_KEPT: usize = 32;

/// A tick that differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Divergence {
    /// Its number.
    pub tick: u64,
    /// Vehicle time, s.
    pub time_s: f64,
    pub phase: &'static str,
    /// Number of fields that differ.
    pub fields_different: usize,
    /// The differing fields, in the record's order; only the first of them if there are many.
    pub fields: Vec<FieldDifference>,
}

/// The comparisons so far.
#[derive(Debug, Clone, Default)]
pub(super) struct Tally {
    pub(super) ticks: u64,
    pub(super) ticks_different: u64,
    pub(super) fields_different: u64,
    pub(super) first: Option<Moment>,
    pub(super) last: Option<Moment>,
    pub(super) divergence: Option<Divergence>,
    pub(super) growth: Growth,
    recorded: Vec<u8>,
    recomputed: Vec<u8>,
}

impl Tally {
    /// Compares a record with the recomputed one.
    pub(super) fn compare<C: Replayed>(
        &mut self,
        descriptor: Option<&MessageDescriptor>,
        recorded: &C::Tick,
        again: &C::Tick,
    ) {
        let moment = C::moment(again);
        encode_into(recorded, &mut self.recorded);
        encode_into(again, &mut self.recomputed);
        self.ticks += 1;
        self.first.get_or_insert(moment);
        self.last = Some(moment);
        if self.recorded != self.recomputed {
            let fields = differences(descriptor, &self.recorded, &self.recomputed);
            let axes = C::gimbal_rad(recorded).iter().zip(C::gimbal_rad(again));
            let gimbal_rad = axes.map(|(then, now)| (then - now).abs()).fold(0.0, f64::max);
            self.differs(moment, fields, gimbal_rad);
        }
    }

    fn differs(&mut self, moment: Moment, mut fields: Vec<FieldDifference>, gimbal_rad: f64) {
        let Moment { tick, time_s, phase } = moment;
        let fields_different = fields.len();
        self.ticks_different += 1;
        self.fields_different += fields_different as u64;
        self.growth.note(GrowthStep {
            tick,
            time_s,
            fields_different,
            gimbal_rad,
            worst_ulps: fields.iter().filter_map(|field| field.ulps).max(),
        });
        if self.divergence.is_none() {
            fields.truncate(FIELDS_KEPT);
            self.divergence = Some(Divergence { tick, time_s, phase, fields_different, fields });
        }
    }
}

fn encode_into(record: &impl Message, bytes: &mut Vec<u8>) {
    bytes.clear();
    bytes.reserve(record.encoded_len());
    record.encode_raw(bytes);
}
