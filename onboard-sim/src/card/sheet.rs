//! Content of a card, as text and as HTML. Both show the same sheet of two sides: the front for the
//! range safety officer, the back for the person who prepares the vehicle.

use flight::rules::phase::{HOLD_LIMIT_S, MISFIRE_WAIT_S, MOTOR_HOT_S, PAD_ABORT_WAIT_S};
use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use flight::vehicle::launch::Launch;
use flight::vehicle::mission::StartPoint;
use flight::vehicle::thrust_curve::ThrustCurve;
use sim::dispersion::is_more_benign;
use sim::wire::field::{field_of, pad_of};

use super::range_safety::{
    Circle, FEWEST, InWind, PERMITTED_M_S, aborts, calibres, in_winds, limit_m_s, plan, thrust_to_weight,
};
use super::{Card, NINE_OF_TEN};
use crate::hazard::{Case, Impact, Rule, lift_off_kg};

/// One side of a sheet.
struct Side {
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
    /// A plan, if there is one, as SVG, and its text.
    Plan(Option<String>, Vec<String>),
    /// To be filled in behind these words, row by row.
    Blanks(Vec<Vec<String>>),
}

/// The cells of each line of a part of the card's words, with values by their names. A line with a
/// value that is `None` is left out.
pub(super) fn words_of(part: &str, values: &[(&str, Option<String>)]) -> Vec<Vec<String>> {
    const WORDS: &str = include_str!("words.txt");
    let lines = WORDS.split("\n# ").find_map(|text| text.strip_prefix(part)).unwrap_or_default();
    let filled = |line: &str| {
        let filled = values.iter().try_fold(line.to_owned(), |line, (name, value)| {
            let name = format!("{{{name}}}");
            if line.contains(&name) { Some(line.replace(&name, value.as_ref()?)) } else { Some(line) }
        });
        Some(filled?.split(" | ").map(str::to_owned).collect())
    };
    lines.lines().filter(|line| !line.is_empty()).filter_map(filled).collect()
}

fn rows(title: &'static str, rows: Vec<Vec<String>>) -> Section {
    Section { title, content: Content::Table(&[], rows) }
}

/// A required value, and whether it reaches its usual minimum.
fn judged(value: f64, least: f64) -> String {
    format!("{value:.1}: {}", if value < least { "TOO LOW" } else { "good" })
}

/// Smallest and largest value of the flights.
fn extremes<'a>(
    flights: impl Iterator<Item = &'a Impact>,
    of: impl Fn(&Impact) -> Option<f64>,
) -> Option<[f64; 2]> {
    flights.filter_map(of).fold(None, |found, value| {
        let [low, high] = found.unwrap_or([value; 2]);
        Some([f64::min(low, value), f64::max(high, value)])
    })
}

fn span([low, high]: [f64; 2]) -> String {
    format!("{low:.0} to {high:.0} m")
}

impl Card {
    /// The front and the back.
    fn sides(&self) -> [Side; 2] {
        let winds = in_winds(&self.flown, &self.rule);
        [self.front(&winds), self.back(&winds)]
    }

    /// The card as text.
    pub fn text(&self) -> String {
        self.sides().map(|side| text(&side)).concat()
    }

