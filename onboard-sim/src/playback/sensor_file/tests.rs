use super::*;

const HEADER: &str = "time_s,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,barometer";

/// Rows at these times, s, whose rate about x is `gyro` of the time.
fn rows(times_s: impl IntoIterator<Item = f64>, gyro: impl Fn(f64) -> f64) -> String {
    let row = |time_s: f64| format!("{time_s:?},{:?},0,0,9.8,0,0,\n", gyro(time_s));
    format!("{HEADER}\n{}", times_s.into_iter().map(row).collect::<String>())
}

fn even(rate_hz: f64, duration_s: f64) -> impl Iterator<Item = f64> {
    (0..=(rate_hz * duration_s) as u32).map(move |row| 1_000.0 + f64::from(row) / rate_hz)
}

fn read_text(text: &str) -> Result<RecordedSensors, SensorFileError> {
    read_with(text, None)
}

fn read_with(text: &str, row_rate_hz: Option<f64>) -> Result<RecordedSensors, SensorFileError> {
    read(text.as_bytes(), row_rate_hz, "+x,+y,+z".parse().unwrap())
}

fn refused(text: &str) -> String {
    read_text(text).map(|read| read.rate_hz).unwrap_err().to_string()
}

/// A rate that grows steadily is the mean over each frame, or its end, whatever the rate of the
/// rows.
#[test]
fn val_hand_a_ramp_is_resampled_from_every_accepted_rate() {
    for rate_hz in [50.0, 100.0, 187.0, 200.0, 400.0, 819.0, 1_000.0, 2_000.0] {
        let recorded = read_text(&rows(even(rate_hz, 2.0), |time_s| time_s - 1_000.0)).unwrap();
        assert!((recorded.rate_hz / rate_hz - 1.0).abs() < 1e-6, "{rate_hz}");
        assert_eq!(recorded.frames.len(), 400, "{rate_hz}");
        for (index, frame) in recorded.frames.iter().enumerate().skip(1) {
            let end_s = flight_time_s(index as u64 + 1);
            let found_s = frame.imu.gyro_rad_s.x;
            assert!((end_s - FRAME_S..=end_s + 1e-6).contains(&found_s), "{rate_hz}: {found_s} {end_s}");
        }
    }
}

#[test]
fn rows_at_the_frame_rate_are_frames() {
    let recorded = read_text(&rows(even(200.0, 1.0), |time_s| (200.0 * (time_s - 1_000.0)).round())).unwrap();
    let found: Vec<f64> = recorded.frames.iter().skip(1).map(|frame| frame.imu.gyro_rad_s.x).collect();
    assert_eq!(found, (2..=200).map(f64::from).collect::<Vec<_>>());
}

/// Time stamps that are late by up to 2 ms leave every sample at its recorded time.
#[test]
fn the_recorded_time_stamps_decide_and_not_the_number_of_the_row() {
    let late =
        even(400.0, 1.0).enumerate().map(|(row, time_s)| time_s + 0.002 * f64::from(row as u32 % 7) / 6.0);
    let recorded = read_text(&rows(late, |time_s| time_s - 1_000.0)).unwrap();
    for (index, frame) in recorded.frames.iter().enumerate().skip(1) {
        let end_s = flight_time_s(index as u64 + 1);
        assert!((end_s - FRAME_S..=end_s + 1e-6).contains(&frame.imu.gyro_rad_s.x), "{index}");
    }
}

