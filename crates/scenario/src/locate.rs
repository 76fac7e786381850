//! Where in a text a key stands.

use toml::de::{DeTable, DeValue};

/// The line, counted from one, on which the value of a key stands; for a key that is not there, that of the last of its tables
/// that is. `None` if even the first is missing or the text is no TOML.
pub(crate) fn line_of(text: &str, key: &[String]) -> Option<usize> {
    let root = DeTable::parse(text).ok()?;
    let (first, rest) = key.split_first()?;
    let (name, mut value) = root.get_ref().get_key_value(first.as_str())?;
    let mut position = name.span().start;
    for part in rest {
        match value.get_ref() {
            DeValue::Table(table) => {
                let Some((name, below)) = table.get_key_value(part.as_str()) else { break };
                (position, value) = (name.span().start, below);
            }
            DeValue::Array(array) => {
                let Some(below) = part.parse().ok().and_then(|index: usize| array.get(index)) else { break };
                (position, value) = (below.span().start, below);
            }
            _ => break,
        }
    }
    Some(line_at(text, position))
}

/// The line, counted from one, of a position in the text.
pub(crate) fn line_at(text: &str, position: usize) -> usize {
    text.as_bytes()[..position.min(text.len())].iter().filter(|byte| **byte == b'\n').count() + 1
}
