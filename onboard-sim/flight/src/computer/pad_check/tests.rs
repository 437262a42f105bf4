use alloc::collections::VecDeque;

use nalgebra::Vector3;
use proptest::prelude::*;

use super::*;
use crate::computer::LogState;
use crate::estimation::estimator::{FixQuality, GnssFix, ImuSample, Measurements};
use crate::vehicle::airframe::Servo;

fn mission() -> Mission {
    let mut mission = crate::vehicles::mission::builtin("mk2").unwrap().unwrap();
    mission.start.at = StartPoint::Pad;
    mission
}

/// The fault of the vehicle.
#[derive(Debug, Clone, Copy)]
struct Wrong {
    /// The faulty surface.
    surface: usize,
    /// It does not move.
    stuck: bool,
    /// Its rate, of its airframe's.
    rate_share: f64,
    /// Its delay is longer by this, s.
    later_s: f64,
    /// Its feedback is off by this, rad.
    off_rad: f64,
}

const NOTHING_WRONG: Wrong = Wrong { surface: 0, stuck: false, rate_share: 1.0, later_s: 0.0, off_rad: 0.0 };

/// Surfaces with a delay and a rate, as simple as possible.
struct Bench {
    servos: [Servo; SURFACES],
    lines_rad: [VecDeque<f64>; SURFACES],
    at_rad: [f64; SURFACES],
    wrong: Wrong,
}

impl Bench {
    fn new(airframe: &Airframe, wrong: Wrong) -> Self {
        let (gimbal, fin) = (airframe.gimbal.servo, airframe.fins.servo);
        let servos = [gimbal, gimbal, fin, fin, fin, fin];
        let lines_rad = core::array::from_fn(|surface| {
            let later_s = if surface == wrong.surface { wrong.later_s } else { 0.0 };
            let frames = libm::round((servos[surface].delay_s + later_s) / crate::computer::FRAME_S) as usize;
            VecDeque::from(vec![0.0; frames])
        });
        Self { servos, lines_rad, at_rad: [0.0; SURFACES], wrong }
    }

    fn step(&mut self, told: Option<SurfaceCommand>) -> [f64; SURFACES] {
        for surface in 0..SURFACES {
            let wanted_rad = told.filter(|(moved, _)| *moved == surface).map_or(0.0, |(_, angle)| angle);
            self.lines_rad[surface].push_back(wanted_rad);
            let wanted_rad = self.lines_rad[surface].pop_front().unwrap();
            let is_wrong = surface == self.wrong.surface;
            if is_wrong && self.wrong.stuck {
                continue;
            }
            let share = if is_wrong { self.wrong.rate_share } else { 1.0 };
            let most_rad = share * self.servos[surface].rate_rad_s() * crate::computer::FRAME_S;
            self.at_rad[surface] += (wanted_rad - self.at_rad[surface]).clamp(-most_rad, most_rad);
        }
        let mut found_rad = self.at_rad;
        found_rad[self.wrong.surface] += self.wrong.off_rad;
        found_rad
    }
}

/// Samples of a vehicle at rest, with this multiple of the assumed noise.
fn at_rest(frame: u32, noise: f64) -> Measurements {
    // Plus and minus one in turn: a spread of one.
    let sign = if frame.is_multiple_of(2) { noise } else { -noise };
    let (gyro_rad_s, force_m_s2) = (0.5_f64.to_radians() * sign, 0.0637 * sign);
    Measurements {
        imu: ImuSample {
            gyro_rad_s: Vector3::new(0.003 + gyro_rad_s, 0.0, gyro_rad_s),
            specific_force_m_s2: Vector3::new(9.80665, force_m_s2, 0.0),
        },
        pressure_altitude_m: frame.is_multiple_of(4).then_some(if frame.is_multiple_of(8) {
            0.3 * noise
        } else {
            -0.3 * noise
        }),
        gnss: frame.is_multiple_of(40).then_some(GnssFix {
            position_m: Vector3::zeros(),
            velocity_m_s: Vector3::new(0.05 * sign, 0.0, 0.0),
            valid_at_s: 0.0,
            quality: FixQuality::default(),
        }),
        lidar_range_m: None,
    }
}

/// Switches, battery and log without faults.
fn sound() -> SensedInput {
    SensedInput {
        igniter_continuity: true,
        booster_attached: true,
        battery_v: Some(8.1),
        log: LogState { running: true, space_bytes: 1 << 30 },
        ..SensedInput::default()
    }
}

