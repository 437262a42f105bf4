//! The simulated rocket's state at one instant.

use vehicle_link::snapshot::{BatteryFacts, InSpace as Seen, Snapshot};

use super::{InSpace, Vehicle};

impl Vehicle {
    pub(super) fn snapshot_in_space(&self, space: &InSpace) -> Snapshot {
        let sortie = &space.sortie;
        let (world, battery) = (sortie.world(), sortie.battery());
        let seen = Seen {
            known: self.known(),
            mission: sortie.mission(),
            gimbal_rad: world.gimbal_rad(),
            fins_rad: world.fins_rad(),
            sensors: space.sensors.facts(sortie.frame()),
            battery: Some(BatteryFacts {
                volts: battery.volts(),
                current_a: Some(battery.current_a()),
                left: Some(battery.charge()),
            }),
            rehearsed: sortie.rehearsed().map(|(_, report)| report),
            parachute_ejected: world.parachute_ejected(),
            took_s: space.took_s,
        };
        seen.snapshot().unwrap_or_else(|| unreachable!("the computer of a rocket in space"))
    }
}
