//! Gives each role of a text, and each part of a picture, its style. Colour only repeats the
//! meaning of a word or a mark.
//!
//! Dark and light paint their own background, in colours whose values are fixed (the upper 240 of
//! the 256 of xterm, and what a terminal of 24 bits shows for them), so that their contrast is
//! known. In the sun only the light theme can be read.

use std::borrow::Cow;

use ratatui::buffer::Buffer;
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use strum::VariantArray;

/// The role of a piece of text.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum TextRole {
    /// A value or a sentence.
    #[default]
    Plain,
    /// A name or unit, less important than a value.
    Label,
    /// A value that is too old.
    Stale,
    Title,
    /// A state as it should be.
    Good,
    /// A state that needs attention.
    Caution,
    /// A wrong or dangerous state.
    Alarm,
    Key,
}

/// A part of a picture: what was measured, what is predicted and what limits have one colour each,
/// everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq, VariantArray)]
pub enum Ink {
    /// Drawn as a thick line.
    Measured,
    /// Drawn as dots.
    Predicted,
    /// Drawn as a thin line.
    Limit,
    /// The vehicle, the pad, the present moment.
    Body,
    Flame,
    /// Scales and the ground.
    Scale,
}

/// How dangerous the vehicle is: the colour of the row of its state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, VariantArray)]
pub enum Level {
    /// Disarmed on its pad, or not known.
    Calm,
    /// Armed, in flight, or one person may approach.
    Armed,
    /// The motor burns or may light near people.
    Danger,
    /// It may be approached.
    Free,
}

/// A set of colours.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, VariantArray)]
pub enum Palette {
    #[default]
    Dark,
    /// Black on white, without yellow, for sunlight.
    Light,
    /// No colours but the terminal's own two.
    None,
}

impl Palette {
    #[must_use]
    pub fn next(self) -> Self {
        Self::VARIANTS[(self as usize + 1) % Self::VARIANTS.len()]
    }

    /// `None` if the background is the terminal's own.
    fn colours(self) -> Option<&'static Colours> {
        match self {
            Self::Dark => Some(&DARK),
            Self::Light => Some(&LIGHT),
            Self::None => None,
        }
    }
}

/// Numbers of xterm's 256 colours: half the bytes of a colour by its parts, and every terminal with
/// colours has them.
struct Colours {
    back: u8,
    /// Behind the header, the large numbers and the keys.
    raised: u8,
    plain: u8,
    label: u8,
    good: u8,
    caution: u8,
    /// In the light theme no letter of a warning colour is dark enough: its ground has the colour.
    caution_ground: Option<u8>,
    border: u8,
    /// In the order of [`Ink`].
    inks: [u8; 6],
    /// Text and background, in the order of [`Level`].
    levels: [(u8, u8); 4],
}

const DARK: Colours = Colours {
    back: 233,
    raised: 234,
    plain: 255,
    label: 249,
    good: 79,
    caution: 215,
    caution_ground: None,
    border: 240,
    inks: [75, 221, 218, 255, 215, 249],
    levels: [(231, 238), (16, 214), (231, 124), (16, 79)],
};
const LIGHT: Colours = Colours {
    back: 231,
    raised: 195,
    plain: 16,
    label: 239,
    good: 22,
    caution: 16,
    caution_ground: Some(214),
    border: 246,
    inks: [19, 23, 90, 16, 52, 239],
    levels: [(231, 239), (16, 214), (231, 124), (231, 22)],
};

/// The numbers of the palettes but 231, which stays white, and what a terminal of 24 bits shows for
/// each: red, green and blue.
const NUMBERS: [u8; 22] =
    [16, 19, 22, 23, 52, 75, 79, 90, 124, 195, 214, 215, 218, 221, 233, 234, 238, 239, 240, 246, 249, 255];
