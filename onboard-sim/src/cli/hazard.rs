//! `onboard-sim hazard`: safe distances of people.

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;
use flight::rules::verdict::Landing;
use flight::vehicle::mission::{Mission, StartPoint};
use onboard_sim::files::NewFile;
use onboard_sim::hazard::{
    self, Case, Flights, Impact, Radius, Rule, exclusion_m, landed_as_planned, widest,
};
use onboard_sim::statistics::Landings;
use protocol::program::{Exit, in_range};
use serde_json::{Value, json};
use sim::dispersion::is_more_benign;
use sim::recipe::Recipe;

use super::{MeanWinds, Selection, answer, on_threads, show_flights};

#[derive(Args)]
pub(crate) struct HazardArguments {
    #[command(flatten)]
    selection: Selection,
    /// Where the flights begin: pad, apogee or drone [default: pad if the mission has a booster,
    /// else the mission's].
    #[arg(long, value_name = "START")]
    start: Option<StartPoint>,
    #[command(flatten)]
    mean_winds: MeanWinds,
    /// Flights in each wind of every failure mode, by which those are found that come down
    /// farthest. One that has not come half as far as the farthest ends after 25.
    #[arg(long, default_value_t = 100, value_name = "N", value_parser = in_range(1..=100_000_u64))]
    flights: u64,
    /// Flights in each wind of the failure modes that come down farthest. 368 are needed for an
    /// upper end of the interval.
    #[arg(long, default_value_t = 368, value_name = "N", value_parser = in_range(1..=100_000_u64))]
    hazard_flights: u64,
    /// Write where each flight came down (CSV).
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Answer in JSON.
    #[arg(long)]
    json: bool,
    /// Write the answer into this file.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(crate) fn run(arguments: &HazardArguments) -> anyhow::Result<Exit> {
    let (winds_m_s, recipes): (Vec<f64>, Vec<Recipe>) = recipes(arguments)?.into_iter().unzip();
    let Some(Recipe { mission, dispersion, .. }) = recipes.first() else { anyhow::bail!("--wind is empty") };
    let cases = Case::of(mission);
    let flights = Flights { survey: arguments.flights, of_widest: arguments.hazard_flights };
    let impacts =
        on_threads(arguments.selection.jobs, || Ok(hazard::studies(&recipes, flights, &show_flights())?))?;
    let rule = Rule::of(mission);
    let wind = dispersion.wind_over_height();
    let study = Study { arguments, mission, cases: &cases, winds_m_s: &winds_m_s, wind, impacts: &impacts };
    let mut text = Vec::new();
    study.write_text(&rule, &mut text)?;
    let answer = answer(arguments.json.then(|| study.json(&rule)), &String::from_utf8_lossy(&text));
    match &arguments.out {
        Some(path) => drop(NewFile::create(path)?.fill(|file| file.write_all(answer.as_bytes()))?),
        None => std::io::stdout().lock().write_all(answer.as_bytes())?,
    }
    if let Some(path) = &arguments.csv {
        let csv = study.csv()?;
        NewFile::create(path)?.fill(|file| file.write_all(&csv))?;
    }
    Ok(Exit::Yes)
}

/// The mission in each wind.
fn recipes(arguments: &HazardArguments) -> anyhow::Result<Vec<(f64, Recipe)>> {
    let mut recipe = arguments.selection.recipe(arguments.start)?;
    if arguments.start.is_none() && recipe.mission.launch.is_some() {
        recipe = recipe.starting_at(StartPoint::Pad)?;
    }
    arguments.mean_winds.applied(&recipe)
}

/// The flights with their arguments.
struct Study<'a> {
    arguments: &'a HazardArguments,
    mission: &'a Mission,
    cases: &'a [Case],
    winds_m_s: &'a [f64],
    /// The mean wind over height, in words.
    wind: String,
    /// In each wind.
    impacts: &'a [Vec<Impact>],
}

