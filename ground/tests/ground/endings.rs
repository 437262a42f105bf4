//! How a flight ended, why its motor was inhibited, and a flight in silence.

use ground::key::Key;
use ground::model::Ending;
use protocol::dialect::{
    MavSeverity, TdAbortEffect, TdChute, TdHold, TdInterlock, TdLanding, TdLatch, TdLimit, TdMotor, TdPhase,
};

use ground::view::headline::{banner, pad};
use ground::view::status_lines::next_event;
use ground::view::top_lines;

use crate::rig::{MONO, Rig};
use crate::screens::{counting, descending, powered};

/// A verdict on a vehicle that fell from the descent: vertical and horizontal speed at contact,
/// m/s.
fn judged(speeds_m_s: [f32; 2], landing: TdLanding, violated: TdLimit, chute: TdChute) -> Rig {
    let mut rig = descending();
    rig.limits();
    rig.descent_with(0.0, 0.0, chute);
    rig.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    let [down_m_s, across_m_s] = speeds_m_s;
    rig.contact([12.0, 0.07, -down_m_s, across_m_s, 0.0], landing, violated);
    rig.run(0.5);
    rig
}

fn ending(rig: &Rig) -> Option<Ending> {
    Ending::of(&rig.model.vehicle, rig.now)
}

fn alarm_texts(rig: &Rig) -> Vec<&str> {
    rig.model.alarms.list().iter().map(|alarm| alarm.what.text.as_str()).collect()
}

/// The line above the large words.
pub(crate) fn reason(rig: &Rig) -> Option<String> {
    banner(&rig.model, rig.now).map(|banner| banner.reason())
}

/// Whether the smallest whole screen shows the line above the large words on every page with one of
/// these keys.
fn is_on_pages(rig: &mut Rig, keys: &str) -> bool {
    keys.chars().all(|key| {
        rig.key(Key::Char(key));
        let words = reason(rig).unwrap_or_default();
        rig.screen(80, 24).lines().nth(3).is_some_and(|row| row[1..].starts_with(words.trim_end()))
    })
}

fn next(rig: &Rig) -> Option<String> {
    next_event(&rig.model, rig.now, false)
}

/// Each of the ends has its own word on the review, on the landing page, in the events, in the
/// alarm and on small screens.
#[test]
fn each_end_has_its_word_everywhere() {
    use TdChute::{TD_CHUTE_OPEN as OPEN, TD_CHUTE_STOWED as STOWED};
    const STANDS: TdLanding = TdLanding::TD_LANDING_STANDS;
    const UPRIGHT: TdLanding = TdLanding::TD_LANDING_UPRIGHT;
    let sink = TdLimit::TD_LIMIT_VERTICAL_SPEED;
    let cases = vec![
        (
            judged([0.2, 0.05], TdLanding::all(), TdLimit::empty(), STOWED),
            "STANDS UNDAMAGED, inside the design envelope of its legs, inside Table 2",
        ),
        (
            judged([1.4, 0.1], STANDS | UPRIGHT, sink, STOWED),
            "STANDS UNDAMAGED, outside the design envelope of its legs, outside Table 2",
        ),
        (
            judged([1.4, 0.1], UPRIGHT, sink, STOWED),
            "UPRIGHT, damaged, outside the design envelope of its legs, outside Table 2",
        ),
        (judged([6.1, 9.0], UPRIGHT, sink, OPEN), "DOWN UNDER THE PARACHUTE, sinking at 6.1 m/s"),
        (
            judged([2.4, 0.3], TdLanding::empty(), sink | TdLimit::TD_LIMIT_TILT, STOWED),
            "HARD LANDING: not upright, outside sink, tilt",
        ),
        (judged([39.0, 2.0], TdLanding::empty(), sink, STOWED), "LOST: hit the ground at 39 m/s"),
    ];
    for (mut rig, sentence) in cases {
        let word = ending(&rig).expect("it is down").word();
        assert!(sentence.starts_with(word) && rig.events().contains(sentence), "{}", rig.events());
        assert!(
            is_on_pages(&mut rig, "123456789")
                && reason(&rig).unwrap().starts_with(&format!(" {word}; do not approach"))
        );
        rig.key(Key::Char('4'));
        assert!(rig.screen(80, 24).contains(&format!(" {sentence}")), "{}", rig.screen(80, 24));
        let alarms = alarm_texts(&rig);
        assert_eq!(alarms.contains(&sentence), word != "STANDS UNDAMAGED", "{alarms:?}");
    }
}

