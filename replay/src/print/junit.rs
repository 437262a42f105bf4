//! Prints answers as JUnit XML for build servers.

use std::io::{self, Write};

use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};

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
