//! Roles to styles. Colour only repeats what a word or a glyph already says.

use ratatui::style::{Color, Modifier, Style};

/// What a piece of text means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// A value or a sentence.
    Plain,
    /// Names and units, less important than values.
    Label,
    /// A value that is too old.
    Stale,
    /// A panel's title.
    Title,
    /// As it should be.
    Good,
    /// Worth a look.
    Caution,
    /// Wrong, or dangerous.
    Alarm,
    /// A key to press.
    Key,
}

/// How roles look on this terminal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Theme {
    /// Whether colours may be used.
    pub colour: bool,
}

impl Theme {
    /// The style of a role. Only the 16 basic colours, which the terminal's owner has chosen readable.
    pub fn style(self, role: Role) -> Style {
        let plain = Style::new();
        let coloured = |colour| if self.colour { plain.fg(colour) } else { plain };
        match role {
            Role::Plain => plain,
            Role::Label => plain.add_modifier(Modifier::DIM),
            Role::Stale => plain.add_modifier(Modifier::DIM | Modifier::ITALIC),
            Role::Title | Role::Key => plain.add_modifier(Modifier::BOLD),
            Role::Good => coloured(Color::Green),
            Role::Caution => coloured(Color::Yellow).add_modifier(Modifier::BOLD),
            Role::Alarm => coloured(Color::Red).add_modifier(Modifier::BOLD | Modifier::REVERSED),
        }
    }
}