/// A canopy that was thrown out too late does not make an impact a descent under a parachute.
#[test]
fn an_impact_with_a_parachute_that_did_not_fill_is_lost() {
    let violated = TdLimit::TD_LIMIT_VERTICAL_SPEED;
    let rig = judged([22.0, 1.0], TdLanding::empty(), violated, TdChute::TD_CHUTE_OPEN);
    assert_eq!(ending(&rig), Some(Ending::Lost));
    let rig = judged([0.9, 0.2], TdLanding::empty(), TdLimit::empty(), TdChute::TD_CHUTE_STOWED);
    let hard = ending(&rig).map(|ending| ending.sentence(&rig.model.vehicle));
    assert_eq!(hard.as_deref(), Some("HARD LANDING: it did not stay upright"));
}

/// A vehicle that reports no verdict, as one without a simulated world does.
#[test]
fn without_a_verdict_only_an_open_parachute_is_claimed() {
    let mut rig = descending();
    rig.descent_with(3.0, -6.0, TdChute::TD_CHUTE_OPEN);
    rig.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    rig.run(0.5);
    assert_eq!(ending(&rig), Some(Ending::UnderParachute));
    let mut rig = powered();
    rig.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    rig.run(0.5);
    assert_eq!(ending(&rig), None);
}

/// A vehicle that falls silent is in flight until it must be down; then it is lost until it is
/// received again.
#[test]
fn a_vehicle_that_fell_silent_in_flight_is_lost_once_it_must_be_down() {
    let mut rig = descending();
    rig.run(0.5);
    rig.state(4.0, 120.0, -0.6, -21.5, 88.0);
    rig.speaks = false;
    rig.run(3.0);
    assert_eq!(ending(&rig), None);
    rig.run(60.0);
    assert_eq!(ending(&rig), Some(Ending::Lost));
    assert!(reason(&rig).unwrap().starts_with(" LOST: it went silent in flight and must be down"));
    assert!(alarm_texts(&rig).iter().any(|text| text.starts_with("LOST: it went silent")));
    rig.speaks = true;
    rig.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    rig.motor = TdMotor::TD_MOTOR_HOT;
    rig.approach_wait_s = 20;
    rig.run(1.0);
    assert_eq!(ending(&rig), None, "telemetry arrives again");
}

/// Until the canopy carries, no time is shown: the speed is that of a fall.
#[test]
fn no_time_is_shown_before_the_canopy_carries() {
    let mut rig = descending();
    rig.phase = TdPhase::TD_PHASE_CHUTE;
    rig.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
    // The phase is reported before the parachute is.
    for chute in [TdChute::TD_CHUTE_STOWED, TdChute::TD_CHUTE_FIRED] {
        rig.descent_with(90.0, -40.0, chute);
        rig.state(4.0, 90.0, -0.6, -40.0, 88.0);
        rig.run(0.1);
        assert_eq!(next(&rig).as_deref(), Some(" next chute opens, still fast, LIVE MOTOR"));
    }
    rig.descent_with(72.0, -6.0, TdChute::TD_CHUTE_OPEN);
    assert_eq!(next(&rig).as_deref(), Some(" next ground in 12.0 s, LIVE MOTOR"));
    rig.run(0.5);
    assert_eq!(next(&rig).as_deref(), Some(" next ground in 11.5 s, LIVE MOTOR"));
}