#[test]
fn other_sensors_belong_to_the_frame_in_which_they_arrive() {
    let text = "gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,barometer,gnss_x,gnss_y,gnss_z,gnss_vx,gnss_vy,gnss_vz,gnss_time_s,lidar,satellites\n\
        0,0,0,9.8,0,0,1.5,,,,,,,,,\n\
        0,0,0,9.8,0,0,nan,1,2,3,4,5,6,-0.1,,9\n\
        ,,,,,,2.5,1,2,3,4,5,6,-0.1,,9\n\
        0,0,0,9.8,0,0,,1,2,3.5,nan,nan,nan,,0.4,9\n";
    let axes = "-x,-y,+z".parse().unwrap();
    let RecordedSensors { frames, .. } = read(text.as_bytes(), Some(100.0), axes).unwrap();
    let barometer: Vec<_> = frames.iter().map(|frame| frame.pressure_altitude_m).collect();
    assert_eq!(barometer, [Some(1.5), None, None, Some(2.5), None, None]);
    assert_eq!(frames[1].imu.specific_force_m_s2, Vector3::new(-9.8, 0.0, 0.0));
    let fix = GnssFix {
        position_m: Vector3::new(1.0, 2.0, 3.0),
        velocity_m_s: Vector3::new(4.0, 5.0, 6.0),
        valid_at_s: -0.1,
        quality: FixQuality { satellites: 9, horizontal_m: 0.0, vertical_m: 0.0, speed_m_s: 0.0 },
    };
    assert_eq!(frames[1].gnss, Some(fix));
    assert_eq!(frames[3].gnss, None, "the same fix again");
    let without_velocity = frames[5].gnss.unwrap();
    assert!(without_velocity.velocity_m_s.iter().all(|value| value.is_nan()));
    assert!((without_velocity.valid_at_s - 0.03).abs() < 1e-12);
    assert_eq!(frames[5].lidar_range_m, Some(0.4));
}

/// U.S. Standard Atmosphere, 1976: 95,461 Pa at 500 m and 89,874.6 Pa at 1,000 m.
#[test]
fn val_us_standard_atmosphere_pressures_are_heights_above_the_pad() {
    let row = |row: u32| {
        let pressure_pa = if row < 300 { 95_460.8 } else { 89_874.6 };
        format!("{:?},0,0,0,9.8,0,0,{pressure_pa}\n", f64::from(row) / 200.0)
    };
    let table = HEADER.replace("barometer", "pressure_pa") + "\n" + &(0..400).map(row).collect::<String>();
    let RecordedSensors { frames, .. } = read_text(&table).unwrap();
    assert!(frames[100].pressure_altitude_m.unwrap().abs() < 1e-9);
    let risen_m = frames[350].pressure_altitude_m.unwrap();
    assert!((risen_m - 500.0).abs() < 0.5, "{risen_m}");
}

#[test]
fn what_cannot_be_played_is_refused_with_its_line() {
    let good = rows(even(200.0, 1.0), |_| 0.0);
    assert!(refused(&rows(even(40.0, 2.0), |_| 0.0)).contains("40.0 inertial samples a second; 50 to 2000"));
    assert!(refused(&rows(even(2_500.0, 0.2), |_| 0.0)).starts_with("lines 2 to 502: 2500.0"));
    let swapped = rows([0.0, 0.005, 0.01, 0.01], |_| 0.0);
    assert!(
        refused(&swapped).starts_with("line 5: the time is 0.01 s, after 0.01 s"),
        "{}",
        refused(&swapped)
    );
    let paused = rows([0.0, 0.005, 0.205], |_| 0.0);
    assert!(
        refused(&paused).starts_with("line 4: 0.200 s after the last inertial sample"),
        "{}",
        refused(&paused)
    );
    let broken = good.replacen("9.8", "9.8x", 1);
    assert!(refused(&broken).starts_with("line 2: accel_x is `9.8x`; a number"), "{}", refused(&broken));
    assert!(refused(&good.replacen("9.8,0,0,", "9.8,0", 1)).contains("line: 2"));
    assert!(refused(&good.replace("gyro_y", "gyro_q")).starts_with("no column `gyro_y`"));
    assert!(refused(HEADER).starts_with("lines 2 to 1: 0.0 inertial samples a second"));
    let untimed = good.replace("time_s", "t");
    for (text, rate_hz) in
        [(&untimed, None), (&good, Some(200.0)), (&untimed, Some(49.0)), (&untimed, Some(f64::NAN))]
    {
        let error = read_with(text, rate_hz).map(|read| read.rate_hz).unwrap_err();
        assert_eq!(error.to_string(), "a column time_s or --rate HZ, 50 to 2000, is required, and not both");
    }
    assert!(read_with(&untimed, Some(200.0)).is_ok());
}

proptest::proptest! {
    /// Whatever is in a file, it is played or refused.
    #[test]
    fn no_text_panics(cells in proptest::collection::vec("[-+0-9.einafx]{0,6}", 8..64), header: bool) {
        let lines: Vec<String> = cells.chunks(8).map(|row| row.join(",")).collect();
        let text = format!("{}\n{}", if header { HEADER } else { "a,b" }, lines.join("\n"));
        let _ = read_text(&text);
    }
}
