//! Fins and gimbal, commanded and measured, and whether a motor gives thrust, as the screen shows
//! them.

use ground::key::Key;
use ground::model::Page;
use ground::view::headline;
use ground::view::theme::{Ink, Palette, Theme};
use protocol::dialect::{MavMessage, TD_FINS_DATA, TdInterlock, TdPhase};

use crate::pictures::flying;
use crate::rig::{MONO, Rig};
use crate::screens::armed;

const SIZES: [(u16, u16); 4] = [(80, 24), (120, 36), (140, 45), (200, 50)];

/// Every phase from pad to touchdown, by its name in the logs.
const PHASES: [(TdPhase, &str); 10] = [
    (TdPhase::TD_PHASE_PAD_IDLE, "PAD_IDLE"),
    (TdPhase::TD_PHASE_PAD_ARMED, "PAD_ARMED"),
    (TdPhase::TD_PHASE_BOOST, "BOOST"),
    (TdPhase::TD_PHASE_COAST, "COAST"),
    (TdPhase::TD_PHASE_DEPLOY, "DEPLOY"),
    (TdPhase::TD_PHASE_AERO_DESCENT, "AERO_DESCENT"),
    (TdPhase::TD_PHASE_LAND_ARMED, "LAND_ARMED"),
    (TdPhase::TD_PHASE_IGNITION, "IGNITION"),
    (TdPhase::TD_PHASE_POWERED, "POWERED"),
    (TdPhase::TD_PHASE_TOUCHDOWN, "TOUCHDOWN"),
];

/// The numbers in the row of fins and gimbal: a measured and a commanded one of each fin, of pitch
/// and of yaw, degrees; and the phase before them.
fn read(screen: &str) -> Option<(String, Vec<f64>)> {
    let row = screen.lines().find(|row| row.contains(" fins deg/cmd "))?;
    let (phase, numbers) = row.trim_matches('"').split_once(" fins deg/cmd ")?;
    let (fins, gimbal) = numbers.split_once(" gimbal ")?;
    let (pitch, yaw) = gimbal.trim().strip_prefix('P')?.split_once('Y')?;
    let fins: String = fins.replace('/', " ");
    let numbers = [fins.as_str(), &pitch.replace('/', " "), &yaw.replace('/', " ")].join(" ");
    let numbers: Option<Vec<f64>> = numbers.split_whitespace().map(|number| number.parse().ok()).collect();
    Some((phase.trim().to_owned(), numbers?))
}

#[test]
fn every_page_of_the_flight_shows_phase_fins_and_gimbal_as_numbers() {
    for (step, (phase, name)) in (0_i16..).step_by(137).zip(PHASES) {
        let mut rig = armed();
        rig.phase = phase;
        rig.run(0.5);
        // Centidegrees that differ in every phase: commanded ones, and smaller measured ones.
        let commanded: [i16; 4] = [0, 1_000 + step, 9_000 - step, 4_500];
        let measured = [30, 850 + step, 8_800 - step, 4_450];
        rig.receive(&MavMessage::TD_FINS(TD_FINS_DATA {
            boot_number: rig.boot_number,
            time_boot_ms: rig.boot_ms(),
            commanded,
            measured,
        }));
        let gimbal = [(-step, 30 - step), (1_230, 1_190)];
        rig.gimbal(gimbal);
        let fins = measured.iter().zip(&commanded).flat_map(|(is, asked)| [*is, *asked]);
        let planes = gimbal.iter().flat_map(|(asked, is)| [*is, *asked]);
        let expected: Vec<f64> = fins.chain(planes).map(|cdeg| f64::from(cdeg) / 100.0).collect();
        for page in Page::all().filter(|page| !matches!(page, Page::Help | Page::Find)) {
            rig.model.pages.hold(Some(page));
            for (columns, rows) in SIZES {
                let screen = rig.screen(columns, rows);
                let (shown_phase, shown) =
                    read(&screen).unwrap_or_else(|| panic!("{name} {page:?}\n{screen}"));
                assert_eq!(shown_phase, name, "{page:?}\n{screen}");
                assert_eq!(shown.len(), expected.len(), "{name} {page:?}\n{screen}");
                for (place, (shown, expected)) in shown.iter().zip(&expected).enumerate() {
                    // Whole degrees of a fin; tenths of the gimbal up to ten degrees.
                    let step = if place < 8 || expected.abs() >= 9.95 { 1.0 } else { 0.1 };
                    assert!(
                        (shown - expected).abs() <= step / 2.0 + 1e-9,
                        "{name} {page:?} {shown} {expected}"
                    );
                }
            }
        }
    }
}

/// Cells with the colour of the flame.
fn flame(rig: &Rig) -> usize {
    let theme = Theme { palette: Palette::Dark, ascii: false };
    let terminal = rig.draw(80, 24, theme);
    let is_flame = |symbol: &str| symbol.chars().any(|letter| ('\u{2801}'..='\u{28ff}').contains(&letter));
    let cells = &terminal.backend().buffer().content;
    cells.iter().filter(|cell| cell.fg == theme.ink(Ink::Flame) && is_flame(cell.symbol())).count()
}

/// Falls with this acceleration for a second, m/s2 upwards.
fn falls(rig: &mut Rig, up_m_s2: f32) {
    for k in 0..10_u8 {
        let t = f32::from(k) * 0.1;
        let up = 30.0 - 21.0 * t + 0.5 * up_m_s2 * t * t;
        rig.state_in_space([1.0, -1.0, up], [0.0, 0.0, up_m_s2.mul_add(t, -21.0)], (200.0, 4.0));
        rig.run(0.1);
    }
}

/// An ignition is a command; only the thrust that follows it is a flame.
#[test]
fn a_flame_is_drawn_from_measured_thrust_only() {
    let mut rig = flying(TdPhase::TD_PHASE_AERO_DESCENT);
    rig.phase = TdPhase::TD_PHASE_IGNITION;
    falls(&mut rig, -9.0);
    assert_eq!(flame(&rig), 0, "{}", rig.screen(80, 24));
    rig.phase = TdPhase::TD_PHASE_POWERED;
    falls(&mut rig, 9.0);
    assert!(flame(&rig) > 0, "{}", rig.screen(80, 24));
}

/// A landing motor without thrust is the largest word of every page, until the vehicle is down.
#[test]
fn no_light_is_the_largest_word_of_every_page() {
    for phase in [TdPhase::TD_PHASE_IGNITION, TdPhase::TD_PHASE_CHUTE] {
        let mut rig = flying(TdPhase::TD_PHASE_AERO_DESCENT);
        rig.phase = phase;
        rig.interlocks |= TdInterlock::TD_INTERLOCK_NO_LIGHT;
        falls(&mut rig, -6.0);
        let banner = headline::banner(&rig.model, rig.now).expect("large words");
        assert_eq!(banner.words, "NO LIGHT");
        assert_eq!(flame(&rig), 0, "{}", rig.screen(80, 24));
        for key in '1'..='8' {
            rig.key(Key::Char(key));
            for (columns, rows) in SIZES {
                let screen = rig.draw(columns, rows, MONO).backend().to_string();
                assert!(screen.contains(&banner.reason()), "{key}\n{screen}");
                let large = screen.chars().filter(|letter| "█▀▄".contains(*letter)).count();
                assert!(large > 40, "{key} {columns}x{rows}: {large}\n{screen}");
            }
        }
        rig.phase = TdPhase::TD_PHASE_SAFED;
        rig.run(0.5);
        assert_ne!(headline::banner(&rig.model, rig.now).map(|banner| banner.words), Some("NO LIGHT"));
    }
}