fn reading(
    [pitch, yaw, one, two, three, four]: [f64; SURFACES],
    measured: Measurements,
    switches: &SensedInput,
) -> SensedInput {
    SensedInput { gimbal_rad: [pitch, yaw], fins_rad: [one, two, three, four], measured, ..*switches }
}

fn checked(wrong: Wrong, noise: f64, switches: &SensedInput, moves: bool) -> PadCheck {
    let mission = mission();
    let mut bench = Bench::new(&mission.airframe, wrong);
    let mut check = PadCheck::default();
    check.begin(&mission.airframe, moves, None);
    let mut told = None;
    for frame in 0..6000 {
        let measured = at_rest(frame, noise);
        let seen = reading(bench.step(told), measured, switches);
        let before = check.progress_percent();
        told = check.step(&seen, &mission, &mission.arming);
        assert!(check.progress_percent() >= before, "frame {frame}");
        if !check.is_running() {
            assert!(told.is_none(), "at rest at its end");
            return check;
        }
    }
    panic!("it does not end")
}

fn failing(check: &PadCheck) -> Vec<Item> {
    let failed = check.findings.iter().filter(|found| found.verdict == Verdict::NotOk);
    failed.map(|found| found.item).collect()
}

#[test]
fn a_sound_vehicle_passes_and_every_item_has_its_value() {
    let check = checked(NOTHING_WRONG, 1.0, &sound(), true);
    assert_eq!((check.state, check.run, check.progress_percent()), (CheckState::Passed, 1, 100));
    assert_eq!(check.findings.len(), 3 * SURFACES + 9 + 6);
    for found in &check.findings {
        let shown = matches!(found.item, Item::LidarRange);
        assert!(shown || found.value.is_finite(), "{found:?}");
    }
    let of = |item| check.findings.iter().find(|found| found.item == item).unwrap().value;
    // The gimbal goes 7 degrees to either side, a fin 90 degrees.
    assert!((of(Item::Range(0)).to_degrees() - 14.0).abs() < 0.1);
    assert!((of(Item::Range(5)).to_degrees() - 90.0).abs() < 0.1);
    assert!((of(Item::GyroBias) - 0.003).abs() < 1e-4);
    // The servos' delay of 20 ms, and the frames that it takes to see it.
    assert!((0.020..=0.035).contains(&of(Item::Lag(3))), "{}", of(Item::Lag(3)));
}

#[test]
fn each_wrong_surface_is_named_with_what_is_wrong() {
    for surface in 0..SURFACES {
        let of = |wrong: Wrong| failing(&checked(Wrong { surface, ..wrong }, 1.0, &sound(), true));
        let all = [Item::Range(surface), Item::Error(surface), Item::Lag(surface)];
        assert_eq!(of(Wrong { stuck: true, ..NOTHING_WRONG }), all, "stuck");
        assert_eq!(of(Wrong { later_s: 0.04, ..NOTHING_WRONG }), [Item::Lag(surface)], "late");
        assert_eq!(of(Wrong { rate_share: 0.5, ..NOTHING_WRONG })[..], all[2..], "slow");
        assert_eq!(of(Wrong { off_rad: f64::NAN, ..NOTHING_WRONG }), all, "no feedback");
        let off = of(Wrong { off_rad: 0.03, ..NOTHING_WRONG });
        assert!(off.contains(&Item::Error(surface)), "crooked: {off:?}");
    }
}

/// The lowest voltage counts, not the last one.
#[test]
fn a_battery_that_sags_during_the_check_fails_it() {
    let (mission, mut check) = (mission(), PadCheck::default());
    check.begin(&mission.airframe, false, None);
    for (frame, servo_volts) in (0..).zip([12.0, 10.9].into_iter().chain(core::iter::repeat(12.0))) {
        let switches = SensedInput { servo_battery_v: Some(servo_volts), ..sound() };
        check.step(&reading([0.0; SURFACES], at_rest(frame, 1.0), &switches), &mission, &mission.arming);
        if !check.is_running() {
            break;
        }
    }
    assert_eq!(failing(&check), [Item::ServoBatteryVoltage]);
    let found = check.findings.iter().find(|found| found.item == Item::ServoBatteryVoltage);
    assert!(found.is_some_and(|found| (found.value - 10.9).abs() < 1e-12), "{found:?}");
}

