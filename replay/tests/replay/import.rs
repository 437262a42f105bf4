//! Tests imports of flights of other programs, each from a file as its format's description has it.

use std::path::Path;

use protocol::log::v1::Telemetry;
use replay::import::import;
use replay::info::{GradeLevel, info};
use replay::log::Recording;
use replay::report::report;

use crate::command_line::{replay, run};

const TIMES: std::ops::Range<u16> = 0..40;

/// Height of a flight of 4 s to 30 m, m.
fn height_m(step: u16) -> f64 {
    let time_s = f64::from(step) / 10.0;
    30.0 - 7.5 * (time_s - 2.0) * (time_s - 2.0)
}

/// Writes the file, imports it, and checks what all of them must have.
fn imported(name: &str, bytes: &[u8]) -> (Recording, Vec<&'static str>) {
    let directory = tempfile::tempdir().unwrap();
    let (file, log) = (directory.path().join(name), directory.path().join("log.mcap"));
    std::fs::write(&file, bytes).unwrap();
    let imported = import(&file, &log).unwrap();
    assert_eq!((imported.samples, imported.output.as_path()), (TIMES.len(), log.as_path()));
    let found = info(&log).unwrap();
    assert_eq!(found.grade.level, GradeLevel::TelemetryOnly, "{name}");
    assert!((found.highest_m.unwrap() - 30.0).abs() < 0.01, "{name}: {:?}", found.highest_m);
    assert!(report(&log).unwrap().html.contains("<svg"), "{name}");
    (Recording::open(&log).unwrap(), imported.missing)
}

#[test]
fn val_hand_an_altos_file() {
    let mut text =
        "#version,serial,flight,call,time,clock,rssi,lqi,state,state_name,pressure,altitude,height,speed,connected,latitude,longitude,altitude\n"
            .to_owned();
    for step in TIMES {
        let (state, height) = (if step < 20 { "boost" } else { "main" }, height_m(step));
        let north_deg = 35.0 + f64::from(step) * 1e-5;
        text.extend([format!(
            "5,1,2,N0CALL,{:8.2},0,0,0,1,{state:>8},900,1300,{height:8.2},{:8.2},1,{north_deg:.7},-117.0,1300\n",
            f64::from(step) / 10.0,
            15.0 - 1.5 * f64::from(step),
        )]);
    }
    let (flight, missing) = imported("altos.csv", text.as_bytes());
    assert_eq!(missing, ["horizontal velocity", "tilt"]);
    let last = flight.telemetry.last().unwrap();
    // A degree of latitude is 110.94 km there.
    assert!((last.north_m.unwrap() - 39.0 * 1.1094).abs() < 0.02, "{last:?}");
    assert!(last.east_m.unwrap().abs() < 1e-6 && flight.telemetry[0].phase != last.phase);
}

#[test]
fn val_hand_a_rocketpy_file() {
    let mut text =
        "# Time (s),X (m),Y (m),Z (m),Vx (m/s),Vy (m/s),Vz (m/s),Attitude Angle (\u{b0})\n".to_owned();
    for step in TIMES {
        let time_s = f64::from(step) / 10.0;
        text.extend([format!(
            "{time_s:.6},{time_s:.6},{:.6},{:.6},1,2,0,80\n",
            2.0 * time_s,
            1400.0 + height_m(step)
        )]);
    }
    let (flight, missing) = imported("rocketpy.csv", text.as_bytes());
    assert!(missing.is_empty(), "{missing:?}");
    let last = flight.telemetry.last().unwrap();
    assert!((last.east_m.unwrap() - 3.9).abs() < 1e-6 && (last.north_m.unwrap() - 7.8).abs() < 1e-6);
    assert!((last.tilt_rad.unwrap().to_degrees() - 10.0).abs() < 1e-9);
}

