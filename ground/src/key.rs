//! The keys that have a meaning, and how terminal events are reduced to them.

use crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

/// A key press.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Key {
    /// A character without Ctrl or Alt.
    Char(char),
    Enter,
    Escape,
    Backspace,
    F1,
    Up,
    Down,
    Left,
    Right,
    PageUp,
    PageDown,
    Home,
    End,
    CtrlC,
    CtrlL,
    CtrlX,
    CtrlY,
}

impl Key {
    /// The key of a terminal event; `None` for key releases and for keys without a meaning.
    pub fn from_event(event: &KeyEvent) -> Option<Self> {
        if event.kind == KeyEventKind::Release || event.modifiers.contains(KeyModifiers::ALT) {
            return None;
        }
        let ctrl = event.modifiers.contains(KeyModifiers::CONTROL);
        let key = match event.code {
            KeyCode::Char('c' | 'C') if ctrl => Some(Self::CtrlC),
            KeyCode::Char('l' | 'L') if ctrl => Some(Self::CtrlL),
            KeyCode::Char('x' | 'X') if ctrl => Some(Self::CtrlX),
            KeyCode::Char('y' | 'Y') if ctrl => Some(Self::CtrlY),
            KeyCode::Char(c) if !ctrl && !c.is_control() => {
                // Some terminals report the key with Shift instead of the capital letter.
                let shift = event.modifiers.contains(KeyModifiers::SHIFT);
                Some(Self::Char(if shift { c.to_ascii_uppercase() } else { c }))
            }
            KeyCode::Enter => Some(Self::Enter),
            KeyCode::Esc => Some(Self::Escape),
            KeyCode::Backspace => Some(Self::Backspace),
            KeyCode::F(1) => Some(Self::F1),
            KeyCode::Up => Some(Self::Up),
            KeyCode::Down => Some(Self::Down),
            KeyCode::Left => Some(Self::Left),
            KeyCode::Right => Some(Self::Right),
            KeyCode::PageUp => Some(Self::PageUp),
            KeyCode::PageDown => Some(Self::PageDown),
            KeyCode::Home => Some(Self::Home),
            KeyCode::End => Some(Self::End),
            _ => None,
        };
        // On a terminal that reports repeats, a held key is one press; only scrolling repeats.
        key.filter(|key| event.kind != KeyEventKind::Repeat || key.scrolls())
    }

    /// Whether the key only scrolls; such keys are held down on purpose.
    pub fn scrolls(self) -> bool {
        matches!(
            self,
            Self::Up
                | Self::Down
                | Self::Left
                | Self::Right
                | Self::PageUp
                | Self::PageDown
                | Self::Home
                | Self::End
        )
    }

    /// The name of the key, for the log.
    pub fn name(self) -> String {
        match self {
            Self::Char(' ') => "Space".to_owned(),
            Self::Char(c) => c.to_string(),
            Self::Escape => "Esc".to_owned(),
            Self::PageUp => "PgUp".to_owned(),
            Self::PageDown => "PgDn".to_owned(),
            key => format!("{key:?}").replace("Ctrl", "Ctrl-"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn releases_and_repeats_do_not_count() {
        let chord = |kind| KeyEvent::new_with_kind(KeyCode::Char('x'), KeyModifiers::CONTROL, kind);
        let held = |code| KeyEvent::new_with_kind(code, KeyModifiers::NONE, KeyEventKind::Repeat);
        assert_eq!(Key::from_event(&held(KeyCode::Char('q'))), None);
        assert_eq!(Key::from_event(&held(KeyCode::Down)), Some(Key::Down));
        assert_eq!(Key::from_event(&chord(KeyEventKind::Press)), Some(Key::CtrlX));
        assert_eq!(Key::from_event(&chord(KeyEventKind::Repeat)), None);
        assert_eq!(Key::from_event(&chord(KeyEventKind::Release)), None);
    }

    #[test]
    fn a_shifted_letter_is_the_capital_letter() {
        for c in ['A', 'a'] {
            let key = KeyEvent::new(KeyCode::Char(c), KeyModifiers::SHIFT);
            assert_eq!(Key::from_event(&key), Some(Key::Char('A')));
        }
    }
}
