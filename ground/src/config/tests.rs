//! Tests of the settings file, its example and the flags.

use super::*;
use crate::model::act::Act;
use crate::model::callouts::Amount;
use crate::view::theme::Palette;
use clap::{CommandFactory as _, Parser as _};

/// Every key of the example is valid without its comment mark, and the example names every key.
#[test]
fn the_example_contains_every_key() {
    let keys =
        EXAMPLE.lines().filter_map(|line| line.strip_prefix('#')).filter(|line| !line.starts_with(' '));
    let uncommented = keys.collect::<Vec<_>>().join("\n");
    let config = Config::parse(&uncommented).unwrap();
    assert!(
        !config.connect.is_empty() && config.key.is_some() && config.log.is_some() && config.tlog.is_some()
    );
    assert!(config.socket.is_some() && config.bell == Some(true) && config.alarm_command.is_some());
    assert_eq!(uncommented.lines().count(), 19, "one line a key: {uncommented}");
    assert_eq!(Config::parse(EXAMPLE), Ok(Config::default()));
}

#[test]
fn an_error_names_the_wrong_key() {
    let wrong = |text: &str| Config::parse(text).unwrap_err();
    assert!(wrong("belll = true").contains("belll"));
    assert!(wrong("connect = [\"tcp\"]").contains("udpin:ADDRESS:PORT"));
    assert!(wrong("theme = \"blue\"").contains("light"));
    assert!(wrong("sysid = 0").contains("sysid: 0 addresses every system"));
    assert!(wrong("vehicle_sysid = 256").contains("vehicle_sysid"));
    assert!(wrong("log = \"\"").contains("log: "));
    assert!(wrong("voice = \"\"").contains("voice is empty"));
    assert!(wrong("talk = \"loud\"").contains("few"));
    assert!(wrong("talk_every_s = 0.0").contains("from 0.1 to 86400"));
    assert!(wrong("keys = { arm = \"a\" }").contains("capital letter"));
    assert!(wrong("alarm_command = \" \"").contains("empty"));
}

/// A key, its value in a file, its flags, and a check that the value of the flag is used.
type Override = (&'static str, &'static str, &'static [&'static str], fn(&Cli, &Config) -> bool);

const OVERRIDES: [Override; 19] = [
    ("connect", "[\"udpin:0.0.0.0:1\"]", &["--connect", "udpin:0.0.0.0:2"], |cli, _| {
        cli.connect == [LinkAddress::UdpIn("0.0.0.0:2".to_owned())]
    }),
    ("sysid", "3", &["--sysid", "4"], |cli, _| cli.us().system_id == 4),
    ("vehicle_sysid", "3", &["--vehicle-sysid", "4"], |cli, _| cli.vehicle().system_id == 4),
    ("key", "\"a\"", &["--connect", "udpin:0.0.0.0:2", "--key", "b"], |cli, _| cli.key == Some("b".into())),
    ("crew", "\"a\"", &["--connect", "udpin:0.0.0.0:2", "--crew", "b"], |cli, _| {
        cli.crew == Some("b".into())
    }),
    ("operator", "\"Ann\"", &["--operator", "Bob"], |cli, _| cli.operator.as_deref() == Some("Bob")),
    ("mission", "\"mk2\"", &["--connect", "udpin:0.0.0.0:2", "--mission", "mk3"], |cli, _| {
        cli.mission.as_deref() == Some("mk3")
    }),
    ("checklist", "\"a\"", &["--connect", "udpin:0.0.0.0:2", "--checklist", "b"], |cli, _| {
        cli.checklist.as_deref() == Some(Path::new("b"))
    }),
    ("log", "\"a.mcap\"", &["--log", "b.mcap"], |cli, _| cli.log == Some(LogChoice::File("b.mcap".into()))),
    ("tlog", "\"a.tlog\"", &["--tlog", "none"], |cli, _| cli.tlog == Some(LogChoice::None)),
    ("socket", "\"/a\"", &["--socket", "/b"], |cli, _| cli.socket == Some("/b".into())),
    ("bell", "true", &["--bell", "false"], |_, config| config.bell == Some(false)),
    ("alarm_command", "\"a\"", &["--alarm-command", "b"], |_, config| {
        config.alarm_command.as_deref() == Some("b")
    }),
    ("characters", "\"unicode\"", &["--characters", "ascii"], |_, config| {
        config.characters == Characters::Ascii
    }),
    ("theme", "\"dark\"", &["--theme", "light"], |_, config| {
        config.theme == ThemeChoice::Palette(Palette::Light)
    }),
    ("voice", "\"a\"", &["--voice", "b"], |_, config| config.voice.as_deref() == Some("b")),
    ("talk", "\"few\"", &["--talk", "all"], |_, config| config.talk().amount == Amount::All),
    ("talk_every_s", "3", &["--talk-every-s", "4"], |_, config| config.talk().height_every.as_secs() == 4),
    ("keys", "{ theme = \"w\" }", &["--keys", "theme=z"], |_, config| {
        config.keys.name(Act::NextTheme) == "z"
    }),
];

