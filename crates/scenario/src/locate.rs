//! Where in a text a key stands.

use std::collections::BTreeSet;
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

/// The keys of the tables that are written in braces.
pub(crate) fn inline_tables(text: &str) -> BTreeSet<Vec<String>> {
    fn collect(text: &str, table: &DeTable, key: &mut Vec<String>, found: &mut BTreeSet<Vec<String>>) {
        for (name, value) in table {
            let DeValue::Table(below) = value.get_ref() else { continue };
            key.push(name.get_ref().to_string());
            if text.as_bytes().get(value.span().start) == Some(&b'{') {
                found.insert(key.clone());
            }
            collect(text, below, key, found);
            key.pop();
        }
    }
    let mut found = BTreeSet::new();
    if let Ok(root) = DeTable::parse(text) {
        collect(text, root.get_ref(), &mut Vec::new(), &mut found);
    }
    found
}
