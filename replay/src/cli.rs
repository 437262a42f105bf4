//! What all commands have in common: how they ended, what they print, how they stop.

use std::io::{self, Write};
use std::num::NonZeroUsize;
use std::path::Path;

use anyhow::{Context as _, Result, ensure};
pub(crate) use onboard_sim::files::text_of;
use onboard_sim::run::threads;

use crate::log::{Cut, Gap, Recording};
use crate::output::write_whole;

/// The answer is no: the controller decides differently from the record, or flights differ by more than is tolerated.
const EXIT_NO: u8 = 1;
/// There is no answer: wrong usage, an unreadable file, not a flight log, or not replayable.
pub const EXIT_NO_ANSWER: u8 = 2;

/// How an answer turned out.
pub enum Outcome {
    /// There is an answer.
    Given,
    /// Some of the logs could not be read, or not be run again.
    NotAll,
    /// Yes or no.
    Decided { yes: bool },
}

impl Outcome {
    /// The exit code of the program.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Given | Self::Decided { yes: true } => 0,
            Self::Decided { yes: false } => EXIT_NO,
            Self::NotAll => EXIT_NO_ANSWER,
        }
    }
}

/// Passes text on without what steers a terminal: text of a log or a file name is only shown.
pub(crate) struct Shown<W> {
    output: W,
    /// The first byte of a character that may be a control character.
    held: bool,
}

/// In UTF-8, the control characters from U+0080 to U+009F are this byte and one of 80 to 9f.
const HIGH_CONTROL: u8 = 0xc2;
const REPLACEMENT: &[u8] = "\u{fffd}".as_bytes();

impl<W: Write> Shown<W> {
    fn new(output: W) -> Self {
        Self { output, held: false }
    }

    fn release(&mut self) -> io::Result<()> {
        if std::mem::take(&mut self.held) { self.output.write_all(&[HIGH_CONTROL]) } else { Ok(()) }
    }
}

impl<W: Write> Write for Shown<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        for byte in bytes {
            if self.held && (0x80..0xa0).contains(byte) {
                self.held = false;
                self.output.write_all(REPLACEMENT)?;
                continue;
            }
            self.release()?;
            match byte {
                &HIGH_CONTROL => self.held = true,
                b'\n' | b'\t' => self.output.write_all(&[*byte])?,
                0..=0x1f | 0x7f => self.output.write_all(REPLACEMENT)?,
                _ => self.output.write_all(&[*byte])?,
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.release()?;
        self.output.flush()
    }
}

/// Writes an answer to standard output. A reader that closes the pipe early is not an error.
pub(crate) fn answer(
    write: impl FnOnce(&mut Shown<io::BufWriter<io::StdoutLock<'static>>>) -> io::Result<()>,
) -> Result<()> {
    let mut output = Shown::new(io::BufWriter::new(io::stdout().lock()));
    match write(&mut output).and_then(|()| output.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error).context("standard output"),
        _ => Ok(()),
    }
}

/// Writes a new file; an existing one is kept.
pub(crate) fn write_new(path: &Path, text: &str) -> Result<()> {
    refuse_existing(path)?;
    Ok(write_whole(path.into(), Path::new(""), |file| file.write_all(text.as_bytes()))?)
}

/// Writes a table into a new file; an existing one is kept.
pub(crate) fn write_table(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    let mut table = Vec::new();
    write(&mut table)?;
    write_new(path, std::str::from_utf8(&table)?)
}

/// Refuses a path where a file is, before the work for it is done.
pub(crate) fn refuse_existing(path: &Path) -> Result<()> {
    ensure!(
        path.symlink_metadata().is_err(),
        "{}: exists already, and nothing is overwritten",
        path.display()
    );
    Ok(())
}

/// Writes a line to standard error; a closed standard error is ignored.
pub fn say(text: &str) {
    let mut output = Shown::new(io::stderr());
    let _ = writeln!(output, "replay: {text}").and_then(|()| output.flush());
}

/// Warns about damage, a missing end of the flight and missing frames.
pub(crate) fn warn_of_what_is_missing(recording: &Recording) {
    if let Some(Gap { after, before }) = recording.gap() {
        let name = &recording.name;
        say(&format!(
            "warning: {name}: after frame {after} comes frame {before}; nothing after the gap was run again"
        ));
    }
    warn_of_damage(&recording.name, recording.damage.as_deref());
    warn_of_cut(&recording.name, recording.cut.as_ref());
}

/// Warns that only the part of a log before its damage is used.
pub(crate) fn warn_of_damage(file: &str, damage: Option<&str>) {
    if let Some(damage) = damage {
        say(&format!("warning: {file} is damaged: {damage}; what can be read was used"));
    }
}

/// Warns that a flight was not recorded to its end.
pub(crate) fn warn_of_cut(file: &str, cut: Option<&Cut>) {
    if let Some(cut) = cut {
        say(&format!("warning: {file}: the flight {cut}"));
    }
}

/// Does work on so many threads, or on as many as there are processors.
pub(crate) fn in_pool<R: Send>(jobs: Option<NonZeroUsize>, work: impl FnOnce() -> R + Send) -> Result<R> {
    Ok(threads(jobs.map(NonZeroUsize::get)).context("cannot start threads")?.install(work))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_steers_a_terminal_is_shown() {
        let text = "grün\tand\n\u{1b}[2J \u{9b}2J \u{7f}\u{8}\r§\u{c2}";
        for length in [1, 2, 3, 100] {
            let mut output = Shown::new(Vec::new());
            for piece in text.as_bytes().chunks(length) {
                output.write_all(piece).unwrap();
            }
            output.flush().unwrap();
            let said = String::from_utf8(output.output).unwrap();
            let r = char::REPLACEMENT_CHARACTER;
            assert_eq!(said, format!("grün\tand\n{r}[2J {r}2J {r}{r}{r}§\u{c2}"));
        }
    }
}
