//! Gives each role of a text a style. Colour only repeats what a word or a mark already says.

use ratatui::style::{Color, Modifier, Style};

/// The role of a piece of text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextRole {
    /// A value or a sentence.
    Plain,
    /// A name or unit, less important than a value.
    Label,
    /// A value that is too old.
    Stale,
    Title,
    /// A state as it should be.
    Good,
    /// A state that needs attention.
    Caution,
    /// A wrong or dangerous state.
    Alarm,
    Key,
}

/// What the terminal can show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Theme {
    /// Whether colours may be used.
    pub colour: bool,
    /// Whether the terminal shows ASCII only.
    pub ascii: bool,
}

impl Theme {
    /// Reads what the terminal can show from the environment: `TERM`, `NO_COLOR`, and the first of `LC_ALL`,
    /// `LC_CTYPE` and `LANG` that is set (POSIX.1-2017, 8.2).
    pub fn of_environment(variable: impl Fn(&str) -> Option<String>) -> Self {
        let set = |name: &str| variable(name).filter(|value| !value.is_empty());
        let term = set("TERM").unwrap_or_default();
        // Terminals without colour.
        let grey = ["vt1", "vt2", "vt3", "ansi-m", "linux-m", "xterm-mono"];
        let colour = set("NO_COLOR").is_none() && !grey.iter().any(|name| term.starts_with(name));
        let locale = ["LC_ALL", "LC_CTYPE", "LANG"].into_iter().find_map(set).unwrap_or_default();
        let locale = locale.to_ascii_lowercase();
        let unicode = locale.contains("utf-8") || locale.contains("utf8");
        let old = ["vt1", "vt2", "vt3"].iter().any(|name| term.starts_with(name));
        Self { colour, ascii: !unicode || old }
    }

    /// Replaces `±` on a terminal that shows only ASCII.
    pub fn either_side(self, text: &str) -> String {
        if self.ascii { text.replace('±', "+-") } else { text.to_owned() }
    }

    /// The style of a role. Uses only the 16 basic colours, which users choose to be readable.
    pub fn style(self, role: TextRole) -> Style {
        let plain = Style::new();
        let coloured = |colour| if self.colour { plain.fg(colour) } else { plain };
        match role {
            TextRole::Plain => plain,
            TextRole::Label => plain.add_modifier(Modifier::DIM),
            TextRole::Stale => plain.add_modifier(Modifier::DIM | Modifier::ITALIC),
            TextRole::Title | TextRole::Key => plain.add_modifier(Modifier::BOLD),
            TextRole::Good => coloured(Color::Green),
            TextRole::Caution => coloured(Color::Yellow).add_modifier(Modifier::BOLD),
            TextRole::Alarm => coloured(Color::Red).add_modifier(Modifier::BOLD | Modifier::REVERSED),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(set: &[(&str, &str)]) -> Theme {
        Theme::of_environment(|name| {
            set.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn the_environment_says_what_the_terminal_can_show() {
        let full = Theme { colour: true, ascii: false };
        assert_eq!(of(&[("TERM", "xterm-256color"), ("LANG", "C.UTF-8")]), full);
        assert_eq!(of(&[("TERM", "tmux"), ("LC_ALL", "de_DE.utf8"), ("LANG", "C")]), full);
        assert!(of(&[("LANG", "en_US.UTF-8"), ("LC_ALL", "C")]).ascii);
        assert!(of(&[("LANG", "C")]).ascii && of(&[]).ascii);
        assert!(!of(&[("NO_COLOR", "1"), ("LANG", "C.UTF-8")]).colour);
        assert!(of(&[("NO_COLOR", ""), ("LANG", "C.UTF-8")]).colour);
        assert_eq!(of(&[("TERM", "vt100"), ("LANG", "C.UTF-8")]), Theme { colour: false, ascii: true });
    }
}
