//! A rocket in space: the wait on its pad, and the pilot that flies it from its release.

use super::pad::PadWatch;
use super::table::PhaseTable;
use crate::computer::memory::remembers;
use crate::computer::pilot::{Pilot, PilotInput, PilotOutput};
use crate::estimation::estimator::StartUncertainty;
use crate::guidance::baseline::Law;
use crate::rules::phase::Phase;
use crate::vehicle::mission::Mission;
use crate::vehicle::rigid::RigidState;

/// The rocket's part of the flight computer.
#[derive(Debug, Clone)]
pub(super) struct Space {
    pub(super) pad: PadWatch,
    pub(super) pilot: Pilot,
    /// The last frame in the air.
    pub(super) last: Option<(PilotInput, PilotOutput)>,
    /// The gate check that the crew was last told of.
    gate_refusal: Option<&'static str>,
}

// The last frame in the air came with its input, and its decisions are compared as output.
remembers!(Space { pad, pilot, gate_refusal } but { last });

impl Space {
    pub(super) fn new(mission: &Mission, law: Law, believed: &RigidState) -> Self {
        let mut pilot = Pilot::at_apogee(mission, 0.0, believed, &StartUncertainty::at_apogee());
        pilot.set_law(law);
        Self { pad: PadWatch::default(), pilot, last: None, gate_refusal: None }
    }

    pub(super) fn fly(&mut self, table: &mut PhaseTable, input: &PilotInput) -> PilotOutput {
        let output = self.pilot.step(table, input);
        self.last = Some((*input, output));
        let refusal = self.pilot.gate_refusal().filter(|_| table.mode().phase == Phase::LandArmed);
        if let Some(check) = refusal.filter(|_| refusal != self.gate_refusal) {
            table.say_gate_shut(check);
        }
        self.gate_refusal = refusal;
        output
    }
}