#[expect(clippy::unreadable_literal, reason = "two digits each for red, green and blue")]
const TRUE_COLOURS: [u32; NUMBERS.len()] = [
    0x0b0f14, 0x00449e, 0x005c38, 0x7a4300, 0x4a0d00, 0x74c0ff, 0x63d8a4, 0x8c1273, 0xa31a14, 0xeef2f5,
    0xffb000, 0xffb454, 0xf2a0d8, 0xffd866, 0x0b0f14, 0x141b23, 0x3b4753, 0x44505b, 0x44525f, 0x98a4af,
    0xa3b0bd, 0xf0f4f8,
];

/// The same on a terminal of 16 colours: of letters, and of their ground (the first eight).
const SIXTEEN: [[u8; NUMBERS.len()]; 2] = [
    [0, 4, 4, 0, 1, 14, 10, 5, 9, 7, 11, 11, 13, 3, 0, 0, 8, 0, 8, 8, 7, 15],
    [0, 4, 4, 0, 1, 6, 2, 5, 1, 7, 3, 3, 5, 3, 0, 0, 4, 0, 0, 0, 7, 7],
];

/// How many colours a terminal has.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Depth {
    Sixteen,
    #[default]
    Indexed,
    /// 24 bits.
    True,
}

impl Depth {
    /// Reads it from the environment: `COLORTERM` and `TERM`. Over SSH COLORTERM is not passed on;
    /// the listed terminals are known to have 256 colours.
    pub fn of_environment(variable: impl Fn(&str) -> Option<String>) -> Self {
        const KNOWN: [&str; 6] = ["256color", "kitty", "foot", "alacritty", "ghostty", "wezterm"];
        let term = variable("TERM").unwrap_or_default();
        match variable("COLORTERM").as_deref() {
            Some("truecolor" | "24bit") => Self::True,
            None | Some("") if !KNOWN.iter().any(|name| term.contains(name)) => Self::Sixteen,
            _ => Self::Indexed,
        }
    }

    /// A colour of a theme as the terminal has it.
    pub fn shown(self, colour: Color, is_ground: bool) -> Color {
        let place = NUMBERS.iter().position(|number| Color::Indexed(*number) == colour);
        match (self, place) {
            (Self::True, Some(place)) => Color::from_u32(TRUE_COLOURS[place]),
            (Self::Sixteen, Some(place)) => Color::Indexed(SIXTEEN[usize::from(is_ground)][place]),
            // White, which is not in the list.
            (Self::Sixteen, None) if colour == Color::Indexed(231) => {
                Color::Indexed(if is_ground { 7 } else { 15 })
            }
            _ => colour,
        }
    }
}

/// What the terminal can show, and in which colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Theme {
    pub palette: Palette,
    /// Whether the terminal shows ASCII only.
    pub ascii: bool,
}

impl Theme {
    /// Reads what the terminal can show from the environment: `TERM`, `COLORTERM`, `COLORFGBG`,
    /// `NO_COLOR`, and the first of `LC_ALL`, `LC_CTYPE` and `LANG` that is set (POSIX.1-2017,
    /// 8.2).
    pub fn of_environment(variable: impl Fn(&str) -> Option<String>) -> Self {
        let set = |name: &str| variable(name).filter(|value| !value.is_empty());
        let term = set("TERM").unwrap_or_default();
        // All that are in use but these have colours (terminfo, `colors`).
        let is_without = ["", "dumb", "unknown"].contains(&term.as_str())
            || term.starts_with("vt")
            || ["-m", "-mono"].iter().any(|end| term.ends_with(end));
        let has_colours = !is_without || set("COLORTERM").is_some();
        let palette = if set("NO_COLOR").is_some() || !has_colours {
            Palette::None
        } else if set("COLORFGBG").is_some_and(|colours| colours.ends_with(";15")) {
            Palette::Light
        } else {
            Palette::Dark
        };
        let locale = ["LC_ALL", "LC_CTYPE", "LANG"].into_iter().find_map(set).unwrap_or_default();
        let locale = locale.to_ascii_lowercase();
        let unicode = locale.contains("utf-8") || locale.contains("utf8");
        // The console of Linux has at most 512 characters: none of its fonts has braille or parts
        // of blocks.
        let old = ["vt1", "vt2", "vt3", "linux"].iter().any(|name| term.starts_with(name));
        Self { palette, ascii: !unicode || old }
    }

