//! Draws a word in large letters, five dots high with two dots per cell, to be read from a distance.

/// The width of a letter with the gap after it, columns.
pub const LETTER_COLUMNS: usize = 5;

/// The word as three lines of half blocks. Letters that no verdict uses become gaps.
pub fn word(word: &str) -> [String; 3] {
    let mut lines = [String::new(), String::new(), String::new()];
    for letter in word.chars() {
        let dots = dots(letter);
        for (row, line) in lines.iter_mut().enumerate() {
            let (upper, lower) = (dots[2 * row], dots.get(2 * row + 1).copied().unwrap_or(0));
            for column in (0..4).rev() {
                let bit = 1 << column;
                line.push(match (upper & bit != 0, lower & bit != 0) {
                    (true, true) => '█',
                    (true, false) => '▀',
                    (false, true) => '▄',
                    (false, false) => ' ',
                });
            }
            line.push(' ');
        }
    }
    lines
}

/// Five rows of four dots.
fn dots(letter: char) -> [u8; 5] {
    match letter {
        'A' => [0b0110, 0b1001, 0b1111, 0b1001, 0b1001],
        'D' => [0b1110, 0b1001, 0b1001, 0b1001, 0b1110],
        'E' => [0b1111, 0b1000, 0b1110, 0b1000, 0b1111],
        'L' => [0b1000, 0b1000, 0b1000, 0b1000, 0b1111],
        'N' => [0b1001, 0b1101, 0b1011, 0b1001, 0b1001],
        'O' => [0b0110, 0b1001, 0b1001, 0b1001, 0b0110],
        'T' => [0b1111, 0b0110, 0b0110, 0b0110, 0b0110],
        _ => [0; 5],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_letter_of_both_verdicts_exists() {
        for letter in "NOTLANDED".chars() {
            assert_ne!(dots(letter), [0; 5], "{letter}");
        }
        for line in word("NOT LANDED") {
            assert_eq!(line.chars().count(), 10 * LETTER_COLUMNS);
        }
    }
}
