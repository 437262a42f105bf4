//! The text of the open dialog, and its box; the box of the palette.

use std::time::Duration;

use protocol::dialect::{TdAct, TdRole};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::Line;
use ratatui::widgets::{Block, Clear};

use super::{TextRole, Theme, draw_lines, lists};
use crate::model::{
    AGAIN_KEY, Act, CONFIRM_WORD, Model, PadCheck, Prompt, Role, SURFACES, TERMINATION, TextEntry,
    foreign_name, palette_entries, role_name, why_not_here, why_not_quit, why_untested,
};

const BOX_COLUMNS: u16 = 68;

/// A title and the lines under it.
type Titled = (&'static str, Vec<Line<'static>>);

/// Title and lines of the open dialog; `None` if none is open.
pub fn dialog_lines(model: &Model, theme: Theme, now: Duration) -> Option<Titled> {
    let Some(dialog) = &model.dialog else { return notice(model, theme, now) };
    let left = format!("within {:.0} s", dialog.until.saturating_sub(now).as_secs_f64());
    let plain = |text: String| theme.line(text, TextRole::Plain);
    let strong = |text: String| theme.line(text, TextRole::Caution);
    if dialog.again_from.is_some() {
        let (name, key) = (dialog.prompt.name(), AGAIN_KEY.name());
        let lines = vec![
            plain(format!("The keys for the {name} came faster than a hand types:")),
            plain("a paste, or a connection that delivers them in bunches.".to_owned()),
            strong(format!("{key} {left}: yes, do it.")),
            plain("Any other key cancels. Nothing has been sent.".to_owned()),
        ];
        return Some(("DID YOU TYPE THIS?", lines));
    }
    let cancels = || plain("Any other key cancels.".to_owned());
    let any_other_key = || plain("Any other key cancels. Nothing is sent before Enter.".to_owned());
    let ours = model.role_of(model.seat_key()).filter(|_| model.people() == Some(2));
    let asks = |ours| plain(format!("This is a request: {} must confirm within 10 s.", other_roles(ours)));
    let next = || ours.map(asks).into_iter().chain([any_other_key()]);
    // The lines above and below the line of the word.
    let (title, above, below) = match dialog.prompt {
        Prompt::Arm => ("ARM, step 2 of 2", Vec::new(), next().chain(checks(model, theme)).collect()),
        Prompt::Start => {
            ("START the countdown", Vec::new(), next().chain(model.loss_in_words().map(plain)).collect())
        }
        Prompt::Confirm(proposal) => {
            let asks = plain(format!("{} requests to {}.", model.operator(proposal.by), proposal.act_name()));
            ("CONFIRM another operator's request", vec![asks], vec![any_other_key()])
        }
        Prompt::TakeCommand => {
            let who = plain(format!("{} is in command, if the vehicle receives them.", commander(model)));
            ("TAKE COMMAND of an armed vehicle", vec![who], vec![any_other_key()])
        }
        Prompt::AbortForeign => {
            let name = model.vehicle.as_foreign().map_or_else(|| "The vehicle".to_owned(), foreign_name);
            let does = format!("{name}: flight termination {TERMINATION}.");
            let does = lists::wrap(&does, usize::from(BOX_COLUMNS) - 4).into_iter().map(strong).collect();
            ("ABORT of a vehicle that is NOT A TOUCHDOWN VEHICLE", does, vec![any_other_key()])
        }
        Prompt::WithoutLog => {
            let why = model.why_no_log(now).unwrap_or_else(|| "It is fit again.".to_owned());
            let goes_on = plain("Then arm and start go on without a record, a book and a place.".to_owned());
            let above = vec![theme.line(why, TextRole::Alarm)];
            ("THE STATION'S LOG IS UNFIT", above, vec![goes_on, any_other_key()])
        }
        Prompt::Untested => {
            let why = why_untested(model).unwrap_or_else(|| "Burns confirm it now.".to_owned());
            let curve = "A certified curve is another lot's: impulse and burn time may differ by 5 and 8 %.";
            let above = vec![theme.line(why, TextRole::Alarm), plain(curve.to_owned())];
            let goes_on = plain("Then arming goes on, and the book says who overruled it.".to_owned());
            ("NO BURN CONFIRMS THE MOTOR", above, vec![goes_on, any_other_key()])
        }
        Prompt::Quit => {
            let goes_on = match model.settings.role {
                Role::Station if model.settings.demonstration => "Quitting ends the demonstration.",
                Role::Station => "The station continues without a screen: `ground attach` shows it.",
                _ => "The station continues; a countdown is held without a screen that commands.",
            };
            let leaves = "Quitting neither disarms nor aborts. Any other key cancels.";
            let below = [goes_on, leaves].map(|words| plain(words.to_owned()));
            let above = why_not_quit(model, now).map(|why| theme.line(why, TextRole::Alarm));
            let title =
                if model.is_at_risk() { "QUIT although armed or in flight" } else { "QUIT too early" };
            (title, above.into_iter().collect(), below.to_vec())
        }
        Prompt::Hold => {
            let anew = "Then only a new start counts down again. Any other key cancels.".to_owned();
            ("HOLD the countdown", vec![strong(format!("Enter {left} holds."))], vec![plain(anew)])
        }
        Prompt::Check { moves } => {
            let begins = if moves {
                format!("Gimbal and fins MOVE for 8 s, or 30 s to be seen: hands off. Enter {left}.")
            } else {
                format!("Nothing moves. Enter {left} begins.")
            };
            let then = plain("Then the sensors are watched for 5 s: touch nothing.".to_owned());
            ("CHECK the vehicle", vec![strong(begins)], vec![then, cancels()])
        }
        Prompt::Seen => {
            let saw = SURFACES.map(|(_, _, words)| plain(words.to_owned()));
            let below = plain("It takes two people.".to_owned());
            ("SEEN, in this order and nothing else?", saw.to_vec(), vec![below])
        }
        Prompt::Sign { step: number, void } => {
            let step = model.checklist.as_ref().and_then(|list| list.steps.get(number));
            let words = step.map_or("", |step| step.words.as_str());
            let who = step.and_then(|step| step.role).map(role_name);
            let who = who.unwrap_or_else(|| "Anybody who commands".to_owned());
            let verb = if void { "voids the signature" } else { "signs" };
            let above =
                vec![plain(format!("{}: {words}", number + 1)), strong(format!("Enter {left} {verb}."))];
            let title = if void { "VOID a step of the checklist" } else { "SIGN a step of the checklist" };
            (title, above, vec![plain(format!("{who} signs it. Any other key cancels."))])
        }
        Prompt::Disarm => ("DISARM", vec![strong(format!("Enter {left} disarms."))], vec![cancels()]),
    };
    let typing = dialog.prompt.word().map(|word| {
        strong(format!("Type {word} and Enter {left}:  [{:<width$}]", dialog.typed, width = word.len()))
    });
    Some((title, above.into_iter().chain(typing).chain(below).collect()))
}

