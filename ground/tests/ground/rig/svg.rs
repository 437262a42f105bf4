//! Draws a screen of a terminal in memory as an SVG picture, and several as one that moves.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use ratatui::buffer::{Buffer, Cell};
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier};

/// Pixels of a cell, and where the letters stand in it.
const CELL: (u16, u16) = (9, 18);
const BASELINE: u16 = 14;

const UPPER: u8 = 1;
const LOWER: u8 = 2;
const BOTH: u8 = UPPER | LOWER;

/// The sixteen colours of a usual terminal.
const SIXTEEN: [[u8; 3]; 16] = [
    [0, 0, 0],
    [205, 49, 49],
    [13, 188, 121],
    [229, 229, 16],
    [36, 114, 200],
    [188, 63, 188],
    [17, 168, 205],
    [229, 229, 229],
    [102, 102, 102],
    [241, 76, 76],
    [35, 209, 139],
    [245, 245, 67],
    [59, 142, 234],
    [214, 112, 214],
    [41, 184, 219],
    [255, 255, 255],
];

/// Red, green and blue of a colour; `None` for the terminal's own.
pub(crate) fn rgb(colour: Color) -> Option<[u8; 3]> {
    let level = |part: u8| if part == 0 { 0 } else { 55 + 40 * part };
    match colour {
        Color::Reset => None,
        Color::Indexed(number @ 232..) => Some([8 + 10 * (number - 232); 3]),
        Color::Indexed(number @ 16..=231) => {
            let place = number - 16;
            Some([level(place / 36), level(place / 6 % 6), level(place % 6)])
        }
        Color::Indexed(number) => Some(SIXTEEN[usize::from(number)]),
        Color::Rgb(red, green, blue) => Some([red, green, blue]),
        Color::Black => Some(SIXTEEN[0]),
        Color::White => Some(SIXTEEN[15]),
        other => panic!("no theme uses {other}"),
    }
}

/// Colour of the letters and of the background.
pub(crate) fn colours(cell: &Cell) -> ([u8; 3], [u8; 3]) {
    let (fore, back) = (rgb(cell.fg).unwrap_or(SIXTEEN[7]), rgb(cell.bg).unwrap_or(SIXTEEN[0]));
    if cell.modifier.contains(Modifier::REVERSED) { (back, fore) } else { (fore, back) }
}

/// The halves that a block covers. `None` for other characters.
fn halves(symbol: &str) -> Option<u8> {
    match symbol {
        "█" => Some(BOTH),
        "▀" => Some(UPPER),
        "▄" => Some(LOWER),
        _ => None,
    }
}

/// What pictures share: a class for each colour. A row is drawn around its base line.
struct Pen {
    page: [u8; 3],
    classes: BTreeMap<[u8; 3], usize>,
}

impl Pen {
    fn new(page: [u8; 3]) -> Self {
        Self { page, classes: BTreeMap::new() }
    }

    fn class(&mut self, colour: [u8; 3]) -> String {
        let next = self.classes.len();
        format!("c{}", self.classes.entry(colour).or_insert(next))
    }

    /// A row of the screen: backgrounds and blocks as shapes, so that they join whatever the font,
    /// then the letters.
    fn row(&mut self, cells: &[Cell]) -> String {
        let (mut backs, mut blocks, mut texts) = (String::new(), String::new(), String::new());
        let mut at = 0;
        for run in cells.chunk_by(|one, next| colours(one).1 == colours(next).1) {
            let back = colours(&run[0]).1;
            if back != self.page {
                let (x, width, class) = (at * CELL.0, run.len() as u16 * CELL.0, self.class(back));
                let height = CELL.1;
                let _ = write!(
                    backs,
                    "<path d=\"M{x}-{BASELINE}h{width}v{height}h-{width}z\" class=\"{class}\"/>"
                );
            }
            at += run.len() as u16;
        }
        at = 0;
        for run in
            cells.chunk_by(|one, next| colours(one).0 == colours(next).0 && one.modifier == next.modifier)
        {
            let class = self.class(colours(&run[0]).0);
            let covered: Vec<u8> = run.iter().map(|cell| halves(cell.symbol()).unwrap_or_default()).collect();
            let path = path(&covered, at);
            if !path.is_empty() {
                let _ = write!(blocks, "<path d=\"{path}\" class=\"{class}\"/>");
            }
            let letter =
                |cell: &Cell| if halves(cell.symbol()).is_some() { " " } else { cell.symbol() }.to_owned();
            let text: String = run.iter().map(letter).collect();
            let begin = text.len() - text.trim_start().len();
            let trimmed = text.trim();
            if !trimmed.is_empty() {
                let (x, length) = (at + begin as u16, trimmed.chars().count() as u16 * CELL.0);
                let bold = if run[0].modifier.contains(Modifier::BOLD) { " b" } else { "" };
                // Several spaces would become one.
                let escaped = trimmed
                    .replace(' ', "\u{a0}")
                    .replace('&', "&amp;")
                    .replace('<', "&lt;")
                    .replace('>', "&gt;");
                let stretched =
                    if length > CELL.0 { format!(" textLength=\"{length}\"") } else { String::new() };
                let x = x * CELL.0;
                let _ = write!(texts, "<text x=\"{x}\"{stretched} class=\"{class}{bold}\">{escaped}</text>");
            }
            at += run.len() as u16;
        }
        backs + &blocks + &texts
    }