    /// The card as HTML: two pages, for the two sides of a sheet.
    pub fn html(&self) -> String {
        let sides = self.sides();
        let (title, sides) = (escaped(&sides[0].title), sides.each_ref().map(html).concat());
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><title>{title}</title>\n\
             <style>{STYLE}</style></head><body>\n{sides}</body></html>\n"
        )
    }

    fn front(&self, winds: &[InWind]) -> Side {
        let set = &self.recipe.dispersion_name;
        Side {
            title: format!("Range safety: {}", self.named()),
            subtitle: format!(
                "From {}. Simulated, not flown: set {set}{}, seed {}.",
                self.begins(),
                if is_more_benign(set) { " (which may be kinder than real)" } else { "" },
                self.recipe.seed
            ),
            sections: vec![
                wind_table(winds),
                rows("Questions of a range officer", words_of("officer", &self.values(winds))),
                self.places(winds),
                rows(
                    "What an abort does: Ctrl-X, then Enter, at any station; one person is enough",
                    self.aborts(winds),
                ),
                Section { title: "On the day", content: Content::Blanks(words_of("day", &[])) },
            ],
            notes: crate::field::crowd_alarm(&self.recipe, people_m(winds)).into_iter().collect(),
        }
    }

    /// The mission with its identification.
    fn named(&self) -> String {
        format!("{}, mission {}", self.recipe.mission.name, self.hash())
    }

    /// The flights in the winds to fly in, or in all.
    fn flights<'a>(&'a self, winds: &[InWind]) -> impl Iterator<Item = &'a Impact> {
        let most_m_s = limit_m_s(winds).unwrap_or(f64::INFINITY);
        self.flown.iter().filter(move |(wind_m_s, _)| *wind_m_s <= most_m_s).flat_map(|(_, impacts)| impacts)
    }

    fn as_planned(&self, winds: &[InWind], of: impl Fn(&Impact) -> Option<f64>) -> Option<[f64; 2]> {
        extremes(self.flights(winds).filter(|impact| impact.case == Case::AsPlanned), of)
    }

    fn launch(&self) -> Option<&Launch> {
        self.recipe.mission.launch.as_ref().filter(|_| self.start == StartPoint::Pad)
    }

    /// Values for the placeholders of the card's text.
    fn values(&self, winds: &[InWind]) -> Vec<(&'static str, Option<String>)> {
        let (mission, launch) = (&self.recipe.mission, self.launch());
        let (airframe, mass, chute) =
            (&mission.airframe, &mission.airframe.mass, &mission.airframe.parachute);
        let density_kg_m3 = mission.site.air_at_m(0.0).density_kg_m3;
        let lift_kg_m = density_kg_m3 * chute.drag_coefficient * chute.area_m2;
        let chute_m_s = libm::sqrt(2.0 * mass.loaded_kg * STANDARD_GRAVITY_M_S2 / lift_kg_m);
        let igniters = if airframe.igniters > 1 { "every igniter" } else { "the igniter" };
        let motor = |curve: &ThrustCurve| {
            let gone = match flight::vehicles::motors::status(curve.name()) {
                Some((false, dated)) => format!(", OUT OF PRODUCTION ({dated})"),
                _ => String::new(),
            };
            format!("{}, {:.0} N s{gone}", curve.name(), curve.total_impulse_n_s())
        };
        let burns = mission.lot.as_ref().filter(|lot| lot.burns > 0);
        let upwind_s = launch.map(|launch| launch.rail.upwind_s).filter(|upwind_s| *upwind_s > 0.0);
        let highest_m = |impact: &Impact| Some(impact.course.highest_m);
        let calm = self.flown.iter().take(1).flat_map(|(_, impacts)| impacts);
        let rounded = |value: f64| format!("{value:.0}");
        let if_so = |is_so: bool| is_so.then(String::new);
        vec![
            ("rail", if_so(launch.is_some())),
            ("no rail", if_so(launch.is_none())),
            ("name", Some(mission.name.clone())),
            ("site", Some(mission.site.to_string())),
            ("wind", Some(self.recipe.dispersion.wind_over_height())),
            (
                "field",
                field_of(&self.recipe).map(|field| field.distances(pad_of(&self.recipe.mission), (0.0, 0.0))),
            ),
            ("hash", Some(self.hash())),
            ("controller", Some(mission.changed.join(", ")).filter(|changed| !changed.is_empty())),
            ("ascent", launch.map(|launch| motor(&launch.booster.motor_curve))),
            ("landing", Some(motor(&mission.motor_curve))),
            ("both_n_s", Some(rounded(self.rule.impulse_n_s))),
            ("lift_kg", launch.map(|launch| format!("{:.2}", lift_off_kg(mission, Some(launch))))),
            ("thrust_to_weight", launch.map(|launch| judged(thrust_to_weight(mission, launch), 5.0))),
            (
                "rail_m_s",
                self.as_planned(winds, |impact| impact.course.rail_m_s).map(|[least, _]| judged(least, 15.0)),
            ),
            ("calibres", launch.map(|launch| judged(calibres(mission, launch), 1.0))),
            ("highest_m", extremes(self.flights(winds), highest_m).map(|[_, most]| rounded(most))),
            ("apogee", extremes(calm.filter(|impact| impact.case == Case::AsPlanned), highest_m).map(span)),
            (
                "canopy_s",
                extremes(self.flights(winds), |impact| impact.course.canopy_s).map(|[_, most]| rounded(most)),
            ),
            ("lying", Some(self.lying(winds))),
            ("ignition", self.as_planned(winds, |impact| impact.course.ignition_m).map(span)),
            ("hold_s", Some(rounded(HOLD_LIMIT_S))),
            ("pad_s", Some(rounded(PAD_ABORT_WAIT_S))),
            ("misfire_s", Some(rounded(MISFIRE_WAIT_S))),
            ("hot_s", Some(rounded(MOTOR_HOT_S))),
            ("kg", Some(format!("{:.3}", mass.loaded_kg))),
            ("nine_of_ten", Some(self.nine_of_ten())),
            ("cg_mm", Some(rounded(1e3 * mass.loaded_cg_station_m))),
            ("stroke_mm", airframe.legs.crush.map(|crush| rounded(1e3 * crush.stroke_m))),
            ("motor", Some(mission.motor_curve.name().to_owned())),
            ("confirmed", burns.map(|lot| format!("confirmed by {} burns of lot {}", lot.burns, lot.name))),
            ("unconfirmed", if_so(burns.is_none())),
            ("igniters", Some(igniters.to_owned())),
            ("chute_m_s", Some(format!("{chute_m_s:.1}"))),
            ("upwind_s", upwind_s.map(rounded)),
        ]
    }

    /// Attitudes of vehicles under the parachute with an unignited landing motor, on the ground.
    fn lying(&self, winds: &[InWind]) -> String {
        let hung = |impact: &&Impact| impact.course.canopy_s.is_some() && impact.course.ignition_m.is_none();
        let (of, lie) = self
            .flights(winds)
            .filter(hung)
            .fold((0, 0), |(of, lie), impact| (of + 1, lie + u64::from(impact.course.lies)));
        format!("{lie} of {of} end on their side, all of them with a live motor")
    }

    /// With the heights of these flights.
    fn aborts(&self, winds: &[InWind]) -> Vec<Vec<String>> {
        let down_to = self.as_planned(winds, |impact| impact.course.chute_down_to_m);
        let height = down_to.map_or_else(|| "never".to_owned(), |m| format!("feet above {}", span(m)));
        aborts(Some(self.start), &height)
    }

    fn begins(&self) -> &'static str {
        match self.start {
            StartPoint::Pad => "its pad",
            StartPoint::Apogee => "apogee (the way up is not in it)",
            StartPoint::Drone => "its drone",
        }
    }

    fn places(&self, winds: &[InWind]) -> Section {
        let (lines_m, pad) = (crate::field::lines_m(&self.recipe), pad_of(&self.recipe.mission));
        let plan = plan(winds, self.wind_from_deg, &lines_m, pad);
        let limit_m_s = limit_m_s(winds);
        let forbidden = winds.first().is_some_and(|wind| wind.wind_m_s > PERMITTED_M_S);
        let degrees = |turned_deg: f64| {
            self.wind_from_deg.map(|from_deg| format!("{:.0}", (from_deg + turned_deg) % 360.0))
        };
        let words = words_of(
            "places",
            &[
                ("no_limit", (limit_m_s.is_none() && !forbidden).then(String::new)),
                ("forbidden", forbidden.then(String::new)),
                ("permitted_m_s", Some(PERMITTED_M_S.to_string())),
                ("limit_m_s", limit_m_s.map(|limit_m_s| limit_m_s.to_string())),
                ("plan", plan.as_ref().map(|_| String::new())),
                ("no_from", self.wind_from_deg.is_none().then(String::new)),
                ("from_deg", degrees(0.0)),
                ("to_deg", degrees(180.0)),
            ],
        );
        Section { title: "Who stands where", content: Content::Plan(plan, words.concat()) }
    }

    /// Sources of the numbers of the front.
    fn sources(&self, winds: &[InWind]) -> String {
        let winds: Vec<String> = winds.iter().map(|wind| wind.wind_m_s.to_string()).collect();
        let name = &self.recipe.dispersion_name;
        let (set, winds) = match name.split_once(" with the winds of ") {
            Some((set, file)) => (set, format!("--winds {file}")),
            None => (name.as_str(), format!("--wind {}", winds.join(","))),
        };
        let values = [
            ("rule", format!("{} ({})", self.rule, Rule::SOURCE)),
            ("fewest", FEWEST.to_string()),
            ("fence_m", format!("{:.0}", self.recipe.mission.gate.fence_radius_m)),
            ("set", set.to_owned()),
            ("winds", winds),
            ("seed", self.recipe.seed.to_string()),
            ("survey", self.flights.survey.to_string()),
            ("widest", self.flights.of_widest.to_string()),
        ];
        words_of("sources", &values.map(|(name, value)| (name, Some(value)))).concat().concat()
    }

    fn back(&self, winds: &[InWind]) -> Side {
        let values = &self.values(winds);
        let people = words_of("people", &[]).into_iter().map(|who| [who, vec![String::new(); 6]].concat());
        Side {
            title: format!("Landing card: {}", self.named()),
            subtitle: format!(
                "For the person who prepares the vehicle, and for emergencies. From {}.",
                self.begins()
            ),
            sections: vec![
                rows("If it goes otherwise", words_of("otherwise", values)),
                Section {
                    title: "Who holds which key, and who goes",
                    content: Content::Table(
                        &["role", "name", "key file", "link", "asks, confirms, taps", "time", "signature"],
                        people.collect(),
                    ),
                },
                rows("Set before the flight", words_of("set", values)),
                Section { title: "Check", content: Content::Checks(words_of("checks", values).concat()) },
            ],
            notes: vec![self.sources(winds)],
        }
    }

    /// The masses at which nine of ten land.
    fn nine_of_ten(&self) -> String {
        let enough = self.flights.survey >= FEWEST;
        let mut good =
            self.masses.iter().filter(|(_, landed)| landed.stands.share >= NINE_OF_TEN).map(|(kg, _)| *kg);
        let own = self.masses.first().map(|(_, landed)| landed);
        match (good.next(), own) {
            _ if !enough => "too few flights to say at which masses nine of ten stand undamaged".to_owned(),
            (Some(least_kg), _) => {
                let most_kg = good.next_back().unwrap_or(least_kg);
                format!("nine of ten land at {least_kg:.2} to {most_kg:.2} kg in the least wind")
            }
            (None, own) => {
                let landed = own.map_or_else(String::new, ToString::to_string);
                format!("fewer than nine of ten stand undamaged in the least wind: {landed}")
            }
        }
    }
}

