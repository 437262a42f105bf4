//! The log of a ground station that flew a real vehicle: what it says agrees with the vehicle's own log.

use std::path::Path;

use e2e::{Ended, Program, Running, auto_ground, expect_landing, program, vehicle};

fn replay(folder: &Path, arguments: &[&str]) -> Ended {
    let ended = Running::to_end(program(Program::Replay).args(arguments).current_dir(folder));
    assert_eq!(ended.code, Some(0), "{arguments:?}: {}", ended.output);
    ended
}

/// A column of a table, as text.
fn column(table: &Path, name: &str) -> Vec<String> {
    let text = std::fs::read_to_string(table).unwrap_or_else(|error| panic!("{}: {error}", table.display()));
    let mut lines = text.lines().map(|line| line.split(','));
    let mut head = lines.next().expect("a table begins with its columns");
    let place = head.position(|column| column == name).unwrap_or_else(|| panic!("{name} in {text:.200}"));
    lines.map(|mut cells| cells.nth(place).expect("every row has every column").to_owned()).collect()
}

/// The line of `replay info` that begins with a word.
fn fact<'a>(info: &'a Ended, word: &str) -> &'a str {
    let line = info.output.lines().find(|line| line.trim_start().starts_with(word));
    line.unwrap_or_else(|| panic!("no {word}: {}", info.output)).trim()
}

#[test]
fn what_a_station_recorded_agrees_with_the_vehicles_own_log() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut station = auto_ground(folder, &["udpin:127.0.0.1:0"]);
    let mut ground = Running::start(station.args(["--tlog", "ground.tlog"]));
    let mut fly = vehicle(folder, &[&ground.udp_link()]);
    let flight = Running::start(fly.args(["--profile", "mk2"]));
    expect_landing(flight, ground);

    // The same verdict, in the words for what a station can know.
    let [own, heard] = ["vehicle.mcap", "ground.mcap"].map(|log| replay(folder, &["info", log]));
    for info in [&own, &heard] {
        assert!(fact(info, "verdict").contains("LANDED"), "{}", info.output);
    }
    for phase in ["POWERED", "TOUCHDOWN"] {
        assert!(heard.output.contains(phase), "{phase}: {}", heard.output);
    }

    // The report says it, too.
    for log in ["vehicle", "ground"] {
        replay(folder, &["report", &format!("{log}.mcap")]);
        let page = std::fs::read_to_string(folder.join(format!("{log}.html"))).unwrap();
        assert!(page.contains("LANDED") && page.contains("touchdown"), "{log}");
    }

    // Each row of the station's tables is a row that the vehicle's log says it sent.
    for log in ["vehicle", "ground"] {
        replay(folder, &["export", &format!("{log}.mcap"), "--to", "csv", "--output", log]);
    }
    for (table, value) in [
        ("mavlink_1_1_local_position_ned", "z"),
        ("mavlink_1_1_td_flight_status", "time_boot_ms"),
        ("mavlink_1_1_td_landing_verdict", "limits_violated"),
    ] {
        let of = |log: &str| {
            let path = folder.join(log).join(format!("{table}.csv"));
            column(&path, "time_boot_ms").into_iter().zip(column(&path, value)).collect::<Vec<_>>()
        };
        let (sent, received) = (of("vehicle"), of("ground"));
        assert!(!received.is_empty(), "{table}");
        for row in &received {
            assert!(sent.contains(row), "{table}: {row:?} was never sent");
        }
        // Nothing is lost on this machine, but the station ends with the verdict and the vehicle a little later.
        let of_all = if table.ends_with("verdict") { 0 } else { sent.len() * 9 / 10 };
        assert!(received.len() >= of_all, "{table}: {} of {}", received.len(), sent.len());
    }

    its_tlog_tells_the_same(folder);

    // And `compare` finds no difference.
    let compared = replay(folder, &["compare", "vehicle.mcap", "ground.mcap"]);
    assert!(
        compared.output.contains("ground.mcap is within tolerance of vehicle.mcap"),
        "{}",
        compared.output
    );
    assert!(compared.output.contains("the air lost 0 (0.0 %)"), "{}", compared.output);
    assert!(compared.output.contains("Compared while both recorded"), "{}", compared.output);
}

/// The times of a table's log and a column, s and its unit, where the column has a value.
fn over_time(table: &Path, name: &str) -> Vec<(f64, f64)> {
    let times =
        column(table, "log_time_ns").into_iter().map(|time_ns| time_ns.parse().unwrap_or(f64::NAN) / 1e9);
    let rows = times.zip(column(table, name));
    rows.filter_map(|(time_s, value)| Some((time_s, value.parse().ok()?))).collect()
}

/// What `replay` makes of a station's `.tlog` is what the station recorded itself: of the vehicle's state, which rolls as it
/// falls, each value that the station recorded is a value of the same moment there.
fn its_tlog_tells_the_same(folder: &Path) {
    replay(folder, &["export", "ground.tlog", "--to", "csv", "--output", "tlog"]);
    let of = |log: &str, name: &str| over_time(&folder.join(log).join("telemetry.csv"), name);
    // How near a value is the same, and how far one may be that only the station's moment has, between two of the other's.
    for (name, near, between) in [
        ("phase", 0.0, 0.0),
        ("altitude_m", 0.01, 1.0),
        ("x_m", 0.01, 0.5),
        ("pitch_rad", 0.001, 0.05),
        ("u_m_s", 0.01, 1.0),
        ("w_m_s", 0.01, 1.0),
        ("q_rad_s", 0.001, 0.5),
        ("gimbal_measured_rad", 0.001, 0.1),
    ] {
        let (recorded, made) = (of("ground", name), of("tlog", name));
        assert!(recorded.len() > 100, "{name}: {}", recorded.len());
        let mut equal = 0;
        for (time_s, value) in &recorded {
            // Both record ten times a second, and not in the same moments, on a busy machine by half a second apart; when
            // nothing is heard, only the station does.
            let same_moment =
                made.iter().filter(|(at_s, _)| (at_s - time_s).abs() < 0.6).map(|(_, other)| *other);
            let values: Vec<f64> = same_moment.collect();
            let (least, most) =
                values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), other| {
                    (least.min(*other), most.max(*other))
                });
            let within = values.is_empty() || (least - between..=most + between).contains(value);
            assert!(within, "{name}: {value} at {time_s:.3}, and {values:?} in the .tlog");
            equal += usize::from(values.iter().any(|other| (other - value).abs() <= near));
        }
        assert!(equal * 10 >= recorded.len() * 9, "{name}: {equal} of {} are equal", recorded.len());
    }
}