    /// The file around what was drawn.
    fn file(&self, size: Rect, style: &str, drawn: &str) -> String {
        let (width, height) = (size.width * CELL.0, size.height * CELL.1);
        let hex = |[red, green, blue]: [u8; 3]| format!("#{red:02x}{green:02x}{blue:02x}");
        let mut fills = String::new();
        for (colour, class) in &self.classes {
            let _ = write!(fills, ".c{class}{{fill:{}}}", hex(*colour));
        }
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
             font-family=\"DejaVu Sans Mono,Menlo,Consolas,monospace\" font-size=\"15\">\n\
             <style>{fills}.b{{font-weight:bold}}{style}</style>\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"{}\"/>\n{drawn}</svg>\n",
            hex(self.page)
        )
    }
}

/// Outlines of the halves of cells that are covered alike, from this column on.
fn path(halves: &[u8], column: u16) -> String {
    let mut path = String::new();
    let mut at = column;
    for run in halves.chunk_by(|one, next| one == next) {
        let (x, width) = (at * CELL.0, run.len() as u16 * CELL.0);
        let (top, height) = match run[0] {
            UPPER => (i32::from(BASELINE), CELL.1 / 2),
            LOWER => (i32::from(BASELINE) - i32::from(CELL.1 / 2), CELL.1 / 2),
            _ => (i32::from(BASELINE), CELL.1),
        };
        if run[0] != 0 {
            let _ = write!(path, "M{x}-{top}h{width}v{height}h-{width}z");
        }
        at += run.len() as u16;
    }
    path
}

fn rows(buffer: &Buffer) -> impl Iterator<Item = (u16, &[Cell])> {
    let cells = buffer.content.chunks(usize::from(buffer.area.width));
    cells.enumerate().map(|(row, cells)| (row as u16 * CELL.1 + BASELINE, cells))
}

/// The screen as a picture.
pub(crate) fn picture(buffer: &Buffer) -> String {
    let mut pen = Pen::new(colours(&buffer.content[0]).1);
    let mut drawn = String::new();
    for (y, cells) in rows(buffer) {
        let row = pen.row(cells);
        if !row.is_empty() {
            let _ = writeln!(drawn, "<g transform=\"translate(0,{y})\">{row}</g>");
        }
    }
    pen.file(buffer.area, "", &drawn)
}

/// Screens one after the other, each for its time in s, again and again. A row that several show is
/// stored once. Who asks for less motion, and a program that knows no motion, shows the last.
pub(crate) fn moving_picture(screens: &[(Buffer, f64)]) -> String {
    let (last, _) = screens.last().expect("a screen");
    let mut pen = Pen::new(colours(&last.content[0]).1);
    let (mut kept, mut frames): (BTreeMap<String, usize>, _) = (BTreeMap::new(), String::new());
    let all_s: f64 = screens.iter().map(|(_, shown_s)| shown_s).sum();
    let (mut defined, mut motion, mut from_s) = (String::new(), String::new(), 0.0);
    for (number, (buffer, shown_s)) in screens.iter().enumerate() {
        let _ = write!(frames, "<g id=\"f{number}\" class=\"f\">");
        for (y, cells) in rows(buffer) {
            let row = pen.row(cells);
            if row.is_empty() {
                continue;
            }
            let next = kept.len();
            let id = *kept.entry(row).or_insert_with_key(|row| {
                let _ = writeln!(defined, "<g id=\"r{next}\">{row}</g>");
                next
            });
            let _ = write!(frames, "<use href=\"#r{id}\" y=\"{y}\"/>");
        }
        frames.push_str("</g>\n");
        let percent = |at_s: f64| format!("{:.2}%", 100.0 * at_s / all_s);
        let until_s = from_s + shown_s;
        // Before and after its time a frame is hidden.
        let before = if number == 0 { "" } else { "0%{visibility:hidden}" };
        let after = if number + 1 == screens.len() {
            String::new()
        } else {
            percent(until_s) + "{visibility:hidden}"
        };
        let from = percent(from_s);
        let _ = writeln!(
            motion,
            "@keyframes k{number}{{{before}{from}{{visibility:visible}}{after}}}\
             #f{number}{{animation:k{number} {all_s}s step-end infinite}}"
        );
        from_s = until_s;
    }
    let shown = screens.len() - 1;
    let style = format!(
        ".f{{visibility:hidden}}#f{shown}{{visibility:visible}}\n\
         @media (prefers-reduced-motion:no-preference){{\n{motion}}}"
    );
    pen.file(last.area, &style, &format!("<defs>\n{defined}</defs>\n{frames}"))
}
