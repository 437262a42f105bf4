//! Tests the report of a flight: well-formed, self-contained and complete.

use flight::vehicle::mission::StartPoint;
use replay::log::Recording;
use replay::refly::{ReflyOptions, print_refly, refly};
use replay::report::report;
use replay::verify::explain::explain;

use crate::flown::{FLIGHT, Recipe, WHOLE, write_log};
use crate::from_apogee::{self, LANDED};
use crate::simulated::{DISPERSED, MK2, WITH_FRAMES};

/// Every tag is closed, and the page refers to nothing outside itself.
fn check(page: &str) {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..roxmltree::ParsingOptions::default() };
    let document = roxmltree::Document::parse_with_options(page, options).unwrap();
    for tag in document.descendants() {
        for refers in ["src", "onload"] {
            assert!(!tag.has_attribute(refers), "{refers}");
        }
        // Links lead to places of the page.
        if let Some(link) = tag.attribute("href") {
            let place = link.strip_prefix('#').unwrap();
            assert!(document.descendants().any(|tag| tag.attribute("id") == Some(place)), "{link}");
        }
    }
    let page = page.replace("http://www.w3.org/2000/svg", "");
    for outside in ["http:", "https:", "url(\"", "@import", "fetch", "import(", "NaN", "inf "] {
        assert!(!page.contains(outside), "{outside}");
    }
}

/// A flight is shown in space; the flight computer is run again to get its plans.
#[test]
fn the_report_says_the_verdict_first_and_then_why() {
    for log in [&LANDED.log, &MK2.log, &DISPERSED.log, &WITH_FRAMES.log] {
        says_the_verdict_first_and_then_why(&report(log, None).unwrap().html);
    }
    let recipe = sim::recipe::Recipe::built_in("mk3", "none").unwrap();
    says_the_verdict_first_and_then_why(&report(&from_apogee::fly_recipe(&recipe).log, None).unwrap().html);
}

fn says_the_verdict_first_and_then_why(page: &str) {
    check(page);
    let order = [
        "STANDS UNDAMAGED",
        "Worst of the legs' limits: ",
        "Touchdown at T+",
        "Findings, first in time",
        "<th>inside the design envelope of its legs</th>",
        "<summary>inside Table 2</summary>",
        "Height over the whole flight, m",
        "Seen from above: ground track",
        "The landing: height over the distance from the pad",
        "The landing from above",
        "level speed, m/s",
        "rotation rate, deg/s",
        "Gimbal pitch, deg",
        "Gimbal yaw, deg",
        "inferred impulse at the end, of expected",
        "Thrust, N",
        "north at touchdown, m",
        "iterations.</p>",
        "Newton iterations of each plan",
        "predicted ahead",
        "gimbal yaw at its stop of ",
        "Wind towards north, m/s",
        "Roll rate, deg/s",
        "Test ratio of each measurement",
        "Gyro bias as estimated, deg/s",
        "estimate less truth",
        "Battery, V",
        "Specific force along the nose",
        "thrust confirmed on board",
        "thrust fell through weight",
        "Events</h2>",
        "Mission against the built-in one</h2>",
        "Link</h2>",
        "every checksum holds",
    ];
    let places: Vec<usize> =
        order.iter().map(|words| page.find(words).unwrap_or_else(|| panic!("{words}"))).collect();
    assert!(places.is_sorted(), "{places:?}");
    assert!(!page.contains("in its plane") && !page.contains("the plane of"));
    assert!(page.contains("\nplanned\n") && page.contains("prefers-color-scheme: dark"));
    assert!(page.matches("<svg").count() > 15);
}

/// Logs with frames only, a cut log, a log without a flight, and names that contain markup.
#[test]
fn a_poor_log_has_a_page_that_says_what_is_missing() {
    let directory = tempfile::tempdir().unwrap();
    let page_of = |name: &str, bytes: &[u8]| {
        let path = directory.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let page = report(&path, None).unwrap().html;
        check(&page);
        page
    };
    let frames = write_log(&FLIGHT.frames, &Recipe { with_frames: false, profile_toml: None }).bytes;
    let page = page_of("frames.mcap", &frames);
    assert!(page.contains("No verdict in this log") && page.contains("no profile"));
    assert!(page.contains("has no positions of the vehicle"));
    let frames = write_log(&FLIGHT.frames, &Recipe { with_frames: false, ..Recipe::default() }).bytes;
    assert!(page_of("estimate.mcap", &frames).contains("estimate; the log has no truth"));
    let page = page_of("cut <b>&.mcap", &WHOLE.bytes[..WHOLE.bytes.len() / 2]);
    assert!(page.contains("without an end mark") && page.contains("cut &lt;b&gt;&amp;.mcap"));
    let page =
        page_of("empty.mcap", &write_log(&[], &Recipe { with_frames: false, ..Recipe::default() }).bytes);
    assert!(page.contains("has no positions of the vehicle"));
    let path = directory.path().join("no.mcap");
    std::fs::write(&path, b"something else").unwrap();
    assert!(report(&path, None).is_err());
}

/// A log with telemetry only, as it comes from a ground station's `.tlog`.
#[test]
fn telemetry_alone_makes_a_page() {
    let (tlog, log) = (WITH_FRAMES.beside("page.tlog"), WITH_FRAMES.beside("page.mcap"));
    let open = || replay::log::FlightLog::open(&WITH_FRAMES.log);
    replay::export::export_tlog(&open, None, &tlog).unwrap();
    replay::log::import_tlog(&tlog, &log).unwrap();
    let page = report(&log, None).unwrap().html;
    check(&page);
    assert!(page.contains("From the telemetry of a ground station") && page.contains("STANDS UNDAMAGED"));
}

