//! Writes the flight in a log as the stream that a board reads (`frames`), and what it decided as the answers to be
//! expected (`recorded`), into a folder: `cargo run -p board --example frames -- flight.mcap FOLDER`.
#![expect(clippy::disallowed_methods, reason = "an example reads its arguments and files")]

use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

use anyhow::{Context as _, Result, bail, ensure};
use board::stream::{Answer, Begin, Frame, put};
use prost::Message as _;
use protocol::log::computer_v1::{ComputerFrame, ComputerStart};
use protocol::log::reader::{LogItem, LogReader};
use protocol::log::record::{ATTACHMENT_PROFILE, TOPIC_COMPUTER_FRAME, TOPIC_COMPUTER_START};

fn main() -> Result<()> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let (Some(log), Some(folder)) = (arguments.next(), arguments.next()) else {
        bail!("usage: frames LOG FOLDER");
    };
    let file = File::open(&log).with_context(|| log.display().to_string())?;
    let mut reader = LogReader::new(BufReader::new(file));
    let (mut toml, mut begin, mut written) = (None, None, 0);
    let (mut frames, mut recorded) = (Vec::new(), Vec::new());
    while let Some(item) = reader.next_item()? {
        match item {
            LogItem::Attachment { name, data } if name == ATTACHMENT_PROFILE => {
                toml = Some(String::from_utf8(data)?);
            }
            LogItem::Metadata { entries, .. } => {
                ensure!(!entries.contains_key("settings_in_flight"), "its settings were changed in flight");
            }
            LogItem::Message { channel_id, data, .. } => {
                match reader.channel(channel_id).map(|channel| channel.topic.as_str()) {
                    Some(TOPIC_COMPUTER_START) => {
                        let start = ComputerStart::decode(data.as_slice())?;
                        // The computer of a flight from power-up needs no other start.
                        if written == 0 || !start.released {
                            ensure!(begin.is_none() && written == 0, "it has more than one flight");
                            let toml = toml.clone().context("it has no mission before its first frame")?;
                            begin = Some(Begin { toml, start, on_the_air: None, flight: 0 });
                        }
                    }
                    Some(TOPIC_COMPUTER_FRAME) => {
                        ensure!(begin.is_some() || written > 0, "the start of its flight is missing");
                        let ComputerFrame { input, output, state_digest } =
                            ComputerFrame::decode(data.as_slice())?;
                        let frame = input.frame;
                        put(&Frame { input, begin: begin.take() }, &mut frames);
                        put(&Answer { frame, output, state_digest, heard: None }, &mut recorded);
                        written += 1;
                    }
                    _ => {}
                }
            }
            _ => {}
        }
    }
    ensure!(reader.damage().is_none() && written > 0, "it is damaged, or has no frames");
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join("frames"), frames)?;
    std::fs::write(folder.join("recorded"), recorded)?;
    Ok(())
}
