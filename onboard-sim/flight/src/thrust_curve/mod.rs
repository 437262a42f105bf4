//! A solid motor's thrust over time, from the files the hobby exchanges: RASP (`.eng`) and `RockSim` (`.rse`).
//!
//! Thrust is piecewise linear between the file's points and nil outside them, so impulse and mean thrust are exact.
//! Propellant leaves in proportion to the impulse delivered (a constant exhaust velocity).

mod rasp;
mod rocksim;
#[cfg(test)]
mod tests;

/// One point of a thrust curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThrustPoint {
    /// Time since the thrust began, s.
    pub time_s: f64,
    /// Thrust, N.
    pub thrust_n: f64,
}

/// A motor: its thrust curve, masses and size.
#[derive(Debug, Clone, PartialEq)]
pub struct ThrustCurve {
    name: String,
    manufacturer: String,
    diameter_m: f64,
    length_m: f64,
    propellant_mass_kg: f64,
    total_mass_kg: f64,
    points: Vec<ThrustPoint>,
    /// Impulse up to each point, N s.
    impulse_n_s: Vec<f64>,
}

/// A motor file that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ThrustCurveError {
    /// A line or element is not what the format has there.
    #[error("line {line}: {field} is '{found}'; {required}")]
    BadField {
        /// Line, from 1.
        line: usize,
        /// What stands there in the format.
        field: &'static str,
        /// What was found.
        found: String,
        /// What would be accepted.
        required: &'static str,
    },
    /// The file ends before it holds a motor.
    #[error("{what} is missing; {required}")]
    Missing {
        /// What is not there.
        what: &'static str,
        /// What would be accepted.
        required: &'static str,
    },
    /// The file's name does not tell its format.
    #[error("motor file '{file_name}': names that end in .eng (RASP) and .rse (RockSim) are accepted")]
    UnknownFormat {
        /// The name.
        file_name: String,
    },
    /// The text is not XML.
    #[error("not XML: {0}")]
    Xml(String),
}

/// What a file says about a motor, before it is checked as a whole.
struct Parts {
    name: String,
    manufacturer: String,
    diameter_m: f64,
    length_m: f64,
    propellant_mass_kg: f64,
    total_mass_kg: f64,
    points: Vec<ThrustPoint>,
}

impl ThrustCurve {
    /// Reads a RASP file that holds one motor.
    ///
    /// # Errors
    ///
    /// [`ThrustCurveError`] names the line, the field and what would be accepted.
    pub fn from_rasp(text: &str) -> Result<Self, ThrustCurveError> {
        Self::from_parts(rasp::parse(text)?)
    }

    /// Reads a `RockSim` file that holds one motor.
    ///
    /// # Errors
    ///
    /// [`ThrustCurveError`] names the line, the field and what would be accepted.
    pub fn from_rocksim(text: &str) -> Result<Self, ThrustCurveError> {
        Self::from_parts(rocksim::parse(text)?)
    }

    /// Reads a motor file by the ending of its name: `.eng` or `.rse`, in any case.
    ///
    /// # Errors
    ///
    /// [`ThrustCurveError`] names the line, the field and what would be accepted.
    pub fn from_file_text(file_name: &str, text: &str) -> Result<Self, ThrustCurveError> {
        let ending = file_name.rsplit_once('.').map_or("", |(_, ending)| ending);
        if ending.eq_ignore_ascii_case("eng") {
            Self::from_rasp(text)
        } else if ending.eq_ignore_ascii_case("rse") {
            Self::from_rocksim(text)
        } else {
            Err(ThrustCurveError::UnknownFormat { file_name: file_name.to_owned() })
        }
    }

    fn from_parts(parts: Parts) -> Result<Self, ThrustCurveError> {
        let Parts { name, manufacturer, diameter_m, length_m, propellant_mass_kg, total_mass_kg, points } =
            parts;
        let mut impulse_n_s = Vec::with_capacity(points.len());
        let mut sum_n_s = 0.0;
        impulse_n_s.push(sum_n_s);
        for pair in points.windows(2) {
            if let [from, to] = pair {
                sum_n_s += 0.5 * (from.thrust_n + to.thrust_n) * (to.time_s - from.time_s);
                impulse_n_s.push(sum_n_s);
            }
        }
        if points.len() < 2 || !(sum_n_s.is_finite() && sum_n_s > 0.0) {
            return Err(ThrustCurveError::Missing {
                what: "thrust",
                required: "a motor has at least one point with thrust after the first",
            });
        }
        Ok(Self {
            name,
            manufacturer,
            diameter_m,
            length_m,
            propellant_mass_kg,
            total_mass_kg,
            points,
            impulse_n_s,
        })
    }

    /// The motor's name as its file has it ("H45W").
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The manufacturer as the file has it ("AT").
    pub fn manufacturer(&self) -> &str {
        &self.manufacturer
    }

    /// Diameter of the casing, m.
    pub fn diameter_m(&self) -> f64 {
        self.diameter_m
    }

    /// Length of the casing, m.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Propellant before ignition, kg.
    pub fn propellant_mass_kg(&self) -> f64 {
        self.propellant_mass_kg
    }

    /// Motor before ignition, kg.
    pub fn total_mass_kg(&self) -> f64 {
        self.total_mass_kg
    }

