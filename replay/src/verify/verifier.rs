//! Runs a controller on the ticks of a log and compares the results.

use prost_reflect::MessageDescriptor;

use super::tally::Tally;
use crate::controller::Replayed;

/// Re-executes ticks and compares them; ticks must come in order, from the first tick on.
#[derive(Debug)]
pub struct Verifier<C> {
    controller: C,
    descriptor: Option<MessageDescriptor>,
    pub(super) tally: Tally,
}

impl<C: Replayed> Verifier<C> {
    /// A controller before its first tick.
    pub fn new(controller: C) -> Self {
        Self { controller, descriptor: C::descriptor(), tally: Tally::default() }
    }

    pub(super) fn controller(&self) -> &C {
        &self.controller
    }

    /// Re-executes the next tick and compares it with its record.
    ///
    /// # Errors
    /// The recorded input cannot be given to this build's controller.
    pub fn check(&mut self, tick: &C::Tick) -> Result<(), C::Error> {
        let again = self.controller.run_again(tick)?;
        self.tally.compare::<C>(self.descriptor.as_ref(), tick, &again);
        Ok(())
    }
}