#[test]
fn each_sensor_and_switch_is_judged() {
    let still = |noise, switches: SensedInput| failing(&checked(NOTHING_WRONG, noise, &switches, false));
    assert_eq!(still(3.0, sound()), [Item::GyroNoise, Item::AccelerometerNoise, Item::BarometerNoise]);
    assert_eq!(still(1.0, SensedInput { igniter_continuity: false, ..sound() }), [Item::IgniterContinuity]);
    assert_eq!(still(1.0, SensedInput { battery_v: Some(7.3), ..sound() }), [Item::BatteryVoltage]);
    assert_eq!(still(1.0, SensedInput { battery_v: Some(f64::NAN), ..sound() }), [Item::BatteryVoltage]);
    assert_eq!(still(1.0, SensedInput { battery_v: None, ..sound() }), []);
    for volts in [11.0, f64::NAN] {
        let servos = SensedInput { servo_battery_v: Some(volts), ..sound() };
        assert_eq!(still(1.0, servos), [Item::ServoBatteryVoltage]);
    }
    assert_eq!(
        still(1.0, SensedInput { log: LogState { running: false, ..sound().log }, ..sound() }),
        [Item::LogRunning]
    );
    assert_eq!(
        still(1.0, SensedInput { log: LogState { space_bytes: 1 << 20, ..sound().log }, ..sound() }),
        [Item::LogSpace]
    );
    assert_eq!(still(1.0, SensedInput { pin_out: true, ..sound() }), [], "the pin is only shown");
    assert_eq!(still(f64::NAN, sound()).len(), 7, "no number passes");
}

/// A mount skewed by 4 degrees is indistinguishable from a rail that leans by 4 degrees: the crew
/// inspects both.
#[test]
fn a_mount_that_leans_further_than_stated_fails() {
    let lean = |deg: f64, mounting_deg: f64, at: StartPoint| {
        let mut mission = mission();
        mission.estimator.mounting_deg = mounting_deg;
        mission.start.at = at;
        let (sin, cos) = libm::sincos(deg.to_radians());
        let mut still = Still::default();
        for frame in 0..sweep::STILL_FRAMES {
            let mut measured = at_rest(frame, 1.0);
            measured.imu.specific_force_m_s2 = Vector3::new(9.8 * cos, 0.0, 9.8 * sin);
            still.take(&measured);
        }
        still.lean_from_the_rail(&mission)
    };
    let on_a_rail = |deg, mounting_deg| lean(deg, mounting_deg, StartPoint::Pad).unwrap();
    let found = on_a_rail(2.0, 0.3);
    assert!((found.value.to_degrees() - 2.0).abs() < 1e-9, "{found:?}");
    // Three times the root of 1 and 0.09.
    assert!((found.most.to_degrees() - 3.132).abs() < 1e-3, "{found:?}");
    assert_eq!(found.verdict, Verdict::Ok);
    assert_eq!(on_a_rail(4.0, 0.3).verdict, Verdict::NotOk);
    assert_eq!(on_a_rail(4.0, 1.0).verdict, Verdict::Ok, "a mount that is stated as askew");
    assert!(lean(4.0, 0.3, StartPoint::Apogee).is_none(), "no rail");
}

#[test]
fn no_two_items_have_the_same_number() {
    let check = checked(NOTHING_WRONG, 1.0, &sound(), true);
    let mut numbers: Vec<u8> = check.findings.iter().map(|found| found.item.number()).collect();
    numbers.sort_unstable();
    numbers.dedup();
    assert_eq!(numbers.len(), check.findings.len());
}

proptest! {
    /// For any feedback, a command stays inside the airframe's range.
    #[test]
    fn no_command_leaves_the_range(feedback in prop::collection::vec(prop::num::f64::ANY, 64)) {
        let mission = mission();
        let mut check = PadCheck::default();
        check.begin(&mission.airframe, true, None);
        let (limit_rad, open_rad) = (mission.airframe.gimbal.limit_rad(), mission.airframe.fins.open_rad());
        for frame in 0..4000_usize {
            let surfaces_rad = core::array::from_fn(|surface| feedback[(frame + 7 * surface) % 64]);
            let measured = at_rest(0, 1.0);
            let seen = reading(surfaces_rad, measured, &sound());
            match check.step(&seen, &mission, &mission.arming) {
                Some((0..2, angle_rad)) => prop_assert!(angle_rad.abs() <= limit_rad),
                Some((surface, angle_rad)) => {
                    prop_assert!(surface < SURFACES && (0.0..=open_rad).contains(&angle_rad));
                }
                None => {}
            }
        }
        prop_assert!(!check.is_running());
    }
}
