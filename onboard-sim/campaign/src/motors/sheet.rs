//! What stands on a card, as text and as HTML. Both show the same sheet.

use core::fmt::{self, Write};

use flight::vehicle::atmosphere::Air;
use flight::vehicle::mission::StartPoint;
use sim::dispersion::may_be_kinder;

use super::card::{Card, Hazard};
use super::ranking::Flown;
use crate::hazard::{Rule, keep_out_m};

/// A card's content.
pub(super) struct Sheet {
    pub(super) title: String,
    pub(super) subtitle: String,
    pub(super) sections: Vec<Section>,
    /// To be ticked off, in order.
    pub(super) checks: Vec<String>,
    pub(super) notes: Vec<String>,
}

pub(super) struct Section {
    pub(super) title: &'static str,
    /// What, its value, and a remark.
    pub(super) rows: Vec<[String; 3]>,
}

fn row(what: &str, value: String, remark: impl Into<String>) -> [String; 3] {
    [what.to_owned(), value, remark.into()]
}

/// A share with its interval.
fn rate(flown: &Flown) -> String {
    let legs = flown.legs;
    format!(
        "{} of {}: {:.0} % ({:.0} to {:.0})",
        legs.count,
        legs.of,
        100.0 * legs.share,
        100.0 * legs.low,
        100.0 * legs.high
    )
}

fn most_frequent(flown: &Flown) -> String {
    flown.failure.as_ref().map_or_else(String::new, |(reason, count)| {
        let of = flown.legs.of - flown.legs.count;
        format!("not landed: {of}, of them {count} by {reason}")
    })
}

impl Card {
    pub(super) fn sheet(&self) -> Sheet {
        let choice = &self.landing.choice;
        let curve = &self.landing.candidate.curve;
        Sheet {
            title: format!("Landing card: {}", self.recipe.mission.name),
            subtitle: format!(
                "{}, {:.3} kg, {} m/s of wind, set {}{}. Simulated, not flown.",
                self.landing.candidate.name(),
                choice.mass.loaded_kg,
                self.winds.today_m_s,
                self.set,
                if may_be_kinder(&self.set) { " (which may be kinder than real)" } else { "" }
            ),
            sections: vec![self.vehicle(), self.heights(), self.wind(), self.people(), self.margins()],
            checks: self.checks(),
            notes: vec![
                format!(
                    "Motor: {}, {:.1} N s in {:.2} s, peak {:.1} N; {:.1} g of propellant in {:.1} g, {:.0} x {:.0} mm; data: {}.",
                    self.landing.candidate.name(),
                    curve.total_impulse_n_s(),
                    curve.burn_time_s(),
                    curve.peak_thrust_n(),
                    1e3 * curve.propellant_mass_kg(),
                    1e3 * curve.total_mass_kg(),
                    1e3 * curve.diameter_m(),
                    1e3 * curve.length_m(),
                    self.landing.candidate.origin
                ),
                format!(
                    "The same flights again: onboard-sim campaign --profile mission.toml --dispersion day.toml --seed {} \
                     --flights {} --out flights",
                    self.recipe.seed, self.winds.today.legs.of
                ),
                format!(
                    "Distances of people: {}. The fence of the mission ({:.0} m) only decides whether the landing motor may light.",
                    Rule::SOURCE,
                    self.recipe.mission.gate.fence_radius_m
                ),
                "A rate is the share of simulated flights that landed on their legs, with Wilson's 95 % \
                 interval. More flights make it narrower; only flights make it true."
                    .to_owned(),
            ],
        }
    }

