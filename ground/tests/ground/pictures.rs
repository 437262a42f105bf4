//! Every page at three sizes and in every theme: nothing is cut, every letter can be read, colour
//! says nothing alone.
//!
//! The pictures are written to `target/tmp/pictures`. `UPDATE_PICTURES=1 cargo test -p ground
//! --test ground pictures` also writes those that README.md and docs/crew.md show, the moving one
//! included, to `ground/pictures`, from the flight that is recorded there: `onboard-sim fly --start
//! pad --dispersion real --seed 2001 --mavlink udpin:127.0.0.1:14550` and `ground --auto --connect
//! udpout:127.0.0.1:14550 --log flight.mcap`.

use std::fs;
use std::path::Path;
use std::time::Duration;

use ground::key::Key;
use ground::model::{Act, Page, Seat};
use ground::replay::recording::Recording;
use ground::update::{Msg, Request};
use ground::view::theme::{Depth, Ink, Level, Palette, TextRole, Theme};
use ground::view::{CUT_MARK, footer};
use protocol::dialect::{
    MavMessage, TD_FLIGHT_STATUS_DATA, TdAbortEffect, TdBooster, TdCheck, TdChute, TdHold, TdInterlock,
    TdLimit, TdPhase,
};
use ratatui::buffer::Buffer;
use ratatui::style::{Color, Modifier};
use strum::VariantArray as _;

use crate::rig::svg::{colours, moving_picture, picture, rgb};
use crate::rig::{MONO, Rig, settings};
use crate::screens::{armed, counting, on_the_pad};

const SIZES: [(u16, u16); 3] = [(80, 24), (140, 45), (200, 60)];
/// A middling screen.
const MIDDLING: (u16, u16) = (120, 36);
/// The same terminal with a line, or two, of a multiplexer.
const LESS_ROWS: [(u16, u16); 2] = [(80, 23), (80, 22)];

/// The least contrast of text and of pictures: the strictest level of WCAG 2.2.
pub(crate) const CONTRAST_MIN: f64 = 7.0;

fn no_go() -> Rig {
    let mut rig = with_events();
    rig.checks_failed =
        (TdCheck::TD_CHECK_PIN | TdCheck::TD_CHECK_IGNITER | TdCheck::TD_CHECK_LOG_SPACE).bits();
    rig.interlocks = TdInterlock::empty();
    rig.run(1.0);
    rig
}

/// On the pad after the vehicle has said what it says at its start.
fn with_events() -> Rig {
    let mut rig = on_the_pad();
    for text in
        ["self-test passed", "the log runs", "plan: a landing is rehearsed", "igniter closed", "uplink alive"]
    {
        rig.text(text);
    }
    rig.run(1.0);
    rig
}

/// On the pad with a checklist: signed, open, voided, and with a value.
fn with_checklist() -> Rig {
    let mut rig = on_the_pad();
    let list = ground::model::parse_checklist(include_str!("../../checklist-example.toml"));
    rig.msg(Msg::Checklist(Box::new(list.expect("the example is a checklist"))));
    for (step, void) in [(0, false), (1, false), (3, false), (1, true)] {
        rig.msg(Msg::Requested { request: Request::Sign { step, void }, by: Seat::new(2, "Ann") });
    }
    rig.key(Key::Char('k'));
    rig.run(1.0);
    rig
}