/// The reason of a latch stands beside the word, on every page.
#[test]
fn a_latch_has_its_reason_beside_it() {
    use TdLatch as L;
    for (latch, words) in [
        (L::TD_LATCH_COMMANDED, "ABORT LATCHED: commanded by another station"),
        (L::TD_LATCH_UNCOMMANDED_LIFTOFF, "ABORT LATCHED: uncommanded lift-off"),
        (L::TD_LATCH_UNCOMMANDED_RELEASE, "ABORT LATCHED: uncommanded release"),
        (L::TD_LATCH_NO_SEPARATION, "ABORT LATCHED: the booster stayed on"),
        (L::TD_LATCH_GATE, "ABORT LATCHED: the ignition gate did not open in time"),
    ] {
        let mut rig = Rig::crewed();
        rig.phase = TdPhase::TD_PHASE_COAST;
        rig.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED | TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED;
        (rig.latch, rig.motor) = (latch, TdMotor::TD_MOTOR_PIN_IN);
        rig.run(1.0);
        assert!(alarm_texts(&rig).contains(&words), "{:?}", alarm_texts(&rig));
    }
    // Inhibited for good without an abort.
    let mut rig = Rig::crewed();
    rig.phase = TdPhase::TD_PHASE_CHUTE;
    rig.interlocks |= TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED;
    rig.latch = TdLatch::TD_LATCH_GATE;
    rig.run(1.0);
    let words = "MOTOR INHIBITED: the ignition gate did not open in time";
    assert!(alarm_texts(&rig).contains(&words));
}

/// A cause without a value of its own: the grave text about that time is the reason, or there is
/// none.
#[test]
fn a_text_is_the_reason_of_a_latch_without_one() {
    let latched = |before: &str, at_the_latch: Option<&str>| {
        let mut rig = Rig::crewed();
        rig.text_of(MavSeverity::MAV_SEVERITY_CRITICAL, before);
        rig.run(30.0);
        rig.phase = TdPhase::TD_PHASE_COAST;
        rig.latch = TdLatch::TD_LATCH_OTHER;
        rig.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
        rig.run(0.3);
        rig.text("only a warning");
        if let Some(text) = at_the_latch {
            rig.text_of(MavSeverity::MAV_SEVERITY_CRITICAL, text);
        }
        rig.run(0.5);
        rig.text_of(MavSeverity::MAV_SEVERITY_CRITICAL, "LIVE MOTOR: do not approach for 60 s");
        rig.run(0.1);
        let alarms = rig.model.alarms.list();
        alarms.iter().find(|alarm| alarm.what.text.starts_with("ABORT")).map(|alarm| alarm.what.text.clone())
    };
    assert_eq!(
        latched("an old trouble", Some("LIFT-OFF without a command")).as_deref(),
        Some("ABORT LATCHED: LIFT-OFF without a command")
    );
}

/// The link is lost at T-1.8 s, and the vehicle launches unheard.
fn unheard() -> Rig {
    let mut rig = counting();
    rig.limits();
    rig.countdown_ms = 1_800;
    rig.run(0.1);
    rig.speaks = false;
    rig
}

#[test]
fn a_countdown_that_ends_unheard_may_be_a_flight_on_every_page() {
    let mut rig = unheard();
    rig.run(1.6);
    assert_eq!(reason(&rig), None, "not yet");
    rig.run(12.2);
    let words = " MAY BE IN THE AIR since T-0, silent since T-1.8 s; should land within 120 m";
    assert_eq!(reason(&rig).as_deref(), Some(words));
    assert!(is_on_pages(&mut rig, "123456789?ftx"));
    let state = rig.screen(80, 24).lines().nth(1).unwrap_or_default().to_owned();
    assert!(state.starts_with("\"~ARMED    IN THE AIR?   ~T+12.0"), "{state}");
    for (columns, rows) in [(60, 12), (20, 5)] {
        assert!(rig.screen(columns, rows).contains("MAY BE IN THE AIR"), "{}", rig.screen(columns, rows));
    }
    rig.key(Key::Char('f'));
    let find = rig.screen(80, 24);
    assert!(find.contains("120 m, the fence of its"), "{find}");
    assert!(rig.events().contains("MAY BE IN THE AIR: no telemetry since T-1.8 s"), "{}", rig.events());
}