/// Largest radius without people in the winds to fly in, or of all, m.
fn people_m(winds: &[InWind]) -> f64 {
    let limit_m_s = limit_m_s(winds).unwrap_or(f64::INFINITY);
    let circles = winds.iter().filter(|wind| wind.wind_m_s <= limit_m_s).filter_map(|wind| wind.circle);
    circles.map(|circle| circle.exclusion_m).fold(0.0, f64::max)
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
                "stand undamaged (95 % interval), inside the envelope of their legs",
            ],
            winds.iter().map(|wind| wind_row(wind, may_fly(wind))).collect(),
        ),
    }
}

/// Results of the flights in one wind, as a row.
fn wind_row(wind: &InWind, may_fly: bool) -> Vec<String> {
    let or_too_few = |text: Option<String>| text.unwrap_or_else(|| "too few flights".to_owned());
    let [people, crew] = if let Some(circle) = wind.circle.filter(|_| may_fly) {
        let [exclusion_m, crew_m] = [circle.exclusion_m, circle.crew_m()];
        [format!("{exclusion_m:.0} m"), format!("{crew_m:.0} m, {:.0} min", libm::ceil(crew_m / 60.0))]
    } else {
        let why = wind.too_few.map(|[flown, needed]| format!(": too few flights ({flown}, {needed} needed)"));
        [format!("DO NOT FLY{}", why.unwrap_or_default()), "-".to_owned()]
    };
    vec![
        format!("{} m/s", wind.wind_m_s),
        people,
        crew,
        or_too_few(wind.circle.map(|circle| circle.farthest_m.map(|m| format!("{m:.0}")).join(", ") + " m")),
        or_too_few(wind.circle.map(|Circle { case, radius, .. }| {
            let high = radius.high_m.map_or_else(|| "?".to_owned(), |high_m| format!("{high_m:.0}"));
            format!(
                "{:.0} m ({:.0} to {high}) of {}: {}",
                radius.holds_m,
                radius.low_m,
                radius.flights,
                case.name()
            )
        })),
        or_too_few(wind.landed.as_ref().map(ToString::to_string)),
    ]
}

