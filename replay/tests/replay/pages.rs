//! Tests the report of a flight: well-formed, self-contained and complete.

use quick_xml::events::Event as Xml;
use replay::report::report;

use crate::flown::{FLIGHT, Recipe, WHOLE, write_log};
use crate::from_apogee::LANDED;
use crate::simulated::{DISPERSED, NOMINAL, WITH_FRAMES};

/// Every tag is closed, and the page refers to nothing outside itself.
fn check(page: &str) {
    let mut reader = quick_xml::Reader::from_str(page);
    reader.config_mut().check_end_names = true;
    let mut open = 0_i32;
    loop {
        match reader.read_event().unwrap() {
            Xml::Start(tag) => {
                open += 1;
                assert_ne!(tag.name().as_ref(), b"script");
                for attribute in tag.attributes() {
                    let key = attribute.unwrap();
                    assert!(!matches!(key.key.as_ref(), b"src" | b"href" | b"onload"), "{key:?}");
                }
            }
            Xml::End(_) => open -= 1,
            Xml::Eof => break,
            _ => {}
        }
    }
    assert_eq!(open, 0);
    for outside in ["http:", "https:", "url(", "@import", "NaN", "inf "] {
        assert!(!page.contains(outside), "{outside}");
    }
}

#[test]
fn the_report_says_the_verdict_first_and_then_why() {
    for flight in [&*NOMINAL, &*DISPERSED, &*WITH_FRAMES] {
        let page = report(&flight.log).unwrap().html;
        check(&page);
        let order = [
            "LANDED at",
            "ignition delay",
            "thrust fell through weight",
            "Path in the pitch plane",
            "Gimbal angle, deg",
            "Tracking error by phase",
            "gimbal at its stop of 20.0 deg",
            "solve time, 99 of 100 within",
            "x at touchdown, m",
            "Thrust, N",
            "estimate less truth",
            "<h2>Link</h2>",
            "every checksum holds",
        ];
        let places: Vec<usize> = order.iter().map(|words| page.find(words).unwrap()).collect();
        assert!(places.is_sorted(), "{places:?}");
        assert!(page.matches("<svg").count() > 15);
        assert!(page.contains("prefers-color-scheme: dark"));
    }
    assert!(report(&WITH_FRAMES.log).unwrap().html.contains("/mavlink/tx/raw"));
}

/// A flight from apogee is shown in the plane of its landing; the flight computer is run again to get its plans.
#[test]
fn the_report_of_a_flight_from_apogee_has_the_same_sections() {
    let page = report(&LANDED.log).unwrap().html;
    check(&page);
    let order = [
        "LANDED at",
        "vertical speed",
        "ignition delay",
        "thrust fell through weight",
        "Path in the pitch plane",
        "Gimbal pitch, deg",
        "Gimbal yaw, deg",
        "Tracking error by phase",
        "gimbal yaw at its stop of 7.0 deg",
        "Newton iterations of each plan",
        "x at touchdown, m",
        "inferred impulse at the end, of certified",
        "Thrust, N",
        "estimate less truth",
        "every checksum holds",
    ];
    let places: Vec<usize> = order.iter().map(|words| page.find(words).unwrap()).collect();
    assert!(places.is_sorted(), "{places:?}");
    assert!(page.contains(">planned<"));
}

/// Logs with ticks only, a cut log, a log without a flight, and names that contain markup.
#[test]
fn a_poor_log_has_a_page_that_says_what_is_missing() {
    let directory = tempfile::tempdir().unwrap();
    let page_of = |name: &str, bytes: &[u8]| {
        let path = directory.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let page = report(&path).unwrap().html;
        check(&page);
        page
    };
    let ticks = write_log(&FLIGHT.ticks, &Recipe { with_frames: false, profile_toml: None }).bytes;
    let page = page_of("ticks.mcap", &ticks);
    assert!(page.contains("No verdict in this log") && page.contains("no profile"));
    assert!(
        page.contains("From the controller&quot;s") || page.contains("state estimate; the log has no plant")
    );
    let page = page_of("cut <b>&.mcap", &WHOLE.bytes[..WHOLE.bytes.len() / 2]);
    assert!(page.contains("without an end mark") && page.contains("cut &lt;b&gt;&amp;.mcap"));
    let page =
        page_of("empty.mcap", &write_log(&[], &Recipe { with_frames: false, ..Recipe::default() }).bytes);
    assert!(page.contains("has no positions of the vehicle"));
    let path = directory.path().join("no.mcap");
    std::fs::write(&path, b"something else").unwrap();
    assert!(report(&path).is_err());
}

/// A log with telemetry only, as it comes from a ground station's `.tlog`.
#[test]
fn telemetry_alone_makes_a_page() {
    let (tlog, log) = (WITH_FRAMES.beside("page.tlog"), WITH_FRAMES.beside("page.mcap"));
    let open = || replay::log::FlightLog::open(&WITH_FRAMES.log);
    replay::export::export_tlog(&open, None, &tlog).unwrap();
    replay::import::import_tlog(&tlog, &log, &mut |_| {}).unwrap();
    let page = report(&log).unwrap().html;
    check(&page);
    assert!(page.contains("From the telemetry of a ground station") && page.contains("LANDED at"));
}
