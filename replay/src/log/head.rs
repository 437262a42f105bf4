//! The head of a log: metadata and attachments.

use std::collections::BTreeMap;

use protocol::log::build::build_info;
use protocol::log::reader::{Damage, LogItem};
use protocol::log::record::{
    ATTACHMENT_PROFILE, ATTACHMENT_SCENARIO, METADATA_BUILD, METADATA_RECOVERY, METADATA_RUN,
    METADATA_SCHEMA, RECOVERY_FAULT_ENTRY, SCHEMA_VERSION, SCHEMA_VERSION_ENTRY,
};
use serde::Serialize;

/// Limit on the stored part of a head, bytes.
const RUN_FACTS_MAX: usize = 10_000;
const ATTACHMENTS_MAX: usize = 10_000;

/// Metadata and attachments.
#[derive(Debug, Clone, Default)]
pub struct Head {
    /// The library that wrote the file.
    pub library: String,
    /// The log's schema metadata: the version of its contents.
    pub schema: BTreeMap<String, String>,
    /// Which build wrote it.
    pub build: BTreeMap<String, String>,
    /// Facts about the run: profile, seed and so on.
    pub run: BTreeMap<String, String>,
    /// The profile's whole text, or why it is not text.
    pub profile_toml: Option<Result<String, std::string::FromUtf8Error>>,
    /// The whole text of the dispersions.
    pub scenario_toml: Option<String>,
    pub attachments: Vec<Attachment>,
    /// The log was recovered from one that lacked something.
    pub recovered: Option<Damage>,
}

/// An attachment, without its content.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Attachment {
    pub name: String,
    /// Its size.
    pub bytes: usize,
}

/// Comparison of the build that wrote a log with this one.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct BuildComparison {
    /// Whether the log says which build wrote it.
    pub recorded: bool,
    /// Every fact that differs; empty with `recorded` means the same build.
    pub differences: Vec<BuildDifference>,
}

/// A fact in which two builds differ.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BuildDifference {
    pub fact: String,
    /// The recorded value; absent if the log has none.
    pub recorded: Option<String>,
    /// The value of this build; absent if this build does not record it.
    pub this_build: Option<String>,
}

impl Head {
    /// Version of the log's contents, as the log states it.
    pub fn schema_version(&self) -> Option<&str> {
        self.schema.get(SCHEMA_VERSION_ENTRY).map(String::as_str)
    }

    /// Whether this build reads this version of contents.
    pub fn is_of_this_schema(&self) -> bool {
        self.schema_version() == Some(SCHEMA_VERSION.to_string().as_str())
    }

    /// Whether one of our programs wrote the log.
    pub(super) fn is_ours(&self) -> bool {
        self.library.starts_with("touchdown ")
            || self.build.contains_key("git_commit")
            || self.attachments.iter().any(|attachment| attachment.name == ATTACHMENT_PROFILE)
    }

    /// Notes an item that is not a message.
    pub(super) fn take(&mut self, item: LogItem) {
        match item {
            LogItem::Library(library) => self.library = library,
            LogItem::Metadata { name, entries } if name == METADATA_BUILD => self.build = entries,
            LogItem::Metadata { name, entries } if name == METADATA_SCHEMA => self.schema = entries,
            LogItem::Metadata { name, entries } if name == METADATA_RUN && self.run.len() < RUN_FACTS_MAX => {
                self.run.extend(entries);
            }
            LogItem::Metadata { name, entries } if name == METADATA_RECOVERY => {
                let fault = entries.get(RECOVERY_FAULT_ENTRY).filter(|fault| !fault.is_empty());
                self.recovered = self.recovered.take().or(fault.cloned().map(Damage::Recovered));
            }
            LogItem::Attachment { name, data } => {
                if self.attachments.len() < ATTACHMENTS_MAX {
                    self.attachments.push(Attachment { name: name.clone(), bytes: data.len() });
                }
                match name.as_str() {
                    ATTACHMENT_PROFILE => self.profile_toml = Some(String::from_utf8(data)),
                    ATTACHMENT_SCENARIO => self.scenario_toml = String::from_utf8(data).ok(),
                    _ => {}
                }
            }
            _ => {}
        }
    }

    /// Comparison of the build that wrote the log with this one.
    pub fn compare_build(&self) -> BuildComparison {
        let differences = differing(&self.build, &build_info()).into_iter();
        let differences =
            differences.map(|(fact, [recorded, this_build])| BuildDifference { fact, recorded, this_build });
        BuildComparison { recorded: !self.build.is_empty(), differences: differences.collect() }
    }
}

/// The entries that only one map has, or that have another value there.
pub(crate) fn differing(
    one: &BTreeMap<String, String>,
    other: &BTreeMap<String, String>,
) -> BTreeMap<String, [Option<String>; 2]> {
    let both = |name: &String| (name.clone(), [one, other].map(|map| map.get(name).cloned()));
    one.keys().chain(other.keys()).map(both).filter(|(_, [one, other])| one != other).collect()
}
