//! Maps where a vehicle lands, over two quantities of the start, the motor or the day.
//!
//! There are two questions: whether a mission can be landed with perfect information, which is cheaper, and whether its own
//! guidance lands it ([`map`]). Cells are independent, so a map does not depend on how many of them are computed at the same
//! time. A cell differs from the mission's nominal flight in two values alone: the draw of one flight number is the same in
//! every cell.

use std::fmt;
use std::io::{self, Write};
use std::str::FromStr;

use flight::vehicle::mission::Mission;
use sim::draw::{Draw, draw};
use sim::recipe::Recipe;
use sim::sortie::{SetUpError, Sortie};

use crate::attainable::onset_window;
use crate::figure::{CellAxis, Cells, FigureError, cells_svg};
use crate::run::in_parallel;

/// The result of one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Whether a landing exists, and if not, why.
    pub finding: Finding,
    /// Vertical speed at contact, m/s; not a number where nothing was flown.
    pub touchdown_speed_m_s: f64,
}

/// Whether a landing exists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finding {
    /// The flight leaves the vehicle standing undamaged, or the bound does not forbid it.
    Lands,
    /// The flight ends outside a limit.
    Misses,
    /// A bound proves that nothing lands.
    NotLandable,
}

impl Finding {
    /// All of them, in their order.
    const ALL: [Self; 3] = [Self::Lands, Self::Misses, Self::NotLandable];

    /// One word for tables, the sign of a map as text, and red, green and blue, which are also different in grey.
    fn shown(self) -> (&'static str, char, [u8; 3]) {
        match self {
            Self::Lands => ("lands", '#', [0x7f, 0xc9, 0x7f]),
            Self::Misses => ("misses", 'o', [0xe6, 0xa2, 0x3c]),
            Self::NotLandable => ("not landable", '.', [0x5b, 0x4b, 0x6b]),
        }
    }
}

/// A map: cells row by row, the first row at the lowest value of `y`.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Columns.
    pub x: Axis,
    /// Rows.
    pub y: Axis,
    /// `x.count` times `y.count` cells.
    pub cells: Vec<Cell>,
}

/// Why there is no map.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// The bound of perfect information does not know the quantity.
    #[error(
        "what is attainable with {mission} cannot be mapped over {}; it can over {}",
        .quantity.name(),
        names(&Quantity::ATTAINABLE)
    )]
    Quantity { mission: String, quantity: Quantity },
    /// Both axes are the same quantity.
    #[error("both axes vary {}; choose two quantities", .0.name())]
    SameQuantity(Quantity),
    /// A cell's flight cannot be set up.
    #[error(transparent)]
    Flight(#[from] SetUpError),
}

fn names(quantities: &[Quantity]) -> String {
    quantities.iter().map(|quantity| quantity.name()).collect::<Vec<_>>().join(", ")
}

impl Map {
    /// Number of cells with this finding.
    pub fn count(&self, finding: Finding) -> usize {
        self.cells.iter().filter(|cell| cell.finding == finding).count()
    }

    /// The map as text: one character for each cell, the highest row first.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn write_table(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(out, "# lands   o misses a limit   . proved not landable")?;
        writeln!(out, "{:>10}", self.y.quantity.label())?;
        for (row, cells) in self.cells.chunks(self.x.count).enumerate().rev() {
            let signs: String = cells.iter().map(|cell| cell.finding.shown().1).collect();
            writeln!(out, "{:>10.3} |{signs}", self.y.value(row))?;
        }
        writeln!(out, "{:>10} +{}", "", "-".repeat(self.x.count))?;
        writeln!(
            out,
            "{:>10}  {:.3} to {:.3} {}",
            "",
            self.x.value(0),
            self.x.value(self.x.count - 1),
            self.x.quantity.label()
        )?;
        writeln!(
            out,
            "{} of {} cells land, {} miss, {} are proved not landable",
            self.count(Finding::Lands),
            self.cells.len(),
            self.count(Finding::Misses),
            self.count(Finding::NotLandable)
        )
    }

    /// The map as CSV: one row for each cell.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn write_csv(&self, out: &mut impl Write) -> io::Result<()> {
        let mut table = csv::Writer::from_writer(out);
        let [x, y] = [self.x, self.y].map(|axis| axis.quantity.words()[1]);
        table.write_record([x, y, "finding", "touchdown_speed_m_s"])?;
        for (place, cell) in self.cells.iter().enumerate() {
            let (x, y) = (self.x.value(place % self.x.count), self.y.value(place / self.x.count));
            let [x, y, speed] = [x, y, cell.touchdown_speed_m_s].map(|value| value.to_string());
            table.write_record([&x, &y, cell.finding.shown().0, &speed])?;
        }
        table.flush()
    }
}