/// The other roles that may command.
fn other_roles(ours: TdRole) -> String {
    let all = [TdRole::TD_ROLE_RANGE_SAFETY, TdRole::TD_ROLE_FLIGHT, TdRole::TD_ROLE_PAD];
    all.into_iter().filter(|role| *role != ours).map(role_name).collect::<Vec<_>>().join(" or ")
}

/// Who is in command.
fn commander(model: &Model) -> String {
    match (model.commanded_by(), model.link.uplink.armed_by_other) {
        (Some(number), _) => model.operator(number),
        (None, Some(other)) => format!("station {}/{}", other.system_id, other.component_id),
        (None, None) => "another station".to_owned(),
    }
}

/// A pending request or tap, while no dialog is open: it is on every page.
fn notice(model: &Model, theme: Theme, now: Duration) -> Option<Titled> {
    let plain = |text: String| theme.line(text, TextRole::Plain);
    let strong = |text: String| theme.line(text, TextRole::Caution);
    let ours = model.seat_key();
    if let Some(proposal) = model.proposal(now) {
        let (left_s, act) = (proposal.left.as_secs_f64(), proposal.act_name());
        let who = model.operator(proposal.by);
        if proposal.by == ours && ours > 0 {
            let others = model.role_of(ours).map_or_else(String::new, other_roles);
            let words = format!("{others} must confirm within {left_s:.0} s.");
            return Some(("REQUESTED", vec![plain(format!("You request to {act}.")), strong(words)]));
        }
        let key = if proposal.act == TdAct::TD_ACT_START { Act::Start } else { Act::Arm }.key_name();
        let words = match model.open_proposal(now) {
            Some(_) if why_not_here(model).is_none() => strong(format!(
                "Press {key} within {left_s:.0} s, then type {CONFIRM_WORD} and Enter to confirm."
            )),
            _ => plain(format!("Another role must confirm within {left_s:.0} s; not this screen.")),
        };
        return Some((
            "ANOTHER OPERATOR'S REQUEST",
            vec![strong(format!("{who} requests to {act}.")), words],
        ));
    }
    let (by, left) = model.tapping(now)?;
    let left_s = left.as_secs_f64();
    if by == ours && why_not_here(model).is_none() {
        let key = Act::Tap.key_name();
        let words = format!("Tap {key}: {left_s:.1} s left, or the countdown is held.");
        return Some(("TAP twice a second", vec![strong(words)]));
    }
    let words = format!("{} taps: {left_s:.1} s left, or the countdown is held.", model.operator(by));
    Some(("TAPS", vec![plain(words)]))
}