/// A flight in space up to a phase.
pub(crate) fn flying(until: TdPhase) -> Rig {
    let mut rig = counting();
    rig.limits();
    rig.phase = TdPhase::TD_PHASE_BOOST;
    for k in 0..60_u16 {
        let t = f32::from(k) * 0.1;
        if k == 15 {
            rig.phase = TdPhase::TD_PHASE_COAST;
        }
        let climb = if t < 1.5 { 45.0 * t } else { 67.5 - 9.8 * (t - 1.5) };
        let up = if t < 1.5 { 22.5 * t * t } else { 50.6 + 67.5 * (t - 1.5) - 4.9 * (t - 1.5) * (t - 1.5) };
        rig.state_in_space([2.0 * t, -1.5 * t, up], [2.0, -1.5, climb], (200.0, 4.0));
        rig.actuated_fins();
        rig.ascent(TdBooster::TD_BOOSTER_ATTACHED, 284.0, (9.0 - t).max(0.1));
        rig.run(0.1);
    }
    if until == TdPhase::TD_PHASE_COAST {
        return rig;
    }
    rig.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    rig.text("fins open");
    for k in 0..90_u16 {
        let t = f32::from(k) * 0.1;
        let up = 280.0 - 21.5 * t;
        rig.state_in_space([18.0 - 1.8 * t, -12.0 + 1.1 * t, up], [-1.8, 1.1, -21.5], (200.0, 4.0));
        rig.actuators(0);
        rig.descent_with(up, -21.5, TdChute::TD_CHUTE_STOWED);
        rig.run(0.1);
    }
    if until == TdPhase::TD_PHASE_AERO_DESCENT {
        return rig;
    }
    rig.phase = TdPhase::TD_PHASE_POWERED;
    for k in 0..20_u16 {
        let t = f32::from(k) * 0.1;
        let up = 30.0 - 14.0 * t;
        rig.state_in_space([1.8 - 0.6 * t, -1.1 + 0.4 * t, up], [-0.6, 0.4, -14.0], (200.0, 4.0));
        rig.actuators(-310);
        rig.plan(TdLimit::empty());
        rig.run(0.1);
    }
    if until == TdPhase::TD_PHASE_POWERED {
        return rig;
    }
    rig.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    rig.armed = false;
    rig.verdict(true, TdLimit::empty());
    rig.run(1.0);
    rig
}

/// Armed, and a sensor dies.
fn unfit() -> Rig {
    let mut rig = armed();
    rig.checks_failed = TdCheck::TD_CHECK_ACCELEROMETER.bits();
    rig.text("armed, and accelerometer repeats one value for 1 s");
    rig.run(1.0);
    rig
}

/// The countdown is held for it.
fn held() -> Rig {
    let mut rig = counting();
    rig.checks_failed = TdCheck::TD_CHECK_ACCELEROMETER.bits();
    rig.text("accelerometer repeats one value for 1 s");
    (rig.countdown_ms, rig.hold) = (i32::MAX, TdHold::TD_HOLD_CHECK_FAILED);
    rig.run(1.0);
    rig
}

/// A state of each kind that a crew sees, with its name.
pub(crate) fn states() -> Vec<(&'static str, Rig)> {
    let mut lost = flying(TdPhase::TD_PHASE_AERO_DESCENT);
    lost.speaks = false;
    lost.run(6.0);
    vec![
        ("pad", with_events()),
        ("nogo", no_go()),
        ("checklist", with_checklist()),
        ("armed", armed()),
        ("counting", counting()),
        ("unfit", unfit()),
        ("held", held()),
        ("coast", flying(TdPhase::TD_PHASE_COAST)),
        ("descent", flying(TdPhase::TD_PHASE_AERO_DESCENT)),
        ("burn", flying(TdPhase::TD_PHASE_POWERED)),
        ("landed", flying(TdPhase::TD_PHASE_TOUCHDOWN)),
        ("lost", lost),
    ]
}

/// Draws every page of every state at every size and passes it on with its name.
fn every_page(mut see: impl FnMut(&str, &Rig, (u16, u16))) {
    for (state, mut rig) in states() {
        see(&format!("{state}-followed"), &rig, SIZES[0]);
        for page in Page::all() {
            rig.model.pages.hold(Some(page));
            for size in SIZES.into_iter().chain([MIDDLING]) {
                see(&format!("{state}-{}-{}x{}", page.name().to_lowercase(), size.0, size.1), &rig, size);
            }
        }
    }
}

fn drawn(rig: &Rig, (columns, rows): (u16, u16), palette: Palette) -> Buffer {
    rig.draw(columns, rows, Theme { palette, ascii: false }).backend().buffer().clone()
}

pub(crate) fn rows(buffer: &Buffer) -> Vec<String> {
    let cells = buffer.content.chunks(usize::from(buffer.area.width));
    cells.map(|row| row.iter().map(ratatui::buffer::Cell::symbol).collect()).collect()
}

/// The ratio of the lighter to the darker luminance (WCAG 2.2, "contrast ratio").
pub(crate) fn contrast(one: [u8; 3], other: [u8; 3]) -> f64 {
    let luminance = |rgb: [u8; 3]| {
        let [red, green, blue] = rgb.map(|part| {
            let part = f64::from(part) / 255.0;
            if part <= 0.04045 { part / 12.92 } else { libm::pow((part + 0.055) / 1.055, 2.4) }
        });
        0.2126 * red + 0.7152 * green + 0.0722 * blue
    };
    let (one, other) = (luminance(one), luminance(other));
    (one.max(other) + 0.05) / (one.min(other) + 0.05)
}