/// The link is back after the landing: the page of the lost vehicle knows what the verdict knows.
#[test]
fn a_verdict_or_a_later_phase_means_that_the_vehicle_has_left_the_pad() {
    let mut rig = unheard();
    rig.run(40.0);
    rig.verdict_at(40.7);
    let place = rig.model.last_place(rig.now).expect("it has left the pad");
    assert!((place.predicted.unwrap_or(place.received).error_m - 42.0).abs() < 0.5, "{place:?}");
    rig.speaks = true;
    rig.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    rig.run(1.0);
    assert!(reason(&rig).unwrap().starts_with(" STANDS UNDAMAGED; do not approach for 55 s"));
    rig.state(40.7, 0.0, 0.0, 0.0, 89.0);
    rig.key(Key::Char('f'));
    let find = rig.screen(80, 24);
    assert!(find.contains("41 m, bearing 000 deg"), "{find}");
    assert!(rig.model.outcome.started, "a flight was flown");
}

/// The largest letters of every page, while it climbs; and the abort does not say that nothing is
/// left.
#[test]
fn a_liftoff_that_nobody_commanded_is_the_largest_word_of_every_page() {
    let mut rig = Rig::crewed();
    rig.phase = TdPhase::TD_PHASE_BOOST;
    rig.latch = TdLatch::TD_LATCH_UNCOMMANDED_LIFTOFF;
    rig.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED | TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED;
    rig.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_NONE;
    rig.run(0.3);
    assert_eq!(reason(&rig).as_deref(), Some(" LIFT-OFF, uncommanded: TAKE COVER, look up"));
    assert!(is_on_pages(&mut rig, "123456789?ftx"));
    let abort = top_lines::abort(&rig.model, MONO, rig.now, 80).to_string();
    assert_eq!(abort, " abort now: ABORTED already: parachute at apogee");
    assert!(rig.screen(20, 5).contains("LIFT-OFF"), "{}", rig.screen(20, 5));
    rig.key(Key::Char('0'));
    rig.phase = TdPhase::TD_PHASE_CHUTE;
    rig.run(0.3);
    assert_eq!(reason(&rig), None);
}

/// The vehicle held its countdown in the silence: when telemetry returns, nothing was in the air.
#[test]
fn a_hold_in_the_silence_takes_the_warning_back() {
    let mut rig = unheard();
    rig.run(10.0);
    assert!(reason(&rig).is_some());
    rig.speaks = true;
    (rig.hold, rig.countdown_ms) = (TdHold::TD_HOLD_UPLINK_SILENT, i32::MAX);
    rig.run(0.2);
    assert_eq!((reason(&rig), pad(&rig.model, rig.now).text), (None, "HOLD".to_owned()));
    assert!(rig.model.last_place(rig.now).is_none(), "it has not left the pad");
    // Without a countdown silence on the pad is only silence.
    rig.speaks = false;
    rig.run(60.0);
    assert_eq!(reason(&rig), None);
}

/// The review begins with what the vehicle found, first in time; what has not arrived is said.
#[test]
fn the_review_lists_what_went_wrong() {
    let sink = TdLimit::TD_LIMIT_VERTICAL_SPEED;
    let mut rig = judged([2.4, 0.3], TdLanding::empty(), sink, TdChute::TD_CHUTE_STOWED);
    rig.key(Key::Char('4'));
    assert!(rig.screen(120, 36).contains("not reported yet"), "{}", rig.screen(120, 36));
    rig.finding(1, 3, 15.75, "landing motor's impulse 0.867 of the mission's");
    rig.finding(0, 3, 21.5, "no plan that lands for 1.2 s\u{1b}[2J");
    for (columns, rows) in [(80, 24), (120, 36), (200, 50)] {
        let screen = rig.screen(columns, rows);
        let [impulse, plan, more] =
            ["T+15.8", "T+21.5", "1 more not received yet"].map(|part| screen.find(part));
        assert!(impulse.is_some() && impulse < plan && plan < more, "{screen}");
        assert!(screen.contains("what went wrong") && screen.contains("landing motor's"), "{screen}");
        assert!(!screen.contains('\u{1b}'), "{screen}");
    }
    rig.finding(2, 3, 25.0, "battery down to 6.50 V");
    assert!(!rig.screen(120, 36).contains("not received yet"));

    let mut rig = judged([0.4, 0.1], TdLanding::all(), TdLimit::empty(), TdChute::TD_CHUTE_STOWED);
    rig.finding(0, 0, 0.0, "");
    rig.key(Key::Char('4'));
    assert!(rig.screen(120, 36).contains("nothing went wrong"), "{}", rig.screen(120, 36));
}
