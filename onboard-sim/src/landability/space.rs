//! Where a mission lands, in space, from its own start.
//!
//! A cell differs from the mission's nominal flight in two values alone: the draw of one flight number is the same in every
//! cell.

use campaign::attainable::onset_window;
use flight::guidance::baseline::Law;
use flight::vehicle::mission::Mission;
use sim::draw::{Draw, draw};
use sim::recipe::Recipe;
use sim::sortie::{SetUpError, Sortie};

use super::{Axis, Cell, Finding, Map, MapError, Quantity, check, map_of};

/// What a map of a mission asks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Question {
    /// Whether the mission's own guidance lands it, inside the limits of the legs: a simulated flight for each cell.
    Flown,
    /// Whether a clairvoyant could ([`campaign::attainable`]): an upper bound, in vertical motion alone.
    Attainable,
}

/// What each question can be asked over.
const FLOWN: &[Quantity] =
    &[Quantity::IgnitionHeight, Quantity::ThrustScale, Quantity::Wind, Quantity::Tilt, Quantity::Height];
/// The bound knows no wind and no attitude.
const ATTAINABLE: &[Quantity] = &[Quantity::IgnitionHeight, Quantity::ThrustScale, Quantity::Height];

/// Computes a mission's map on `jobs` threads; `progress` is called with the cells done, from any of them.
///
/// # Errors
/// The axes do not suit the question, a cell cannot be flown, or a thread could not be started.
pub fn map(
    recipe: &Recipe,
    question: Question,
    axes: [Axis; 2],
    jobs: usize,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Map, MapError> {
    let (possible, bound) = match question {
        Question::Flown => (FLOWN, ""),
        Question::Attainable => (ATTAINABLE, "what is attainable with "),
    };
    check(&format!("{bound}{}", recipe.mission.name), axes, possible)?;
    map_of(axes, jobs, progress, |x, y| cell(recipe, question, axes, [x, y]))
}

fn cell(recipe: &Recipe, question: Question, axes: [Axis; 2], values: [f64; 2]) -> Result<Cell, SetUpError> {
    /// Any: the draw is the same in all cells.
    const NUMBER: u64 = 0;
    let Recipe { mut mission, mut dispersion, .. } = recipe.clone();
    let values = || axes.into_iter().map(|axis| axis.quantity).zip(values);
    for (quantity, value) in values() {
        if quantity == Quantity::Wind {
            dispersion.wind_m_s = [value; 2];
        }
        put_into_mission(quantity, value, &mut mission);
    }
    let mut drawn = draw(&mission, &dispersion, recipe.seed, NUMBER);
    for (quantity, value) in values() {
        put_into_draw(quantity, value, &mut drawn);
    }
    let mut flight = Sortie::drawn_as(&mission, &dispersion, &drawn, Law::of(recipe.controller, &mission))?;
    if question == Question::Attainable {
        let window = onset_window(&mission, flight.drawn(), flight.fell_from());
        // Without a height on an axis the clairvoyant chooses the best one.
        let lands = window.is_some_and(|window| {
            mission.ignition.fixed_height_m.is_none_or(|height_m| window.contains(height_m))
        });
        let finding = if lands { Finding::Lands } else { Finding::NotLandable };
        return Ok(Cell { finding, touchdown_speed_m_s: f64::NAN });
    }
    let outcome = flight.run();
    Ok(Cell {
        finding: if outcome.legs { Finding::Lands } else { Finding::Misses },
        touchdown_speed_m_s: outcome.touchdown.map_or(f64::NAN, |touchdown| touchdown.vertical_m_s.abs()),
    })
}

fn put_into_mission(quantity: Quantity, value: f64, mission: &mut Mission) {
    match quantity {
        Quantity::IgnitionHeight => mission.ignition.fixed_height_m = Some(value),
        Quantity::Height => {
            mission.start.height_m = value;
            if let Some(drop) = &mut mission.drop {
                drop.height_m = value;
            }
        }
        Quantity::Tilt => mission.start.tilt_deg = value,
        _ => {}
    }
}

/// Below a drone the tilt is that of the swing.
fn put_into_draw(quantity: Quantity, value: f64, drawn: &mut Draw) {
    match quantity {
        Quantity::ThrustScale => drawn.truth.impulse_scale *= value,
        Quantity::Tilt => {
            if let Some(hanging) = &mut drawn.hanging {
                hanging.swing_rad = value.to_radians();
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mapped(mission: &str, question: Question, x: &str, y: &str, jobs: usize) -> Map {
        let recipe = Recipe::built_in(mission, "none").unwrap();
        map(&recipe, question, [x.parse().unwrap(), y.parse().unwrap()], jobs, &|_| ()).unwrap()
    }

    fn findings(map: &Map) -> Vec<Finding> {
        map.cells.iter().map(|cell| cell.finding).collect()
    }

    /// The nominal motor lands, half of one and a storm do not; the map does not depend on the number of jobs.
    #[test]
    fn a_mission_in_a_plane_and_one_in_space_are_flown() {
        use Finding::{Lands, Misses};
        for mission in ["mk2", "vlr"] {
            let flown = |jobs| mapped(mission, Question::Flown, "thrust-scale=0.5:1:2", "wind=0:30:2", jobs);
            let map = flown(2);
            assert_eq!(findings(&map), [Misses, Lands, Misses, Misses], "{mission}");
            assert!(map.cells[1].touchdown_speed_m_s < 1.0, "{mission}: {map:?}");
            assert_eq!(findings(&flown(1)), findings(&map));
        }
    }

    /// What is flown and lands is inside the clairvoyant's bound, and an ignition at 10 m is too late for both.
    #[test]
    fn val_bound_what_the_guidance_lands_is_attainable() {
        let (x, y) = ("thrust-scale=0.9:1.1:3", "ignition-height=10:70:4");
        let flown = mapped("mk2", Question::Flown, x, y, 2);
        let attainable = mapped("mk2", Question::Attainable, x, y, 2);
        assert!(flown.count(Finding::Lands) > 0, "{flown:?}");
        for (place, (flown, bound)) in flown.cells.iter().zip(&attainable.cells).enumerate() {
            let lands = flown.finding == Finding::Lands;
            assert!(!lands || bound.finding == Finding::Lands, "cell {place}");
            assert!(place >= 3 || bound.finding == Finding::NotLandable, "cell {place}");
        }
    }

    #[test]
    fn a_quantity_that_means_nothing_is_refused_with_those_that_do() {
        let recipe = Recipe::built_in("mk2", "none").unwrap();
        let refused = |x: &str, question| {
            let axes = [x.parse().unwrap(), "thrust-scale=0.9:1.1:2".parse().unwrap()];
            map(&recipe, question, axes, 1, &|_| ()).unwrap_err().to_string()
        };
        assert_eq!(
            refused("speed=1:2:2", Question::Flown),
            "mk2 cannot be mapped over speed; it can over ignition-height, thrust-scale, wind, tilt, height"
        );
        assert_eq!(
            refused("wind=1:2:2", Question::Attainable),
            "what is attainable with mk2 cannot be mapped over wind; it can over ignition-height, thrust-scale, height"
        );
        assert_eq!(
            refused("thrust-scale=1:2:2", Question::Flown),
            "both axes vary thrust-scale; choose two quantities"
        );
    }
}
