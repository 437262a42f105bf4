//! A vehicle whose motor may not be ignited descends under the parachute.

use onboard_sim::tally;
use sim::recipe::Recipe;

/// In a wind of 8 m/s these flights of seed 1 would land outside the fence, where the motor must
/// not be ignited. Before the parachute was used there they fell all the way, and reached the
/// ground at 42 to 46 m/s.
const OUTSIDE_THE_FENCE: [u64; 2] = [18, 22];

#[test]
fn regress_a_flight_outside_the_fence_comes_down_under_the_parachute() {
    let recipe = Recipe::built_in("mk2", "harsh").unwrap();
    for number in OUTSIDE_THE_FENCE {
        let row = tally::fly(&recipe, number).unwrap();
        let vertical_m_s = row.touchdown_vertical_m_s.unwrap();
        assert!(row.parachute && !row.ignited, "{number}: {} at {vertical_m_s} m/s", row.failure);
        assert!(vertical_m_s > -10.0, "{number}: {vertical_m_s} m/s");
    }
}
