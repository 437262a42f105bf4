//! The controller, fed from a log.

use flight::phase::Phase;
use flight::profile::Profile;
use prost::Message as _;
use protocol::log::v1;
use tick_log::TickLogError;

use super::difference::differences;
use super::growth::Growth;
use super::report::Divergence;
use crate::controller::LoggedController;

/// Fields of the first diverged tick that are kept.
const FIELDS_KEPT: usize = 32;

/// Re-executes ticks and compares them; ticks must come in order, from the first one on.
#[derive(Debug)]
pub struct Verifier {
    controller: LoggedController,
    recorded: Vec<u8>,
    recomputed: Vec<u8>,
    pub(super) counts: Counts,
    pub(super) first: Option<Divergence>,
    pub(super) growth: Growth,
}

/// What has been compared so far.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    pub(super) ticks: u64,
    pub(super) ticks_different: u64,
    pub(super) fields_different: u64,
    pub(super) first: Option<Moment>,
    pub(super) last: Option<Moment>,
}

/// A tick and its vehicle time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moment {
    pub(super) tick: u64,
    pub(super) time_s: f64,
}

impl Verifier {
    /// The controller of a profile before its first tick.
    pub fn new(profile: &Profile) -> Self {
        Self {
            controller: LoggedController::new(profile),
            recorded: Vec::new(),
            recomputed: Vec::new(),
            counts: Counts::default(),
            first: None,
            growth: Growth::default(),
        }
    }

    /// Re-executes the next tick and compares it with its record.
    ///
    /// # Errors
    /// The recorded input cannot be given to this build's controller.
    pub fn check(&mut self, tick: &v1::ControllerTick) -> Result<(), TickLogError> {
        let again = self.controller.run_again(tick)?;
        encode_into(tick, &mut self.recorded);
        encode_into(&again, &mut self.recomputed);

        self.counts.ticks += 1;
        let moment = Moment { tick: tick.input.tick, time_s: tick.input.time_s };
        self.counts.first.get_or_insert(moment);
        self.counts.last = Some(moment);
        if self.recorded != self.recomputed {
            let mut fields = differences(&self.recorded, &self.recomputed);
            self.counts.ticks_different += 1;
            self.counts.fields_different += fields.len() as u64;
            self.growth.note(tick, &again, &fields);
            if self.first.is_none() {
                let fields_different = fields.len();
                fields.truncate(FIELDS_KEPT);
                self.first = Some(Divergence {
                    tick: tick.input.tick,
                    time_s: tick.input.time_s,
                    phase: phase_name(tick.input.phase),
                    fields_different,
                    fields,
                });
            }
        }
        Ok(())
    }
}

/// The controller has taken the input, so the phase is a known one.
fn phase_name(number: u32) -> &'static str {
    u8::try_from(number).ok().and_then(Phase::from_index).map_or("unknown", Phase::name)
}

fn encode_into(tick: &v1::ControllerTick, bytes: &mut Vec<u8>) {
    bytes.clear();
    bytes.reserve(tick.encoded_len());
    tick.encode_raw(bytes);
}
