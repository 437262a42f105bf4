//! What of a flight goes into its log beside its events.

use protocol::log::computer_v1::ComputerStart;
use protocol::log::record::Record;
use protocol::log::v1;

use super::{Flight, Judged, Vehicle};

impl Vehicle {
    /// What the flight computer was given and decided in the last frame; they come before all others, so that a flight begins
    /// with the power-up of its computer.
    pub fn computer_records(&self) -> Vec<Record> {
        let Some(frame) = &self.computer_frame else { return Vec::new() };
        let start =
            (self.frames_decided == 1).then(|| Record::ComputerStart(Box::new(self.computer_start())));
        start.into_iter().chain([Record::ComputerFrame(frame.clone())]).collect()
    }

    fn computer_start(&self) -> ComputerStart {
        match &self.flight {
            Flight::Space(space) => {
                ComputerStart { in_space: Some(tick_log::sortie::pilot_start(&space.sortie)), in_plane: None }
            }
            Flight::Plane(flight) => ComputerStart {
                in_space: None,
                in_plane: Some(tick_log::state_to_log(&flight.drawn().release)),
            },
        }
    }

    /// The other records of the last frame. `changed`: the phase has just changed.
    pub fn records(&self, changed: bool) -> Vec<Record> {
        match &self.flight {
            Flight::Space(space) if space.flown => tick_log::sortie::frame(&space.sortie),
            // Let go in this frame: the first frame of the flight is the next one.
            Flight::Space(space) if changed && self.is_just_released() => {
                vec![tick_log::sortie::start(&space.sortie)]
            }
            Flight::Space(_) => Vec::new(),
            Flight::Plane(flight) => {
                // The waiting vehicle does not move: once a second and at every change of phase is enough to see that.
                let moving = !self.phase().on_pad() && !self.is_over();
                let now = moving || changed || self.time_s().fract() < 0.015;
                now.then(|| Record::PlantTruth(Box::new(tick_log::plant_truth(flight)))).into_iter().collect()
            }
        }
    }

    fn is_just_released(&self) -> bool {
        self.computer().released_at_s().is_some_and(|at_s| at_s.to_bits() == self.time_s().to_bits())
    }

    /// The landing as a log's record, once it is judged. Of a rocket in space its time counts from apogee, as that of the
    /// frames.
    pub fn verdict_record(&self) -> Option<v1::LandingVerdict> {
        let Judged { impact, verdict, .. } = self.judged()?;
        match &self.flight {
            Flight::Space(space) => tick_log::sortie::verdict(&space.sortie),
            Flight::Plane(_) => Some(v1::LandingVerdict {
                ending: Some(tick_log::ending_in_plane(&verdict, self.aborted()).to_string()),
                ..tick_log::verdict_to_log(impact.time_s, &impact.state, &verdict)
            }),
        }
    }
}
