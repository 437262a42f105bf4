//! The drivers against their data sheets, and the complete board flown: simulated devices with the
//! registers, frames and pulses of the real ones connect it to a simulated world.
#![expect(clippy::float_cmp, reason = "two decoders of the same bytes give the same bits")]

use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::rc::Rc;

use allocation_counter::{measure, opt_out};
use avionics::log::again::RecordedComputer;
use avionics::log::frame::start_to_log;
use embedded_hal::{digital, i2c, pwm, spi};
use flight::computer::FRAME_MS;
use flight::computer::crew::{CrewCommand, Request, Requests};
use flight::computer::pad_check::CheckState;
use flight::estimation::estimator::{FixQuality, GRAVITY_M_S2};
use flight::rules::arming::Uplink;
use flight::rules::phase::Phase;
use flight::vehicle::mission::StartPoint;
use flight::vehicle::site::Site;
use prost::bytes::Buf;
use protocol::motion::Degrees;
use protocol::records::computer_v1::ComputerStart;
use sim::draw::draw;
use sim::recipe::Recipe;
use sim::world::sensors::{SensorTruth, Sensors};
use sim::world::{Actuators, RestOutcome, World};

use super::*;

/// Registers from 0x31 on of a sensor, and its raw pressure and temperature, as the crate `bmp390`
/// 0.5.0-alpha.1 has them in its tests (`test_utils.rs`), and the values that it expects.
const COEFFICIENTS: [u8; 21] = [
    0x98, 0x6c, 0xa9, 0x4a, 0xf9, 0xe3, 0x1c, 0x61, 0x16, 0x06, 0x01, 0x51, 0x4a, 0xde, 0x5d, 0x03, 0xfa,
    0xf9, 0x0e, 0x06, 0xf5,
];
const TEMPERATURE_RAW: u32 = 0x0082_bad1;

#[test]
fn val_bmp390_crate_recorded_bytes() {
    let coefficients = barometer::Coefficients::of(&COEFFICIENTS);
    let (temperature_c, pressure_pa) = coefficients.compensated(0x006b_b3cb, TEMPERATURE_RAW);
    // The crate computes in single precision.
    assert!((temperature_c - 25.770_746).abs() < 1e-4, "{temperature_c}");
    assert!((pressure_pa - 98_370.55).abs() < 0.1, "{pressure_pa}");
}

/// A sensor's registers and samples of another club, and the values that the library `bmp3xx` for
/// Elixir expects (`test/bmp3xx/bmp388/calibration_test.exs`). A BMP388 differs in its name alone.
#[test]
fn val_elixir_bmp3xx_recorded_bytes() {
    let registers = [
        0x23, 0x6B, 0x58, 0x49, 0xF6, 0x5C, 0xFF, 0xCE, 0xF4, 0x23, 0x00, 0xEA, 0x63, 0x6E, 0x79, 0xF3, 0xF6,
        0xAA, 0x43, 0x12, 0xC4,
    ];
    let (temperature_c, pressure_pa) =
        barometer::Coefficients::of(&registers).compensated(0x006D_9F97, 0x0085_D873);
    assert!((temperature_c - 30.499_314_453_874_284).abs() < 1e-9, "{temperature_c}");
    assert!((pressure_pa - 100_876.006_346_921_99).abs() < 1e-6, "{pressure_pa}");
}

