//! Maps where a vehicle lands, over two quantities of the start, the motor or the day.
//!
//! There are three questions, cheapest first: whether a plan exists for the landing paper's vehicle ([`crate::paper::map`]),
//! whether a mission can be landed with perfect information, and whether its own guidance lands it ([`map_mission`]).
//! Cells are independent, so a map does not depend on how many of them are computed at the same time.

mod axis;
mod picture;
mod space;

use std::io::{self, Write};

use campaign::work::in_parallel;
use sim::sortie::SetUpError;

pub use axis::{Axis, AxisError, Quantity};
pub use picture::svg;
pub use space::{Question as SpaceQuestion, map as map_mission};

/// The result of one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Whether a landing exists, and if not, why.
    pub finding: Finding,
    /// Speed at the end of the plan, m/s, or the lower bound if nothing was planned; in space vertical speed at contact, not
    /// a number where nothing was flown.
    pub touchdown_speed_m_s: f64,
}

/// Whether a landing exists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finding {
    /// A converged plan, or a flight, ends inside every limit.
    Lands,
    /// The best plan found, or the flight, ends outside a limit.
    Misses,
    /// A bound proves that nothing lands.
    NotLandable,
}

impl Finding {
    /// All of them, in their order.
    const ALL: [Self; 3] = [Self::Lands, Self::Misses, Self::NotLandable];

    /// Red, green and blue; also different in grey: light, middle, dark.
    fn colour(self) -> [u8; 3] {
        match self {
            Self::Lands => [0x7f, 0xc9, 0x7f],
            Self::Misses => [0xe6, 0xa2, 0x3c],
            Self::NotLandable => [0x5b, 0x4b, 0x6b],
        }
    }

    /// One word, for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lands => "lands",
            Self::Misses => "misses",
            Self::NotLandable => "not landable",
        }
    }

    fn sign(self) -> char {
        match self {
            Self::Lands => '#',
            Self::Misses => 'o',
            Self::NotLandable => '.',
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

/// A map whose cells `of` computes on `jobs` threads from a value of `x` and one of `y`; `progress` is called with the
/// cells done, from any of them.
pub(crate) fn map_of<E: Send>(
    [x, y]: [Axis; 2],
    jobs: usize,
    progress: &(dyn Fn(usize) + Sync),
    of: impl Fn(f64, f64) -> Result<Cell, E> + Sync,
) -> Result<Map, MapError>
where
    MapError: From<E>,
{
    let places: Vec<usize> = (0..x.count * y.count).collect();
    let cell = |place: &usize| of(x.value(place % x.count), y.value(place / x.count));
    let cells = in_parallel(&places, jobs, cell, progress)?;
    Ok(Map { x, y, cells: cells.into_iter().collect::<Result<_, E>>()? })
}

/// Why there is no map.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// The quantity means nothing to this vehicle or question.
    #[error("{whose} cannot be mapped over {}; it can over {}", .quantity.name(), names(.possible))]
    Quantity { whose: String, quantity: Quantity, possible: &'static [Quantity] },
    /// Both axes are the same quantity.
    #[error("both axes vary {}; choose two quantities", .0.name())]
    SameQuantity(Quantity),
    /// A cell's flight cannot be set up.
    #[error(transparent)]
    Flight(#[from] SetUpError),
    /// Does not happen: a plan is always found or refused.
    #[error(transparent)]
    Plan(#[from] std::convert::Infallible),
    /// A thread could not be started.
    #[error("a thread could not be started")]
    Thread(#[from] std::io::Error),
}

fn names(quantities: &[Quantity]) -> String {
    quantities.iter().map(|quantity| quantity.name()).collect::<Vec<_>>().join(", ")
}

/// Checks that two quantities are different and among those that are possible.
pub(crate) fn check(whose: &str, axes: [Axis; 2], possible: &'static [Quantity]) -> Result<(), MapError> {
    let [x, y] = axes.map(|axis| axis.quantity);
    if x == y {
        return Err(MapError::SameQuantity(x));
    }
    match [x, y].into_iter().find(|quantity| !possible.contains(quantity)) {
        Some(quantity) => Err(MapError::Quantity { whose: whose.to_owned(), quantity, possible }),
        None => Ok(()),
    }
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
            let signs: String = cells.iter().map(|cell| cell.finding.sign()).collect();
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
        writeln!(
            out,
            "{},{},finding,touchdown_speed_m_s",
            self.x.quantity.column(),
            self.y.quantity.column()
        )?;
        for (place, cell) in self.cells.iter().enumerate() {
            let (x_value, y_value) = (self.x.value(place % self.x.count), self.y.value(place / self.x.count));
            writeln!(out, "{x_value},{y_value},{},{}", cell.finding.name(), cell.touchdown_speed_m_s)?;
        }
        Ok(())
    }
}
