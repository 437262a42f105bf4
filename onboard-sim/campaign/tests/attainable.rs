//! The window of a flight against a search that knows nothing of bang-bang paths.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::collections::HashMap;

use campaign::attainable::{Window, window};
use flight::vehicle::atmosphere::{Air, STANDARD_GRAVITY_M_S2};
use flight::vehicle::mission::Mission;
use sim::draw::{Draw, draw};
use sim::recipe::Recipe;
use world::vertical::Vertical;

/// Controls are constant for this long, s, and the motion in it is integrated in `PARTS` parts.
const HOLD_S: f64 = 0.1;
const PARTS: usize = 4;
/// Tilts as shares of the largest, and fin openings.
const TILTS: [f64; 4] = [0.0, 0.4, 0.7, 1.0];
const FINS: [f64; 2] = [0.0, 1.0];
/// Cells of the search, m and m/s. Each keeps its lowest and its highest state, both truly reached.
const CELL: (f64, f64) = (0.2, 0.1);
/// What the search may miss near the ends of a window, m: the cells, the held controls and the few tilts cost it that.
const NEAR_M: f64 = 0.6;
/// What it cannot find outside, m: both sides integrate within a centimetre.
const BEYOND_M: f64 = 0.05;

/// Forward search over all states that a flight can reach with piecewise constant controls.
struct Searcher {
    vertical: Vertical,
    apogee: (f64, f64),
    delay_s: f64,
    controls: Vec<([f64; 2], f64)>,
    leg_m_s: f64,
    carried_until_s: f64,
}

impl Searcher {
    fn new(mission: &Mission, drawn: &Draw) -> Self {
        let vertical = Vertical::new(&mission.airframe, &mission.motor_curve, &drawn.truth);
        let most_rad = mission.powered.tilt_max_deg.to_radians();
        let controls = TILTS
            .iter()
            .flat_map(|tilt| {
                FINS.map(|fins| ([libm::sin(tilt * most_rad), libm::cos(tilt * most_rad)], fins))
            })
            .collect();
        let surplus_n = |ms: &u32| {
            let time_s = f64::from(*ms) * 1e-3;
            vertical.burn().thrust_n(time_s) - vertical.mass_kg(time_s) * STANDARD_GRAVITY_M_S2
        };
        let carried_until_s =
            (0..20_000).rfind(|ms| surplus_n(ms) > 0.0).map_or(f64::INFINITY, |ms| f64::from(ms) * 1e-3);
        Self {
            apogee: (drawn.apogee.position_m.z - vertical.cg_above_feet_m(), drawn.apogee.velocity_m_s.z),
            delay_s: drawn.truth.ignition_delay_s,
            leg_m_s: mission.leg_limits.vertical_m_s,
            carried_until_s,
            vertical,
            controls,
        }
    }

    /// The midpoint rule. A negative time is before the thrust.
    fn moved(
        &self,
        burning_s: f64,
        step_s: f64,
        (h, v): (f64, f64),
        (tilt, fins): ([f64; 2], f64),
    ) -> (f64, f64) {
        let middle_s = burning_s + 0.5 * step_s;
        let (thrust_n, mass_kg) = (self.vertical.burn().thrust_n(middle_s), self.vertical.mass_kg(middle_s));
        let gained_m_s2 = |h: f64, v: f64| {
            let air = Air::at_height_m(h + self.vertical.cg_above_feet_m());
            let drag_n = self.vertical.drag(air.density_kg_m3, v, thrust_n).at_n(tilt, fins);
            (thrust_n * tilt[1] - v.signum() * drag_n) / mass_kg - STANDARD_GRAVITY_M_S2
        };
        let (h_middle, v_middle) = (h + 0.5 * step_s * v, v + 0.5 * step_s * gained_m_s2(h, v));
        (h + step_s * v_middle, v + step_s * gained_m_s2(h_middle, v_middle))
    }

    /// Whether a landing was found from a command height.
    fn lands(&self, command_m: f64) -> bool {
        let falling = |state, step_s| self.moved(-1.0, step_s, state, ([0.0, 1.0], 1.0));
        let mut state = self.apogee;
        while state.0 > command_m {
            state = falling(state, 1e-3);
        }
        for _ in 0..(self.delay_s * 1e3) as usize {
            state = falling(state, 1e-3);
        }
        if state.0 <= 0.0 {
            return false;
        }
        let mut reached = vec![state];
        let mut burning_s = 0.0;
        while !reached.is_empty() && burning_s < self.carried_until_s + 1.5 {
            let mut cells: HashMap<(i32, i32), [(f64, f64); 2]> = HashMap::new();
            for from in &reached {
                for control in &self.controls {
                    match self.held(burning_s, *from, *control) {
                        Held::Landed => return true,
                        Held::Crashed => {}
                        Held::Flies(to) => {
                            let cell = ((to.0 / CELL.0) as i32, libm::floor(to.1 / CELL.1) as i32);
                            let kept = cells.entry(cell).or_insert([to, to]);
                            if to.0 < kept[0].0 {
                                kept[0] = to;
                            }
                            if to.0 > kept[1].0 {
                                kept[1] = to;
                            }
                        }
                    }
                }
            }
            let mut next: Vec<(f64, f64)> = cells.into_values().flatten().collect();
            next.sort_by(|one, two| one.partial_cmp(two).unwrap());
            next.dedup();
            reached = next;
            burning_s += HOLD_S;
        }
        false
    }