    /// The points, in order of time; at least two.
    pub fn points(&self) -> &[ThrustPoint] {
        &self.points
    }

    /// Time of the last point, s.
    pub fn burn_time_s(&self) -> f64 {
        self.points.last().map_or(0.0, |point| point.time_s)
    }

    /// Impulse of the whole burn, N s.
    pub fn total_impulse_n_s(&self) -> f64 {
        self.impulse_n_s.last().copied().unwrap_or(0.0)
    }

    /// Highest thrust, N.
    pub fn peak_thrust_n(&self) -> f64 {
        self.points.iter().fold(0.0, |peak: f64, point| peak.max(point.thrust_n))
    }

    /// The segment a time lies in: its ends and the impulse before it. `None` outside the burn.
    fn segment(&self, time_s: f64) -> Option<(ThrustPoint, ThrustPoint, f64)> {
        let after = self.points.partition_point(|point| point.time_s <= time_s);
        let from = *self.points.get(after.checked_sub(1)?)?;
        Some((from, *self.points.get(after)?, *self.impulse_n_s.get(after - 1)?))
    }

    /// Thrust at a time since it began, N; nil before and after the burn.
    pub fn thrust_at_n(&self, time_s: f64) -> f64 {
        self.segment(time_s).map_or(0.0, |(from, to, _)| interpolate_n(from, to, time_s))
    }

    /// Impulse delivered up to a time since the thrust began, N s.
    pub fn impulse_to_n_s(&self, time_s: f64) -> f64 {
        match self.segment(time_s) {
            Some((from, to, before_n_s)) => {
                let now_n = interpolate_n(from, to, time_s);
                before_n_s + 0.5 * (from.thrust_n + now_n) * (time_s - from.time_s)
            }
            None if time_s >= self.burn_time_s() => self.total_impulse_n_s(),
            None => 0.0,
        }
    }

    /// Mean thrust over `[from_s, from_s + duration_s]`, N; the thrust itself for a duration that is not positive.
    pub fn mean_thrust_n(&self, from_s: f64, duration_s: f64) -> f64 {
        if duration_s > 0.0 {
            (self.impulse_to_n_s(from_s + duration_s) - self.impulse_to_n_s(from_s)) / duration_s
        } else {
            self.thrust_at_n(from_s)
        }
    }

    /// Propellant burnt up to a time since the thrust began, kg.
    pub fn propellant_burnt_kg(&self, time_s: f64) -> f64 {
        self.propellant_mass_kg * self.impulse_to_n_s(time_s) / self.total_impulse_n_s()
    }

    /// Propellant left at a time since the thrust began, kg.
    pub fn propellant_left_kg(&self, time_s: f64) -> f64 {
        self.propellant_mass_kg - self.propellant_burnt_kg(time_s)
    }

    /// When the thrust falls through a value for the last time, s; `None` when it never reaches above it.
    pub fn falls_through_s(&self, thrust_n: f64) -> Option<f64> {
        let last_above = self.points.iter().rposition(|point| point.thrust_n > thrust_n)?;
        let from = self.points.get(last_above)?;
        let Some(to) = self.points.get(last_above + 1) else { return Some(from.time_s) };
        let share = (from.thrust_n - thrust_n) / (from.thrust_n - to.thrust_n);
        Some(from.time_s + share.min(1.0) * (to.time_s - from.time_s))
    }
}

fn interpolate_n(from: ThrustPoint, to: ThrustPoint, time_s: f64) -> f64 {
    let share = (time_s - from.time_s) / (to.time_s - from.time_s);
    from.thrust_n + share * (to.thrust_n - from.thrust_n)
}

/// A number that is finite and not negative, or the reason why not.
fn not_negative(line: usize, field: &'static str, text: &str) -> Result<f64, ThrustCurveError> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() && value >= 0.0 => Ok(value),
        _ => Err(bad(line, field, text, "a number, 0 or more, is accepted")),
    }
}

fn bad(line: usize, field: &'static str, found: &str, required: &'static str) -> ThrustCurveError {
    // A hostile file may hold a line of any length; the message need not.
    ThrustCurveError::BadField { line, field, found: found.chars().take(40).collect(), required }
}

/// Adds a point after the ones before it.
fn push_point(
    points: &mut Vec<ThrustPoint>,
    line: usize,
    time: &str,
    thrust: &str,
) -> Result<(), ThrustCurveError> {
    let point = ThrustPoint {
        time_s: not_negative(line, "time", time)?,
        thrust_n: not_negative(line, "thrust", thrust)?,
    };
    if points.last().is_some_and(|last| point.time_s <= last.time_s) {
        return Err(bad(line, "time", time, "times must increase from point to point"));
    }
    points.push(point);
    Ok(())
}

/// Both masses make sense together.
fn check_masses(line: usize, propellant_kg: f64, total_kg: f64) -> Result<(), ThrustCurveError> {
    if propellant_kg > 0.0 && propellant_kg < total_kg {
        return Ok(());
    }
    Err(bad(
        line,
        "propellant mass",
        &format!("{propellant_kg} kg of {total_kg} kg"),
        "above 0 and below the motor's total mass is accepted",
    ))
}