#[test]
fn no_page_cuts_what_it_shows() {
    let mut cut = Vec::new();
    every_page(|name, rig, size| {
        // Whether people may approach is more important than the last rows of this one.
        // The events beside a checklist have no room at 120 columns.
        if ["landed-help-80x24", "checklist-pad-120x36"].contains(&name) {
            return;
        }
        let rows = rows(&drawn(rig, size, Palette::Dark));
        for row in rows.iter().filter(|row| row.contains(CUT_MARK) && !row.contains("A last … is")) {
            cut.push(format!("{name}: {row}"));
        }
        // An angle has one unit everywhere, which a terminal without Unicode has, too.
        cut.extend(
            rows.iter().filter(|row| row.chars().any(|c| c == '°')).map(|row| format!("{name}: {row}")),
        );
    });
    assert!(cut.is_empty(), "{}", cut.join("\n"));
}

/// Every theme shows the same characters, so no meaning is in a colour alone; and every letter can
/// be read.
#[test]
fn every_theme_shows_the_same_text_with_enough_contrast() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("pictures");
    fs::create_dir_all(&folder).unwrap();
    every_page(|name, rig, size| {
        let plain = rows(&drawn(rig, size, Palette::None));
        for palette in Palette::VARIANTS.iter().copied() {
            let buffer = drawn(rig, size, palette);
            let theme = Theme { palette, ascii: false };
            assert_eq!(rows(&buffer), plain, "{name} {palette:?}");
            for cell in &buffer.content {
                assert!(!cell.modifier.contains(Modifier::DIM), "{name} {palette:?}: dim");
                if palette == Palette::None {
                    assert_eq!((cell.fg, cell.bg), (Color::Reset, Color::Reset), "{name}: no colour");
                    continue;
                }
                let (fore, back) = colours(cell);
                // Nothing depends on the lines between panels.
                let is_line = "│─┌┐└┘├┤┬┴┼┄".contains(cell.symbol());
                if is_line && theme.border().fg == Some(cell.fg) {
                    continue;
                }
                let found = contrast(fore, back);
                assert!(found >= CONTRAST_MIN, "{name} {palette:?}: {cell:?} {found:.1}");
            }
            fs::write(folder.join(format!("{name}-{palette:?}.svg")), picture(&buffer)).unwrap();
        }
    });
}

/// Yellow and pale letters vanish in the sun, and a prediction is no fault.
#[test]
fn the_light_theme_is_dark_on_white_without_yellow() {
    let theme = Theme { palette: Palette::Light, ascii: false };
    assert_eq!(rgb(theme.back()), Some([255; 3]), "white");
    for fore in inks(theme) {
        let [red, green, blue] = rgb(fore).unwrap();
        let yellow = red > 80 && green > 80 && blue < red.min(green) / 2;
        assert!(!yellow, "{fore}");
    }
    let [predicted, alarm] = [Some(theme.ink(Ink::Predicted)), theme.style(TextRole::Alarm).bg];
    let is_red = |colour: Option<Color>| {
        let [red, green, _] = colour.and_then(rgb).unwrap();
        red > 100 && green < 50
    };
    assert!(is_red(alarm) && !is_red(predicted), "{predicted:?}");
    assert!(!is_red(predicted.map(|colour| Depth::True.shown(colour, false))));
}

#[test]
fn in_the_light_theme_caution_alarm_and_flame_have_three_colours() {
    let theme = Theme { palette: Palette::Light, ascii: false };
    let colours =
        [theme.style(TextRole::Caution).bg, theme.style(TextRole::Alarm).bg, Some(theme.ink(Ink::Flame))];
    for depth in [Depth::Indexed, Depth::True] {
        let shown = |colour| depth.shown(colour, false);
        let [caution, alarm, flame] = colours.map(|colour| rgb(shown(colour.unwrap())).unwrap());
        for (one, other) in [(caution, alarm), (caution, flame), (alarm, flame)] {
            let apart: u32 = one.iter().zip(other).map(|(one, other)| u32::from(one.abs_diff(other))).sum();
            assert!(apart >= 80, "{one:?} {other:?}");
        }
    }
}

/// A held countdown is stated on its page and in the row of its alarm, and not in a third one.
#[test]
fn a_hold_is_stated_once_on_the_page_and_once_as_an_alarm() {
    let screen = held().screen(80, 24);
    assert_eq!(screen.matches("HOLD: accelerometer").count(), 2, "{screen}");
}

