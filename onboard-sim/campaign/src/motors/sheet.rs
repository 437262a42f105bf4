//! What stands on a card, as text and as HTML. Both show the same sheet of two sides: the front for the range safety officer,
//! the back for whoever prepares the vehicle.

use core::fmt::{self, Write};

use flight::vehicle::atmosphere::Air;
use flight::vehicle::mission::StartPoint;
use sim::dispersion::may_be_kinder;

use super::card::Card;
use super::range_safety::{Circle, FEWEST, InWind, aborts, in_winds, limit_m_s, plan};
use crate::hazard::Rule;

/// One side of a sheet.
pub(super) struct Side {
    title: String,
    subtitle: String,
    sections: Vec<Section>,
    notes: Vec<String>,
}

struct Section {
    title: &'static str,
    content: Content,
}

enum Content {
    /// Rows of cells below heads, if there are any. An empty cell is to be filled in.
    Table(&'static [&'static str], Vec<Vec<String>>),
    /// To be ticked off, in order.
    Checks(Vec<String>),
    /// A plan, if there is one, as SVG, and what it says in words.
    Plan(Option<String>, Vec<String>),
    /// To be filled in behind these words, row by row.
    Blanks(&'static [&'static [&'static str]]),
}

/// What, its value, and a remark.
fn row(what: &str, value: String, remark: impl Into<String>) -> Vec<String> {
    vec![what.to_owned(), value, remark.into()]
}

fn rows(title: &'static str, rows: Vec<Vec<String>>) -> Section {
    Section { title, content: Content::Table(&[], rows) }
}

/// Who signs on the day.
const PEOPLE: [&str; 3] = ["range safety", "flight", "pad: has the pin"];

/// What is written down on the day. A book's end is a number and eight groups.
const DAY: &[&[&str]] = &[
    &["Date", "Place", "Vehicle, its boot"],
    &["Wind, mean of 10 min, m/s", "from, \u{b0}", "at", "so nobody within, m"],
    &["Circle clear", "Armed", "Lift-off", "Down", "Approached"],
    &["Book of station 1", ":", "-", "-", "-", "-", "-", "-", "-"],
    &["Book of station 2", ":", "-", "-", "-", "-", "-", "-", "-"],
];

impl Card {
    /// The front and the back.
    pub(super) fn sides(&self) -> [Side; 2] {
        let winds = in_winds(&self.flown, &self.rule);
        [self.front(&winds), self.back(&winds)]
    }

    fn front(&self, winds: &[InWind]) -> Side {
        let aborts = aborts(self.start).into_iter().map(|row| row.map(str::to_owned).to_vec()).collect();
        let people = PEOPLE.map(|who| [vec![who.to_owned()], vec![String::new(); 6]].concat());
        Side {
            title: format!("Range safety: {}", self.recipe.mission.name),
            subtitle: format!(
                "{}, {:.3} kg, from {}. Simulated, not flown: set {}{}, seed {}.",
                self.landing.candidate.name(),
                self.landing.choice.mass.loaded_kg,
                self.begins(),
                self.recipe.dispersion_name,
                if may_be_kinder(&self.recipe.dispersion_name) {
                    " (which may be kinder than real)"
                } else {
                    ""
                },
                self.recipe.seed
            ),
            sections: vec![
                wind_table(winds),
                self.places(winds),
                Section {
                    title: "What an abort does: Ctrl-X, then Enter, at any station; one person is enough",
                    content: Content::Table(&[], aborts),
                },
                Section { title: "On the day", content: Content::Blanks(DAY) },
                Section {
                    title: "Who holds which key",
                    content: Content::Table(
                        &["role", "name", "key file", "link", "asks, confirms, taps", "time", "signature"],
                        people.to_vec(),
                    ),
                },
            ],
            notes: Vec::new(),
        }
    }

    fn begins(&self) -> &'static str {
        match self.start {
            StartPoint::Pad => "its pad",
            StartPoint::Apogee => "apogee (the way up is not in it)",
            StartPoint::Drone => "its drone",
        }
    }

    fn places(&self, winds: &[InWind]) -> Section {
        let mut words = match limit_m_s(winds) {
            None => vec![format!(
                "Fewer than {FEWEST} flights were flown in each wind, or one did not come down: no radius, no rate and no wind to \
                 fly in. Do not fly by this card."
            )],
            Some(most_m_s) => vec![format!(
                "Do not fly above {most_m_s} m/s: fewer land, or it is not known. The wind is the mean of ten minutes, 10 m above the \
                 ground; held at 2 m, times 1.3. Between two rows the stronger wind counts."
            )],
        };
        words.extend([
            "Everybody stands outside of the circle, the launch crew too, and nobody stands downwind.".to_owned(),
            "The launch crew stands upwind and launches by radio over the distance in the table, not by a cable. The range test (U) \
             is passed at that place before the pin is pulled."
                .to_owned(),
            "Whoever pulls the pin walks out (minutes in the table, at 1 m/s) before anybody arms.".to_owned(),
            "If the wind turns, so does the line: look again before the arming.".to_owned(),
        ]);
        let plan = plan(winds, self.wind_from_deg);
        if plan.is_some() {
            words.push(self.wind_from_deg.map_or_else(
                || "Hold the plan so that its arrow points downwind.".to_owned(),
                |from_deg| {
                    let to_deg = (from_deg + 180.0) % 360.0;
                    format!(
                        "The plan has north up: wind from {from_deg:.0}\u{b0}, downwind {to_deg:.0}\u{b0}."
                    )
                },
            ));
        }
        Section { title: "Who stands where", content: Content::Plan(plan, words) }
    }

    /// What the numbers of the front rest on.
    fn sources(&self, winds: &[InWind]) -> String {
        let open = winds.iter().filter_map(|wind| wind.circle).any(|circle| circle.radius.high_m.is_none());
        format!(
            "Front. Nobody within: the largest of what holds 99 % of the flights of the way of ending that reaches farthest (upper end), of the rows \
             above, and of {} ({}); rounded up to 10 m.{} On their legs: of the flights as planned, Wilson's interval. Fewer than {FEWEST} flights tell \
             neither. The fence of the mission ({:.0} m) only decides whether the landing motor may light. The same flights again: \
             onboard-sim hazard --profile mission.toml --dispersion {} --wind {} --seed {} --flights {} --hazard-flights {}",
            self.rule,
            Rule::SOURCE,
            if open { " At least: there are too few flights for an upper end." } else { "" },
            self.recipe.mission.gate.fence_radius_m,
            self.recipe.dispersion_name,
            winds.iter().map(|wind| wind.wind_m_s.to_string()).collect::<Vec<_>>().join(","),
            self.recipe.seed,
            self.flights.survey,
            self.flights.of_widest
        )
    }

    fn back(&self, winds: &[InWind]) -> Side {
        let candidate = &self.landing.candidate;
        let curve = &candidate.curve;
        Side {
            title: format!("Landing card: {}", self.recipe.mission.name),
            subtitle: format!("{}, {:.3} kg.", candidate.name(), self.landing.choice.mass.loaded_kg),
            sections: vec![
                self.vehicle(),
                self.heights(),
                self.margins(),
                Section { title: "Check", content: Content::Checks(self.checks()) },
            ],
            notes: vec![
                format!(
                    "Motor: {}, {:.1} N s in {:.2} s, peak {:.1} N; {:.1} g of propellant in {:.1} g, {:.0} x {:.0} mm; data: {}.",
                    candidate.name(),
                    curve.total_impulse_n_s(),
                    curve.burn_time_s(),
                    curve.peak_thrust_n(),
                    1e3 * curve.propellant_mass_kg(),
                    1e3 * curve.total_mass_kg(),
                    1e3 * curve.diameter_m(),
                    1e3 * curve.length_m(),
                    candidate.origin
                ),
                self.sources(winds),
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
        rows(
            "Set before the flight",
            vec![
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
        )
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
        self::rows("Heights", rows)
    }

    fn margins(&self) -> Section {
        let choice = &self.landing.choice;
        let window = &choice.window;
        let impulse_n_s = self.landing.candidate.curve.total_impulse_n_s();
        let [low, high] = window.impulse_scales;
        rows(
            "What may differ",
            vec![
                self.confirmed(),
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
                    "outside no landing exists; the flights of the front differ by what their set says",
                ),
                row(
                    "Scatter it stands",
                    format!("{:.2}", window.scatter),
                    "impulse, burn time and igniter at once, over what the mission plans for; 1 and more is good",
                ),
            ],
        )
    }

    /// Whether burns of its lot confirm the motor's curve.
    fn confirmed(&self) -> Vec<String> {
        match &self.recipe.mission.lot {
            Some(lot) if lot.burns > 0 => row(
                "Motor confirmed by",
                format!("{} burns of lot {}", lot.burns, lot.name),
                "the mission expects what they had; another lot is unconfirmed",
            ),
            _ => row(
                "Motor",
                "UNCONFIRMED".to_owned(),
                "no burn of its lot confirms the certified curve; arming asks for the word UNTESTED",
            ),
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
            "Measure the wind for ten minutes; the front says who stands where in it.".to_owned(),
            "Load mission.toml; the ground station shows its name and no failed self-test.".to_owned(),
            format!("Parachute packed: {chute_m_s:.1} m/s under the canopy at this mass."),
            "After the flight: a motor that was not lit is live. Nobody approaches for 60 s; then the pin first."
                .to_owned(),
        ];
        let on_rail = mission.launch.as_ref().filter(|_| self.start == StartPoint::Pad);
        if let Some(upwind_s) = on_rail.map(|launch| launch.rail.upwind_s).filter(|upwind_s| *upwind_s > 0.0)
        {
            checks.insert(6, format!(
                "Lay the landing pad downwind of the rail: {upwind_s:.0} m for each m/s of that wind. Write where the rail then stands, from \
                 the middle of the pad, into mission.toml, [launch.rail]: x_m to the north, y_m to the west.",
            ));
        }
        if let Some(crush) = airframe.legs.crush {
            checks.insert(2, format!(
                "Each leg: its block new and unmarked, its foot free to rise by {:.0} mm. A block that has given way is replaced.",
                1e3 * crush.stroke_m
            ));
        }
        checks
    }
}

fn wind_table(winds: &[InWind]) -> Section {
    let limit_m_s = limit_m_s(winds);
    let may_fly = |wind: &InWind| limit_m_s.is_some_and(|most_m_s| wind.wind_m_s <= most_m_s);
    Section {
        title: "Which wind, which radius",
        content: Content::Table(
            &[
                "wind up to",
                "nobody within",
                "launch crew, upwind; walk",
                "farthest downwind, across, upwind",
                "99 % come down within (95 % interval)",
                "on their legs (95 % interval)",
            ],
            winds.iter().map(|wind| wind_row(wind, may_fly(wind))).collect(),
        ),
    }
}

/// What flights in one wind tell, as a row.
fn wind_row(wind: &InWind, may_fly: bool) -> Vec<String> {
    let told = |text: Option<String>| text.unwrap_or_else(|| "too few flights".to_owned());
    let people = |circle: Circle| {
        if !may_fly {
            return ["DO NOT FLY".to_owned(), "-".to_owned()];
        }
        let at_least = if circle.radius.high_m.is_none() { "at least " } else { "" };
        let [keep_out_m, crew_m] = [circle.keep_out_m, circle.crew_m()];
        [
            format!("{at_least}{keep_out_m:.0} m"),
            format!("{at_least}{crew_m:.0} m, {:.0} min", libm::ceil(crew_m / 60.0)),
        ]
    };
    let [people, crew] = wind.circle.map_or_else(|| ["none".to_owned(), "-".to_owned()], people);
    vec![
        format!("{} m/s", wind.wind_m_s),
        people,
        crew,
        told(wind.circle.map(|circle| circle.farthest_m.map(|m| format!("{m:.0}")).join(", ") + " m")),
        told(wind.circle.map(|Circle { way, radius, .. }| {
            let high = radius.high_m.map_or_else(|| "?".to_owned(), |high_m| format!("{high_m:.0}"));
            format!(
                "{:.0} m ({:.0} to {high}) of {}: {}",
                radius.holds_m,
                radius.low_m,
                radius.flights,
                way.name()
            )
        })),
        told(wind.landed.map(|landed| {
            let [share, low, high] = [landed.share, landed.low, landed.high].map(|share| 100.0 * share);
            format!("{} of {}: {share:.0} % ({low:.0} to {high:.0})", landed.count, landed.of)
        })),
    ]
}

/// One sheet of A4 with two sides, in black and white, readable in the sun.
const STYLE: &str = "@page{size:A4;margin:10mm}body{font:12px/1.25 sans-serif;max-width:190mm;margin:0 auto;color:#000}\
section+section{break-before:page}h1{font-size:20px;margin:0}p{margin:2px 0}h2{font-size:14px;margin:7px 0 2px}\
table{border-collapse:collapse;width:100%}td,th{padding:2px 6px;vertical-align:top;text-align:left;border:1px solid #000}\
.c2 td:first-child{font-weight:bold;width:34%}.c3 td:first-child{width:25%}.c3 td:nth-child(2){font-weight:bold;width:29%}\
.c6 td{font-size:11px}.c6 td:nth-child(-n+3){font-weight:bold;font-size:14px}.c6{table-layout:fixed}.c6 th{font-size:11px;width:15%}.c6 th:first-child{width:9%}\
.c6 th:nth-child(3){width:17%}.c6 th:nth-child(5){width:28%}.c7{table-layout:fixed}.c7 th:first-child{width:17%}.c7 th:nth-child(4),.c7 th:nth-child(6){width:7%}.c7 th:nth-child(5){width:21%}.c7 td{height:22px}\
ul{list-style:none;padding:0;margin:2px 0}li:before{content:'\\2610\\00a0'}small{display:block;margin-top:5px;overflow-wrap:anywhere}\
.plan{display:flex;gap:5mm;align-items:center}.plan p{margin:3px 0}svg{flex:0 0 82mm;height:57mm}\
circle,line{fill:none;stroke:#000;stroke-width:.7}.downwind{stroke-width:2}.crew{fill:#000}\
text{font-size:9px;paint-order:stroke;stroke:#fff;stroke-width:2px}\
.b{display:flex;gap:4px;align-items:end;height:22px}.b i{flex:1;border-bottom:1px solid #000}";

pub(super) fn text(sides: &[Side]) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = sides.iter().try_for_each(|side| write_text(side, &mut out));
    out
}

fn write_text(side: &Side, out: &mut String) -> fmt::Result {
    writeln!(out, "{}\n{}", side.title, side.subtitle)?;
    for Section { title, content } in &side.sections {
        writeln!(out, "\n{title}")?;
        match content {
            Content::Table(heads, rows) => write_table(heads, rows, out)?,
            Content::Checks(checks) => checks.iter().try_for_each(|check| writeln!(out, "  [ ] {check}"))?,
            Content::Plan(_, words) => words.iter().try_for_each(|words| writeln!(out, "  {words}"))?,
            Content::Blanks(rows) => {
                rows.iter().try_for_each(|row| writeln!(out, "  {} ______", row.join(" ______ ")))?;
            }
        }
    }
    writeln!(out)?;
    side.notes.iter().try_for_each(|note| writeln!(out, "{note}"))?;
    writeln!(out)
}

fn write_table(heads: &[&str], rows: &[Vec<String>], out: &mut String) -> fmt::Result {
    let blank = |cell: &String| if cell.is_empty() { "______".to_owned() } else { cell.clone() };
    let heads: Vec<String> = heads.iter().map(|head| (*head).to_owned()).collect();
    let heads = Some(heads).filter(|heads| !heads.is_empty());
    let shown: Vec<Vec<String>> =
        heads.iter().chain(rows).map(|row| row.iter().map(blank).collect()).collect();
    let width = |column: usize| {
        shown
            .iter()
            .filter_map(|row| row.get(column))
            .map(|cell| cell.chars().count())
            .max()
            .unwrap_or_default()
    };
    for row in &shown {
        let cells = row.iter().enumerate().map(|(column, cell)| format!("{cell:<0$}  ", width(column)));
        writeln!(out, "  {}", cells.collect::<String>().trim_end())?;
    }
    Ok(())
}

pub(super) fn html(sides: &[Side]) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = write_html(sides, &mut out);
    out
}

