//! The lines of the field that a mission names: read beside its file, and stored in logs.

use std::path::Path;

pub use avionics::link::vehicle::pad_of;
use protocol::field::{Field, FieldError};

use crate::recipe::Recipe;

/// The fact about a run with the text of its field.
pub const RUN_FACT: &str = "field";
/// The fact about a run with the latitude and longitude of its pad, degrees, beside its field: a
/// station's log has no mission.
pub const PAD_FACT: &str = "pad";

/// This recipe with the field that its mission names, whose file is at this path.
///
/// # Errors
/// The file cannot be read, or is no field around the pad.
pub fn with_field(recipe: Recipe, mission_path: &str) -> Result<Recipe, FieldError> {
    let Some(file) = &recipe.mission.field_file else { return Ok(recipe) };
    let text = Field::text_of(file, Path::new(mission_path))?;
    Field::parse(&text, pad_of(&recipe.mission), file)?;
    Ok(Recipe { field: Some(text), ..recipe })
}

/// The field of a recipe.
pub fn field_of(recipe: &Recipe) -> Option<Field> {
    Field::parse(recipe.field.as_ref()?, pad_of(&recipe.mission), RUN_FACT).ok()
}