/// Combines settings and command line as a run does.
fn together(file: &str, flags: &[&str]) -> (Cli, Config) {
    let config = Config::parse(file).unwrap();
    let mut cli = Cli::try_parse_from([&["ground"], flags].concat()).unwrap();
    config.fill(&mut cli);
    let config = config.overridden_by(&cli);
    (cli, config)
}

#[test]
fn every_key_has_a_flag_that_overrides_it() {
    let keys: Vec<&str> = EXAMPLE
        .lines()
        .filter_map(|line| line.strip_prefix('#')?.split_once(" = "))
        .map(|(key, _)| key)
        .filter(|key| !key.contains(' '))
        .collect();
    assert_eq!(OVERRIDES.map(|(key, ..)| key).as_slice(), keys);
    for (key, in_file, flags, holds) in OVERRIDES {
        let file = format!("{key} = {in_file}");
        assert!(flags.contains(&format!("--{}", key.replace('_', "-")).as_str()), "{key}: its own name");
        let (cli, config) = together(&file, flags);
        assert!(holds(&cli, &config), "{key}: the flag counts");
        let (cli, config) = together(&file, &[]);
        assert!(!holds(&cli, &config), "{key}: without the flag the file counts");
    }
}

#[test]
fn completions_and_manual_page_have_the_flag_of_every_key() {
    let (mut script, mut page) = (Vec::new(), Vec::new());
    clap_complete::generate(clap_complete::Shell::Bash, &mut Cli::command(), "ground", &mut script);
    clap_mangen::Man::new(Cli::command()).render(&mut page).unwrap();
    let (script, page) = (String::from_utf8(script).unwrap(), String::from_utf8(page).unwrap());
    for (key, ..) in OVERRIDES {
        let flag = format!("--{}", key.replace('_', "-"));
        assert!(script.contains(&flag), "{flag}");
        // A hyphen is escaped in roff.
        assert!(page.contains(&flag.replace('-', "\\-")), "{flag}");
    }
}

/// A bare `ground` flies the demonstration; it must not command a real vehicle over a link in the settings.
#[test]
fn a_bare_ground_takes_no_link_from_the_settings() {
    for bare in [&[][..], &["--auto"], &["--headless"], &["--log", "none"]] {
        assert_eq!(together("connect = [\"udpin:0.0.0.0:14550\"]", bare).0.connect, [], "{bare:?}");
    }
}

#[test]
fn flags_for_the_demonstration_and_none_override_the_file() {
    let file = "connect = [\"udpin:0.0.0.0:14550\"]";
    for demonstration in [&["daemon", "--demo"][..], &["daemon", "--seed", "2"]] {
        assert_eq!(together(file, demonstration).0.connect, []);
    }
    assert_eq!(together(file, &["daemon"]).0.connect.len(), 1);
    let (_, config) = together("alarm_command = \"aplay horn.wav\"", &["--alarm-command", "none"]);
    assert_eq!(config.alarm_command, None);
    let empty = Cli::try_parse_from(["ground", "--alarm-command", ""]);
    assert!(empty.unwrap_err().to_string().contains("--alarm-command"));
}

/// The table has a line for every key; what the file does not give is in parentheses.
#[test]
fn the_table_shows_every_key() {
    let usual = Config::default().table();
    assert_eq!(usual.lines().count(), OVERRIDES.len());
    for (key, in_file, ..) in OVERRIDES {
        let line = |table: &str| {
            let found = table.lines().find(|line| line.split(' ').next() == Some(key));
            found.unwrap_or_else(|| panic!("no line for {key} in {table}")).to_owned()
        };
        assert!(line(&usual).ends_with(')'), "{}", line(&usual));
        let given = line(&Config::parse(&format!("{key} = {in_file}")).unwrap().table());
        assert!(!given.ends_with(')'), "{given}");
        if key != "keys" {
            let value = in_file.trim_matches(['[', ']']).trim_matches('"');
            assert!(given.ends_with(value), "{given}: {value}");
        }
    }
    let keys = Config::parse("keys = { theme = \"w\", path = \"m\" }").unwrap().table();
    assert!(keys.contains("theme=w") && keys.contains("path=m"), "{keys}");
}
