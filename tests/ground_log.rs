//! The log of a ground station that flew a real vehicle: what it says agrees with the vehicle's own
//! log.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::path::Path;

use protocol::frame::Framer;
use protocol::identity::VEHICLE;
use protocol::log::tlog::TlogReader;
use protocol::reported::ReportedState;

use e2e::{Ended, Program, Running, Terminal, auto_ground, expect_landing, program, vehicle};

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
fn the_stations_record_agrees_with_the_vehicles_log() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut ground = Running::start(&mut auto_ground(folder, &["udpin:127.0.0.1:0"]));
    let mut fly = vehicle(folder, &[&ground.udp_link()]);
    let flight = Running::start(fly.args(["--mission", "mk2"]));
    expect_landing(flight, ground);

    // The same verdict, in the words for what a station can know.
    let [own, heard] = ["vehicle.mcap", "ground.mcap"].map(|log| replay(folder, &["info", log]));
    for info in [&own, &heard] {
        assert!(fact(info, "verdict").contains("STANDS UNDAMAGED"), "{}", info.output);
    }
    for event in ["thrust", "touchdown"] {
        assert!(fact(&heard, "events").contains(event), "{event}: {}", heard.output);
    }

    // The report says it, too.
    for log in ["vehicle", "ground"] {
        replay(folder, &["report", &format!("{log}.mcap")]);
        let page = std::fs::read_to_string(folder.join(format!("{log}.html"))).unwrap();
        assert!(page.contains("STANDS UNDAMAGED") && page.contains("touchdown"), "{log}");
    }

    its_ignition_has_one_time_and_one_height(folder, &own, &heard);

    // Each row of the station's tables is a row that the vehicle's log says it sent.
    for log in ["vehicle", "ground"] {
        replay(folder, &["export", &format!("{log}.mcap"), "--out", log]);
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
        // Nothing is lost on this machine, but the station ends with the verdict and the vehicle a
        // little later.
        let of_all = if table.ends_with("verdict") { 0 } else { sent.len() * 9 / 10 };
        assert!(received.len() >= of_all, "{table}: {} of {}", received.len(), sent.len());
    }

    its_tlog_reports_the_same(folder);
}

/// `replay info` of both logs, both reports and the screen print the same of the ignition, each to
/// its last digit.
fn its_ignition_has_one_time_and_one_height(folder: &Path, own: &Ended, heard: &Ended) {
    let [own, heard] = [own, heard].map(|info| {
        let events = fact(info, "events").split(", ").map(str::trim);
        events.filter(|event| !event.starts_with("over")).collect::<Vec<_>>()
    });
    assert_eq!(own[1..], heard[1..own.len()]);
    let ignition = own.iter().find_map(|event| event.strip_prefix("ignition ")).unwrap();
    let [at_s, height_m] = ignition.trim_end_matches(" m").split_once(' ').map(Into::into).unwrap();
    for log in ["vehicle", "ground"] {
        let page = std::fs::read_to_string(folder.join(format!("{log}.html"))).unwrap();
        let row = page.lines().find(|line| line.contains("<td>ignition</td>")).unwrap();
        let cells = format!("<td class=\"n\">{at_s}</td><td class=\"n\">{height_m}</td>");
        assert!(row.contains(&cells), "{log}: no {cells} in {row}");
    }
    let number = |text: &str| text.parse::<f64>().unwrap();
    let mut playback = program(Program::Ground);
    playback
        .args(["--replay", "ground.mcap", "--from", "POWERED"])
        .current_dir(folder)
        .env("TERM", "xterm-256color");
    let screen = Terminal::start(&playback, (160, 50), false);
    for words in
        [format!("ignition {:.1}", number(at_s)), format!("{:.0} m, T+{:.1}", number(height_m), number(at_s))]
    {
        screen.wait_for(&words);
    }
}

/// What a station records ten times a second, of the vehicle's state: which of its moments it takes
/// depends on the machine.
const STATE: [&str; 8] =
    ["phase", "north_m", "east_m", "altitude_m", "north_m_s", "climb_m_s", "tilt_rad", "turn_rate_rad_s"];

/// The vehicle's state after each frame of a `.tlog` that reports it, and once before the first.
fn reported_by_each_frame(tlog: &Path) -> Vec<[Option<f64>; 8]> {
    let mut frames = TlogReader::new(std::fs::File::open(tlog).expect("the station has written it"));
    let mut told = ReportedState::default();
    let mut states = Vec::new();
    loop {
        let told_now = told.record(0.0);
        states.push([
            told_now.phase.map(f64::from),
            told_now.north_m,
            told_now.east_m,
            told_now.altitude_m,
            told_now.north_m_s,
            told_now.climb_m_s,
            told_now.tilt_rad,
            told_now.turn_rate_rad_s,
        ]);
        let mut heard =
            std::iter::from_fn(|| frames.next_frame().expect("a file can be read")).filter_map(|frame| {
                let mut framer = Framer::new();
                framer.push_datagram(&frame.bytes);
                framer.next_frame()
            });
        if !heard.any(|frame| {
            frame.source() == VEHICLE && told.update(&frame.decode().expect("the vehicle is of this release"))
        }) {
            return states;
        }
    }
}

/// What the station recorded is the vehicle's state after one of the frames in its `.tlog`, and the
/// later record after the later frame. The vehicle rolls as it falls.
fn its_tlog_reports_the_same(folder: &Path) {
    let told = reported_by_each_frame(&folder.join("ground.tlog"));
    let columns = STATE.map(|name| column(&folder.join("ground/telemetry.csv"), name));
    let rows = columns[0].len();
    assert!(rows > 100, "{rows}");
    let mut first = 0;
    for row in 0..rows {
        let recorded = columns.each_ref().map(|column| column[row].parse::<f64>().ok());
        let after = told[first..].iter().position(|state| *state == recorded);
        // Several records may follow one frame.
        first += after.unwrap_or_else(|| panic!("row {row}: {recorded:?} was reported by no frame"));
    }
}
