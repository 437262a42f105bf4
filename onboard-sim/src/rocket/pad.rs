//! The rocket on its pad: it stands there in the world, and its sensors feel it stand.

use campaign::draw::Draw;
use campaign::fly::FlyError;
use campaign::order::Order;
use flight::estimator::alignment::PadAlignment;
use flight::estimator::{GnssFix, ImuSample, Measurements};
use flight::rigid::{RigidState, upright};
use flight::thrust_curve::ThrustCurve;
use nalgebra::{UnitQuaternion, Vector3};
use world::sensors::{FRAME_MS, SensorFaults, SensorTruth, Sensors};
use world::{Actuators, World};

use crate::craft::{ANSWERING_RAD, SelfTest, TestStep};

/// The pad is judged anew after so many frames: a second.
const WINDOW_FRAMES: u32 = 200;

/// What a second on the pad told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PadFound {
    /// Attitude with the heading of the pad; `None` if the second was not that of a vehicle at rest.
    pub(super) world_from_body: Option<UnitQuaternion<f64>>,
    /// Mean rotation rate, rad/s.
    pub(super) rotation_rad_s: f64,
    /// Mean velocity by satellite, world, m/s; not a number without a fix.
    pub(super) velocity_m_s: Vector3<f64>,
}

/// The pad and what stands on it.
pub(super) struct Pad {
    world: World,
    sensors: Option<Sensors>,
    closed_rad: f64,
    command: Actuators,
    self_test: SelfTest,
    window: Window,
    found: Option<PadFound>,
}

/// Means over the second under way.
#[derive(Debug, Clone, Copy, Default)]
struct Window {
    alignment: PadAlignment,
    frames: u32,
    gyro_sum_rad_s: Vector3<f64>,
    fixes: u32,
    velocity_sum_m_s: Vector3<f64>,
}

impl Pad {
    /// The vehicle of a draw, upright on its feet.
    pub(super) fn new(order: &Order, curve: &ThrustCurve, draw: &Draw) -> Result<Self, FlyError> {
        let airframe = &order.mission.airframe;
        let standing = RigidState::upright(
            airframe.above_feet_m(airframe.mass.loaded_cg_station_m + draw.truth.cg_offset_m[0]),
        );
        let world = World::new(airframe, curve, &draw.truth, &standing, draw.flight_seed)?;
        let sensors = if order.dispersion.sensors {
            Some(Sensors::new(&order.dispersion.sensor_params, draw.flight_seed, 0.0)?)
        } else {
            None
        };
        let closed_rad = airframe.fins.closed_rad();
        Ok(Self {
            world,
            sensors,
            closed_rad,
            command: at_rest(closed_rad, 0.0),
            self_test: SelfTest::NotBegun,
            window: Window::default(),
            found: None,
        })
    }

    /// One frame; what was measured, where sensors are modelled.
    pub(super) fn step(&mut self) -> Option<Measurements> {
        let mut measured = None;
        for _ in 0..FRAME_MS {
            self.world.step(&self.command);
            if let Some(sensors) = &mut self.sensors {
                measured =
                    sensors.observe(&SensorTruth::of(&self.world), &SensorFaults::default()).or(measured);
            }
        }
        self.feel(&measured.unwrap_or_else(|| self.perfect()));
        measured
    }

    /// What perfect sensors would say.
    fn perfect(&self) -> Measurements {
        let state = self.world.state();
        Measurements {
            imu: ImuSample {
                gyro_rad_s: state.rate_rad_s,
                specific_force_m_s2: *self.world.specific_force_m_s2(),
            },
            pressure_altitude_m: None,
            gnss: Some(GnssFix {
                position_m: state.position_m,
                velocity_m_s: state.velocity_m_s,
                valid_at_s: self.world.time_s(),
            }),
            lidar_range_m: None,
        }
    }

    fn feel(&mut self, measurements: &Measurements) {
        let window = &mut self.window;
        window.alignment.take(&measurements.imu);
        window.gyro_sum_rad_s += measurements.imu.gyro_rad_s;
        if let Some(fix) = &measurements.gnss {
            window.fixes += 1;
            window.velocity_sum_m_s += fix.velocity_m_s;
        }
        window.frames += 1;
        if window.frames < WINDOW_FRAMES {
            return;
        }
        let window = core::mem::take(window);
        self.found = Some(PadFound {
            world_from_body: window.alignment.finish(0.0).ok().map(|start| start.world_from_body),
            rotation_rad_s: (window.gyro_sum_rad_s / f64::from(window.frames)).norm(),
            // Without a fix nought by nought: not a number, which passes no check.
            velocity_m_s: window.velocity_sum_m_s / f64::from(window.fixes),
        });
    }

    /// Moves every actuator and brings it back; passed once a second on the pad has been felt as well.
    pub(super) fn test_itself(&mut self, time_s: f64) -> TestStep {
        match self.self_test.step(self.actuators_answer(), time_s) {
            TestStep::Command(angle_rad) => {
                self.command = at_rest(self.closed_rad, angle_rad);
                TestStep::Wait
            }
            TestStep::Passed if self.found.is_none() => TestStep::Wait,
            step => step,
        }
    }

    /// Fins that have come to their commanded angle.
    pub(super) fn fins_answering(&self) -> [bool; 4] {
        let actual = self.world.fins_rad();
        core::array::from_fn(|fin| (self.command.fins_rad[fin] - actual[fin]).abs() <= ANSWERING_RAD)
    }

    fn actuators_answer(&self) -> bool {
        let actual = self.world.gimbal_rad();
        let gimbal = (0..2).all(|axis| (self.command.gimbal_rad[axis] - actual[axis]).abs() <= ANSWERING_RAD);
        gimbal && self.fins_answering() == [true; 4]
    }

    /// What the last second told.
    pub(super) fn found(&self) -> Option<&PadFound> {
        self.found.as_ref()
    }

    /// The state as it was last felt: on the pad, at rest.
    pub(super) fn believed(&self) -> RigidState {
        let found = self.found.as_ref();
        RigidState {
            world_from_body: found.and_then(|found| found.world_from_body).unwrap_or_else(upright),
            velocity_m_s: found.map_or_else(Vector3::zeros, |found| found.velocity_m_s),
            ..RigidState::upright(self.world.cg_above_feet_m())
        }
    }

    /// Commanded and actual angles of gimbal and fins.
    pub(super) fn actuators(&self) -> (&Actuators, [f64; 2], [f64; 4]) {
        (&self.command, self.world.gimbal_rad(), self.world.fins_rad())
    }
}

fn at_rest(closed_rad: f64, moved_rad: f64) -> Actuators {
    Actuators {
        gimbal_rad: [moved_rad; 2],
        fins_rad: [closed_rad + moved_rad; 4],
        ignite: false,
        parachute: false,
    }
}