/// A quantity that a map varies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Height of the feet at which the thrust begins, m.
    IgnitionHeight,
    /// Thrust over nominal, learnt in flight by the guidance.
    ThrustScale,
    /// Mean wind 10 m above the ground, m/s.
    Wind,
    /// Tilt from upright at the start (below a drone: of its swing), degrees.
    Tilt,
    /// Height of the start, m.
    Height,
}

impl Quantity {
    const ALL: [Self; 5] = [Self::IgnitionHeight, Self::ThrustScale, Self::Wind, Self::Tilt, Self::Height];
    /// What the bound of perfect information knows: no wind and no attitude. All are above 0.
    const ATTAINABLE: [Self; 3] = [Self::IgnitionHeight, Self::ThrustScale, Self::Height];

    /// The name on a command line, that of a table's column with its unit, and the words beside a picture's axis.
    fn words(self) -> [&'static str; 3] {
        match self {
            Self::Height => ["height", "height_m", "height, m"],
            Self::Tilt => ["tilt", "tilt_deg", "tilt, deg"],
            Self::ThrustScale => ["thrust-scale", "thrust_scale", "thrust / nominal"],
            Self::IgnitionHeight => ["ignition-height", "ignition_height_m", "ignition height, m"],
            Self::Wind => ["wind", "wind_m_s", "wind at 10 m, m/s"],
        }
    }

    fn name(self) -> &'static str {
        self.words()[0]
    }

    fn label(self) -> &'static str {
        self.words()[2]
    }
}

/// A quantity over a range: `count` values, both ends among them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// What is varied.
    pub quantity: Quantity,
    /// Its first value.
    pub from: f64,
    /// Its last value.
    pub to: f64,
    /// How many values.
    pub count: usize,
}

impl Axis {
    /// The most values of one axis.
    pub const MAX_COUNT: usize = 500;

    /// The value at an index, counted from 0.
    pub fn value(&self, place: usize) -> f64 {
        let steps = self.count.saturating_sub(1).max(1);
        self.from + (self.to - self.from) * place as f64 / steps as f64
    }
}

/// Why an axis cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "axis `{given}`: {problem}; write QUANTITY=FROM:TO:COUNT with a quantity of {}",
    names(&Quantity::ALL)
)]
pub struct AxisError {
    given: String,
    problem: &'static str,
}

impl FromStr for Axis {
    type Err = AxisError;

    fn from_str(given: &str) -> Result<Self, AxisError> {
        let refuse = |problem| AxisError { given: given.to_owned(), problem };
        let (name, range) = given.split_once('=').ok_or_else(|| refuse("no `=`"))?;
        let quantity = Quantity::ALL
            .into_iter()
            .find(|quantity| quantity.name() == name)
            .ok_or_else(|| refuse("unknown quantity"))?;
        let mut parts = range.split(':');
        let (Some(from), Some(to), Some(count), None) =
            (parts.next(), parts.next(), parts.next(), parts.next())
        else {
            return Err(refuse("the range is not FROM:TO:COUNT"));
        };
        let number = |text: &str| text.parse::<f64>().ok().filter(|value| value.is_finite());
        let (from, to) =
            number(from).zip(number(to)).ok_or_else(|| refuse("an end of the range is not a number"))?;
        let count = count
            .parse()
            .ok()
            .filter(|count| (2..=Self::MAX_COUNT).contains(count))
            .ok_or_else(|| refuse("the count is not a number from 2 to 500"))?;
        if quantity == Quantity::Wind && from.min(to) < 0.0 {
            return Err(refuse("the range must not be below 0"));
        }
        if Quantity::ATTAINABLE.contains(&quantity) && from.min(to) <= 0.0 {
            return Err(refuse("the range must be above 0"));
        }
        Ok(Self { quantity, from, to, count })
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}:{}:{}", self.quantity.name(), self.from, self.to, self.count)
    }
}

/// By what a mission lands on a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum By {
    /// Its own guidance: a simulated flight for each cell lands if it stands undamaged.
    Guidance,
    /// Perfect information ([`crate::attainable`]): an upper bound, in vertical motion alone.
    PerfectInformation,
}

