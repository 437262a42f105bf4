//! Tests the report of a flight: well-formed, self-contained and complete.

use std::path::Path;

use flight::vehicle::mission::StartPoint;
use replay::cli::Answer as _;
use replay::log::Recording;
use replay::refly::{ReflyOptions, refly};
use replay::report::report;
use replay::verify::explain::explain;
use sim::recipe::{Recipe as Flown, toml_starting_at};

use crate::flown::{FLIGHT, Recipe, WHOLE, write_log};
use crate::from_apogee::{LANDED, fly, fly_recipe};
use crate::simulated::{DISPERSED, MK2, WITH_FRAMES, tlog};

/// The page of a log: every tag is closed, and it refers to nothing outside itself.
fn page_of(log: &Path, with: Option<&Path>) -> String {
    let html = report(log, with).unwrap().html;
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..roxmltree::ParsingOptions::default() };
    let document = roxmltree::Document::parse_with_options(&html, options).unwrap();
    for tag in document.descendants() {
        assert!(!tag.has_attribute("src") && !tag.has_attribute("onload"));
        // Links lead to places of the page.
        if let Some(link) = tag.attribute("href") {
            let place = link.strip_prefix('#').unwrap();
            assert!(document.descendants().any(|tag| tag.attribute("id") == Some(place)), "{link}");
        }
    }
    let page = html.replace("http://www.w3.org/2000/svg", "");
    for outside in ["http:", "https:", "url(\"", "@import", "fetch", "import(", "NaN", "inf "] {
        assert!(!page.contains(outside), "{outside}");
    }
    html
}

/// What stands below a heading.
fn section<'a>(page: &'a str, title: &str) -> &'a str {
    let below = page.split_once(&format!("{title}</h2>")).unwrap_or_else(|| panic!("{title}")).1;
    below.split("<h2").next().unwrap()
}

fn says_in_order(page: &str, words: &[&str]) {
    let places: Vec<usize> =
        words.iter().map(|words| page.find(words).unwrap_or_else(|| panic!("{words}"))).collect();
    assert!(places.is_sorted(), "{places:?}");
}

/// The flight computer is run again to get its plans.
#[test]
fn the_report_says_the_verdict_first_and_then_why() {
    let mk3 = fly_recipe(&Flown::built_in("mk3", "none").unwrap());
    for log in [&LANDED.log, &MK2.log, &DISPERSED.log, &WITH_FRAMES.log, &mk3.log] {
        let page = page_of(log, None);
        let order = "STANDS UNDAMAGED|Worst of the legs' limits: |Touchdown at T+|Findings, first in time|\
            <th>inside the design envelope of its legs</th>|<summary>inside Table 2</summary>|\
            Height over the whole flight, m|Seen from above: ground track|\
            The landing: height over the distance from the pad|The landing from above|level speed, m/s|\
            rotation rate, deg/s|Gimbal pitch, deg|Gimbal yaw, deg|inferred impulse at the end, of expected|\
            Thrust, N|north at touchdown, m|iterations.</p>|Newton iterations of each plan|predicted ahead|\
            gimbal yaw at its stop of |Wind towards north, m/s|Roll rate, deg/s|Test ratio of each measurement|\
            Gyro bias as estimated, deg/s|estimate less truth|Battery, V|Specific force along the nose|\
            thrust confirmed on board|thrust fell through weight|Events</h2>|\
            Mission against the built-in one</h2>|Link</h2>|every checksum holds";
        says_in_order(&page, &order.split('|').collect::<Vec<_>>());
        assert!(page.contains("\nplanned\n") && page.matches("<svg").count() > 15);
    }
}

/// Logs with frames only, a cut log, a log without a flight, one of a ground station, and names that contain markup.
#[test]
fn a_poor_log_has_a_page_that_says_what_is_missing() {
    let directory = tempfile::tempdir().unwrap();
    let nothing = || Recipe { with_frames: false, ..Recipe::default() };
    let no_profile = Recipe { with_frames: false, profile_toml: None };
    let cases: [(&str, &[u8], &[&str]); 4] = [
        (
            "frames.mcap",
            &write_log(&FLIGHT.frames, &no_profile).bytes,
            &["No verdict in this log", "no profile", "has no positions of the vehicle"],
        ),
        ("own.mcap", &write_log(&FLIGHT.frames, &nothing()).bytes, &["estimate; the log has no truth"]),
        (
            "cut <b>&.mcap",
            &WHOLE.bytes[..WHOLE.bytes.len() / 2],
            &["without an end mark", "cut &lt;b&gt;&amp;.mcap"],
        ),
        ("empty.mcap", &write_log(&[], &nothing()).bytes, &["has no positions of the vehicle"]),
    ];
    for (name, bytes, words) in cases {
        let path = directory.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let page = page_of(&path, None);
        assert!(words.iter().all(|words| page.contains(words)), "{name}: {page}");
    }
    let log = WITH_FRAMES.beside("page.mcap");
    replay::log::import_tlog(&tlog(&WITH_FRAMES, "page.tlog"), &log).unwrap();
    says_in_order(&page_of(&log, None), &["STANDS UNDAMAGED", "From the telemetry of a ground station"]);
}