    fn vehicle(&self) -> Section {
        let choice = &self.landing.choice;
        let (mass, ballast) = (&choice.mass, &choice.ballast);
        let motor_kg = self.landing.candidate.curve.total_mass_kg();
        let empty_kg = mass.loaded_kg - motor_kg;
        let empty_cg_m =
            (mass.loaded_kg * mass.loaded_cg_station_m - motor_kg * mass.propellant_station_m) / empty_kg;
        let ballast_words = match ballast.mass_kg {
            0.0 => "none".to_owned(),
            mass_kg if mass_kg < 0.0 => format!("take out {:.3} kg", -mass_kg),
            mass_kg => format!("add {mass_kg:.3} kg"),
        };
        Section {
            title: "Set before the flight",
            rows: vec![
                row(
                    "Mass, motor in",
                    format!("{:.3} kg", mass.loaded_kg),
                    format!("{empty_kg:.3} kg without the motor"),
                ),
                row(
                    "Balance, motor in",
                    format!("{:.0} mm above the nozzle", 1e3 * mass.loaded_cg_station_m),
                    format!("centre of gravity; {:.0} mm without the motor", 1e3 * empty_cg_m),
                ),
                row(
                    "Ballast",
                    ballast_words,
                    format!(
                        "at {:.0} mm; the airframe without motor and ballast is {:.3} kg",
                        1e3 * ballast.station_m,
                        self.frame.mass_kg()
                    ),
                ),
                row("Load", "mission.toml".to_owned(), format!("mission {}", self.recipe.mission.name)),
            ],
        }
    }

    fn heights(&self) -> Section {
        let choice = &self.landing.choice;
        let window = &choice.window;
        let command_m = window.onset_m + self.recipe.mission.ignition.delay_s * window.speed_m_s;
        let mut rows = vec![
            row(
                "Apogee or drop",
                format!("{:.0} m above the pad", choice.start_height_m),
                "height of the centre of gravity at rest",
            ),
            row(
                "Ignition command, about",
                format!("{command_m:.0} m above the ground"),
                format!("height of the feet, falling at {:.1} m/s; the computer decides", window.speed_m_s),
            ),
            row(
                "Thrust begins, about",
                format!("{:.0} m", window.onset_m),
                format!(
                    "a landing exists from {:.1} to {:.1} m",
                    window.heights.low_m, window.heights.high_m
                ),
            ),
        ];
        if let Some(bound) = self.attainable {
            rows.push(row(
                "No controller lands it",
                format!("below {:.1} or above {:.1} m", bound.low_m, bound.high_m),
                "ignition command, certified motor, still air",
            ));
        }
        Section { title: "Heights", rows }
    }

    fn wind(&self) -> Section {
        let winds = &self.winds;
        let limit = match winds.steady_m_s {
            None => "lands in no wind that was tried".to_owned(),
            Some(wind_m_s) if wind_m_s >= winds.steady_tried_m_s => {
                format!("above {wind_m_s:.0} m/s, not tried")
            }
            Some(wind_m_s) => format!("{wind_m_s:.0} m/s"),
        };
        Section {
            title: "Wind and expected rate",
            rows: vec![
                row(
                    &format!("Lands at {} m/s in {}", winds.today_m_s, self.set),
                    rate(&winds.today),
                    most_frequent(&winds.today),
                ),
                row(
                    &format!("Lands at {} m/s in {}", winds.windier_m_s, self.set),
                    rate(&winds.windier),
                    most_frequent(&winds.windier),
                ),
                row(
                    "Hard limit, steady wind",
                    limit,
                    "the vehicle exactly as in its data, no gusts; a real one stops earlier",
                ),
                row(
                    "Do not fly above",
                    format!("{} m/s", winds.limit_m_s()),
                    format!(
                        "mean wind 10 m above the ground; above it fewer of the {} and {} flights in {} land, or none was flown",
                        winds.today.legs.of, winds.windier.legs.of, self.set
                    ),
                ),
            ],
        }
    }

