//! A rocket in space: the wait on its pad, and the pilot that flies it from its release.

use super::pad::PadWatch;
use super::table::PhaseTable;
use crate::computer::memory::remembers;
use crate::computer::pilot::{Pilot, PilotInput, PilotOutput};
use crate::estimation::estimator::StartUncertainty;
use crate::guidance::baseline::Law;
use crate::rules::phase::Phase;
use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use crate::vehicle::mission::Mission;
use crate::vehicle::profile::StartPoint;
use crate::vehicle::rigid::RigidState;

/// The rocket's part of the flight computer.
#[derive(Debug, Clone)]
pub(super) struct Space {
    pub(super) pad: PadWatch,
    pub(super) pilot: Pilot,
    /// The law and the state at power-up, to power up again.
    pub(super) law: Law,
    pub(super) believed: RigidState,
    /// The last frame in the air.
    pub(super) last: Option<(PilotInput, PilotOutput)>,
    /// The gate check that the crew was last told of.
    gate_refusal: Option<&'static str>,
}

// Law and first state are constants of the flight. The last frame in the air came with its input, and its decisions are compared as output.
remembers!(Space { pad, pilot, gate_refusal } but { law, believed, last });

impl Space {
    pub(super) fn new(mission: &Mission, law: Law, believed: &RigidState) -> Self {
        let uncertainty = StartUncertainty::at_start(mission.start.at);
        let mut pilot = Pilot::starting(mission, 0.0, believed, &uncertainty);
        pilot.set_law(law.clone());
        let pad = PadWatch::default();
        Self { pad, pilot, law, believed: *believed, last: None, gate_refusal: None }
    }

    pub(super) fn start_point(&self) -> StartPoint {
        self.pilot.mission().start.at
    }

    /// Whether the parachute fills before a vehicle that falls from its drone meets the ground.
    pub(super) fn parachute_fills_below_the_drone(&self) -> bool {
        let parachute = &self.pilot.mission().airframe.parachute;
        // From rest it falls faster and faster: the speed when the lines are taut.
        let delay_s = parachute.ejection_delay_s;
        let fall_m = 0.5 * STANDARD_GRAVITY_M_S2 * delay_s * delay_s + parachute.inflation_distance_m;
        self.pad.stance(true).hanging_m.is_some_and(|height_m| height_m > fall_m)
    }

    /// The flight begins. A vehicle that stood on its rail knows its attitude and the bias of its gyro from there.
    pub(super) fn leave_the_pad(&mut self) {
        let mission = self.pilot.mission();
        if let (Some(launch), Some(start)) = (&mission.launch, self.pad.at_rest())
            && mission.start.at == StartPoint::Pad
        {
            let believed = RigidState {
                world_from_body: start.world_from_body,
                ..launch.standing(mission.airframe.mass.loaded_cg_station_m)
            };
            self.pilot.stand(&believed, start.gyro_bias_rad_s);
        }
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
