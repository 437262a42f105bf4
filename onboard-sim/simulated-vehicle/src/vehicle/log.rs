//! What of a flight goes into its log beside its events.

use protocol::log::computer_v1::ComputerStart;
use protocol::log::record::Record;
use protocol::log::v1;

use super::Vehicle;

impl Vehicle {
    /// What the flight computer was given and decided in the last frame; they come before all others, so that a flight begins
    /// with the power-up of its computer.
    pub fn computer_records(&self) -> Vec<Record> {
        let Some(frame) = &self.computer_frame else { return Vec::new() };
        let start = (self.frames_decided == 1).then(|| {
            let start = ComputerStart { start: tick_log::sortie::pilot_start(&self.sortie) };
            Record::ComputerStart(Box::new(start))
        });
        start.into_iter().chain([Record::ComputerFrame(frame.clone())]).collect()
    }

    /// The other records of the last frame. `changed`: the phase has just changed.
    pub fn records(&self, changed: bool) -> Vec<Record> {
        if self.flown {
            return tick_log::sortie::frame(&self.sortie);
        }
        // Let go in this frame: the first frame of the flight is the next one.
        let just_released =
            self.computer().released_at_s().map(f64::to_bits) == Some(self.time_s().to_bits());
        if changed && just_released { vec![tick_log::sortie::start(&self.sortie)] } else { Vec::new() }
    }

    /// The landing as a log's record, once it is judged. Its time counts from the release, as that of the frames.
    pub fn verdict_record(&self) -> Option<v1::LandingVerdict> {
        self.judged()?;
        tick_log::sortie::verdict(&self.sortie)
    }
}