/// From the pad, by the mission's own words: the path shows the ascent with its moments, and stays above the ground.
#[test]
fn the_report_of_a_flight_from_the_pad_shows_the_ascent() {
    let mut recipe = Flown::built_in("mk2", "field").unwrap();
    recipe.mission_toml = toml_starting_at(&recipe.mission_toml, "mk2", StartPoint::Pad).unwrap();
    recipe.mission = flight::vehicles::mission::from_toml(&recipe.mission_toml, "mk2").unwrap();
    let page = page_of(&fly_recipe(&recipe).log, None);
    let whole = section(&page, "The whole flight");
    let moments = ["lift-off", "burn-out", "separation", "apogee", "ignition", "contact"];
    let cells = moments.map(|moment| format!("<td>{moment}</td>"));
    says_in_order(whole, &cells.each_ref().map(String::as_str));
    says_in_order(
        whole,
        &["Seen from the west", "\nascent\n", "\ndescent\n", "\nburn\n", "Seen from the south"],
    );
    let drawn = [whole.matches("<svg").count(), whole.matches("<circle").count()];
    assert_eq!(drawn, [2, 2 * moments.len()], "the thrust's moments are in the table only");
}

/// The estimate is compared with the truth in every direction, up to contact and not after it.
#[test]
fn errors_of_the_estimate_count_in_every_direction_and_only_in_the_air() {
    let recording = Recording::open(&LANDED.log).unwrap();
    let contact_s = recording.contact_s().unwrap();
    let planning = recording.frames.iter().filter(|frame| {
        (frame.input.frame.is_multiple_of(10) || frame.output.planned) && frame.input.time_s <= contact_s
    });
    let counted = format!("At {} planning frames", planning.count());
    let page = page_of(&LANDED.log, None);
    let errors = section(&page, "Estimator error");
    let rows =
        ["position north, m", "position east, m", "position, distance, m", "direction of the nose, deg"];
    says_in_order(errors, &[&rows[..], &[&counted]].concat());
    assert!(["e0<", "e-"].iter().all(|exponent| !errors.contains(exponent)), "{errors}");
}

/// Two flights in the same pictures: both are named, and every picture has a line of each.
#[test]
fn a_report_with_another_log_draws_both_flights() {
    page_of(&MK2.log, Some(&LANDED.log));
    let page = page_of(&MK2.log, Some(&DISPERSED.log));
    let both = section(&page, ">Two flights");
    let words = ["STANDS UNDAMAGED", "The landing from above", "Both: height, m", "Both: Gimbal yaw, deg"];
    says_in_order(both, &words);
    for figure in both.split("<figure").skip(1) {
        assert!(["a", "b"].iter().all(|class| figure.contains(&format!("class=\"l {class}\""))), "{figure}");
    }
}

/// The first screen names the cause with its number, links to where more of it stands, and says what the flight is without it.
#[test]
fn the_report_of_a_broken_flight_names_its_cause_first() {
    let page = page_of(&fly(&["gimbal-jams:4@powered"]).log, None);
    let cause = "gimbal pitch 10.8 deg from where its commands take it, at 3.7 deg";
    says_in_order(
        &page,
        &[
            &format!("<p>First sign: {cause}, at T+"),
            "Findings, first in time",
            &format!("<a href=\"#burn\">{cause}"),
            "Simulated: flown again without gimbal-jams:4@powered: STANDS UNDAMAGED",
        ],
    );
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
    let (text, page) = (flown.sentences().join("\n"), page_of(&DISPERSED.log, None));
    for plan in worst {
        let words =
            format!("orst plan: frame {} (T+{:.2} s): {} at node", plan.frame, plan.time_s, plan.condition);
        assert!(text.contains(&words) && page.contains(&words.replace(" plan", "")), "{words}: {text}");
    }
    let judged = explain(&recording, worst[0].frame).unwrap().judged.unwrap().flown;
    let condition = format!("{} at node {}", worst[0].condition, worst[0].node);
    assert_eq!(judged.broken_condition, Some(condition));
    assert!((judged.merit - judged.cost - worst[0].price).abs() < 1e-9, "{judged:?}");
}