/// The mission's own words for a start on its pad.
fn from_the_pad() -> from_apogee::Logged {
    let mut recipe = sim::recipe::Recipe::built_in("mk2", "field").unwrap();
    let toml = sim::recipe::toml_starting_at(&recipe.mission_toml, "mk2", StartPoint::Pad).unwrap();
    recipe.mission = flight::vehicles::mission::from_toml(&toml, "mk2").unwrap();
    recipe.mission_toml = toml;
    from_apogee::fly_recipe(&recipe)
}

/// From the pad: the path shows the ascent with its moments, and stays above the ground.
#[test]
fn the_report_of_a_flight_from_the_pad_shows_the_ascent() {
    let page = report(&from_the_pad().log, None).unwrap().html;
    check(&page);
    let whole = page.split("The whole flight</h2>").nth(1).unwrap();
    let whole = whole.split("<h2").next().unwrap();
    let moments = ["lift-off", "burn-out", "separation", "apogee", "ignition", "contact"];
    let places: Vec<usize> =
        moments.iter().map(|moment| whole.find(&format!("<td>{moment}</td>")).unwrap()).collect();
    assert!(places.is_sorted(), "{places:?}");
    for part in ["ascent", "descent", "burn", "Seen from the west", "Seen from the south"] {
        assert!(whole.contains(part), "{part}");
    }
    assert_eq!(whole.matches("<svg").count(), 2);
    assert_eq!(
        whole.matches("<circle").count(),
        2 * moments.len(),
        "the thrust's moments are in the table only"
    );
}

/// The estimate is compared with the truth in every direction, up to contact and not after it.
#[test]
fn errors_of_the_estimate_count_in_every_direction_and_only_in_the_air() {
    let recording = Recording::open(&LANDED.log).unwrap();
    let page = report(&LANDED.log, None).unwrap().html;
    let section = page.split("Estimator error</h2>").nth(1).unwrap().split("<h2").next().unwrap();
    for row in
        ["position north, m", "position east, m", "position, distance, m", "direction of the nose, deg"]
    {
        assert!(section.contains(row), "{row}");
    }
    assert!(!section.contains("e0<") && !section.contains("e-"), "no exponents");
    let contact_s = recording.contact_s().unwrap();
    let counted = recording
        .frames
        .iter()
        .filter(|frame| frame.input.frame.is_multiple_of(10) || frame.output.planned)
        .filter(|frame| frame.input.time_s <= contact_s)
        .count();
    assert!(section.contains(&format!("At {counted} planning frames")), "{counted}");
}

/// Two flights in the same pictures: both are named, and every picture has a line of each.
#[test]
fn a_report_with_another_log_draws_both_flights() {
    let page = report(&MK2.log, Some(&DISPERSED.log)).unwrap().html;
    check(&page);
    let both = page.split("<h2").find(|section| section.contains(">Two flights</h2>")).unwrap();
    for words in ["The landing from above", "Both: height, m", "Both: Gimbal yaw, deg", "STANDS UNDAMAGED"] {
        assert!(both.contains(words), "{words} is not in {both}");
    }
    for figure in both.split("<figure").skip(1) {
        assert!(figure.contains("class=\"l a\"") && figure.contains("class=\"l b\""), "{figure}");
    }
    check(&report(&MK2.log, Some(&LANDED.log)).unwrap().html);
}

/// The first screen names the cause with its number, links to where more of it stands, and says what the flight is without it.
#[test]
fn the_report_of_a_broken_flight_names_its_cause_first() {
    let page = report(&from_apogee::fly(&["gimbal-jams:4@powered"]).log, None).unwrap().html;
    check(&page);
    assert!(
        page.contains(
            "<p>First sign: gimbal pitch 10.8 deg from where its commands take it, at 3.7 deg, at T+"
        )
    );
    let findings = page.split("Findings, first in time").nth(1).unwrap();
    assert!(findings.split("<li>").nth(1).unwrap().contains("<a href=\"#burn\">gimbal pitch 10.8 deg"));
    assert!(page.contains("Simulated: flown again without gimbal-jams:4@powered: STANDS UNDAMAGED"));
    // In every picture of the burn the finding stands where it began.
    assert!(page.matches("class=\"limit\"").count() > 10);
}

/// Report and a flight flown again name the same plans, and what is said of one when it is explained is the same.
#[test]
fn the_worst_plans_are_named_alike() {
    let recording = Recording::open(&DISPERSED.log).unwrap();
    let flown = refly(&recording, &ReflyOptions::default()).unwrap();
    let worst = &flown.worst_plans;
    assert!((1..=3).contains(&worst.len()) && worst.is_sorted_by(|a, b| a.price >= b.price), "{worst:?}");
    let mut text = Vec::new();
    print_refly(&flown, &mut text).unwrap();
    let (text, page) = (String::from_utf8(text).unwrap(), report(&DISPERSED.log, None).unwrap().html);
    for plan in worst {
        let words = format!("frame {} (T+{:.2} s): {} at node", plan.frame, plan.time_s, plan.condition);
        assert!(page.contains(&format!("Worst: {words}")), "{words}");
        assert!(text.contains(&format!("worst plan: {words}")), "{text}");
    }
    let judged = explain(&recording, worst[0].frame).unwrap().judged.unwrap().flown;
    let condition = format!("{} at node {}", worst[0].condition, worst[0].node);
    assert_eq!(judged.broken_condition, Some(condition));
    assert!((judged.merit - judged.cost - worst[0].price).abs() < 1e-9, "{judged:?}");
}