    fn held(&self, from_s: f64, from: (f64, f64), control: ([f64; 2], f64)) -> Held {
        let step_s = HOLD_S / PARTS as f64;
        let mut state = from;
        for part in 0..PARTS {
            let at_s = from_s + part as f64 * step_s;
            let after = self.moved(at_s, step_s, state, control);
            if after.0 <= 0.0 {
                let share = state.0 / (state.0 - after.0);
                let (contact_s, contact_m_s) = (at_s + share * step_s, state.1 + share * (after.1 - state.1));
                let lands = contact_s >= self.carried_until_s && contact_m_s >= -self.leg_m_s;
                return if lands { Held::Landed } else { Held::Crashed };
            }
            state = after;
        }
        Held::Flies(state)
    }
}

enum Held {
    Landed,
    Crashed,
    Flies((f64, f64)),
}

#[derive(Debug, Default)]
struct Compared {
    /// Questions on which both agree that there is a landing, and that there is none.
    both_land: u32,
    neither_lands: u32,
    /// Landings that only the search found, with flight and height.
    only_search: Vec<(u64, f64, Option<Window>)>,
    /// Landings that only the window promises.
    only_window: Vec<(u64, f64, Option<Window>)>,
}

/// Asks both about heights inside and outside of each window, and about many heights if there is no window.
fn compared(mission: &str, dispersion: &str, seed: u64, numbers: impl Iterator<Item = u64>) -> Compared {
    let recipe = Recipe::built_in(mission, dispersion).unwrap();
    let mut all = Compared::default();
    for number in numbers {
        let drawn = draw(&recipe.mission, &recipe.dispersion, seed, number);
        let found = window(&recipe.mission, &drawn);
        let searcher = Searcher::new(&recipe.mission, &drawn);
        let heights_m = found.map_or_else(
            || (0..10).map(|i| 30.0 + 8.0 * f64::from(i)).collect(),
            |Window { low_m, high_m }| {
                vec![
                    low_m - BEYOND_M,
                    low_m + NEAR_M,
                    0.5 * (low_m + high_m),
                    high_m - NEAR_M,
                    high_m + BEYOND_M,
                    high_m + 5.0,
                ]
            },
        );
        for height_m in heights_m {
            let promised = found.is_some_and(|found| found.contains(height_m));
            match (searcher.lands(height_m), promised) {
                (true, true) => all.both_land += 1,
                (false, false) => all.neither_lands += 1,
                (true, false) => all.only_search.push((number, height_m, found)),
                (false, true) => all.only_window.push((number, height_m, found)),
            }
        }
    }
    all
}

/// Share of the landings in windows that the search may miss: windows narrower than twice `NEAR_M`, where every question is
/// near an end.
fn agrees(compared: &Compared, missed_share: f64) {
    eprintln!("{compared:?}");
    assert!(compared.only_search.is_empty(), "the window is too small: {compared:?}");
    let missed = compared.only_window.len() as f64;
    assert!(missed <= missed_share * (missed + f64::from(compared.both_land)), "{compared:?}");
}

#[test]
fn val_brute_force_finds_no_landing_outside_the_windows_of_a_few_flights() {
    agrees(&compared("mk2", "harsh", 11, 0..4), 0.1);
}

/// Some minutes in release: `cargo test --release -p campaign --test attainable -- --ignored --nocapture`.
#[test]
#[ignore = "minutes"]
fn val_brute_force_finds_no_landing_outside_the_windows_of_hundreds_of_flights() {
    for (mission, dispersion, flights) in [
        ("mk2", "harsh", 150),
        ("mk2", "field", 60),
        ("mk2", "real", 60),
        ("mk2-h53", "field", 30),
        ("mini-f10", "field", 30),
    ] {
        eprintln!("{mission} {dispersion}");
        agrees(&compared(mission, dispersion, 11, 0..flights), 0.1);
    }
}

#[test]
#[ignore = "a look at the windows"]
fn show() {
    for (mission, dispersion) in [
        ("mk2", "field"),
        ("mk2", "harsh"),
        ("mk2", "real"),
        ("mk2", "real-harsh"),
        ("mk2-h53", "field"),
        ("mini-f10", "field"),
    ] {
        let recipe = Recipe::built_in(mission, dispersion).unwrap();
        let begin = std::time::Instant::now();
        let n = 1000;
        let w: Vec<Option<Window>> = (0..n)
            .map(|k| window(&recipe.mission, &draw(&recipe.mission, &recipe.dispersion, 11, k)))
            .collect();
        let ms = begin.elapsed().as_secs_f64() * 1e3 / n as f64;
        let some: Vec<Window> = w.iter().flatten().copied().collect();
        eprintln!(
            "{mission} {dispersion}: {ms:.2} ms, {} windows, best {:?}",
            some.len(),
            campaign::attainable::best_height_m(&some)
        );
        eprintln!("{:?}", &w[..6]);
    }
}
