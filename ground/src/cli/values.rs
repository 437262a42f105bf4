//! The values that flags take, and how their text is parsed.

use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use clap::ValueEnum;
use protocol::dialect::TdPhase;
use serde::Deserialize;

use crate::model::words;
use crate::view::theme::Palette;

/// Where the log goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogChoice {
    /// No log.
    None,
    /// This file.
    File(PathBuf),
}

impl FromStr for LogChoice {
    type Err = String;

    fn from_str(given: &str) -> Result<Self, String> {
        match given {
            "" => Err("the name of the log is empty; give a file or `none`".to_owned()),
            "none" => Ok(Self::None),
            path => Ok(Self::File(PathBuf::from(path))),
        }
    }
}

/// Where a replay begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ReplayFrom {
    /// Time since the first frame.
    Time(Duration),
    /// The start of this phase.
    Phase(TdPhase),
}

impl FromStr for ReplayFrom {
    type Err = String;

    fn from_str(given: &str) -> Result<Self, String> {
        if let Some(phase) = words::phase_from_name(given) {
            return Ok(Self::Phase(phase));
        }
        match given.parse::<f64>() {
            Ok(seconds) if (0.0..=1e6).contains(&seconds) => Ok(Self::Time(Duration::from_secs_f64(seconds))),
            _ => Err(format!(
                "`{given}` is neither a number of seconds from 0 to 1000000 nor a phase such as POWERED"
            )),
        }
    }
}

/// How much is called out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum TalkAmount {
    /// Neither voice nor bells, except those of alarms
    Nothing,
    /// Liftoff, apogee, ignition, touchdown, verdict, parachute, NO-GO and a lost link
    Few,
    /// Also phases and every 50 m
    #[default]
    Normal,
    /// Also every 10 m below 50 m
    All,
}

/// A time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "f64")]
pub struct Seconds(pub Duration);

impl FromStr for Seconds {
    type Err = String;

    fn from_str(given: &str) -> Result<Self, String> {
        match given.parse::<f64>() {
            Ok(seconds) => Self::try_from(seconds),
            Err(_) => Err(wrong_seconds(given)),
        }
    }
}

impl TryFrom<f64> for Seconds {
    type Error = String;

    fn try_from(seconds: f64) -> Result<Self, String> {
        let accepted = (0.1..=86_400.0).contains(&seconds);
        if accepted { Ok(Self(Duration::from_secs_f64(seconds))) } else { Err(wrong_seconds(seconds)) }
    }
}

fn wrong_seconds(given: impl std::fmt::Display) -> String {
    format!("`{given}` is not a number of seconds from 0.1 to 86400")
}

/// What the terminal can show.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Characters {
    /// Decide by the environment
    #[default]
    Auto,
    /// Unicode characters
    Unicode,
    /// Only ASCII characters
    Ascii,
}

/// Which colours to use.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub enum ThemeChoice {
    /// Decide by the environment.
    #[default]
    Auto,
    Palette(Palette),
}

impl FromStr for ThemeChoice {
    type Err = String;

    fn from_str(given: &str) -> Result<Self, String> {
        if given == "auto" {
            return Ok(Self::Auto);
        }
        let found = Palette::ALL.into_iter().find(|palette| palette.name() == given);
        found.map(Self::Palette).ok_or_else(|| {
            let names = Palette::ALL.map(Palette::name).join(", ");
            format!("`{given}` is no theme; give auto, {names}")
        })
    }
}

impl TryFrom<String> for ThemeChoice {
    type Error = String;

    fn try_from(given: String) -> Result<Self, String> {
        given.parse()
    }
}