/// The ground of large letters of danger is one area.
#[test]
fn large_letters_of_danger_have_one_ground() {
    for palette in [Palette::Dark, Palette::Light] {
        let theme = Theme { palette, ascii: false };
        let buffer = drawn(&held(), SIZES[0], palette);
        let alarm = theme.style(TextRole::Alarm).bg;
        // HOLD is 20 columns wide, and as many rows high as its letters.
        for (column, row) in (1..20).flat_map(|column| (4..7).map(move |row| (column, row))) {
            assert_eq!(Some(buffer[(column, row)].bg), alarm, "{palette:?} {column} {row}");
        }
    }
}

#[test]
fn a_large_pad_page_lists_every_check() {
    let screen = on_the_pad().screen(200, 60);
    for name in ["abort latch", "self test", "igniter", "controller warm", "uplink", "battery"] {
        assert!(screen.contains(name), "{name}: {screen}");
    }
}

/// Every colour of letters and pictures of a theme.
fn inks(theme: Theme) -> Vec<Color> {
    use TextRole::{Caution, Good, Key as OfKeys, Label, Plain, Stale, Title};
    let roles = [Plain, Label, Stale, Title, Good, Caution, OfKeys];
    let styles = roles.map(|role| theme.style(role).fg.expect("a colour"));
    Ink::VARIANTS.iter().map(|ink| theme.ink(*ink)).chain(styles).collect()
}

/// Every colour can be read on every ground of its theme, on terminals of 256 colours and of 24
/// bits. Those of 16 are the terminal's own: where letters and ground differ least, large ones can
/// be read (3:1, WCAG 2.2).
#[test]
fn every_colour_of_a_theme_can_be_read() {
    for palette in [Palette::Dark, Palette::Light] {
        let theme = Theme { palette, ascii: false };
        let grounds = [theme.ground(), theme.raised()].map(|style| style.bg.unwrap());
        let on_grounds = inks(theme).into_iter().flat_map(|fore| grounds.map(|back| (fore, back)));
        let levels = Level::VARIANTS.iter().map(|level| theme.level(*level));
        let whole = levels.chain([theme.style(TextRole::Alarm)]).map(|s| (s.fg.unwrap(), s.bg.unwrap()));
        for (fore, back) in on_grounds.chain(whole) {
            for (depth, least) in
                [(Depth::Indexed, CONTRAST_MIN), (Depth::True, CONTRAST_MIN), (Depth::Sixteen, 3.0)]
            {
                let (fore, back) = (depth.shown(fore, false), depth.shown(back, true));
                let found = contrast(rgb(fore).unwrap(), rgb(back).unwrap());
                assert!(found >= least, "{palette:?} {depth:?} {fore} on {back}: {found:.2}");
            }
            for colour in [fore, back] {
                let is_grey = matches!(colour, Color::Indexed(231));
                let true_colour = Depth::True.shown(colour, false);
                assert!(is_grey || matches!(true_colour, Color::Rgb(..)), "{colour} has no 24 bits");
            }
        }
    }
}

/// Roles that mean different things differ without colour, or have words of their own.
#[test]
fn without_colour_an_alarm_still_stands_out() {
    let theme = Theme { palette: Palette::None, ascii: false };
    let weight = |role| theme.style(role).add_modifier;
    assert!(weight(TextRole::Alarm).contains(Modifier::REVERSED));
    assert_ne!(weight(TextRole::Caution), weight(TextRole::Plain));
    assert_ne!(weight(TextRole::Stale), weight(TextRole::Plain));
}

/// What must be seen first is in large letters on the page that follows the flight.
#[test]
fn what_must_be_seen_first_is_the_largest() {
    for (name, rig) in states() {
        for (size, least) in SIZES.into_iter().chain(LESS_ROWS).zip([30, 60, 70, 30, 30]) {
            let buffer = drawn(&rig, size, Palette::Dark);
            let blocks = "█▀▄";
            let large = buffer.content.iter().filter(|cell| blocks.contains(cell.symbol())).count();
            assert!(large >= least || name == "pad", "{name} {size:?}: {large} cells");
        }
    }
}

/// After a loss of the link an old height would be the most dangerous thing to show large.
#[test]
fn the_headline_shows_no_old_height() {
    let mut lost = flying(TdPhase::TD_PHASE_AERO_DESCENT);
    let labels = |rig: &Rig| rig.screen(80, 24).lines().nth(3).unwrap_or_default().to_owned();
    assert!(labels(&lost).contains("height m"), "{}", labels(&lost));
    lost.speaks = false;
    lost.run(6.0);
    for page in ['2', '3'] {
        lost.key(Key::Char(page));
        let band = labels(&lost);
        assert!(!band.contains("height m") && band.contains("PREDICTED m up"), "{band}");
    }
}