    /// Replaces `±` on a terminal that shows only ASCII.
    pub fn either_side(self, text: &str) -> String {
        if self.ascii { text.replace('±', "+-") } else { text.to_owned() }
    }

    /// The style of an empty cell.
    pub fn ground(self) -> Style {
        self.palette.colours().map_or_else(Style::new, |colours| on((colours.plain, colours.back)))
    }

    /// The background of an empty cell.
    pub fn back(self) -> Color {
        self.ground().bg.unwrap_or(Color::Reset)
    }

    /// The style of the header, the large numbers and the keys, which stand out a little.
    pub fn raised(self) -> Style {
        self.palette.colours().map_or_else(Style::new, |colours| on((colours.plain, colours.raised)))
    }

    /// The style of the lines between panels: nothing depends on them.
    pub fn border(self) -> Style {
        self.palette.colours().map_or_else(Style::new, |colours| ink(colours.border))
    }

    /// The style of the rows of the state.
    pub fn level(self, level: Level) -> Style {
        let colours = self.palette.colours();
        let style = colours.map_or_else(reversed, |colours| on(colours.levels[level as usize]));
        style.add_modifier(Modifier::BOLD)
    }

    /// The style of a role. A letter's weight and slant say the same without colour.
    pub fn style(self, role: TextRole) -> Style {
        let given = self.palette.colours().map(|colours| match role {
            TextRole::Plain | TextRole::Stale | TextRole::Title | TextRole::Key => ink(colours.plain),
            // Paler than a value, and still readable in the sun: 7:1.
            TextRole::Label => ink(colours.label),
            TextRole::Good => ink(colours.good),
            TextRole::Caution => {
                let letter = ink(colours.caution);
                colours.caution_ground.map_or(letter, |ground| letter.bg(Color::Indexed(ground)))
            }
            TextRole::Alarm => on(colours.levels[Level::Danger as usize]),
        });
        let style = given.unwrap_or_else(|| if role == TextRole::Alarm { reversed() } else { Style::new() });
        match role {
            TextRole::Plain | TextRole::Label | TextRole::Good => style,
            TextRole::Stale => style.add_modifier(Modifier::ITALIC),
            TextRole::Title | TextRole::Key | TextRole::Caution | TextRole::Alarm => {
                style.add_modifier(Modifier::BOLD)
            }
        }
    }

