//! Tests the other subcommands: exit codes, formats, and the messages if there is no answer.

use flight::guidance::powered::ControlLevel;
use flight::rules::phase::Phase;
use protocol::log::computer_v1::ComputerFrame;
use replay::info::info;

use serde_json::Value;

use crate::command_line::{Files, data, refusal, replay, run};
use crate::flown::{COMPLETE, FLIGHT, Recipe, write_log};
use crate::from_apogee::{LANDED, fly};
use crate::simulated::{DISPERSED, MK2, WITH_FRAMES};
use crate::station::station_log;

/// Every log of a folder has its line, also one that cannot be read.
#[test]
fn a_folder_is_a_season() {
    let season = tempfile::tempdir().unwrap();
    for (name, flight) in [("a.mcap", &MK2), ("b.mcap", &DISPERSED)] {
        std::fs::copy(&flight.log, season.path().join(name)).unwrap();
    }
    std::fs::write(season.path().join("c.mcap"), "no log").unwrap();
    std::fs::write(season.path().join("notes.txt"), "no log either").unwrap();
    let (code, stdout, _) = run(&mut replay("info", season.path()));
    let lines: Vec<&str> = stdout.lines().collect();
    assert_eq!((code, lines.len()), (5, 4), "{stdout}");
    assert!(lines[0].starts_with("date ") && lines[0].contains("worst limit"), "{stdout}");
    assert!(lines[1].contains("CANNOT BE READ") && lines[1].ends_with("c.mcap"), "{stdout}");
    assert!(lines[2].contains(" mk2 ") && lines[2].contains("STANDS UNDAMAGED  "), "{stdout}");
    let (code, table, _) = run(replay("info", season.path()).arg("--csv"));
    assert_eq!(code, 5);
    let mut rows = csv::Reader::from_reader(table.as_bytes());
    let found = info(&MK2.log).unwrap();
    let row = rows.records().map(Result::unwrap).find(|row| row[8].ends_with("a.mcap")).unwrap();
    let distance =
        found.verdict.unwrap().table_2.iter().find(|limit| limit.name == "distance").unwrap().value;
    assert_eq!(row[4].parse::<f64>().unwrap().to_bits(), distance.to_bits());
    assert_eq!(&row[5], found.ending.unwrap());
    assert!(refusal(replay("info", &MK2.log).arg("--csv")).contains("--csv is for a folder"));
}

/// The log of a station and a log without its end have their lines.
#[test]
fn a_season_lists_station_logs_and_damaged_logs() {
    let season = tempfile::tempdir().unwrap();
    std::fs::copy(station_log(&WITH_FRAMES.log, "season.mcap"), season.path().join("station.mcap")).unwrap();
    let (code, stdout, _) = run(&mut replay("info", season.path()));
    assert!(code == 0 && stdout.contains("STANDS UNDAMAGED") && stdout.contains("station.mcap"), "{stdout}");
    std::fs::write(season.path().join("cut.mcap"), &COMPLETE.bytes[..COMPLETE.bytes.len() / 2]).unwrap();
    let (code, stdout, _) = run(&mut replay("info", season.path()));
    let cut = stdout.lines().find(|line| line.ends_with("cut.mcap")).unwrap();
    assert!(code == 0 && cut.contains("no verdict") && cut.contains("without an end mark"), "{stdout}");
}

/// What differs in the landing comes first, the limits that are furthest apart before the others.
#[test]
fn a_comparison_opens_with_the_landings() {
    let crash = fly(&["no-light@0"]);
    let (code, stdout, _) = run(replay("compare", &LANDED.log).arg(&crash.log));
    let first = stdout.lines().next().unwrap();
    assert!(
        code == 3 && first.contains(": stands undamaged; ") && first.contains(": not landed; "),
        "{stdout}"
    );
    let rows: Vec<&str> = stdout.lines().skip(3).collect();
    let (_, most) = first.split_once("most different: ").unwrap();
    for (place, limit) in most.split(", ").enumerate() {
        let name = rows[place].split("  ").next().unwrap();
        assert!(limit.starts_with(name), "{limit}: {stdout}");
    }
    assert!(most.contains(" OUTSIDE") && stdout.contains("\nleg load "), "{stdout}");
    let (_, stdout, _) = run(replay("compare", &LANDED.log).arg(&LANDED.log));
    assert!(stdout.lines().next().unwrap().ends_with("; no limit differs"), "{stdout}");
}