/// The names in the timeline: whole ones alone, at every width.
#[test]
fn no_name_in_the_timeline_overwrites_another() {
    const NAMES: [&str; 11] = [
        "lift",
        "off",
        "burnout",
        "apogee",
        "falls",
        "ready",
        "ignition",
        "thrust",
        "touchdown",
        "over",
        "parachute",
    ];
    for until in [TdPhase::TD_PHASE_AERO_DESCENT, TdPhase::TD_PHASE_POWERED, TdPhase::TD_PHASE_TOUCHDOWN] {
        let rig = flying(until);
        for columns in 60..240 {
            let rows = footer::message_rows(&rig.model, MONO, rig.now, columns);
            assert_eq!(rows.len(), if columns < 120 { 1 } else { 2 });
            let text: String = rows.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
            let words = text.split(|letter: char| !letter.is_ascii_alphabetic());
            let cut: Vec<_> = words.filter(|word| !word.is_empty() && !NAMES.contains(word)).collect();
            assert!(cut.is_empty(), "{columns}: {cut:?} in {text}");
        }
    }
}

/// While people wait beside a vehicle that has landed, the flight does not shrink.
#[test]
fn the_flight_stands_still_after_the_touchdown() {
    let mut rig = flying(TdPhase::TD_PHASE_TOUCHDOWN);
    rig.run(3.0);
    let until = footer::shown_until(&rig.model, rig.now);
    rig.run(60.0);
    assert_eq!(footer::shown_until(&rig.model, rig.now), until);
    assert!(until + Duration::from_mins(1) < rig.now);
}

/// The row of the keys names none that the vehicle refuses.
#[test]
fn no_key_disarms_in_flight() {
    for (name, rig) in states() {
        let armed = ["armed", "counting", "unfit", "held"].contains(&name);
        assert_eq!(Act::Disarm.works(&rig.model, rig.now), armed, "{name}");
    }
}

/// A moment of the recorded flight: a station that has received everything up to it, and the
/// vehicle's last words.
struct Moment {
    rig: Rig,
    phase: TdPhase,
    status: TD_FLIGHT_STATUS_DATA,
    /// Metres above the pad.
    height_m: f64,
}

/// Plays the flight and shows every moment, until this says that it has seen enough.
fn recorded(mut enough: impl FnMut(&Moment) -> bool) -> Moment {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("pictures/flight.tlog");
    let recording = Recording::load(&path, None).expect("the recorded flight");
    let reader = recording.reader().expect("the recorded flight");
    let mut rig = Rig::new(settings(false, true));
    rig.speaks = false;
    // As the first command of README.md shows it.
    rig.model.settings.demonstration = true;
    let status = TD_FLIGHT_STATUS_DATA::default();
    let mut moment = Moment { rig, phase: TdPhase::TD_PHASE_SAFE, status, height_m: f64::INFINITY };
    for event in reader {
        let (at, event) = event.expect("the recorded flight");
        let rig = &mut moment.rig;
        while rig.now + Duration::from_millis(100) <= at {
            rig.run(0.1);
        }
        match event {
            Msg::Frame(frame) => {
                match frame.decode().expect("a message of the vehicle") {
                    MavMessage::TD_FLIGHT_STATUS(status) => {
                        (moment.phase, moment.status) = (status.phase, status);
                    }
                    // The station of the recording is the one whose screen is drawn.
                    MavMessage::TD_UPLINK(told) => moment.rig.model.settings.session = told.session,
                    MavMessage::LOCAL_POSITION_NED(place) => moment.height_m = -f64::from(place.z),
                    _ => {}
                }
                moment.rig.msg(Msg::Frame(frame));
            }
            command @ Msg::Commanded(_) => rig.msg(command),
            _ => {}
        }
        if enough(&moment) {
            break;
        }
    }
    moment
}

/// On the pad, with every check passed.
fn is_ready(moment: &Moment) -> bool {
    let phase = moment.phase == TdPhase::TD_PHASE_PAD_IDLE;
    phase && moment.status.checks_failed.is_empty() && moment.rig.model.link.uplink.is_proven(moment.rig.now)
}

