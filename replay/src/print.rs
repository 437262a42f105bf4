//! Prints reports as text for people, as JSON for programs and as JUnit XML for build servers.
//!
//! Control characters are removed from the text of a log first, because a log may come from anywhere.

use std::io;
use std::io::Write;
use std::path::Path;

use crate::cli::refuse_existing;
use crate::output::{NewFile, WriteError};
use anyhow::Result;
use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};
use serde::Serialize;

use crate::log::{VerdictFacts, VerdictLimit};

/// Writes any report as JSON.
///
/// # Errors
/// The output failed.
pub fn print_json(report: &impl Serialize, output: &mut impl Write) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *output, report)?;
    writeln!(output)
}

/// Text from a log, without control characters.
pub(crate) fn shown(text: &str) -> String {
    protocol::text::printable(text.as_bytes())
}

/// `1 frame`, `2 frames`.
pub(crate) fn counted(count: u64, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

/// One question and its answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JunitCase {
    /// What was asked.
    pub name: String,
    pub outcome: JunitOutcome,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum JunitOutcome {
    /// Yes.
    Passed {
        /// Remarks.
        said: String,
    },
    /// No, with a short and a full reason.
    Failed {
        /// One line.
        message: String,
        /// The full reason.
        details: String,
    },
    /// There is no answer.
    Error {
        /// Why.
        message: String,
    },
}

/// Writes cases as JUnit XML: one suite.
///
/// # Errors
/// The output failed.
pub fn print_junit(suite: &str, cases: Vec<JunitCase>, output: &mut impl Write) -> io::Result<()> {
    let mut report = Report::new("replay");
    let mut test_suite = TestSuite::new(suite);
    for case in cases {
        let mut said = String::new();
        let status = match case.outcome {
            JunitOutcome::Passed { said: words } => {
                said = words;
                TestCaseStatus::success()
            }
            JunitOutcome::Failed { message, details } => {
                let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
                status.set_message(message).set_description(details);
                status
            }
            JunitOutcome::Error { message } => {
                let mut status = TestCaseStatus::non_success(NonSuccessKind::Error);
                status.set_message(message);
                status
            }
        };
        let mut test_case = TestCase::new(case.name, status);
        if !said.is_empty() {
            test_case.set_system_out(said);
        }
        test_suite.add_test_case(test_case);
    }
    report.add_test_suite(test_suite);
    let text = report.to_string().map_err(io::Error::other)?;
    output.write_all(text.as_bytes())
}

/// One limit in both verdicts.
pub(crate) struct LimitRow<'a> {
    pub(crate) limit: &'a VerdictLimit,
    /// Each verdict's value with its unit, marked if outside.
    pub(crate) values: [String; 2],
}

/// A verdict in short; `none` if there is none.
pub(crate) fn verdict_words(verdict: Option<&VerdictFacts>, none: &str) -> String {
    match verdict {
        None => none.to_owned(),
        Some(verdict) if verdict.landed => format!("LANDED at {}", verdict.contact()),
        Some(verdict) => format!("NOT LANDED at {}", verdict.contact()),
    }
}

/// The limits of `named`, then those that only one verdict has, with the values of both. `shown` escapes text for the
/// output; `outside` marks a value outside its limit.
pub(crate) fn verdict_rows<'a>(
    named: Option<&'a VerdictFacts>,
    both: [Option<&'a VerdictFacts>; 2],
    shown: fn(&str) -> String,
    outside: &str,
) -> Vec<LimitRow<'a>> {
    let value = |verdict: Option<&VerdictFacts>, name: &str| {
        let found = verdict.and_then(|verdict| verdict.limits.iter().find(|limit| limit.name == name));
        found.map_or_else(
            || "-".to_owned(),
            |found| {
                let mark = if found.passed { "" } else { outside };
                format!("{:.4} {}{mark}", found.value, shown(&found.unit))
            },
        )
    };
    let mut limits: Vec<&VerdictLimit> = Vec::new();
    for limit in named.into_iter().chain(both.into_iter().flatten()).flat_map(|verdict| &verdict.limits) {
        if !limits.iter().any(|known| known.name == limit.name) {
            limits.push(limit);
        }
    }
    limits
        .into_iter()
        .map(|limit| LimitRow { limit, values: both.map(|verdict| value(verdict, &limit.name)) })
        .collect()
}

/// A file for JUnit XML: before the work, so that nothing is done for a file that may not be written. An existing file is
/// kept, with any content; a pipe or a device has nothing to keep.
pub(crate) fn junit_file(path: &Path) -> Result<NewFile> {
    if std::fs::metadata(path).is_ok_and(|found| found.is_file()) {
        refuse_existing(path)?;
    }
    Ok(NewFile::create(path.into(), Path::new(""))?)
}

/// Writes JUnit XML to a file of [`junit_file`].
pub(crate) fn write_junit(suite: &str, cases: Vec<JunitCase>, mut file: NewFile) -> Result<()> {
    print_junit(suite, cases, &mut file).map_err(WriteError::at(file.path()))?;
    Ok(file.commit()?)
}