#[test]
fn several_logs_are_verified_at_once_and_the_worst_decides() {
    let files = Files::new();
    let good = files.file(&COMPLETE.bytes);
    let mut frames = FLIGHT.frames[..8].to_vec();
    frames[6].output.gimbal_rad[1] = 0.25;
    let bad = files.directory.path().join("bad <&>.mcap");
    std::fs::write(&bad, write_log(&frames, &Recipe::default()).bytes).unwrap();
    let (code, reports) = data(replay("verify", &good).arg(&bad));
    assert_eq!(
        (code, reports.as_array().unwrap().len(), &reports[0]["outcome"]),
        (3, 2, &"identical".into())
    );
    let first = &reports[1]["first_divergence"];
    assert_eq!((&first["frame"], &first["fields"][0]["path"]), (&7.into(), &"output.gimbal_rad[1]".into()));
    // There is no landing in the log to fly on from.
    // One unreadable log is a separate error, and the others are still verified.
    let none = files.directory.path().join("none.mcap");
    let (code, reports) = data(replay("verify", &none).arg(&good));
    assert_eq!((code, &reports[0]["outcome"]), (5, &"identical".into()));
}

#[test]
fn a_flight_equals_itself_and_another_one_differs_by_signal() {
    let (code, found) = data(replay("compare", &MK2.log).arg(&MK2.log));
    assert_eq!((code, &found[0]["failures"]), (0, &Value::Array(Vec::new())));
    let (_, found) = data(replay("compare", &MK2.log).arg(&DISPERSED.log));
    let signals = found[0]["signals"].as_array().unwrap();
    let named = |signal: &&Value| signal["signal"] == "vehicle_truth3d.state.position_m.x";
    assert!(signals.iter().find(named).unwrap()["max"].as_f64().unwrap() > 1e-6, "{found}");
    assert_eq!(&found[0]["align"], "ignition");
}

#[test]
fn answers_state_open_or_closed_loop_and_unknown_names_exit_1() {
    let log = &MK2.log;
    for (question, kind) in [("evaluate", "open loop"), ("refly", "closed loop")] {
        let (code, report) = data(replay(question, log).args(["--set", "powered.weights.theta=75"]));
        assert!(code == 0 && report["kind"].as_str().unwrap().starts_with(kind), "{report}");
        let refused = refusal(replay(question, log).args(["--set", "powered.wieghts.theta=75"]));
        assert!(refused.contains("did you mean `powered.weights.theta`?"), "{refused}");
    }
    let (_, report) = data(replay("evaluate", log).args(["--set", "powered.weights.theta=75"]));
    let frames = MK2.recording().frames.len();
    assert_eq!(report["frames"].as_array().map(Vec::len), Some(frames));
}

/// Whether a plan was taken over in this frame of the burn whose solve had converged.
fn has_converged(frame: &ComputerFrame) -> bool {
    frame.output.phase == u32::from(Phase::Powered.index())
        && frame.input.plan_ready
        && frame.output.level == u32::from(ControlLevel::Converged.index())
}