fn checks(model: &Model, theme: Theme) -> Vec<Line<'static>> {
    if model.vehicle.status.is_none() {
        return vec![theme.line("The vehicle has not reported its checks.", TextRole::Caution)];
    }
    let failing = model.vehicle.failing();
    if failing.is_empty() {
        let mut lines = vec![theme.line("Every arming check passes.", TextRole::Good)];
        let failure = model.vehicle.pad_check.as_ref().and_then(PadCheck::failure);
        lines.extend(failure.map(|failure| theme.line(failure, TextRole::Alarm)));
        return lines;
    }
    let mut lines = vec![theme.line("Failing checks; the vehicle will refuse:", TextRole::Alarm)];
    lines.extend(failing.into_iter().map(|(_, why)| theme.line(format!("  NO {why}"), TextRole::Caution)));
    lines
}

/// Draws the open dialog in the middle of an area.
pub fn draw_dialog(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let Some((title, lines)) = dialog_lines(model, theme, now) else { return };
    let width = BOX_COLUMNS.min(area.width);
    let height = u16::try_from(lines.len()).unwrap_or(u16::MAX).saturating_add(2).min(area.height);
    // A notice leaves the middle of the page free.
    let free = area.height - height;
    let down = if model.dialog.is_none() { free } else { free / 2 };
    let at = Rect { x: area.x + (area.width - width) / 2, y: area.y + down, width, height };
    let at = at.intersection(frame.area());
    let inside = pop_up(title, theme, frame, at);
    let padded = Rect { x: inside.x + 1, width: inside.width.saturating_sub(2), ..inside };
    draw_lines(frame, padded, &lines);
}

/// Draws an empty box over the page and returns its inside.
fn pop_up(title: &str, theme: Theme, frame: &mut Frame, at: Rect) -> Rect {
    let block = Block::bordered().title(theme.line(format!(" {title} "), TextRole::Title));
    let inside = block.inner(at);
    frame.render_widget(Clear, at);
    frame.buffer_mut().set_style(at, theme.ground());
    frame.render_widget(block, at);
    inside
}

// The box of the palette: the typed text, and the actions found with their keys.

const PALETTE_COLUMNS: u16 = 74;
/// Rows around the list: the border, and the line of the typed text.
const FRAME_ROWS: u16 = 3;
/// Columns of a key.
const KEY_COLUMNS: usize = 7;

pub fn draw_palette(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    // A note leaves the page to be seen.
    let Some(entry) = &model.pages.entry else { return };
    let note = ("Note for log and book", FRAME_ROWS + 1);
    let (title, rows) = entry.chosen.map_or(note, |_| ("Every action", area.height));
    let width = PALETTE_COLUMNS.min(area.width);
    let area = Rect { y: area.bottom().saturating_sub(rows), height: rows, ..area };
    let at = Rect { x: area.x + (area.width - width) / 2, width, ..area }.intersection(frame.area());
    let inside = pop_up(title, theme, frame, at);
    let rows = usize::from(at.height.saturating_sub(FRAME_ROWS));
    draw_lines(frame, inside, &palette_lines(model, theme, now, rows));
}

/// The typed text and this many of the actions found, the marked one among them. Empty while it is
/// closed.
pub fn palette_lines(model: &Model, theme: Theme, now: Duration, rows: usize) -> Vec<Line<'static>> {
    let Some(TextEntry { typed, chosen }) = &model.pages.entry else { return Vec::new() };
    let Some(chosen) = chosen else {
        let keys = theme.label(" Enter records it, Esc does not");
        return vec![Line::from(theme.key(format!(" {typed}_"))), Line::from(keys)];
    };
    let entries = palette_entries(model, typed, now);
    let head = Line::from(vec![
        theme.key(format!(" :{typed}_")),
        theme.label(format!("   {} found; Up Down choose, Enter does it, Esc closes", entries.len())),
    ]);
    let start = (chosen + 1).saturating_sub(rows);
    let list = entries.iter().enumerate().skip(start).take(rows).map(|(place, entry)| {
        let (mark, role) = if place == *chosen { (">", TextRole::Key) } else { (" ", TextRole::Plain) };
        Line::from(vec![
            theme.key(format!("{mark}{:<KEY_COLUMNS$}", entry.key)),
            theme.span(entry.words.clone(), role),
        ])
    });
    std::iter::once(head).chain(list).collect()
}
