//! The settings as a table, for `ground config check`.

use std::fmt::Write as _;

use clap::ValueEnum;
use protocol::identity::{GROUND, VEHICLE};

use super::Config;
use crate::cli::{Seconds, ThemeChoice};
use crate::model::act::DEFINITIONS;
use crate::model::callouts::Talk;

/// Values begin in this column.
const VALUES: usize = 15;

impl Config {
    /// One line for each key: its value, or in parentheses what holds without one.
    pub fn table(&self) -> String {
        // Named one by one, so that a new key does not compile without its line.
        let Self {
            connect,
            sysid,
            vehicle_sysid,
            key,
            crew,
            operator,
            mission,
            checklist,
            log,
            tlog,
            socket,
            bell,
            alarm_command,
            characters,
            theme,
            keys,
            voice,
            talk,
            talk_every_s,
        } = self;
        let usual = Self::default();
        let seconds = |time: std::time::Duration| time.as_secs_f64().to_string();
        let given =
            |value: Option<String>, otherwise: &str| value.unwrap_or_else(|| format!("({otherwise})"));
        let chosen = |name: String, is_usual: bool| if is_usual { format!("({name})") } else { name };
        let path = |path: &Option<std::path::PathBuf>| path.as_ref().map(|path| path.display().to_string());
        let other_keys: Vec<String> = DEFINITIONS
            .iter()
            .filter(|definition| keys.key(definition.act) != definition.usual)
            .map(|definition| format!("{}={}", definition.name, keys.name(definition.act)))
            .collect();
        let theme_name = match theme {
            ThemeChoice::Auto => "auto",
            ThemeChoice::Palette(palette) => palette.name(),
        };
        let rows = [
            ("connect", given((!connect.is_empty()).then(|| connect.join(" ")), "the demonstration")),
            ("sysid", given(sysid.map(|id| id.to_string()), &GROUND.system_id.to_string())),
            ("vehicle_sysid", given(vehicle_sysid.map(|id| id.to_string()), &VEHICLE.system_id.to_string())),
            ("key", given(path(key), "nothing is signed")),
            ("crew", given(path(crew), "nobody is named")),
            ("operator", given(operator.clone(), "the user and the terminal, or the SSH client")),
            ("mission", given(mission.clone(), "any")),
            ("checklist", given(path(checklist), "none")),
            ("log", given(log.clone(), "touchdown-YYYYMMDD-HHMMSS.mcap in the current directory")),
            ("tlog", given(tlog.clone(), "with a link: beside the log")),
            ("socket", given(path(socket), "one for each station")),
            ("bell", given(bell.map(|bell| bell.to_string()), "true")),
            ("alarm_command", given(alarm_command.clone(), "none")),
            ("characters", chosen(value_name(characters), *characters == usual.characters)),
            ("theme", chosen(theme_name.to_owned(), *theme == usual.theme)),
            ("voice", given(voice.clone(), "none")),
            ("talk", chosen(value_name(talk), *talk == usual.talk)),
            (
                "talk_every_s",
                given(
                    talk_every_s.map(|Seconds(every)| seconds(every)),
                    &seconds(Talk::default().height_every),
                ),
            ),
            ("keys", given((!other_keys.is_empty()).then(|| other_keys.join(" ")), "the usual ones")),
        ];
        let mut table = String::new();
        for (key, value) in rows {
            // Writing to a string cannot fail.
            let _ = writeln!(table, "{key:VALUES$}{value}");
        }
        table
    }
}

/// The name of a value, as in the file.
fn value_name(value: &impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}