/// The judge shares no function with the solver that flies. It finds the plan that flew, if its
/// solve converged, or one that costs at most a per cent less.
#[test]
fn val_judge_finds_no_better_plan_than_the_one_that_flew() {
    let recording = MK2.recording();
    let (_, frames) = recording.replayable_frames().unwrap();
    let planning = frames.iter().filter(|frame| has_converged(frame)).map(|frame| frame.input.frame);
    let mut same = 0;
    for frame in planning.skip(2).step_by(10).take(5) {
        let judged = replay::verify::explain::explain(&recording, recording.release_frame + frame)
            .unwrap()
            .judged
            .unwrap();
        assert!(judged.excess_cost < 0.01, "{frame}: {judged:?}");
        if judged.excess_cost.abs() < 1e-4 {
            same += 1;
            assert!(judged.first_input_deg < 0.1, "{frame}: {judged:?}");
            let [ours, theirs] = [&judged.flown, &judged.judge].map(|plan| plan.touchdown_m);
            assert!(libm::hypot(ours[0] - theirs[0], ours[1] - theirs[1]) < 0.05, "{frame}: {judged:?}");
        }
    }
    assert!(same >= 3, "{same} of 5 plans are the judge's");
}

#[test]
fn a_recovered_log_is_not_complete() {
    let files = Files::new();
    let (at, frames) = COMPLETE.synced[4];
    let cut = files.file(&COMPLETE.bytes[..usize::try_from(at).unwrap() + 5]);
    let output = files.directory.path().join("whole.mcap");
    let (code, recovery) = data(replay("recover", &cut).arg(&output));
    assert_eq!((code, &recovery["ended"]), (0, &false.into()));
    let (code, report) = data(&mut replay("verify", &output));
    assert_eq!((code, &report["frames_identical"]), (0, &frames.into()));
    assert_eq!(report["outcome"], "identical-readable-part");
    let (code, _, _) = run(replay("verify", &output).arg("--strict"));
    assert_eq!(code, 3, "the repair does not make a whole flight of it");
    let other = files.directory.path().join("x");
    refusal(replay("recover", &files.file(b"nothing")).arg(other));
}

/// A degree of latitude is 110,941.6 m and of longitude 90,899.4 m at 35.347 degrees north (WGS
/// 84).
#[test]
fn val_wgs84_the_flown_path_is_exported_for_maps() {
    let log = &crate::simulated::WITH_FRAMES.log;
    let folder = tempfile::tempdir().unwrap();
    let texts = ["flight.kml", "flight.gpx"].map(|name| {
        let path = folder.path().join(name);
        let (code, stdout, stderr) = run(replay("export", log).arg("--out").arg(&path));
        assert_eq!(code, 0, "{stderr}");
        assert!(stdout.contains(" pad, touchdown planned at ignition, touchdown, fence"), "{stdout}");
        std::fs::read_to_string(&path).unwrap()
    });
    let documents = texts.each_ref().map(|text| roxmltree::Document::parse(text).unwrap());
    let world = crate::simulated::WITH_FRAMES.recording().world;
    let first = &world[0].state.position_m;
    let points: Vec<_> = documents[1].descendants().filter(|node| node.has_tag_name("trkpt")).collect();
    assert!(points.len() > 100, "{}", points.len());
    let degrees = |name: &str| points[0].attribute(name).unwrap().parse::<f64>().unwrap();
    let pad = documents[1].descendants().find(|node| node.has_tag_name("wpt")).unwrap();
    let of_pad = |name: &str| pad.attribute(name).unwrap().parse::<f64>().unwrap();
    // World: x north, y west. Seven decimals of a degree are a centimetre.
    assert!(((degrees("lat") - of_pad("lat")) * 110_941.6 - first.x).abs() < 0.05);
    assert!(((degrees("lon") - of_pad("lon")) * 90_899.4 + first.y).abs() < 0.05);
    let names = |tag: &str| {
        let of_tag = documents[0].descendants().filter(|node| node.has_tag_name(tag));
        of_tag.map(|node| node.text().unwrap_or_default().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(names("name")[1..], ["pad", "touchdown planned at ignition", "touchdown", "track", "fence"]);
}
