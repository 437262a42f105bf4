//! `replay audit`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use protocol::book::PublicKey;
use replay::audit::{ShownHead, Trusted, audit_logs};
use replay::print::{print_audit, print_json};

use super::{Answer, answer};

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// Logs of ground stations, and of the vehicle: only the vehicle's log or --head shows that a book was cut.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The station's public key, 64 hexadecimal digits, as the first entry of its book and `audit` show it.
    #[arg(long, value_name = "HEX", value_parser = public_key)]
    public_key: Option<PublicKey>,
    /// The head that the station showed at its end, as in 57:ab12-cd34.
    #[arg(long, value_name = "ENTRIES:HASH")]
    head: Option<ShownHead>,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

fn public_key(text: &str) -> Result<PublicKey, String> {
    PublicKey::from_hex(text).ok_or_else(|| "give 64 hexadecimal digits of an Ed25519 key".to_owned())
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let trusted = Trusted { key: self.public_key, head: self.head };
        let found = audit_logs(&self.files, &trusted)?;
        answer(|output| if self.json { print_json(&found, output) } else { print_audit(&found, output) })?;
        Ok(if found.books.is_empty() {
            Answer::NotAll
        } else {
            Answer::Audited { proven: found.is_proven() }
        })
    }
}
