//! Letters of two columns: texts of the vehicle and names of people may have them.

use std::num::NonZero;

use ground::app::terminal::DiffBackend;
use ground::key::Key;
use ground::model::{Seat, Settings};
use ground::update::Msg;
use ground::view::draw;
use ground::view::theme::{Palette, Theme};
use ratatui::backend::CrosstermBackend;
use ratatui::{Terminal, TerminalOptions, Viewport, layout::Rect};

use crate::rig::{Rig, settings};

const SIZE: (u16, u16) = (80, 24);

/// What stands on a real terminal after these pages, one drawn over the other, and what should.
fn on_a_terminal(rig: &mut Rig, keys: &[Key]) -> (Vec<String>, Vec<String>) {
    let theme = Theme { palette: Palette::Dark, ascii: false };
    let (columns, rows) = SIZE;
    let mut bytes = Vec::new();
    let viewport = Viewport::Fixed(Rect::new(0, 0, columns, rows));
    let backend = DiffBackend::new(CrosstermBackend::new(&mut bytes));
    let mut terminal = Terminal::with_options(backend, TerminalOptions { viewport }).expect("a terminal");
    for key in keys {
        rig.key(*key);
        terminal
            .draw(|frame| {
                draw(&rig.model, theme, rig.now, frame);
            })
            .expect("a frame");
    }
    drop(terminal);
    let size = |number| NonZero::new(number).expect("a terminal has a size");
    let mut parser = vt100::Parser::new(size(rows), size(columns), 0);
    parser.process(&bytes);
    let shown = parser.screen().rows(0, columns).map(|row| row.trim_end().to_owned()).collect();
    let meant = rig.draw(columns, rows, theme);
    let buffer = meant.backend().buffer();
    let row = |cells: &[ratatui::buffer::Cell]| {
        let mut line = String::new();
        let mut skip = 0;
        for cell in cells {
            if skip == 0 {
                line.push_str(cell.symbol());
                skip = ratatui::text::Span::raw(cell.symbol()).width();
            }
            skip = skip.saturating_sub(1);
        }
        line.trim_end().to_owned()
    };
    let meant = buffer.content.chunks(usize::from(columns)).map(row).collect();
    (shown, meant)
}

/// On every page, whatever stood there before.
#[test]
fn a_text_and_a_name_of_wide_letters_leave_nothing_of_the_page_before() {
    let mut settings = Settings { log_path: None, demonstration: true, ..settings(false, true) };
    settings.seat = Seat::new(1, "山田太郎");
    let mut rig = Rig::new(settings);
    rig.run(1.0);
    rig.msg(Msg::Crew {
        seats: vec![Seat::new(1, "山田太郎"), Seat::new(2, "김철수")], silent: Vec::new()
    });
    for text in [
        "点火ゲートが閉じています: 傾き",
        "착륙 다리가 펴졌습니다 한국어 문장은 두 칸입니다",
        "e\u{301}galement",
    ] {
        rig.text(text);
        rig.run(0.2);
    }
    let pages: Vec<Key> = "165829731641".chars().map(Key::Char).collect();
    for shown in 1..=pages.len() {
        let (found, meant) = on_a_terminal(&mut rig, &pages[..shown]);
        assert_eq!(found, meant, "page {shown}");
        let first = &found[0];
        assert!(first.starts_with(" DEMO, NOT REAL") && first.contains("NOT RECORDED"), "{first}");
    }
}

/// An alarm with wide letters keeps its key at the right end.
#[test]
fn a_line_is_cut_by_columns_and_not_by_letters() {
    use ground::view::status_lines::cut;
    assert_eq!(cut("点火ゲート", 7), "点火..");
    assert_eq!(cut("点火ゲートが閉じています", 12), "点火ゲート..");
    assert_eq!(cut("点火", 4), "点火");
}
