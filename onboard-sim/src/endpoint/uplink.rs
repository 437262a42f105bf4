//! What the vehicle does by how well it hears its stations.

use flight::arming::Uplink;
use flight::phase::{Event, HoldCause, Phase, UPLINK_SILENT_S};
use protocol::identity::Address;

use super::VehicleEndpoint;
use crate::craft::{Answer, Asker, Craft, Request, Severity};

impl VehicleEndpoint {
    /// The same for a vehicle that starts by itself: no station has to be heard, and none holds it by falling silent.
    #[must_use]
    pub fn starting_by_itself(self) -> Self {
        Self { starts_by_itself: true, ..self }
    }

    /// Tells the vehicle how well it hears, and holds a countdown whose station has fallen silent. To be called in every
    /// frame, after the frames that have arrived and before the vehicle goes on.
    pub fn watch_the_uplink(&mut self, vehicle: &mut dyn Craft) {
        let time_s = vehicle.time_s();
        if self.starts_by_itself {
            *vehicle.uplink() = Uplink::NotNeeded;
            return;
        }
        *vehicle.uplink() = self.stations.best_uplink(time_s);
        if vehicle.mode().countdown_end_s.is_none() {
            return;
        }
        let Some(station) = self.stations.armed_by() else { return };
        if self.stations.age_s(station, time_s).is_some_and(|age_s| age_s <= UPLINK_SILENT_S) {
            return;
        }
        let Address { system_id, component_id } = station;
        let words = format!("nothing heard of {system_id}/{component_id} for {UPLINK_SILENT_S} s");
        vehicle.say(Severity::Critical, words);
        vehicle.happen(Event::Hold { cause: HoldCause::UplinkSilent });
    }

    /// Puts a station's request to the vehicle, and remembers the station that armed it.
    pub(super) fn put(&mut self, request: Request, station: Address, vehicle: &mut dyn Craft) -> Answer {
        let uplink = if self.starts_by_itself {
            Uplink::NotNeeded
        } else {
            self.stations.uplink(station, vehicle.time_s())
        };
        let was_armed = vehicle.phase() == Phase::PadArmed;
        let answer = vehicle.request_by(request, Asker { station: Some(station), uplink });
        if vehicle.phase() == Phase::PadArmed && !was_armed {
            self.stations.set_armed_by(Some(station));
        }
        answer
    }
}
