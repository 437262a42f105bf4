//! The lines of the field on card and check: the crowd line beside the radius without people.

use protocol::field::Kind;
use sim::recipe::Recipe;
use sim::wire::field::{field_of, pad_of};

use crate::check::{Row, Verdict};
use crate::hazard::Rule;

/// Distance of the crowd line from the pad, m, if the field has one.
fn crowd_m(recipe: &Recipe) -> Option<f64> {
    field_of(recipe)?.nearest_m(Kind::CrowdLine, pad_of(&recipe.mission), (0.0, 0.0))
}

/// The lines by the class of their drawing, as points north and east of the pad, m.
pub fn lines_m(recipe: &Recipe) -> Vec<(&'static str, Vec<(f64, f64)>)> {
    let class = |kind| match kind {
        Kind::CrowdLine => "crowd",
        Kind::Road => "road",
        Kind::Trees => "trees",
        Kind::Boundary | Kind::LandingArea => "area",
    };
    let field = field_of(recipe);
    let lines = field.iter().flat_map(|field| field.lines_m(pad_of(&recipe.mission)));
    lines.map(|(kind, points)| (class(kind), points)).collect()
}

/// The crowd line beside the exclusion radius of rule and fence; `None` without a field.
pub fn crowd(recipe: &Recipe) -> Option<Row> {
    const WHAT: &str = "crowd";
    recipe.field.as_ref()?;
    let required_m = Rule::of(&recipe.mission).distance_m().max(recipe.mission.gate.fence_radius_m);
    let beside = format!("{required_m:.0} m, by rule and fence; card: by flights");
    let Some(found_m) = crowd_m(recipe) else {
        let change = Some("a line of kind `crowd line` in the field".to_owned());
        let (found, verdict) = ("the field has no crowd line".to_owned(), Verdict::Tight);
        return Some(Row { what: WHAT, found, beside, verdict, change });
    };
    let crossed = found_m < required_m;
    let verdict = if crossed { Verdict::No } else { Verdict::Ok };
    let change = crossed.then(|| format!("the crowd {:.0} m farther away", (required_m - found_m).ceil()));
    Some(Row { what: WHAT, found: format!("crowd line at {found_m:.0} m"), beside, verdict, change })
}

/// The alarm of a card whose radius without people, m, crosses the crowd line.
pub fn crowd_alarm(recipe: &Recipe, people_m: f64) -> Option<String> {
    let found_m = crowd_m(recipe).filter(|found_m| *found_m < people_m)?;
    Some(format!(
        "DO NOT FLY: the crowd line is {found_m:.0} m from the pad, inside the {people_m:.0} m within which nobody may stand."
    ))
}