/// Computes a mission's map; `progress` is called with the cells done, from any thread.
///
/// # Errors
/// The axes do not suit a mission, or a cell cannot be flown.
pub fn map(
    recipe: &Recipe,
    by: By,
    axes: [Axis; 2],
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Map, MapError> {
    let [x, y] = axes;
    if x.quantity == y.quantity {
        return Err(MapError::SameQuantity(x.quantity));
    }
    let unknown = |axis: &Axis| !Quantity::ATTAINABLE.contains(&axis.quantity);
    if let Some(axis) = axes.into_iter().find(|axis| by == By::PerfectInformation && unknown(axis)) {
        return Err(MapError::Quantity { mission: recipe.mission.name.clone(), quantity: axis.quantity });
    }
    let places: Vec<usize> = (0..x.count * y.count).collect();
    let of = |place: &usize| cell(recipe, by, axes, [x.value(place % x.count), y.value(place / x.count)]);
    let cells = in_parallel(&places, of, progress);
    Ok(Map { x, y, cells: cells.into_iter().collect::<Result<_, _>>()? })
}

fn cell(recipe: &Recipe, by: By, axes: [Axis; 2], values: [f64; 2]) -> Result<Cell, SetUpError> {
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
    let mut flight = Sortie::drawn_as(&mission, &dispersion, &drawn)?;
    if by == By::PerfectInformation {
        let window = onset_window(&mission, flight.drawn(), flight.fell_from());
        // Without a height on an axis the best one is chosen.
        let lands = window.is_some_and(|window| {
            mission.ignition.fixed_height_m.is_none_or(|height_m| window.contains(height_m))
        });
        let finding = if lands { Finding::Lands } else { Finding::NotLandable };
        return Ok(Cell { finding, touchdown_speed_m_s: f64::NAN });
    }
    let outcome = flight.run();
    Ok(Cell {
        finding: if outcome.landing.stands { Finding::Lands } else { Finding::Misses },
        touchdown_speed_m_s: outcome
            .touchdown
            .map_or(f64::NAN, |touchdown| touchdown.over_ground.vertical_m_s.abs()),
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

/// The map as SVG, below a title.
///
/// # Errors
/// An axis is not finite.
pub fn svg(map: &Map, title: &str) -> Result<String, FigureError> {
    let axis = |axis: Axis| CellAxis {
        label: axis.quantity.label().to_owned(),
        first: axis.from,
        last: axis.to,
        count: axis.count,
    };
    let cells: Vec<usize> = map.cells.iter().map(|cell| cell.finding as usize).collect();
    let kinds = Finding::ALL.map(|finding| {
        let (name, _, colour) = finding.shown();
        (name, colour)
    });
    cells_svg(title, &Cells { x: axis(map.x), y: axis(map.y), kinds: &kinds, cells: &cells })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::threads;

    #[test]
    fn axes_are_read_and_written_alike() {
        for text in ["height=5:30:26", "tilt=-30:30:7", "thrust-scale=0.9:1.4:26"] {
            assert_eq!(text.parse::<Axis>().unwrap().to_string(), text);
        }
        let axis: Axis = "height=5:30:26".parse().unwrap();
        assert!((axis.value(0) - 5.0).abs() < 1e-12 && (axis.value(25) - 30.0).abs() < 1e-12);
    }

    #[test]
    fn a_wrong_axis_is_refused_with_the_valid_forms() {
        for text in
            ["", "height", "depth=1:2:3", "height=1:2", "height=a:2:3", "height=1:2:1", "height=-1:2:3"]
        {
            let error = text.parse::<Axis>().unwrap_err().to_string();
            assert!(error.contains("QUANTITY=FROM:TO:COUNT") && error.contains("ignition-height"), "{error}");
        }
    }

    fn mapped(mission: &str, by: By, x: &str, y: &str) -> Map {
        let recipe = Recipe::built_in(mission, "none").unwrap();
        map(&recipe, by, [x.parse().unwrap(), y.parse().unwrap()], &|_| ()).unwrap()
    }

    fn findings(map: &Map) -> Vec<Finding> {
        map.cells.iter().map(|cell| cell.finding).collect()
    }

    /// The nominal motor lands, half of one and a storm do not; the map does not depend on the number of jobs.
    #[test]
    fn two_missions_are_flown_on_as_many_threads_as_wanted() {
        use Finding::{Lands, Misses};
        for mission in ["mk2", "vlr"] {
            let map = || mapped(mission, By::Guidance, "thrust-scale=0.5:1:2", "wind=0:30:2");
            let flown = |jobs| threads(Some(jobs)).unwrap().install(map);
            let map = flown(2);
            assert_eq!(findings(&map), [Misses, Lands, Misses, Misses], "{mission}");
            assert!(map.cells[1].touchdown_speed_m_s < 1.0, "{mission}: {map:?}");
            assert_eq!(findings(&flown(1)), findings(&map));
        }
    }

    /// What is flown and lands is inside the bound with perfect information, and an ignition at 10 m is too late for both.
    #[test]
    fn val_bound_what_the_guidance_lands_is_attainable() {
        let (x, y) = ("thrust-scale=0.9:1.1:3", "ignition-height=10:70:4");
        let flown = mapped("mk2", By::Guidance, x, y);
        let attainable = mapped("mk2", By::PerfectInformation, x, y);
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
        let refused = |x: &str, by| {
            let axes = [x.parse().unwrap(), "thrust-scale=0.9:1.1:2".parse().unwrap()];
            map(&recipe, by, axes, &|_| ()).unwrap_err().to_string()
        };
        assert_eq!(
            refused("wind=1:2:2", By::PerfectInformation),
            "what is attainable with mk2 cannot be mapped over wind; it can over ignition-height, thrust-scale, height"
        );
        assert_eq!(
            refused("thrust-scale=1:2:2", By::Guidance),
            "both axes vary thrust-scale; choose two quantities"
        );
    }
}
