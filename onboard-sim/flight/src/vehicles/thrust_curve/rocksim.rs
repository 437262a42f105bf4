//! `RockSim` motor files: XML with one `engine` element. Its attributes hold the data (mm, g), its
//! `eng-data` elements the points (s, N).

use alloc::borrow::ToOwned as _;
use alloc::string::ToString as _;
use alloc::vec::Vec;

use crate::vehicle::thrust_curve::MotorData;
use roxmltree::{Document, Node};

use super::{ThrustCurveError, bad, check_masses, not_negative, push_point};

/// The data, and the line of the engine.
pub(super) fn parse(text: &str) -> Result<(MotorData, usize), ThrustCurveError> {
    let document = Document::parse(text).map_err(|error| ThrustCurveError::Xml(error.to_string()))?;
    let mut engines = document.descendants().filter(|node| node.has_tag_name("engine"));
    let engine = engines.next().ok_or(ThrustCurveError::Missing {
        what: "the engine element",
        required: "a RockSim file holds one <engine> with its <eng-data> points",
    })?;
    if let Some(second) = engines.next() {
        return Err(bad(line_of(&second), "engine", "a second engine", "one motor a file is accepted"));
    }
    let line = line_of(&engine);
    let number = |name: &'static str| not_negative(line, name, attribute(&engine, name)?);
    let propellant_mass_kg = number("propWt")? / 1000.0;
    let total_mass_kg = number("initWt")? / 1000.0;
    check_masses(line, propellant_mass_kg, total_mass_kg)?;
    let mut points = Vec::new();
    for point in engine.descendants().filter(|node| node.has_tag_name("eng-data")) {
        push_point(&mut points, line_of(&point), attribute(&point, "t")?, attribute(&point, "f")?)?;
    }
    let impulse_n_s: f64 = points
        .windows(2)
        .map(|at| 0.5 * (at[0].thrust_n + at[1].thrust_n) * (at[1].time_s - at[0].time_s))
        .sum();
    if let Some(stated) = engine.attribute("Itot") {
        let stated_n_s = not_negative(line, "Itot", stated)?;
        if !(0.5..=2.0).contains(&(stated_n_s / impulse_n_s)) && stated_n_s > 0.0 {
            return Err(bad(line, "Itot", stated, "half to twice the impulse of the points is accepted"));
        }
    }
    let data = MotorData {
        name: attribute(&engine, "code")?.to_owned(),
        manufacturer: engine.attribute("mfg").unwrap_or_default().to_owned(),
        diameter_m: number("dia")? / 1000.0,
        length_m: number("len")? / 1000.0,
        propellant_mass_kg,
        total_mass_kg,
        points,
    };
    Ok((data, line))
}

fn attribute<'a>(node: &Node<'a, '_>, name: &'static str) -> Result<&'a str, ThrustCurveError> {
    node.attribute(name).ok_or_else(|| bad(line_of(node), name, "", "the attribute must be there"))
}

fn line_of(node: &Node) -> usize {
    node.document().text_pos_at(node.range().start).row as usize
}