    fn people(&self) -> Section {
        let Hazard { wind_m_s, survey, way, radius, rule } = &self.hazard;
        let high = radius.high_m.map_or_else(|| "no upper end".to_owned(), |high_m| format!("{high_m:.0}"));
        let from_apogee =
            self.recipe.mission.launch.is_none() && self.recipe.mission.start.at == StartPoint::Apogee;
        let not_in_it = if from_apogee { "; the way up to apogee is not in it" } else { "" };
        Section {
            title: "Where people stand",
            rows: vec![
                row(
                    "Nobody within",
                    self.keep_out(),
                    format!("of the pad: the largest of the three below, rounded up{not_in_it}"),
                ),
                row(
                    &format!("99 % down within, {wind_m_s} m/s"),
                    format!("{:.0} m ({:.0} to {high})", radius.holds_m, radius.low_m),
                    format!(
                        "{} flights of {}, seed {}: {}, the way of ending that reached farthest",
                        radius.flights,
                        self.set,
                        self.recipe.seed,
                        way.name()
                    ),
                ),
                row(
                    "Farthest flight",
                    format!("{:.0} m", radius.farthest_m),
                    format!(
                        "of these; of each other way {survey} were flown: `onboard-sim hazard` flies more"
                    ),
                ),
                row(
                    "Rule of NAR",
                    format!("{:.0} m ({:.0} ft)", libm::ceil(rule.distance_m()), rule.feet),
                    format!(
                        "{:.0} N s, {}",
                        rule.impulse_n_s,
                        if rule.complex { "complex" } else { "one motor" }
                    ),
                ),
            ],
        }
    }

    /// The distance of people, in words.
    fn keep_out(&self) -> String {
        let at_least = if self.hazard.radius.high_m.is_none() { "at least " } else { "" };
        format!("{at_least}{:.0} m", keep_out_m(&self.hazard.radius, &self.hazard.rule))
    }

    fn margins(&self) -> Section {
        let choice = &self.landing.choice;
        let window = &choice.window;
        let impulse_n_s = self.landing.candidate.curve.total_impulse_n_s();
        let [low, high] = window.impulse_scales;
        Section {
            title: "What may differ",
            rows: vec![
                row(
                    "Impulse of the motor",
                    format!("{:+.1} to {:+.1} %", 100.0 * (low - 1.0), 100.0 * (high - 1.0)),
                    format!(
                        "{:.1} to {:.1} N s, all else as in the data",
                        low * impulse_n_s,
                        high * impulse_n_s
                    ),
                ),
                row(
                    "Mass, certified motor",
                    format!("{:.3} to {:.3} kg", choice.landing_kg[0], choice.landing_kg[1]),
                    "outside no landing exists; the flights above differ by what their dispersions say",
                ),
                row(
                    "Scatter it stands",
                    format!("{:.2}", window.scatter),
                    "impulse, burn time and igniter at once, over what the mission plans for; 1 and more is good",
                ),
            ],
        }
    }

    fn checks(&self) -> Vec<String> {
        let choice = &self.landing.choice;
        let (mission, airframe) = (&self.recipe.mission, &self.recipe.mission.airframe);
        let chute = &airframe.parachute;
        let density_kg_m3 = Air::at_height_m(mission.pad_altitude_m).density_kg_m3;
        let lift_kg_m = density_kg_m3 * chute.drag_coefficient * chute.area_m2;
        let chute_m_s = libm::sqrt(2.0 * choice.mass.loaded_kg * mission.gravity_m_s2 / lift_kg_m);
        let igniters = if airframe.igniter.scatter_scale < 1.0 { "every igniter" } else { "the igniter" };
        let mut checks = vec![
            format!("Weigh the vehicle with its motor: {:.3} kg, to 5 g.", choice.mass.loaded_kg),
            format!(
                "Balance it on an edge: {:.0} mm above the nozzle, to 3 mm.",
                1e3 * choice.mass.loaded_cg_station_m
            ),
            format!(
                "Read the label of the motor: {}. No other delay grain, no ejection charge.",
                self.landing.candidate.name()
            ),
            format!("Measure the continuity of {igniters}; the pin stays in until the pad is clear."),
            "Move fins and gimbal through their travel; each returns to its mark.".to_owned(),
            "Load mission.toml; the ground station shows its name and no failed self-test.".to_owned(),
            format!(
                "Measure the wind for ten minutes: mean below {} m/s.",
                self.winds.limit_m_s()
            ),
            format!("Nobody within {} of the pad, up to {} m/s of wind.", self.keep_out(), self.hazard.wind_m_s),
            format!("Parachute packed: {chute_m_s:.1} m/s under the canopy at this mass."),
            "After the flight: a motor that was not lit is live. Nobody approaches for 60 s; then the pin first."
                .to_owned(),
        ];
        if let Some(crush) = airframe.legs.crush {
            checks.insert(2, format!(
                "Each leg: its block new and unmarked, its foot free to rise by {:.0} mm. A block that has given way is replaced.",
                1e3 * crush.stroke_m
            ));
        }
        checks
    }
}

