//! The scatter of the ignition delay belongs to the vehicle's igniter.

use sim::draw::draw;
use sim::recipe::Recipe;
use sim::world::truth::Truth;

#[test]
fn the_airframe_scales_the_deviation_of_the_delay_and_changes_no_other_draw() {
    let recipe = Recipe::built_in("mk2", "field").unwrap();
    let single = &recipe.mission;
    let mut double = single.clone();
    double.airframe.igniters = 2;
    let share = double.airframe.igniter_scatter();
    let nominal_s = Truth::default().ignition_delay_s;
    for number in 0..20 {
        let [one, two] = [single, &double].map(|mission| draw(mission, &recipe.dispersion, 1, number));
        let (one_s, two_s) = (one.truth.ignition_delay_s, two.truth.ignition_delay_s);
        // The least delay cuts off the tail of a single igniter.
        let cut_off = one_s < 0.021;
        assert!(cut_off || (two_s - nominal_s - share * (one_s - nominal_s)).abs() < 1e-12, "{number}");
        let truth = Truth { ignition_delay_s: one_s, ..two.truth };
        assert_eq!((truth, two.apogee, two.flight_seed), (one.truth, one.apogee, one.flight_seed));
    }
}
