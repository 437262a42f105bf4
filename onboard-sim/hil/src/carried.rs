//! Readings and commands in the units of HIL_SENSOR, HIL_GPS, DISTANCE_SENSOR, HIL_ACTUATOR_CONTROLS and of our own
//! messages, which are coarser than a simulated sensor.
//!
//! Inertial values, heights and angles are single precision. A place is in 1e-7 degrees (11 mm) and millimetres, a
//! velocity in cm/s, a range in cm. A world that narrows its readings before its own flight computer gets them flies the
//! same bits as one whose flight computer is at the other end of a wire.

use core::f64::consts::FRAC_PI_2;

use flight::computer::Commands;
use flight::computer::pilot::BoosterCommands;
use flight::estimation::estimator::{GnssFix, ImuSample, Measurements};
use flight::vehicle::mission::Mission;
use flight::vehicle::site::Site;
use nalgebra::Vector3;

use crate::readings::{Feedback, Readings, Switches};

/// A wire for the vehicle of one mission: it carries places on the globe and heights above the sea.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wire {
    site: Site,
    pad_altitude_m: f64,
}

/// The readings of a frame in the units of the wire.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CarriedReadings {
    pub gyro_rad_s: [f32; 3],
    pub specific_force_m_s2: [f32; 3],
    /// Above the sea.
    pub pressure_altitude_m: Option<f32>,
    pub fix: Option<CarriedFix>,
    pub range_cm: Option<u16>,
    pub gimbal_rad: [f32; 2],
    pub fins_rad: [f32; 4],
    pub switches: Switches,
}

/// A satellite fix in the units of HIL_GPS.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CarriedFix {
    pub latitude_e7: i32,
    pub longitude_e7: i32,
    /// Above the sea.
    pub altitude_mm: i32,
    /// North, east, down.
    pub velocity_cm_s: [i16; 3],
    /// On the flight computer's clock.
    pub valid_at_us: u64,
}

/// Commands in the units of HIL_ACTUATOR_CONTROLS, where an angle of a quarter turn is 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CarriedCommands {
    /// Pitch, yaw.
    pub gimbal_quarter_turns: [f32; 2],
    pub fins_quarter_turns: [f32; 4],
    pub ignite: bool,
    pub parachute: bool,
    pub booster: BoosterCommands,
}

impl Wire {
    pub fn new(mission: &Mission) -> Self {
        Self { site: mission.site, pad_altitude_m: mission.pad_altitude_m }
    }

    /// The readings as the wire carries them.
    pub fn narrow(&self, readings: &Readings) -> CarriedReadings {
        let Measurements { imu, pressure_altitude_m, gnss, lidar_range_m } = &readings.measured;
        let Feedback { gimbal_rad, fins_rad, switches } = readings.feedback;
        CarriedReadings {
            gyro_rad_s: single(&imu.gyro_rad_s),
            specific_force_m_s2: single(&imu.specific_force_m_s2),
            pressure_altitude_m: pressure_altitude_m.map(|height_m| (height_m + self.pad_altitude_m) as f32),
            fix: gnss.as_ref().map(|fix| self.narrow_fix(fix)),
            range_cm: lidar_range_m.map(|range_m| libm::round(100.0 * range_m) as u16),
            gimbal_rad: gimbal_rad.map(|angle| angle as f32),
            fins_rad: fins_rad.map(|angle| angle as f32),
            switches,
        }
    }

    /// The readings that the flight computer gets from what the wire has carried.
    pub fn widen(&self, carried: &CarriedReadings) -> Readings {
        let imu = ImuSample {
            gyro_rad_s: double(&carried.gyro_rad_s),
            specific_force_m_s2: double(&carried.specific_force_m_s2),
        };
        Readings {
            measured: Measurements {
                imu,
                pressure_altitude_m: carried
                    .pressure_altitude_m
                    .map(|height_m| f64::from(height_m) - self.pad_altitude_m),
                gnss: carried.fix.as_ref().map(|fix| self.widen_fix(fix)),
                lidar_range_m: carried.range_cm.map(|range_cm| 0.01 * f64::from(range_cm)),
            },
            feedback: Feedback {
                gimbal_rad: carried.gimbal_rad.map(f64::from),
                fins_rad: carried.fins_rad.map(f64::from),
                switches: carried.switches,
            },
        }
    }