fn ardupilot_file() -> Vec<u8> {
    let padded = |text: &str, length: usize| {
        let mut bytes = text.as_bytes().to_vec();
        bytes.resize(length, 0);
        bytes
    };
    let mut file = Vec::new();
    let mut format = |number: u8, length: u8, name: &str, types: &str, labels: &str| {
        file.extend([0xa3, 0x95, 0x80, number, length]);
        file.extend([padded(name, 4), padded(types, 16), padded(labels, 64)].concat());
    };
    format(0x80, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns");
    format(10, 3 + 8 + 1 + 2 + 24, "XKF1", "QBcffffff", "TimeUS,C,Pitch,VN,VE,VD,PN,PE,PD");
    format(11, 3 + 8 + 64, "MSG", "QZ", "TimeUS,Message");
    file.extend(
        [[0xa3, 0x95, 11].as_slice(), &500_000_u64.to_le_bytes(), &padded("Throttle armed", 64)].concat(),
    );
    for step in TIMES {
        for core in [0_u8, 1] {
            file.extend([0xa3, 0x95, 10]);
            file.extend((u64::from(step) * 100_000).to_le_bytes());
            file.push(core);
            file.extend(8_000_i16.to_le_bytes());
            for value in [1.0, 2.0, 3.0, 4.0, 5.0, -height_m(step) as f32] {
                file.extend(value.to_le_bytes());
            }
        }
    }
    file
}

#[test]
fn val_hand_an_ardupilot_file() {
    let (flight, missing) = imported("00000042.BIN", &ardupilot_file());
    assert!(missing.is_empty(), "{missing:?}");
    let last = flight.telemetry.last().unwrap();
    assert!((last.climb_m_s, last.north_m) == (Some(-3.0), Some(0.0)), "{last:?}");
    assert!((last.tilt_rad.unwrap().to_degrees() - 10.0).abs() < 1e-6);
    assert!(
        flight
            .events
            .iter()
            .any(|(at_s, event)| (at_s - 0.5).abs() < 1e-6 && event.message == "Throttle armed")
    );
}

#[test]
fn val_hand_a_px4_file() {
    let mut file = b"ULog\x01\x12\x35\x01".to_vec();
    file.extend([0; 8]);
    let mut message = |kind: u8, body: &[u8]| {
        file.extend(u16::try_from(body.len()).unwrap().to_le_bytes());
        file.push(kind);
        file.extend(body);
    };
    message(b'B', &[0; 40]);
    message(
        b'F',
        b"vehicle_local_position:uint64_t timestamp;float x;float y;float z;float vx;float vy;float vz;",
    );
    message(b'F', b"vehicle_attitude:uint64_t timestamp;float[4] q;");
    message(b'A', b"\0\x01\0vehicle_local_position");
    message(b'A', b"\0\x02\0vehicle_attitude");
    // The nose turned up by 80 degrees about the body's y axis.
    let (half_sin, half_cos) = (40f32.to_radians().sin(), 40f32.to_radians().cos());
    for step in TIMES {
        let mut record = |number: u16, values: &[f32]| {
            let mut body = number.to_le_bytes().to_vec();
            body.extend((1_000_000 + u64::from(step) * 100_000).to_le_bytes());
            body.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            message(b'D', &body);
        };
        record(2, &[half_cos, 0.0, half_sin, 0.0]);
        record(1, &[7.0, 8.0, -height_m(step) as f32, 1.0, 2.0, 3.0]);
    }
    let (flight, missing) = imported("flight.ulg", &file);
    assert!(missing.is_empty(), "{missing:?}");
    let last = flight.telemetry.last().unwrap();
    assert!((last.climb_m_s, last.north_m) == (Some(-3.0), Some(0.0)), "{last:?}");
    assert!((last.tilt_rad.unwrap().to_degrees() - 10.0).abs() < 1e-3, "{last:?}");
}

/// Imports an excerpt of a real flight (`flights/README.md`).
fn real(name: &str) -> (Recording, Vec<&'static str>) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/replay/flights").join(name);
    let directory = tempfile::tempdir().unwrap();
    let log = directory.path().join("log.mcap");
    let missing = import(&file, &log).unwrap().missing;
    assert!(report(&log).unwrap().html.contains("<svg"), "{name}");
    (Recording::open(&log).unwrap(), missing)
}

#[test]
fn val_rocketpy_a_flight_of_a_telemetrum() {
    let (flight, missing) = real("altos-telemetrum.csv");
    assert_eq!(missing, ["horizontal velocity", "tilt"]);
    let highest =
        flight.telemetry.iter().max_by(|a, b| a.altitude_m.partial_cmp(&b.altitude_m).unwrap()).unwrap();
    // Heights count from the first sample.
    assert!((highest.altitude_m.unwrap() - (3889.30 + 0.19)).abs() < 1e-6, "{highest:?}");
    assert!((highest.time_s - 30.17).abs() < 1e-6, "{highest:?}");
    let last = flight.telemetry.last().unwrap();
    // 0.0099953 deg of latitude, at 110.90 km a degree there.
    assert!((last.north_m.unwrap() - 1108.5).abs() < 1.5, "{last:?}");
    assert!((last.east_m.unwrap() + 0.004_008_3 * 93_500.0).abs() < 1.5, "{last:?}");
}

#[test]
fn val_rocketpy_a_flight_of_a_cats_vega() {
    let (flight, missing) = real("cats-vega.csv");
    assert_eq!(missing, ["position", "horizontal velocity", "tilt"]);
    assert_eq!(flight.telemetry.len(), 50);
    let highest = flight.telemetry.iter().filter_map(|sample| sample.altitude_m).fold(0.0, f64::max);
    assert!((highest - 5229.33).abs() < 0.2, "{highest}");
}

/// PX4 writes zeros for what it does not estimate, and says so in flags.
#[test]
fn val_pyulog_a_hop_whose_position_is_valid_from_the_middle_on() {
    let (flight, missing) = real("px4.ulg");
    assert!(missing.is_empty(), "{missing:?}");
    let count = |value: fn(&Telemetry) -> Option<f64>| flight.telemetry.iter().filter_map(value).count();
    assert_eq!(flight.telemetry.len(), 27);
    assert_eq!((count(|sample| sample.north_m), count(|sample| sample.altitude_m)), (18, 26));
    let first = flight.telemetry.iter().find_map(|sample| sample.north_m);
    assert_eq!(first, Some(0.0), "positions count from the first valid one");
}

/// The receiver's first fix comes in flight.
#[test]
fn a_position_that_begins_late_counts_from_its_first_fix() {
    let directory = tempfile::tempdir().unwrap();
    let (file, log) = (directory.path().join("a.csv"), directory.path().join("log.mcap"));
    std::fs::write(&file, "time,height,latitude,longitude\n0,1,0,0\n1,5,35.0,-117.0\n2,9,35.001,-117.0\n")
        .unwrap();
    assert_eq!(import(&file, &log).unwrap().missing, ["climb", "horizontal velocity", "tilt"]);
    let north: Vec<_> =
        Recording::open(&log).unwrap().telemetry.iter().map(|sample| sample.north_m).collect();
    assert!(north[0].is_none() && north[1] == Some(0.0), "{north:?}");
    assert!((north[2].unwrap() - 110.94).abs() < 0.1, "{north:?}");
}

/// OpenRocket writes in the units that its user has chosen.
#[test]
fn val_hand_a_table_in_feet() {
    let directory = tempfile::tempdir().unwrap();
    let (file, log) = (directory.path().join("a.csv"), directory.path().join("log.mcap"));
    std::fs::write(&file, "# Time (s),Altitude (ft),Vertical velocity (ft/s)\n0,0,0\n1,100,-10\n").unwrap();
    import(&file, &log).unwrap();
    let flight = Recording::open(&log).unwrap();
    let last = flight.telemetry.last().unwrap();
    assert!((last.altitude_m.unwrap() - 30.48).abs() < 1e-9, "{last:?}");
    assert!((last.climb_m_s.unwrap() + 3.048).abs() < 1e-9, "{last:?}");
}

/// UTF-16 of both byte orders, semicolons with decimal commas, and tabs, as spreadsheets save them.
#[test]
fn val_hand_a_table_in_the_encodings_and_separators_of_spreadsheets() {
    let mut text = "Time (s),Altitude (m)\n".to_owned();
    for step in TIMES {
        text.extend([format!("{:.1},{:.2}\n", f64::from(step) / 10.0, height_m(step))]);
    }
    let semicolons = text.replace(',', ";").replace('.', ",");
    let units = |unit: fn(u16) -> [u8; 2]| {
        "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(unit).collect::<Vec<u8>>()
    };
    let tables =
        [units(u16::to_le_bytes), units(u16::to_be_bytes), semicolons.into(), text.replace(',', "\t").into()];
    for bytes in tables {
        let (flight, missing) = imported("table.csv", &bytes);
        assert_eq!(missing, ["position", "climb", "horizontal velocity", "tilt"]);
        let last = flight.telemetry.last().unwrap();
        assert!((last.time_s - 3.9).abs() < 1e-9, "{last:?}");
    }
}

#[test]
fn what_is_wrong_with_a_file_is_named() {
    let directory = tempfile::tempdir().unwrap();
    for (name, bytes, wrong) in [
        ("a.bag", b"".as_slice(), "a.bag: .ulg, .bin and .csv are accepted"),
        ("a.csv", b"a,b\n1,2\n", "`time` or `Time (s)`"),
        ("b.csv", b"time,speed\n1,2\n", "no column of heights"),
        ("c.csv", b"time,height\n1,x\n", "line 2, height: x: not a number"),
        (
            "d.csv",
            b"time,height\n1,5,30,5\n",
            "line 2: 4 values under 2 heads: is the decimal sign the separator",
        ),
        ("e.csv", b"time height\n1 5\n", "between commas, semicolons or tabs"),
        ("a.bin", b"nothing of it", "no XKF1, NKF1 or EKF1"),
        ("a.ulg", b"nothing of it", "a.ulg"),
    ] {
        let file = directory.path().join(name);
        std::fs::write(&file, bytes).unwrap();
        let error = format!("{:#}", import(&file, Path::new("/nonexistent/log.mcap")).unwrap_err());
        assert!(error.contains(wrong) && error.contains(name), "{name}: {error}");
    }
}

/// Each file cut, with a bit flipped, a byte lost or added, and a stretch of zeros, in 12 places:
/// the import answers or fails, and any line about it names the file, is short and is no debug
/// text.
#[test]
fn a_damaged_file_is_answered_in_short_sentences() {
    const LONGEST: usize = 300;
    let flights = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/replay/flights");
    let real = |name: &str| std::fs::read(flights.join(name)).unwrap();
    let directory = tempfile::tempdir().unwrap();
    let damages: [fn(&mut Vec<u8>, usize); 5] = [
        Vec::truncate,
        |bytes, at| bytes[at] ^= 0x10,
        |bytes, at| {
            bytes.remove(at);
        },
        |bytes, at| bytes.insert(at, b'7'),
        |bytes, at| bytes.iter_mut().skip(at).take(512).for_each(|byte| *byte = 0),
    ];
    let mut failed = 0;
    for (ending, bytes) in
        [("ulg", real("px4.ulg")), ("csv", real("altos-telemetrum.csv")), ("bin", ardupilot_file())]
    {
        // The first third has the definitions.
        let places =
            (1..8).map(|place| place * bytes.len() / 24).chain((3..8).map(|place| place * bytes.len() / 8));
        for (number, (at, damage)) in places.flat_map(|at| damages.map(|damage| (at, damage))).enumerate() {
            let mut damaged = bytes.clone();
            damage(&mut damaged, at);
            let name = format!("{number}.{ending}");
            let file = directory.path().join(&name);
            std::fs::write(&file, damaged).unwrap();
            let (code, stdout, stderr) =
                run(replay("import", &file).arg(directory.path().join(format!("{name}.mcap"))));
            assert!(
                code == 0 && !stdout.is_empty() || code == 1 && !stderr.is_empty(),
                "{name}: {code} {stderr}"
            );
            failed += code;
            for line in stderr.lines() {
                let begins = ["error: ", "replay: warning: "].iter().any(|begin| line.starts_with(begin));
                let is_short = line.len() < LONGEST && !line.contains(['{', '}']);
                assert!(begins && is_short && line.contains(&name), "{name}, at {at}: {line}");
            }
        }
    }
    assert!(failed > 10, "only {failed} files were refused");
}