/// The pictures of the pages from the recorded flight: on the pad, in the descent, in the burn, and
/// after the landing.
fn moments() -> Vec<(&'static str, Palette, Moment)> {
    let falls = |moment: &Moment| moment.phase == TdPhase::TD_PHASE_AERO_DESCENT && moment.height_m < 220.0;
    let burns = |moment: &Moment| moment.phase == TdPhase::TD_PHASE_POWERED && moment.height_m < 15.0;
    vec![
        ("pad-light", Palette::Light, recorded(is_ready)),
        ("descent-dark", Palette::Dark, recorded(falls)),
        ("burn-dark", Palette::Dark, recorded(burns)),
        ("landed-light", Palette::Light, recorded(|_| false)),
    ]
}

/// A picture of the pages is what the screen shows now; `UPDATE_PICTURES` makes it so.
fn regress(name: &str, svg: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("pictures").join(name);
    if std::env::var_os("UPDATE_PICTURES").is_some() {
        fs::write(&path, svg).expect("the folder of the pictures");
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    assert!(kept == svg, "{} is out of date; see the head of this file", path.display());
}

/// An abort in the descent: the parachute is open.
fn aborted() -> Rig {
    let mut rig = flying(TdPhase::TD_PHASE_AERO_DESCENT);
    rig.phase = TdPhase::TD_PHASE_CHUTE;
    rig.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED | TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED;
    rig.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_NONE;
    rig.approach_wait_s = u16::MAX;
    rig.state_in_space([9.0, -2.0, 122.0], [1.5, 2.0, -6.1], (200.0, 3.0));
    rig.descent_with(122.0, -6.1, TdChute::TD_CHUTE_OPEN);
    rig.run(1.0);
    rig
}

#[test]
fn regress_the_picture_of_an_abort() {
    regress("aborted-dark.svg", &picture(&drawn(&aborted(), SIZES[0], Palette::Dark)));
}

/// The pictures on the pages are what the screen shows at four moments of one recorded flight, at
/// the height that the vehicle sent.
#[test]
fn regress_the_pictures_of_the_pages() {
    for (name, palette, moment) in moments() {
        let svg = picture(&drawn(&moment.rig, SIZES[0], palette));
        regress(&format!("{name}.svg"), &svg);
        assert!(svg.len() < 30_000, "{name}: {} bytes", svg.len());
        let shown = moment.rig.model.vehicle.height_m().expect("a height").value;
        assert!((shown - moment.height_m).abs() < 2.0, "{name}: {shown} m, sent {} m", moment.height_m);
    }
}

/// The phases between the pad and the burn.
const FLOWN: [TdPhase; 5] = [
    TdPhase::TD_PHASE_BOOST,
    TdPhase::TD_PHASE_COAST,
    TdPhase::TD_PHASE_AERO_DESCENT,
    TdPhase::TD_PHASE_LAND_ARMED,
    TdPhase::TD_PHASE_IGNITION,
];

/// The moving picture of README.md is the whole recorded flight: pad and verdict stay long enough
/// to be read, the burn is as slow as it is, the rest twice as fast. It goes through every phase.
#[test]
fn regress_the_moving_picture() {
    let (mut screens, mut phases) = (Vec::new(), Vec::new());
    let mut next_at = Duration::ZERO;
    let end = recorded(|moment| {
        let (step_s, shown_s) = match moment.phase {
            TdPhase::TD_PHASE_PAD_IDLE if is_ready(moment) => (f64::INFINITY, 1.5),
            TdPhase::TD_PHASE_PAD_ARMED if moment.status.countdown_ms < 2_000 => (1.0, 0.5),
            TdPhase::TD_PHASE_POWERED => (0.5, 0.5),
            phase if !FLOWN.contains(&phase) => return false,
            _ => (1.0, 0.5),
        };
        let now = moment.rig.now;
        if phases.last() != Some(&moment.phase) || now >= next_at {
            phases.push(moment.phase);
            next_at = now.saturating_add(Duration::try_from_secs_f64(step_s).unwrap_or(Duration::MAX));
            screens.push((drawn(&moment.rig, SIZES[0], Palette::Dark), shown_s));
        }
        false
    });
    screens.push((drawn(&end.rig, SIZES[0], Palette::Dark), 3.0));
    let svg = moving_picture(&screens);
    let all_s: f64 = screens.iter().map(|(_, shown_s)| shown_s).sum();
    regress("flight.svg", &svg);
    assert!(svg.len() <= 400_000 && !svg.contains("<script"), "{} bytes", svg.len());
    assert!((12.0..=20.0).contains(&all_s), "{all_s} s");
    assert!(FLOWN.iter().all(|phase| phases.contains(phase)), "{phases:?}");
}
