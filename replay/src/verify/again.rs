//! The world of a simulated flight, drawn again from the facts in its log: the commands of the
//! computer that is verified move it. What does not follow from the computer's inputs (its
//! measurements, the verdict) follows from the seed.

use avionics::log::logged::Logged as _;
use flight::computer::Computer;
use prost::Message as _;
use protocol::log::computer_v1::ComputerStart;
use sim::fault::{Breakage, TimedFault, When};
use sim::sortie::Sortie;
use sim::wire::record;

use crate::controller::AgainError;
use crate::log::{Head, LoggedFrame};
use crate::refly::rerun::{begun, drawn_from};
use crate::refly::sensed;

/// What of the metadata no flight follows from.
const BESIDE: &str = "what the flight is drawn from; the dispersion's name, start_unix_ns, the build and touchdown.xml are not compared";

/// A world that is moved beside a verification.
pub(super) struct WorldAgain {
    flight: Box<Sortie>,
    /// The frame of the release.
    released: u64,
    /// It has come to its end.
    over: bool,
    /// The first frame that it made feel something else.
    first_different: Option<u64>,
}

impl WorldAgain {
    /// The world at the release; `None` if the log is not of a drawn flight.
    ///
    /// # Errors
    /// The log lacks a part of its recipe, or this build does not know it.
    pub(super) fn drawn(
        name: &str,
        head: &Head,
        toml: &str,
        start: &ComputerStart,
    ) -> Result<Option<Self>, AgainError> {
        if !["seed", "flight", "dispersion"].iter().any(|fact| head.run.contains_key(*fact)) {
            return Ok(None);
        }
        let (recipe, number) = drawn_from(name, head, toml, start)?;
        let on_the_pad = |fault: &&TimedFault| {
            matches!(fault.when, When::Phase(phase, _) | When::PhaseBetween(phase, _) if phase.on_pad())
                && matches!(fault.breakage, Breakage::Sensor(..))
        };
        if let Some(fault) = recipe.faults.iter().find(on_the_pad) {
            let reason = format!("{fault}: what a sensor that broke on the pad remembers is not recorded");
            return Err(AgainError::Refused { of: name.to_owned(), reason });
        }
        let flight = Box::new(begun(&recipe, number, start)?);
        Ok(Some(Self { flight, released: start.frame, over: false, first_different: None }))
    }

    /// Moves on by a frame that the computer has just flown.
    pub(super) fn follow(&mut self, frame: &LoggedFrame, computer: &Computer) {
        let number = frame.record.input.frame.checked_sub(self.released);
        let Some(number) = number.filter(|_| !self.over) else { return };
        let recorded = sensed(&frame.record.input).encode_to_vec();
        let again = self.flight.follow(number, computer);
        let again = again.map(|input| sensed(&input.to_log()).encode_to_vec());
        if again != Some(recorded) {
            self.first_different.get_or_insert(frame.record.input.frame);
        }
        self.over = !self.flight.goes_on();
    }

    /// Whether the flight, whose log has ended, has the recorded verdict and follows from the run
    /// facts, and what is to be said of each.
    pub(super) fn judge(&self, recorded: Option<&[u8]>) -> [(bool, Option<String>); 2] {
        let again = record::verdict(&self.flight).map(|verdict| verdict.encode_to_vec());
        let same = recorded == again.as_deref();
        let facts = match self.first_different {
            Some(frame) => format!("drawn again, the flight is another one from frame {frame} on"),
            None => BESIDE.to_owned(),
        };
        let verdict = (!same).then(|| "flown again, the flight ends otherwise".to_owned());
        [(same, verdict), (self.first_different.is_none(), Some(facts))]
    }
}
