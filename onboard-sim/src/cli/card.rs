//! `onboard-sim card`: the page that a team takes to the field.

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;
use onboard_sim::card::Card;
use onboard_sim::files::{new_folder, write_folder};
use onboard_sim::hazard::Flights;
use protocol::program::{Exit, in_range};

use super::{MeanWinds, Selection, answer, on_threads, show_flights};

/// Most flights of a card.
const CARD_FLIGHTS_MAX: u64 = 10_000;

#[derive(Args)]
pub(crate) struct CardArguments {
    #[command(flatten)]
    selection: Selection,
    #[command(flatten)]
    mean_winds: MeanWinds,
    /// Where the wind of the day comes from, degrees clockwise from north: the plan has north up
    /// and the line downwind. By default downwind is up.
    #[arg(long, value_name = "DEG", value_parser = degrees)]
    wind_from: Option<f64>,
    /// Flights in each wind of every failure mode; one that has not come half as far as the
    /// farthest ends after 25. Fewer than 100 give neither a rate nor a radius.
    #[arg(long, default_value_t = 100, value_name = "N", value_parser = in_range(1..=CARD_FLIGHTS_MAX))]
    flights: u64,
    /// Flights in each wind of the failure modes that come down farthest. Below 368 the interval
    /// has no upper end.
    #[arg(long, default_value_t = 368, value_name = "N", value_parser = in_range(1..=CARD_FLIGHTS_MAX))]
    hazard_flights: u64,
    /// Folder of the card; one that exists is kept, and the card gets the next free name.
    #[arg(long, default_value = "card", value_name = "DIR")]
    out: PathBuf,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &CardArguments) -> anyhow::Result<Exit> {
    let recipe = arguments.selection.recipe(None)?;
    let winds = arguments.mean_winds.applied(&recipe)?;
    let survey = arguments.flights;
    let flights = Flights { survey, of_widest: arguments.hazard_flights.max(survey) };
    let card = on_threads(arguments.selection.jobs, || {
        Ok(Card::new(&recipe, winds, flights, arguments.wind_from, &show_flights())?)
    })?;
    let (page, json) = (card.text(), arguments.json.then(|| card.json()));
    let (out, _held) = new_folder(&arguments.out)?;
    let [html, mission] = [card.html(), card.recipe.mission_toml];
    write_folder(&out, &[("card.html", &html), ("card.txt", &page), ("mission.toml", &mission)])?;
    let page = format!("{page}card {}\n", out.join("card.html").display());
    write!(std::io::stdout().lock(), "{}", answer(json, &page))?;
    Ok(Exit::Yes)
}

/// A direction.
fn degrees(text: &str) -> Result<f64, String> {
    in_range(0.0..=360.0)(text).map_err(|_range| format!("`{text}` is not a direction of 0 to 360 degrees"))
}