/// The style of the page: one sheet of A4 in black and white, readable in the sun.
const STYLE: &str = "@page{size:A4;margin:12mm}body{font:13px/1.35 sans-serif;max-width:186mm;margin:0 auto;color:#000}\
h1{font-size:20px;margin:6px 0 0}p{margin:2px 0 6px}h2{font-size:14px;margin:10px 0 2px;border-bottom:1px solid #000}\
table{border-collapse:collapse;width:100%}td{padding:2px 6px 2px 0;vertical-align:top}td:first-child{width:25%}\
td.v{font-weight:bold;width:29%}td.r{color:#333}ul{list-style:none;padding:0;margin:2px 0}li:before{content:'\\2610\\00a0'}\
small{display:block;color:#333;margin-top:3px;overflow-wrap:anywhere}";

pub(super) fn text(sheet: &Sheet) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = write_text(sheet, &mut out);
    out
}

fn write_text(sheet: &Sheet, out: &mut String) -> fmt::Result {
    writeln!(out, "{}\n{}", sheet.title, sheet.subtitle)?;
    for section in &sheet.sections {
        writeln!(out, "\n{}", section.title)?;
        for [what, value, remark] in &section.rows {
            writeln!(out, "  {}", format!("{what:<28}{value:<32}{remark}").trim_end())?;
        }
    }
    writeln!(out, "\nCheck")?;
    for check in &sheet.checks {
        writeln!(out, "  [ ] {check}")?;
    }
    writeln!(out)?;
    sheet.notes.iter().try_for_each(|note| writeln!(out, "{note}"))
}

pub(super) fn html(sheet: &Sheet) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = write_html(sheet, &mut out);
    out
}

fn write_html(sheet: &Sheet, out: &mut String) -> fmt::Result {
    let title = escaped(&sheet.title);
    writeln!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><title>{title}</title>"
    )?;
    writeln!(out, "<style>{STYLE}</style></head><body>")?;
    writeln!(out, "<h1>{title}</h1>\n<p>{}</p>", escaped(&sheet.subtitle))?;
    for section in &sheet.sections {
        writeln!(out, "<h2>{}</h2>\n<table>", escaped(section.title))?;
        for [what, value, remark] in &section.rows {
            let [what, value, remark] = [what, value, remark].map(|cell| escaped(cell));
            writeln!(
                out,
                "<tr><td>{what}</td><td class=\"v\">{value}</td><td class=\"r\">{remark}</td></tr>"
            )?;
        }
        writeln!(out, "</table>")?;
    }
    writeln!(out, "<h2>Check</h2>\n<ul>")?;
    for check in &sheet.checks {
        writeln!(out, "<li>{}</li>", escaped(check))?;
    }
    writeln!(out, "</ul>")?;
    for note in &sheet.notes {
        writeln!(out, "<small>{}</small>", escaped(note))?;
    }
    writeln!(out, "</body></html>")
}

/// Text without markup.
pub(crate) fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            c if c.is_control() => safe.push('\u{fffd}'),
            c => safe.push(c),
        }
    }
    safe
}
