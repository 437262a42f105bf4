//! In the air the flight computer allocates only for the buffers of its first plans.

use flight::computer::{Computer, Input, Output};
use flight::rules::phase::Phase;
use sim::outside::{Outside, Watch};
use sim::recipe::Recipe;
use sim::sortie::Sortie;

/// Steps a second computer with the same inputs and counts its allocations.
struct Shadow {
    computer: Computer,
    frames: u64,
    plans: u64,
    /// Frame, plans under thrust so far, allocations.
    allocating: Vec<(u64, u64, u64)>,
}

impl Watch for Shadow {
    fn decided(&mut self, input: &Input<'_>, output: &Output, computer: &Computer) {
        let mut again = None;
        let allocated = allocation_counter::measure(|| again = Some(self.computer.step(input)));
        assert_eq!(again.as_ref(), Some(output));
        self.plans += u64::from(computer.mode().phase == Phase::Powered && output.planned);
        self.frames += 1;
        if allocated.count_total > 0 {
            self.allocating.push((input.frame, self.plans, allocated.count_total));
        }
    }
}

#[test]
fn after_the_first_plans_no_frame_allocates() {
    let mut flight = Sortie::new(&Recipe::built_in("mk2", "field").unwrap(), 3).unwrap();
    let mut shadow =
        Shadow { computer: flight.computer().clone(), frames: 0, plans: 0, allocating: Vec::new() };
    while flight.goes_on() {
        flight.step_with(&Outside::NOBODY, &mut shadow);
    }
    assert!(shadow.frames > 2_000 && flight.outcome().landing.stands);
    // The first plans of a flight allocate the solver's workspace and the two plans that it fills
    // in turn.
    assert!(shadow.allocating.iter().all(|(_, plans, _)| *plans <= 2), "{:?}", shadow.allocating);
    assert!(shadow.plans > 20, "{}", shadow.plans);
}