    /// A piece of text in its role.
    pub fn span(self, text: impl Into<Cow<'static, str>>, role: TextRole) -> Span<'static> {
        Span::styled(text, self.style(role))
    }

    pub fn plain(self, text: impl Into<Cow<'static, str>>) -> Span<'static> {
        self.span(text, TextRole::Plain)
    }

    pub fn label(self, text: impl Into<Cow<'static, str>>) -> Span<'static> {
        self.span(text, TextRole::Label)
    }

    pub fn key(self, text: impl Into<Cow<'static, str>>) -> Span<'static> {
        self.span(text, TextRole::Key)
    }

    /// A line in its role, to its end.
    pub fn line(self, text: impl Into<Cow<'static, str>>, role: TextRole) -> Line<'static> {
        Line::styled(text.into(), self.style(role))
    }

    /// The colour of a part of a picture.
    pub fn ink(self, ink: Ink) -> Color {
        self.palette.colours().map_or(Color::Reset, |colours| Color::Indexed(colours.inks[ink as usize]))
    }
}

fn ink(colour: u8) -> Style {
    Style::new().fg(Color::Indexed(colour))
}

fn on((fore, back): (u8, u8)) -> Style {
    ink(fore).bg(Color::Indexed(back))
}

fn reversed() -> Style {
    Style::new().add_modifier(Modifier::REVERSED)
}

// Converts a drawn screen to ASCII, cell by cell, for terminals without Unicode (`LANG=C`, a
// vt100).

/// The first braille pattern; the low eight bits of a pattern are its dots.
const BRAILLE: u32 = 0x2800;

/// Replaces every character that is not ASCII, cell by cell, so that nothing moves.
pub fn flatten(buffer: &mut Buffer) {
    for cell in &mut buffer.content {
        if !cell.symbol().is_ascii() {
            let symbol = cell.symbol().chars().next().map_or(' ', ascii);
            cell.set_char(symbol);
        }
    }
}

fn ascii(c: char) -> char {
    match c {
        '─' | '━' => '-',
        '│' => '|',
        '┌' | '┐' | '└' | '┘' | '├' | '┤' | '┬' | '┴' | '┼' | '✓' => '+',
        '█' | '▇' => '#',
        '▀' => '"',
        '▄' | '▁' | '▂' | '▃' => '_',
        '·' | '┄' => '.',
        '●' => '*',
        '○' => 'o',
        '×' => 'x',
        '▅' | '▆' => '=',
        '↑' | '◆' | '▲' => '^',
        '↓' => 'v',
        '→' | '…' | '▶' => '>',
        '←' => '<',
        _ => match u32::from(c).checked_sub(BRAILLE) {
            Some(dots @ 0..=0xFF) => match dots.count_ones() {
                0 => ' ',
                1..=2 => '.',
                3..=5 => ':',
                _ => '#',
            },
            _ => '?',
        },
    }
}

#[cfg(test)]
mod theme_tests {
    use super::*;

    #[test]
    fn the_environment_selects_characters_and_colours() {
        for (set, palette, ascii) in [
            (vec![("TERM", "xterm-256color"), ("LANG", "C.UTF-8")], Palette::Dark, false),
            (vec![("TERM", "tmux"), ("LC_ALL", "de_DE.utf8"), ("LANG", "C")], Palette::Dark, false),
            (vec![("TERM", "xterm"), ("LANG", "C.UTF-8")], Palette::Dark, false),
            (vec![("TERM", "vt220"), ("LANG", "C.UTF-8")], Palette::None, true),
            (vec![("TERM", "dumb")], Palette::None, true),
            (vec![("TERM", "tmux"), ("COLORTERM", "truecolor")], Palette::Dark, true),
            (vec![("TERM", "xterm-kitty"), ("LANG", "C.UTF-8")], Palette::Dark, false),
            (vec![("TERM", "alacritty")], Palette::Dark, true),
            (vec![("TERM", "xterm-256color"), ("LANG", "en_US.UTF-8"), ("LC_ALL", "C")], Palette::Dark, true),
            (vec![], Palette::None, true),
            (vec![("NO_COLOR", "1"), ("TERM", "xterm-256color")], Palette::None, true),
            (vec![("NO_COLOR", ""), ("TERM", "xterm-256color")], Palette::Dark, true),
            (vec![("TERM", "rxvt-256color"), ("COLORFGBG", "0;15")], Palette::Light, true),
            (vec![("TERM", "linux"), ("LANG", "C.UTF-8")], Palette::Dark, true),
        ] {
            let found = Theme::of_environment(|name| {
                set.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).to_owned())
            });
            assert_eq!(found, Theme { palette, ascii }, "{set:?}");
        }
    }

    #[test]
    fn the_next_palette_reaches_every_palette() {
        let reached: Vec<_> =
            std::iter::successors(Some(Palette::Dark), |palette| Some(palette.next())).take(4).collect();
        assert_eq!(reached, [Palette::Dark, Palette::Light, Palette::None, Palette::Dark]);
    }
}

#[cfg(test)]
mod ascii_tests {
    use super::*;
    use ratatui::layout::Rect;
    use ratatui::style::Style;

    #[test]
    fn every_cell_becomes_ascii_and_none_moves() {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 12, 1));
        buffer.set_string(0, 0, "a─│┌←⣿⠁⠀é█z", Style::new());
        flatten(&mut buffer);
        let text: String = buffer.content.iter().map(ratatui::buffer::Cell::symbol).collect();
        assert_eq!(text, "a-|+<#. ?#z ");
        assert_eq!(Theme { palette: Palette::None, ascii: true }.either_side("±1 m"), "+-1 m");
    }
}