const STYLE: &str = include_str!("sheet.css");

fn text(side: &Side) -> String {
    let sections = side.sections.iter().map(|Section { title, content }| {
        let lines: Vec<String> = match content {
            Content::Table(heads, rows) => aligned(heads, rows),
            Content::Checks(checks) => checks.iter().map(|check| format!("[ ] {check}")).collect(),
            Content::Plan(_, words) => words.clone(),
            Content::Blanks(rows) => rows.iter().map(|row| row.join(" ______ ") + " ______").collect(),
        };
        lines.iter().fold(format!("\n{title}\n"), |text, line| text + "  " + line + "\n")
    });
    let notes = side.notes.iter().map(|note| format!("{note}\n"));
    let parts: Vec<String> = sections.chain(["\n".to_owned()]).chain(notes).collect();
    format!("{}\n{}\n{}\n", side.title, side.subtitle, parts.concat())
}

/// Rows with columns as wide as their widest cell.
fn aligned(heads: &[&str], rows: &[Vec<String>]) -> Vec<String> {
    let head = Some(heads.iter().map(|head| (*head).to_owned()).collect()).filter(|_| !heads.is_empty());
    let rows: Vec<&Vec<String>> = head.iter().chain(rows).collect();
    let shown = |cell: &String| if cell.is_empty() { "______".to_owned() } else { cell.clone() };
    let width = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column));
        cells.map(|cell| shown(cell).chars().count()).max().unwrap_or_default()
    };
    let line = |row: &&Vec<String>| {
        let cells = row.iter().enumerate();
        let cells: Vec<_> =
            cells.map(|(column, cell)| format!("{:<1$}  ", shown(cell), width(column))).collect();
        cells.concat().trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}