    /// The readings after a way over the wire.
    pub fn carry(&self, readings: &Readings) -> Readings {
        self.widen(&self.narrow(readings))
    }

    /// World x is north, so y is west. A value beyond what its field holds becomes the field's largest.
    fn narrow_fix(&self, fix: &GnssFix) -> CarriedFix {
        let (latitude_deg, longitude_deg) = self.site.at_deg(fix.position_m.x, -fix.position_m.y);
        let velocity_m_s = &fix.velocity_m_s;
        CarriedFix {
            latitude_e7: libm::round(1e7 * latitude_deg) as i32,
            longitude_e7: libm::round(1e7 * longitude_deg) as i32,
            altitude_mm: libm::round(1e3 * (fix.position_m.z + self.pad_altitude_m)) as i32,
            velocity_cm_s: [velocity_m_s.x, -velocity_m_s.y, -velocity_m_s.z]
                .map(|speed_m_s| libm::round(100.0 * speed_m_s) as i16),
            valid_at_us: libm::round(1e6 * fix.valid_at_s) as u64,
        }
    }

    fn widen_fix(&self, fix: &CarriedFix) -> GnssFix {
        let degrees = |e7: i32| f64::from(e7) / 1e7;
        let (north_m, east_m) = self.site.place_m(degrees(fix.latitude_e7), degrees(fix.longitude_e7));
        let height_m = f64::from(fix.altitude_mm) / 1e3 - self.pad_altitude_m;
        let [north_m_s, east_m_s, down_m_s] = fix.velocity_cm_s.map(|speed_cm_s| f64::from(speed_cm_s) / 1e2);
        GnssFix {
            position_m: Vector3::new(north_m, -east_m, height_m),
            velocity_m_s: Vector3::new(north_m_s, -east_m_s, -down_m_s),
            // Exact for 285 years.
            valid_at_s: fix.valid_at_us as f64 / 1e6,
        }
    }
}

impl CarriedCommands {
    /// The commands as the wire carries them.
    pub fn narrow(commands: &Commands) -> Self {
        Self {
            gimbal_quarter_turns: commands.gimbal_rad.map(|angle_rad| (angle_rad / FRAC_PI_2) as f32),
            fins_quarter_turns: commands.fins_rad.map(|angle_rad| (angle_rad / FRAC_PI_2) as f32),
            ignite: commands.ignite,
            parachute: commands.parachute,
            booster: commands.booster,
        }
    }

    /// The commands that arrive.
    pub fn widen(&self) -> Commands {
        let radians = |quarter_turns: f32| f64::from(quarter_turns) * FRAC_PI_2;
        Commands {
            gimbal_rad: self.gimbal_quarter_turns.map(radians),
            fins_rad: self.fins_quarter_turns.map(radians),
            ignite: self.ignite,
            parachute: self.parachute,
            booster: self.booster,
        }
    }

    /// The same positions of the servos without any current.
    #[must_use]
    pub fn without_currents(self) -> Self {
        Self { ignite: false, booster: BoosterCommands::default(), ..self }
    }
}

fn single(vector: &Vector3<f64>) -> [f32; 3] {
    [vector.x as f32, vector.y as f32, vector.z as f32]
}