/// 16 g and 2,000 deg/s are 32,768 counts, high byte first; all axes at -32,768 are a sensor that
/// is off, and one of them is beyond its range.
#[test]
fn val_tdk_drivers_icm42688_scales() {
    let bench = Rc::new(RefCell::new(Bench::standing(&mission()).0));
    let mut device = Device { bench: bench.clone(), which: 0 };
    imu::start(&mut device.clone(), &mut device).unwrap();
    let mut read = |counts| {
        bench.borrow_mut().imu = Some(counts);
        imu::read(&mut device)
    };
    let [force_m_s2, rate_rad_s] = read([2048, -2048, i16::MIN, 16_384, 0, -8_192]).unwrap();
    let expected = [
        GRAVITY_M_S2,
        -GRAVITY_M_S2,
        -16.0 * GRAVITY_M_S2,
        1000.0_f64.to_radians(),
        0.0,
        -500.0_f64.to_radians(),
    ];
    assert_eq!(read([i16::MIN; 6]), None);
    assert_eq!(read([0, 0, 2048, i16::MIN, i16::MIN, i16::MIN]), None);
    for (found, expected) in force_m_s2.into_iter().chain(rate_rad_s).zip(expected) {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
}

/// A frame of NAV-PVT, in 3D if `fixed`.
fn nav_pvt(place_1e7: [i32; 2], height_mm: i32, ned_mm_s: [i32; 3], fixed: bool) -> Vec<u8> {
    let mut frame = vec![0; 98];
    frame[..6].copy_from_slice(&[0xB5, 0x62, 0x01, 0x07, 92, 0]);
    if fixed {
        (frame[6 + 20], frame[6 + 21]) = (3, 1);
    }
    let [latitude, longitude] = place_1e7;
    let [north, east, down] = ned_mm_s;
    frame[6 + 23] = 9;
    for (at, value) in [
        (24, longitude),
        (28, latitude),
        (36, height_mm),
        (40, 1_500),
        (44, 2_500),
        (48, north),
        (52, east),
        (56, down),
        (68, 50),
    ] {
        frame[6 + at..10 + at].copy_from_slice(&value.to_le_bytes());
    }
    let sum = gnss::checksum(&frame[2..]);
    frame.extend(sum);
    frame
}

fn parsed(bytes: &[u8]) -> Vec<gnss::Fix> {
    let mut framer = Framer::new(gnss::HEAD);
    bytes.iter().filter_map(|byte| framer.take(*byte).and_then(gnss::fix)).collect()
}

#[test]
fn val_datasheet_nav_pvt() {
    // UBX-CFG-RATE for 5 Hz as its maker prints it, with its checksum.
    let rate = [0x06, 0x08, 0x06, 0x00, 0xC8, 0x00, 0x01, 0x00, 0x01, 0x00];
    assert_eq!(gnss::checksum(&rate), [0xDE, 0x6A]);
    let frame = nav_pvt([353_470_000, -1_178_090_000], 612_345, [1_500, -250, -30_000], true);
    assert_eq!(frame.len(), 100);
    let expected = gnss::Fix {
        latitude_deg: 353_470_000.0 * 1e-7,
        longitude_deg: -1_178_090_000.0 * 1e-7,
        height_m: 612_345.0 * 1e-3,
        velocity_ned_m_s: [1.5, -0.25, -30.0],
        quality: FixQuality { satellites: 9, horizontal_m: 1.5, vertical_m: 2.5, speed_m_s: 0.05 },
    };
    let noise = [0xB5, 0xB5, 0x62, 0x01, 0x35, b'$', b'G', 0xB5];
    assert_eq!(parsed(&[&noise, &frame[..], &frame].concat()), [expected, expected]);
    for place in 0..frame.len() {
        let mut broken = frame.clone();
        broken[place] ^= 0x04;
        assert_eq!(parsed(&broken), [], "byte {place}");
    }
    assert_eq!(parsed(&nav_pvt([353_470_000, -1_178_090_000], 612_345, [0; 3], false)), [], "no fix");
}

/// A frame that u-blox recorded, and the values that it prints beside it (`ubxlib`,
/// `gnss/test/u_gnss_dec_test.c`).
#[test]
fn val_ubxlib_recorded_nav_pvt() {
    let mut frame = [
        0xB5, 0x62, 0x01, 0x07, 0x5C, 0x00, 0xB0, 0xF3, 0x71, 0x1C, 0xE7, 0x07, 0x08, 0x0B, 0x0C, 0x21, 0x20,
        0xF7, 0xEB, 0x03, 0x00, 0x00, 0xC2, 0xDF, 0xFE, 0xFF, 0x03, 0x01, 0xEA, 0x16, 0x0C, 0x95, 0xF4, 0xFF,
        0xBB, 0x8E, 0x20, 0x1F, 0x5A, 0xF7, 0x01, 0x00, 0xA0, 0x44, 0x01, 0x00, 0x8F, 0x03, 0x00, 0x00, 0x93,
        0x05, 0x00, 0x00, 0xF8, 0xFF, 0xFF, 0xFF, 0xFB, 0xFF, 0xFF, 0xFF, 0x13, 0x00, 0x00, 0x00, 0x09, 0x00,
        0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xAC, 0x00, 0x00, 0x00, 0xD6, 0x7D, 0xD9, 0x00, 0x76, 0x00, 0x00,
        0x00, 0xEE, 0x13, 0x4F, 0x2F, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xBC, 0x7F,
    ];
    let expected = gnss::Fix {
        latitude_deg: 522_227_387.0 * 1e-7,
        longitude_deg: -748_276.0 * 1e-7,
        height_m: 83_104.0 * 1e-3,
        velocity_ned_m_s: [-8.0, -5.0, 19.0].map(|mm_s: f64| mm_s * 1e-3),
        quality: FixQuality {
            satellites: 22,
            horizontal_m: 911.0 * 1e-3,
            vertical_m: 1_427.0 * 1e-3,
            speed_m_s: 172.0 * 1e-3,
        },
    };
    assert_eq!(parsed(&frame), [expected]);
    let mut changed = |at: usize, bytes: &[u8]| {
        frame[6 + at..][..bytes.len()].copy_from_slice(bytes);
        let sum = gnss::checksum(&frame[2..98]);
        frame[98..].copy_from_slice(&sum);
        parsed(&frame)
    };
    // An unknown accuracy is the largest number, and not a negative one.
    let [unknown] = changed(40, &[0xFF; 8])[..] else { panic!("one fix") };
    assert_eq!([unknown.quality.horizontal_m, unknown.quality.vertical_m], [f64::from(u32::MAX) * 1e-3; 2]);
    assert_eq!(changed(78, &[1]), [], "U_GNSS_DEC_UBX_NAV_PVT_FLAGS3_INVALID_LLH");
}

/// Frames as other programs write them: u-blox' `valSetByte` and `valGetByte`, and the checksum of
/// `gnsstool`'s recorded frame for another model, EE 4B for 2: six more in both sums for 8.
#[test]
fn val_ubxlib_sets_and_gets_the_model() {
    let mut wire = Wire(Vec::new());
    gnss::request_airborne(&mut wire);
    let set = [0xB5, 0x62, 0x06, 0x8A, 9, 0, 0, 1, 0, 0, 0x21, 0x00, 0x11, 0x20, 8, 0xF4, 0x51];
    let get = [0xB5, 0x62, 0x06, 0x8B, 8, 0, 0, 0, 0, 0, 0x21, 0x00, 0x11, 0x20];
    let sum = gnss::checksum(&get[2..]);
    assert_eq!(wire.0, [&set[..], &get, &sum].concat());
}

/// Bytes written to a receiver.
struct Wire(Vec<u8>);

impl embedded_io::ErrorType for Wire {
    type Error = Infallible;
}

impl Write for Wire {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.0.extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// The crate `ublox` writes the same settings, and reads the same frame.
#[test]
fn val_ublox_crate_writes_and_reads_the_same() {
    use ublox::cfg_val::{CfgKey, CfgVal};
    use ublox::packets::cfg_nav5::NavDynamicModel;
    use ublox::packets::cfg_val::{CfgLayerGet, CfgLayerSet, CfgValGetRequestBuilder, CfgValSetBuilder};
    use ublox::proto33::PacketRef;
    use ublox::{ParserBuilder, UbxPacket};

    let (mut expected, mut wire) = (Vec::new(), Wire(Vec::new()));
    let model = NavDynamicModel::AirborneWithLess4gAcceleration;
    let layers = CfgLayerSet::RAM;
    let cfg_data = &[CfgVal::NavSpgDynModel(model)];
    CfgValSetBuilder { version: 0, layers, reserved1: 0, cfg_data }.extend_to(&mut expected);
    let (layers, cfg_keys) = (CfgLayerGet::Ram, &[CfgKey::NavSpgDynModel]);
    CfgValGetRequestBuilder { version: 0, layers, position: 0, cfg_keys }.extend_to(&mut expected);
    gnss::request_airborne(&mut wire);
    // The crate writes other lengths than the payload has, and the checksum of the right one.
    (expected[4], expected[17 + 4]) = (9, 8);
    let last = expected.len() - 2;
    expected.truncate(last);
    expected.extend(gnss::checksum(&wire.0[17 + 2..17 + 14]));
    assert_eq!(wire.0, expected);

    let frame = nav_pvt([353_470_000, -1_178_090_000], 612_345, [1_500, -250, -30_000], true);
    let [ours] = parsed(&frame)[..] else { panic!("one fix") };
    let mut parser = ParserBuilder::new().with_vec_buffer();
    let mut packets = parser.consume_ubx(&frame);
    let Some(Ok(UbxPacket::Proto33(PacketRef::NavPvt(theirs)))) = packets.next() else { panic!("no fix") };
    assert_eq!(
        [ours.latitude_deg, ours.longitude_deg, ours.height_m],
        [theirs.latitude(), theirs.longitude(), theirs.height_msl()]
    );
    assert_eq!(ours.velocity_ned_m_s, [theirs.vel_north(), theirs.vel_east(), theirs.vel_down()]);
    let FixQuality { satellites, horizontal_m, vertical_m, speed_m_s } = ours.quality;
    assert_eq!(satellites, u32::from(theirs.num_satellites()));
    assert_eq!(
        [horizontal_m, vertical_m, speed_m_s],
        [theirs.horizontal_accuracy(), theirs.vertical_accuracy(), theirs.speed_accuracy()]
    );
}

fn luna(range_cm: u16, strength: u16) -> [u8; 9] {
    let [[low, high], [weak, strong]] = [range_cm, strength].map(u16::to_le_bytes);
    let mut frame = [0x59, 0x59, low, high, weak, strong, 0x20, 0x09, 0];
    frame[8] = frame.iter().fold(0, |sum, byte| sum.wrapping_add(*byte));
    frame
}

fn ranges(bytes: &[u8]) -> Vec<f64> {
    let mut framer = Framer::new(lidar::HEAD);
    bytes.iter().filter_map(|byte| framer.take(*byte).and_then(lidar::range_m)).collect()
}

#[test]
fn val_datasheet_tf_luna() {
    // 0x59 + 0x59 + 0x2C + 0x01 + 0xE8 + 0x03 + 0x20 + 0x09 = 0x1F3.
    let frame = [0x59, 0x59, 0x2C, 0x01, 0xE8, 0x03, 0x20, 0x09, 0xF3];
    assert_eq!(frame, luna(300, 1000));
    assert_eq!(ranges(&[&[1, 0x59, 7], &frame[..], &frame].concat()), [3.0, 3.0]);
    let mut wrong = frame;
    wrong[8] ^= 1;
    assert_eq!(ranges(&wrong), [0.0; 0], "a wrong checksum");
    assert_eq!(ranges(&[luna(300, 99), luna(300, 0xFFFF)].concat()), [0.0; 0], "a weak echo, a blinded one");
}

/// Position of a servo at a duty of 65,535, rad.
fn angle_rad(surface: &Surface, duty: u16) -> f64 {
    (f64::from(duty) / 65_535.0 * servo::PERIOD_US - surface.zero_us) / surface.us_per_rad
}

/// 1,500 us of 3,003 us are 0.4995 of 65,535.
#[test]
fn val_hand_a_servo_s_pulse() {
    let surface = Surface { zero_us: 1500.0, us_per_rad: -600.0 };
    assert_eq!(surface.duty(0.0, 65_535), 32_735);
    assert_eq!([-9.0, 9.0].map(|rad| surface.duty(rad, 65_535)), [45_829, 19_641], "2,100 and 900 us");
    assert_eq!(surface.duty(f64::NAN, 65_535), 0, "no pulse");
    assert!((angle_rad(&surface, surface.duty(0.3, 65_535)) - 0.3).abs() < 1e-4);
}

#[test]
fn a_record_is_read_complete_or_not_at_all() {
    let (saved, mut place, mut room) = (at_power_up(&mission()).saved(), Zero::default(), [0; MOST_BYTES]);
    assert_eq!(place.from(1, Vector3::new(1.0, -2.0, 3.5)), None);
    assert_eq!(place.from(1, Vector3::new(3.0, -2.0, 3.5)), Some(Vector3::new(2.0, 0.0, 0.0)));
    let record = Record { clock_s: 12.5, height: Zero::default(), place, saved };
    let bytes = record.write(&mut room).unwrap();
    assert_eq!(Record::read(bytes), Some(record));
    for place in 0..bytes.len() {
        assert_eq!(Record::read(&bytes[..place]), None);
        let mut broken = bytes.to_vec();
        broken[place] ^= 1;
        assert_eq!(Record::read(&broken), None, "byte {place}");
    }
}

/// Where the pad is, above the sea, m, and its air: 10 K warmer than the standard's there.
const PAD_M: f64 = 600.0;
const AIR_K: f64 = 288.15 - 0.0065 * PAD_M + 10.0;

fn build() -> Build {
    Build {
        // The unit's y points to the nose, its x to body y, and its z against body z.
        body_from_imu: [(1, 1.0), (0, 1.0), (2, -1.0)],
        surfaces: core::array::from_fn(|surface| match surface {
            0 | 1 => Surface { zero_us: 1500.0, us_per_rad: 2000.0 },
            2 | 4 => Surface { zero_us: 950.0, us_per_rad: 550.0 },
            _ => Surface { zero_us: 2050.0, us_per_rad: -550.0 },
        }),
        fix_age_s: 0.12,
    }
}

fn recipe() -> Recipe {
    Recipe::built_in("mk3", "field").unwrap().starting_at(StartPoint::Pad).unwrap()
}

pub(crate) fn mission() -> Mission {
    let mut mission = recipe().mission;
    mission.airframe.servos_report = false;
    mission.site = Site { altitude_m: PAD_M, temperature_c: Some(AIR_K - 273.15), ..mission.site };
    mission
}

/// A world, and its data for the devices on the board's wires.
pub(crate) struct Bench {
    world: World,
    sensors: Sensors,
    pad: Degrees,
    frame: u64,
    measured: Option<Measurements>,
    /// Replaces the world's values: accelerometer and gyro, counts.
    imu: Option<[i16; 6]>,
    imu_name: u8,
    igniters: [bool; 2],
    barometer_name: u8,
    /// Frame of its last sample.
    barometer: u64,
    /// Whether the receiver is set to airborne, and can be.
    airborne: bool,
    obeys: bool,
    uarts: [VecDeque<u8>; 2],
    actuators: Actuators,
    outputs: [bool; 5],
    pin_out: bool,
    requests: Requests,
    submitted: Option<(u64, Box<Planner>)>,
    pub(crate) log: Vec<(u64, Vec<u8>)>,
    slots: [Vec<u8>; 2],
}

impl Bench {
    fn standing(mission: &Mission) -> (Self, Computer) {
        let recipe = recipe();
        let drawn = draw(mission, &recipe.dispersion, recipe.seed, 0);
        let curve = drawn.truth.curve(mission).unwrap();
        let world = World::new(
            &mission.site,
            &mission.airframe,
            curve.as_ref(),
            &drawn.truth,
            &drawn.apogee,
            drawn.flight_seed,
        );
        let world = world.unwrap().on_rail(mission.launched().unwrap(), &drawn.ascent);
        // The board decides when the barometer measures, and a TF-Luna sees 0.2 to 8 m.
        let mut params = recipe.dispersion.sensor_params;
        params.barometer.period_ms = FRAME_MS;
        (params.lidar.range_min_m, params.lidar.range_max_m) = (0.2, 8.0);
        let bench = Self {
            world,
            sensors: Sensors::new(&params, &mission.sensors, drawn.flight_seed, 1.0).unwrap(),
            pad: Degrees { latitude: mission.site.latitude_deg, longitude: mission.site.longitude_deg },
            frame: 0,
            measured: None,
            imu: None,
            imu_name: 0x47,
            igniters: [true; 2],
            barometer_name: 0x60,
            barometer: 0,
            airborne: false,
            obeys: true,
            uarts: [VecDeque::new(), VecDeque::new()],
            actuators: Actuators::NONE,
            outputs: [false; 5],
            pin_out: false,
            requests: Requests::new(),
            submitted: None,
            log: Vec::new(),
            slots: [Vec::new(), Vec::new()],
        };
        (bench, at_power_up(mission))
    }

    /// The world moves for a frame.
    fn advance(&mut self) {
        let [first, second, ignite_booster, separate, parachute] = self.outputs;
        self.actuators =
            Actuators { ignite: first || second, ignite_booster, separate, parachute, ..self.actuators };
        self.frame += 1;
        for _ in 0..FRAME_MS {
            self.world.step(&self.actuators);
            if let Some(measured) = self.sensors.observe(&SensorTruth::of(&self.world)) {
                self.measured = Some(measured);
            }
        }
        let Measurements { gnss, lidar_range_m, .. } = self.measured.unwrap();
        if let Some(GnssFix { position_m, velocity_m_s, .. }) = gnss {
            let place = self.pad.moved(position_m.x, -position_m.y);
            let place_1e7 = [place.latitude, place.longitude].map(|deg| (deg * 1e7).round() as i32);
            let ned_m_s = [velocity_m_s.x, -velocity_m_s.y, -velocity_m_s.z];
            let ned_mm_s = ned_m_s.map(|part_m_s| (part_m_s * 1e3).round() as i32);
            let height_mm = ((position_m.z + PAD_M) * 1e3).round() as i32;
            self.uarts[0].extend(nav_pvt(place_1e7, height_mm, ned_mm_s, true));
        }
        if let Some(range_m) = lidar_range_m {
            self.uarts[1].extend(luna((range_m * 100.0).round() as u16, 1000));
        }
    }

    /// Counts of accelerometer and gyro, in the unit's axes.
    fn imu_counts(&self) -> [i16; 6] {
        let imu = self.measured.unwrap().imu;
        let mut counts = [0; 6];
        for (body, (axis, sign)) in build().body_from_imu.into_iter().enumerate() {
            let force = sign * imu.specific_force_m_s2[body] / GRAVITY_M_S2 * 2048.0;
            let rate = sign * imu.gyro_rad_s[body].to_degrees() * imu::LSB_PER_DEG_S;
            // A cast saturates, as the sensor does.
            (counts[axis], counts[3 + axis]) = (force.round() as i16, rate.round() as i16);
        }
        counts
    }

    /// Status, pressure and temperature of the barometer: a new one every 20 ms.
    fn barometer_data(&mut self) -> [u8; 7] {
        if self.frame < self.barometer + 4 {
            return [0; 7];
        }
        self.barometer = self.frame;
        let standard_k = Air::at_geopotential_m(PAD_M).temperature_k;
        let above_m = self.measured.unwrap().pressure_altitude_m.unwrap() * standard_k / AIR_K;
        let pressure_pa = Air::at_geopotential_m(PAD_M + above_m).pressure_pa;
        // The pressure falls with the counts: bisected.
        let coefficients = barometer::Coefficients::of(&COEFFICIENTS);
        let at = |raw| coefficients.compensated(raw, TEMPERATURE_RAW).1;
        let (mut low, mut high) = (0, 1 << 24);
        while high - low > 1 {
            let middle = u32::midpoint(low, high);
            if (at(middle) > pressure_pa) == (at(low) > pressure_pa) { low = middle } else { high = middle }
        }
        let [a, b, c, _] = low.to_le_bytes();
        let [d, e, f, _] = TEMPERATURE_RAW.to_le_bytes();
        [0x70, a, b, c, d, e, f]
    }
}

/// Every device and pin of the bench, by its number.
#[derive(Clone)]
struct Device {
    bench: Rc<RefCell<Bench>>,
    which: usize,
}

impl spi::ErrorType for Device {
    type Error = Infallible;
}

impl spi::SpiDevice for Device {
    fn transaction(&mut self, operations: &mut [spi::Operation<'_, u8>]) -> Result<(), Infallible> {
        for operation in operations {
            let spi::Operation::TransferInPlace(bytes) = operation else { continue };
            match bytes[0] {
                0xF5 => bytes[1] = self.bench.borrow().imu_name,
                0x9F => {
                    let bench = self.bench.borrow();
                    let counts = bench.imu.unwrap_or_else(|| bench.imu_counts());
                    bytes[1..].copy_from_slice(counts.map(i16::to_be_bytes).as_flattened());
                }
                register => panic!("read of register {register:#x}"),
            }
        }
        Ok(())
    }
}

impl i2c::ErrorType for Device {
    type Error = Infallible;
}

impl i2c::I2c for Device {
    fn transaction(&mut self, address: u8, operations: &mut [i2c::Operation<'_>]) -> Result<(), Infallible> {
        assert_eq!(address, 0x77);
        let mut bench = self.bench.borrow_mut();
        let Some((i2c::Operation::Write(written), rest)) = operations.split_first_mut() else {
            panic!("a register first")
        };
        match (*written, rest) {
            ([0x00], [i2c::Operation::Read(into)]) => into[0] = bench.barometer_name,
            ([0x03], [i2c::Operation::Read(into)]) => into.copy_from_slice(&bench.barometer_data()),
            ([0x31], [i2c::Operation::Read(into)]) => into.copy_from_slice(&COEFFICIENTS),
            // Reset, oversampling, rate, filter, and the mode that starts it.
            ([0x7E, 0xB6] | [0x1C, 0x03] | [0x1D, 0x02] | [0x1F, 0] | [0x1B, 0x33], []) => {}
            other => panic!("{other:?}"),
        }
        Ok(())
    }
}

impl embedded_io::ErrorType for Device {
    type Error = Infallible;
}

impl Read for Device {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Infallible> {
        let waiting = &mut self.bench.borrow_mut().uarts[self.which];
        let count = into.len().min(waiting.len());
        assert!(count > 0, "it would wait");
        waiting.copy_to_slice(&mut into[..count]);
        Ok(count)
    }
}

/// The receiver sets its model, and answers which it is.
impl Write for Device {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let mut bench = self.bench.borrow_mut();
        assert_eq!(gnss::checksum(&bytes[2..bytes.len() - 2]), bytes[bytes.len() - 2..]);
        match bytes[3] {
            0x8A => bench.airborne |= bench.obeys && bytes[10..15] == [0x21, 0x00, 0x11, 0x20, 8],
            0x8B => opt_out(|| {
                let model = if bench.airborne { 8 } else { 0 };
                let mut answer =
                    vec![0xB5, 0x62, 0x06, 0x8B, 9, 0, 1, 0, 0, 0, 0x21, 0x00, 0x11, 0x20, model];
                answer.extend(gnss::checksum(&answer[2..]));
                bench.uarts[0].extend(answer);
            }),
            other => panic!("{other:#x}"),
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl ReadReady for Device {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.bench.borrow().uarts[self.which].is_empty())
    }
}

impl pwm::ErrorType for Device {
    type Error = Infallible;
}

impl SetDutyCycle for Device {
    fn max_duty_cycle(&self) -> u16 {
        65_535
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        let Actuators { gimbal_rad, fins_rad, .. } = &mut self.bench.borrow_mut().actuators;
        let surfaces = gimbal_rad.iter_mut().chain(fins_rad).nth(self.which);
        *surfaces.unwrap() = angle_rad(&build().surfaces[self.which], duty);
        Ok(())
    }
}

impl digital::ErrorType for Device {
    type Error = Infallible;
}

impl OutputPin for Device {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.bench.borrow_mut().outputs[self.which] = false;
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.bench.borrow_mut().outputs[self.which] = true;
        Ok(())
    }
}

impl InputPin for Device {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        let bench = self.bench.borrow();
        Ok(match self.which {
            0 => bench.world.touchdown().is_none(),
            1 | 2 => bench.igniters[self.which - 1],
            3 => !bench.world.booster_attached(),
            _ => bench.pin_out,
        })
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.is_high().map(|high| !high)
    }
}

impl DelayNs for Device {
    fn delay_ns(&mut self, _: u32) {}
}

impl Chip for Device {
    /// Solved as late as by a Cortex-M7.
    fn submit(&mut self, mut planner: Box<Planner>) {
        opt_out(|| planner.solve());
        let mut bench = self.bench.borrow_mut();
        bench.submitted = Some((bench.frame + planner.frames_on_a_board(), planner));
    }

    fn solved(&mut self) -> Option<Box<Planner>> {
        let mut bench = self.bench.borrow_mut();
        let now = bench.frame;
        bench.submitted.take_if(|(at, _)| now >= *at).map(|(_, planner)| planner)
    }

    fn uplink_state(&mut self) -> UplinkState {
        let mut bench = self.bench.borrow_mut();
        let requests = core::mem::take(&mut bench.requests);
        UplinkState { uplink: Uplink::NotNeeded, commander: None, requests }
    }

    fn send(&mut self, _: &[CrewMessage]) {}

    fn append(&mut self, frame: u64, record: &[u8]) {
        opt_out(|| self.bench.borrow_mut().log.push((frame, record.to_vec())));
    }

    fn log(&self) -> LogState {
        LogState { running: true, space_bytes: 1 << 34 }
    }

    fn batteries_v(&mut self) -> [Option<f64>; 2] {
        [None; 2]
    }

    fn clock_s(&mut self) -> f64 {
        // It is not zeroed at power-up.
        1e6 + flight_time_s(self.bench.borrow().frame)
    }

    fn save(&mut self, slot: usize, record: &[u8]) {
        opt_out(|| self.bench.borrow_mut().slots[slot] = record.to_vec());
    }

    fn load(&mut self, slot: usize, into: &mut [u8]) -> usize {
        let slot = &self.bench.borrow().slots[slot];
        into[..slot.len()].copy_from_slice(slot);
        slot.len()
    }
}

struct Simulated;

impl Wiring for Simulated {
    type Imu = Device;
    type Barometer = Device;
    type Gnss = Device;
    type Lidar = Device;
    type Servo = Device;
    type Output = Device;
    type Switch = Device;
    type Chip = Device;
}

fn parts(bench: &Rc<RefCell<Bench>>) -> Parts<Simulated> {
    let device = |which| Device { bench: bench.clone(), which };
    Parts {
        imu: device(0),
        barometer: device(0),
        gnss: device(0),
        lidar: device(1),
        servos: core::array::from_fn(device),
        outputs: core::array::from_fn(device),
        foot: device(0),
        igniters: [device(1), device(2)],
        booster: device(3),
        pin: device(4),
        chip: device(0),
    }
}

fn switched_on(bench: &Rc<RefCell<Bench>>, computer: Computer) -> (Frames, TeensyBoard<Simulated>) {
    let mut delay = Device { bench: bench.clone(), which: 0 };
    start(parts(bench), build(), computer, &mut delay).unwrap()
}

/// The crew's actions, in order.
const CREW: [CrewCommand; 5] =
    [CrewCommand::Check, CrewCommand::Seen, CrewCommand::Seen, CrewCommand::Arm, CrewCommand::Start];
/// Frames before and between them.
const CREW_WAITS: u64 = 20;
const CREW_COMES: u64 = 1_000;

/// Flies from power-up until the vehicle is at rest. The board loses its power for 0.1 s half a
/// second after the beginning of a phase. No frame with its drivers uses the heap; the bench and
/// the main context do, and are not counted.
pub(crate) fn fly(resets_in: Option<Phase>) -> (Bench, ComputerStart) {
    let (bench, computer) = Bench::standing(&mission());
    let (bench, begun) = (Rc::new(RefCell::new(bench)), start_to_log(&computer));
    let (mut frames, mut board) = switched_on(&bench, computer);
    let (mut crew, mut resets, mut next) = (CREW.into_iter(), resets_in, CREW_COMES);
    while bench.borrow().world.rest().is_none() {
        bench.borrow_mut().advance();
        let now = bench.borrow().frame;
        assert!(now < 40_000, "{:?}", frames.computer().mode());
        bench.borrow_mut().pin_out = now > CREW_COMES / 2;
        let checks = frames.computer().pad_check().state == CheckState::Running;
        if now >= next && !checks {
            next = now + CREW_WAITS;
            bench.borrow_mut().requests.extend(crew.next().map(Request::of_the_programme));
        }
        let mut goes_on = false;
        let heap = measure(|| goes_on = tick(&mut frames, &mut board));
        assert!(goes_on);
        assert_eq!((heap.count_total, heap.bytes_current), (0, 0), "frame {now} uses the heap");
        let mode = frames.computer().mode();
        if resets == Some(mode.phase) && flight_time_s(now) > mode.entered_at_s + 0.5 {
            resets = None;
            let mut dead = bench.borrow_mut();
            (dead.outputs, dead.submitted) = ([false; 5], None);
            (0..20).for_each(|_| dead.advance());
            dead.uarts = [VecDeque::new(), VecDeque::new()];
            drop(dead);
            (frames, board) = switched_on(&bench, at_power_up(&mission()));
        }
    }
    assert_eq!((crew.next(), resets), (None, None));
    drop((frames, board));
    (Rc::into_inner(bench).unwrap().into_inner(), begun)
}

/// The log is that of the flight computer: another one with its inputs and the crew's requests
/// decides and remembers the same. Returns the plans.
fn verified(bench: &Bench, begun: &ComputerStart) -> usize {
    let (mut again, mut plans) = (RecordedComputer::started(&mission(), begun), 0);
    for (_, record) in &bench.log {
        let frame = ComputerFrame::decode(&record[..]).unwrap();
        let read = again.read(&frame.input).unwrap();
        let output = again.step(&read);
        assert_eq!(again.record(&read, &output), frame);
        plans += usize::from(frame.output.planned);
    }
    plans
}

#[test]
fn the_board_is_checked_armed_started_and_lands() {
    let (bench, begun) = fly(None);
    let rest = bench.world.rest().unwrap();
    assert_eq!(rest.outcome, RestOutcome::Upright, "{rest:?}");
    assert!(bench.world.thrust_begins_s().is_some() && bench.world.parachute_ejected_s().is_none());
    let plans = verified(&bench, &begun);
    assert!(plans > 20, "{plans}");
}

#[test]
fn a_reset_in_the_fall_is_flown_through() {
    let (bench, begun) = fly(Some(Phase::AeroDescent));
    let rest = bench.world.rest().unwrap();
    assert_eq!(rest.outcome, RestOutcome::Upright, "{rest:?}");
    assert!(bench.world.thrust_begins_s().is_some() && bench.world.parachute_ejected_s().is_none());
    assert!(verified(&bench, &begun) > 20);
}

#[test]
fn what_is_built_otherwise_does_not_start() {
    let refused = |change: &dyn Fn(&mut Mission, &mut Build)| {
        let (mut mission, mut build) = (mission(), build());
        change(&mut mission, &mut build);
        let (bench, computer) = Bench::standing(&mission);
        let bench = Rc::new(RefCell::new(bench));
        start(parts(&bench), build, computer, &mut Device { bench, which: 0 }).err()
    };
    assert_eq!(refused(&|_, _| ()), None);
    assert_eq!(refused(&|mission, _| mission.airframe.servos_report = true), Some(Trouble::ServosTell));
    assert_eq!(refused(&|_, build| build.body_from_imu[2].1 = 1.0), Some(Trouble::Mirrored));
}

/// Either of the two that is open counts.
#[test]
fn an_open_igniter_is_reported() {
    for igniters in [[true, true], [true, false], [false, true]] {
        let (bench, computer) = Bench::standing(&mission());
        let bench = Rc::new(RefCell::new(Bench { igniters, ..bench }));
        let (mut frames, mut board) = switched_on(&bench, computer);
        bench.borrow_mut().advance();
        assert!(tick(&mut frames, &mut board));
        assert_eq!(frames.computer().input().igniter_continuity, igniters == [true, true]);
    }
}

/// Nothing is armed without it, and in the air the board must not be lost with it.
#[test]
fn a_part_that_does_not_start_is_silent() {
    let (mut bench, computer) = Bench::standing(&mission());
    (bench.imu_name, bench.barometer_name, bench.obeys) = (0xFF, 0x50, false);
    bench.pin_out = true;
    let bench = Rc::new(RefCell::new(bench));
    let (mut frames, mut board) = switched_on(&bench, computer);
    assert_eq!(board.imu, Err(Trouble::AnotherImu(0xFF)));
    let reported = board.barometer.as_ref().unwrap_err().to_string();
    assert_eq!(reported, "the barometer calls itself 0x50; 0x60, a BMP390, is accepted");
    for _ in 0..1_000 {
        bench.borrow_mut().advance();
        assert!(tick(&mut frames, &mut board));
        let measured = frames.computer().input().measured;
        assert!(!measured.imu.is_plausible() && measured.pressure_altitude_m.is_none());
        assert!(measured.gnss.is_none(), "a receiver that is not set to airborne");
    }
    let checks = frames.computer().arming_checks();
    for (name, found) in [("gyro", "gyro silent for 5.0 s"), ("barometer", "barometer silent for 5.0 s")] {
        assert!(
            checks.iter().any(|check| check.name == name && !check.passed && check.found.as_str() == found)
        );
    }
}