fn write_html(sides: &[Side], out: &mut String) -> fmt::Result {
    let title = sides.first().map_or_else(String::new, |side| escaped(&side.title));
    writeln!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><title>{title}</title>"
    )?;
    writeln!(out, "<style>{STYLE}</style></head><body>")?;
    for side in sides {
        writeln!(out, "<section>\n<h1>{}</h1>\n<p>{}</p>", escaped(&side.title), escaped(&side.subtitle))?;
        for Section { title, content } in &side.sections {
            writeln!(out, "<h2>{}</h2>", escaped(title))?;
            write_content(content, out)?;
        }
        side.notes.iter().try_for_each(|note| writeln!(out, "<small>{}</small>", escaped(note)))?;
        writeln!(out, "</section>")?;
    }
    writeln!(out, "</body></html>")
}

fn write_content(content: &Content, out: &mut String) -> fmt::Result {
    match content {
        Content::Table(heads, rows) => {
            writeln!(out, "<table class=\"c{}\">", rows.first().map_or(0, Vec::len))?;
            if !heads.is_empty() {
                write!(out, "<tr>")?;
                write_each(out, ["<th>", "</th>"], heads.iter().copied())?;
                writeln!(out, "</tr>")?;
            }
            for row in rows {
                write!(out, "<tr>")?;
                write_each(out, ["<td>", "</td>"], row.iter().map(String::as_str))?;
                writeln!(out, "</tr>")?;
            }
            writeln!(out, "</table>")
        }
        Content::Checks(checks) => {
            writeln!(out, "<ul>")?;
            write_each(out, ["<li>", "</li>\n"], checks.iter().map(String::as_str))?;
            writeln!(out, "</ul>")
        }
        Content::Plan(plan, words) => {
            write!(out, "<div class=\"plan\">{}<div>", plan.as_deref().unwrap_or_default())?;
            write_each(out, ["<p>", "</p>\n"], words.iter().map(String::as_str))?;
            writeln!(out, "</div></div>")
        }
        Content::Blanks(rows) => rows.iter().try_for_each(|row| {
            write!(out, "<div class=\"b\">")?;
            write_each(out, ["<span>", "</span><i></i>"], row.iter().copied())?;
            writeln!(out, "</div>")
        }),
    }
}

/// Writes each text between two tags.
fn write_each<'a>(
    out: &mut String,
    tags: [&str; 2],
    mut texts: impl Iterator<Item = &'a str>,
) -> fmt::Result {
    texts.try_for_each(|text| write!(out, "{}{}{}", tags[0], escaped(text), tags[1]))
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