fn html(side: &Side) -> String {
    let sections = side.sections.iter().map(|Section { title, content }| {
        let content = match content {
            Content::Table(heads, rows) => {
                let row = |cells: String| format!("<tr>{cells}</tr>\n");
                let head =
                    if heads.is_empty() { String::new() } else { row(each(["<th>", "</th>"], *heads)) };
                let body: Vec<String> =
                    rows.iter().map(|cells| row(each(["<td>", "</td>"], cells))).collect();
                let columns = rows.first().map_or(0, Vec::len);
                format!("<table class=\"c{columns}\">\n{head}{}</table>\n", body.concat())
            }
            Content::Checks(checks) => format!("<ul>\n{}</ul>\n", each(["<li>", "</li>\n"], checks)),
            Content::Plan(plan, words) => {
                let (plan, words) = (plan.as_deref().unwrap_or_default(), each(["<p>", "</p>\n"], words));
                format!("<div class=\"plan\">{plan}<div>{words}</div></div>\n")
            }
            Content::Blanks(rows) => {
                let blanks = |row| each(["<span>", "</span><i></i>"], row);
                rows.iter()
                    .map(|row| format!("<div class=\"b\">{}</div>\n", blanks(row)))
                    .collect::<Vec<_>>()
                    .concat()
            }
        };
        format!("<h2>{}</h2>\n{content}", escaped(title))
    });
    let sections: Vec<String> = sections.collect();
    format!(
        "<section>\n<h1>{}</h1>\n<p>{}</p>\n{}{}</section>\n",
        escaped(&side.title),
        escaped(&side.subtitle),
        sections.concat(),
        each(["<small>", "</small>\n"], &side.notes)
    )
}

/// Each text between two tags.
fn each(tags: [&str; 2], texts: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    let texts = texts.into_iter().map(|text| escaped(text.as_ref()));
    texts.fold(String::new(), |html, text| html + tags[0] + &text + tags[1])
}

/// Text without markup.
pub fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            c if c.is_control() && c != '\n' => safe.push('\u{fffd}'),
            c => safe.push(c),
        }
    }
    safe
}