fn double(vector: &[f32; 3]) -> Vector3<f64> {
    Vector3::from(vector.map(f64::from))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn wire() -> Wire {
        Wire { site: Site::default(), pad_altitude_m: 667.0 }
    }

    fn vector(largest: f64) -> impl Strategy<Value = Vector3<f64>> {
        let axis = -largest..largest;
        (axis.clone(), axis.clone(), axis).prop_map(|(x, y, z)| Vector3::new(x, y, z))
    }

    fn readings() -> impl Strategy<Value = Readings> {
        let fix =
            (vector(500.0), vector(90.0), 0.0..200.0).prop_map(|(position_m, velocity_m_s, valid_at_s)| {
                GnssFix { position_m, velocity_m_s, valid_at_s }
            });
        let measured = (
            (vector(35.0), vector(160.0)),
            proptest::option::of(-10.0..500.0),
            proptest::option::of(fix),
            proptest::option::of(0.05..12.0),
        )
            .prop_map(
                |((gyro_rad_s, specific_force_m_s2), pressure_altitude_m, gnss, lidar_range_m)| {
                    let imu = ImuSample { gyro_rad_s, specific_force_m_s2 };
                    Measurements { imu, pressure_altitude_m, gnss, lidar_range_m }
                },
            );
        (measured, any::<[bool; 4]>(), proptest::array::uniform6(-1.6..1.6)).prop_map(
            |(measured, [contact, igniter_continuity, booster_attached, pin_out], angles)| Readings {
                measured,
                feedback: Feedback {
                    gimbal_rad: [angles[0], angles[1]],
                    fins_rad: [angles[2], angles[3], angles[4], angles[5]],
                    switches: Switches { contact, igniter_continuity, booster_attached, pin_out },
                },
            },
        )
    }

    proptest! {
        #[test]
        fn what_was_carried_once_is_carried_again_without_change(readings in readings()) {
            let wire = wire();
            let once = wire.carry(&readings);
            prop_assert_eq!(wire.carry(&once), once);
            prop_assert_eq!(wire.narrow(&once), wire.narrow(&readings));
        }

        #[test]
        fn readings_change_by_half_a_unit_of_the_wire_at_most(readings in readings()) {
            let carried = wire().carry(&readings);
            let (before, after) = (&readings.measured, &carried.measured);
            prop_assert!((before.imu.gyro_rad_s - after.imu.gyro_rad_s).amax() <= 2e-6);
            prop_assert!((before.imu.specific_force_m_s2 - after.imu.specific_force_m_s2).amax() <= 1e-5);
            prop_assert_eq!(readings.feedback.switches, carried.feedback.switches);
            if let (Some(before), Some(after)) = (before.pressure_altitude_m, after.pressure_altitude_m) {
                prop_assert!((before - after).abs() <= 6.2e-5);
            }
            if let (Some(before), Some(after)) = (before.lidar_range_m, after.lidar_range_m) {
                prop_assert!((before - after).abs() <= 0.005_000_1);
            }
            if let (Some(before), Some(after)) = (&before.gnss, &after.gnss) {
                prop_assert!((before.position_m - after.position_m).amax() <= 0.005_6);
                prop_assert!((before.velocity_m_s - after.velocity_m_s).amax() <= 0.005_000_1);
                prop_assert!((before.valid_at_s - after.valid_at_s).abs() <= 0.51e-6);
            }
        }

        #[test]
        fn commands_are_carried_again_without_change(angles in proptest::array::uniform6(-1.6..1.6)) {
            let commands = Commands {
                gimbal_rad: [angles[0], angles[1]],
                fins_rad: [angles[2], angles[3], angles[4], angles[5]],
                ignite: true,
                parachute: false,
                booster: BoosterCommands::default(),
            };
            let once = CarriedCommands::narrow(&commands);
            prop_assert_eq!(CarriedCommands::narrow(&once.widen()), once);
            for (before, after) in angles.iter().zip(once.widen().gimbal_rad) {
                prop_assert!((before - after).abs() < 1e-7);
            }
        }
    }

    #[test]
    fn values_beyond_a_field_become_its_largest() {
        let fix = GnssFix {
            position_m: Vector3::new(0.0, 0.0, 1e9),
            velocity_m_s: Vector3::new(1e6, 0.0, f64::NAN),
            valid_at_s: -1.0,
        };
        let carried = wire().narrow_fix(&fix);
        assert_eq!(carried.altitude_mm, i32::MAX);
        assert_eq!(carried.velocity_cm_s, [i16::MAX, 0, 0]);
        assert_eq!(carried.valid_at_us, 0);
    }
}