impl Study<'_> {
    fn json(&self, rule: &Rule) -> Value {
        let HazardArguments { selection: Selection { dispersion, seed, .. }, .. } = self.arguments;
        let Mission { name, start, gate, .. } = self.mission;
        let winds = self.winds_m_s.iter().zip(self.impacts);
        let winds: Vec<Value> =
            winds.map(|(wind_m_s, impacts)| hazard::json(*wind_m_s, impacts, rule)).collect();
        json!({
            "mission": name, "start": start.at.name(), "dispersion": dispersion, "seed": seed, "winds": winds,
            "rule_m": rule.distance_m(), "fence_m": gate.fence_radius_m,
        })
    }

    fn write_text(&self, rule: &Rule, out: &mut impl std::io::Write) -> std::io::Result<()> {
        let HazardArguments { selection: Selection { dispersion, seed, .. }, .. } = self.arguments;
        let (winds_m_s, wind) = (self.winds_m_s, &self.wind);
        let Mission { name, site, gate, .. } = self.mission;
        let start = match self.mission.start.at {
            StartPoint::Apogee => "apogee; how it got there is not in it",
            other => other.name(),
        };
        writeln!(
            out,
            "{name} from {start}: where it comes down, m from the pad. Simulated, not flown.\nSite: {site}.\nWind: {wind}."
        )?;
        writeln!(
            out,
            "Set `{dispersion}`{}, seed {seed}; mean wind 10 m above the ground. A cell: the radius that holds 99 % of the flights,\n\
             (its 95 % interval by order statistics; ?: too few flights for an upper end), the farthest; number of flights.\n",
            if is_more_benign(dispersion) { ", which may be kinder than `real`" } else { "" }
        )?;
        let of_each = |cell: &dyn Fn(&Vec<Impact>) -> String| {
            self.impacts.iter().map(|impacts| format!("{:<29}", cell(impacts))).collect::<Vec<_>>().concat()
        };
        let heads = winds_m_s.iter().map(|wind_m_s| format!("{:<29}", format!("{wind_m_s} m/s")));
        writeln!(out, "{:<26}{}", "", heads.collect::<Vec<_>>().concat())?;
        for case in self.cases {
            let cells = of_each(&|impacts| cell(Radius::of_case(impacts, *case).as_ref()));
            writeln!(out, "{:<26}{cells}", case.name())?;
        }
        let apogee = |impacts: &Vec<Impact>| {
            let planned = impacts.iter().filter(|impact| impact.case == Case::AsPlanned);
            let highest_m = planned.map(|impact| impact.course.highest_m);
            let [low_m, high_m] =
                highest_m.fold([f64::INFINITY, 0.0], |[low, high], m| [f64::min(low, m), f64::max(high, m)]);
            format!("{low_m:.0} to {high_m:.0}")
        };
        let landed = |impacts: &Vec<Impact>| {
            let Landings { stands, envelope, .. } = landed_as_planned(impacts);
            format!("{} of {}, {} inside", stands.count, stands.of, envelope.count)
        };
        writeln!(out, "\n{:<26}{}", "stand, inside the envelope", of_each(&landed))?;
        writeln!(out, "{:<26}{}", "apogee, m", of_each(&apogee))?;
        writeln!(out, "\nRule   {rule}\n       ({})", Rule::SOURCE)?;
        writeln!(
            out,
            "Fence  {:.0} m: the vehicle lights its landing motor only inside; it holds nothing else back",
            gate.fence_radius_m
        )?;
        for (wind_m_s, impacts) in winds_m_s.iter().zip(self.impacts) {
            if let Some((case, radius)) = widest(impacts) {
                let apart = exclusion_m(&radius, rule);
                let end =
                    if radius.high_m.is_none() { " at least: too few flights for an upper end;" } else { "" };
                writeln!(out, "{wind_m_s:>4} m/s: nobody within {apart:.0} m;{end} widest: {}", case.name())?;
            }
        }
        if self.mission.start.at == StartPoint::Pad {
            writeln!(
                out,
                "\nNot in it: a launcher that tips, a motor that bursts, a stack that is not stable, pieces; the booster under its own \
                 parachute\n(the mission has no data of it: with the vehicle's sink it drifts as the vehicle does)."
            )?;
        }
        Ok(())
    }

    fn csv(&self) -> anyhow::Result<Vec<u8>> {
        let mut table = csv::Writer::from_writer(Vec::new());
        let columns = ["wind_m_s", "way", "flight", "x_m", "y_m", "downwind_m", "across_m"];
        table.write_record(columns.iter().chain(&Landing::COLUMNS))?;
        for (wind_m_s, impacts) in self.winds_m_s.iter().zip(self.impacts) {
            for impact in impacts {
                let Impact { case, number, place_m, landing, .. } = impact;
                let two =
                    |m: Option<[f64; 2]>| m.map_or_else(Default::default, |m| m.map(|m| format!("{m:.2}")));
                let ([x, y], in_wind) = (two(*place_m), two(impact.in_wind_m()));
                let wind = wind_m_s.to_string();
                table.serialize((wind, case.name(), number, x, y, in_wind, landing.flags()))?;
            }
        }
        Ok(table.into_inner()?)
    }
}

fn cell(radius: Option<&Radius>) -> String {
    radius.map_or_else(String::new, |radius| {
        let high = radius.high_m.map_or_else(|| "?".to_owned(), |high_m| format!("{high_m:.0}"));
        format!(
            "{:.0} ({:.0} to {high}) {:.0}; {}",
            radius.holds_m, radius.low_m, radius.farthest_m, radius.flights
        )
    })
}
