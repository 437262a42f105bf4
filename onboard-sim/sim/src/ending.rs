//! How a flight ended, in one sentence that every program says alike.

use core::fmt;

/// How a flight that touched the ground ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FlightEnding<'a> {
    /// An abort was latched.
    pub aborted: bool,
    /// Within the limits that decide: those of the legs.
    pub landed: bool,
    /// Also inside the landing paper's Table 2; `None` if that is not known.
    pub table_2: Option<bool>,
    /// Why it did not land.
    pub failure: Option<&'a str>,
}

/// The failure of a vehicle that came down under its parachute.
pub const UNDER_PARACHUTE: &str = "parachute";

impl fmt::Display for FlightEnding<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.aborted {
            out.write_str("ABORTED, then ")?;
        }
        match (self.landed, self.table_2, self.failure) {
            (true, Some(true), _) => out.write_str("LANDED inside every limit"),
            (true, Some(false), _) => out.write_str("LANDED on its legs, outside Table 2"),
            (true, None, _) => out.write_str("LANDED on its legs; Table 2 is not known"),
            (false, _, Some(UNDER_PARACHUTE)) => out.write_str("DOWN UNDER THE PARACHUTE, not landed"),
            (false, _, Some(failure)) => write!(out, "NOT LANDED: {failure}"),
            (false, _, None) => out.write_str("NOT LANDED: outside a limit"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inside_every_limit_is_said_of_table_2_only() {
        let landed = FlightEnding { landed: true, ..FlightEnding::default() };
        assert_eq!(FlightEnding { table_2: Some(true), ..landed }.to_string(), "LANDED inside every limit");
        for table_2 in [Some(false), None] {
            let words = FlightEnding { table_2, ..landed }.to_string();
            assert!(words.contains("Table 2") && !words.contains("every limit"), "{words}");
        }
    }

    #[test]
    fn a_parachute_and_an_abort_are_called_that() {
        let under = FlightEnding { aborted: true, failure: Some(UNDER_PARACHUTE), ..FlightEnding::default() };
        assert_eq!(under.to_string(), "ABORTED, then DOWN UNDER THE PARACHUTE, not landed");
        assert_eq!(
            FlightEnding { failure: Some("tipped over"), ..FlightEnding::default() }.to_string(),
            "NOT LANDED: tipped over"
        );
    }
}
