//! The crew's voice: a command that speaks each line of its standard input. There is no shell between.

use std::io::{self, Write as _};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

/// How many callouts wait for the command; further ones are dropped, because late words mislead.
const WAITING_MAX: usize = 4;

/// Passes lines to the command from a thread of its own, so that a command that hangs delays nothing.
#[derive(Debug)]
pub struct Voice {
    lines: SyncSender<String>,
    #[cfg(test)]
    thread: std::thread::JoinHandle<()>,
}

/// The command has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the voice command has ended; nothing is called out any more")]
pub struct VoiceEnded;

impl Voice {
    /// Starts the command: its name and arguments, with spaces between them.
    ///
    /// # Errors
    /// The command or its thread cannot be started.
    pub fn start(command: &str) -> io::Result<Self> {
        let mut words = command.split_whitespace();
        let name = words.next().ok_or_else(|| io::Error::other("the voice command is empty"))?;
        let child = Command::new(name)
            .args(words)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()?;
        let (lines, waiting) = sync_channel(WAITING_MAX);
        let thread = std::thread::Builder::new().name("voice".to_owned());
        let thread = thread.spawn(move || speak(child, &waiting))?;
        // It is never joined, because it may hang with the command.
        #[cfg(not(test))]
        drop(thread);
        Ok(Self {
            lines,
            #[cfg(test)]
            thread,
        })
    }

    /// Says a line, unless the command is too far behind. It never waits.
    ///
    /// # Errors
    /// The command has ended.
    pub fn say(&self, line: &str) -> Result<(), VoiceEnded> {
        match self.lines.try_send(format!("{line}\n")) {
            Ok(()) | Err(TrySendError::Full(_)) => Ok(()),
            Err(TrySendError::Disconnected(_)) => Err(VoiceEnded),
        }
    }
}

fn speak(mut child: Child, lines: &Receiver<String>) {
    if let Some(mut input) = child.stdin.take() {
        for line in lines {
            if input.write_all(line.as_bytes()).and_then(|()| input.flush()).is_err() {
                break;
            }
        }
    }
    // Without more input the command ends; waiting only prevents a zombie process.
    let _ = child.wait();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_reaches_the_command_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let heard = folder.path().join("heard");
        let voice = Voice::start(&format!("tee {}", heard.display())).unwrap();
        for line in ["liftoff", "$(reboot); `x` | y"] {
            assert_eq!(voice.say(line), Ok(()));
        }
        let Voice { lines, thread } = voice;
        drop(lines);
        thread.join().unwrap();
        assert_eq!(std::fs::read_to_string(heard).unwrap(), "liftoff\n$(reboot); `x` | y\n");
    }

    /// More than a pipe holds; a call that waited would never return.
    #[test]
    fn a_command_that_never_reads_delays_nothing() {
        let voice = Voice::start("sleep 3").unwrap();
        for _ in 0..100_000 {
            let _ = voice.say("150 metres");
        }
    }

    #[test]
    fn an_unknown_command_is_an_error_and_an_ended_one_is_noticed() {
        assert!(Voice::start("no-such-command-anywhere").is_err());
        assert!(Voice::start(" ").is_err());
        let voice = Voice::start("true").unwrap();
        while voice.say("anybody there?").is_ok() {
            std::thread::yield_now();
        }
        assert_eq!(voice.say("nobody"), Err(VoiceEnded));
    }
}
