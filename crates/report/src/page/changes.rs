//! Settings of a run that differ from the shipped ones.

use toml::{Table, Value};

/// The configuration files that ship.
const SHIPPED: [(&str, &str); 5] = [
    ("planner", include_str!("../../../../config/planner.toml")),
    ("estimator", include_str!("../../../../config/estimator.toml")),
    ("controller", include_str!("../../../../config/controller.toml")),
    ("simulator", include_str!("../../../../config/simulator.toml")),
    ("recorder", include_str!("../../../../config/recorder.toml")),
];

/// Keys that name places of one machine or one run.
const PLACES: [&str; 6] =
    ["robot", "sole_file", "output_file", "attachment_folder", "programs.output_folder", "settings"];

/// A setting that is another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Change {
    pub key: String,
    pub value: String,
    /// What ships; `None` if the shipped file leaves it to the default.
    pub shipped: Option<String>,
}

/// What a recording's configuration has otherwise, process by process.
pub(super) fn changes(files: &[(String, Vec<u8>)]) -> Vec<Change> {
    let mut changes = Vec::new();
    for (process, shipped) in SHIPPED {
        let file = format!("config/{process}.toml");
        let Some((_, content)) = files.iter().find(|(name, _)| *name == file) else { continue };
        let parsed = |text: &str| text.parse::<Table>().map(|table| flat(&table)).ok();
        let (Some(here), Some(there)) = (parsed(&String::from_utf8_lossy(content)), parsed(shipped)) else { continue };
        for (key, value) in &here {
            let is_place = PLACES.contains(&key.as_str());
            let shipped = there.iter().find(|(known, _)| known == key).map(|(_, value)| value.clone());
            if !is_place && shipped.as_ref() != Some(value) {
                changes.push(Change { key: format!("{process}.{key}"), value: value.clone(), shipped });
            }
        }
    }
    changes
}

/// Keys with their dots, and values as text.
fn flat(table: &Table) -> Vec<(String, String)> {
    fn walk(prefix: &str, table: &Table, out: &mut Vec<(String, String)>) {
        for (key, value) in table {
            let name = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
            match value {
                Value::Table(inner) if !inner.is_empty() => walk(&name, inner, out),
                other => out.push((name, text(other))),
            }
        }
    }
    let mut out = Vec::new();
    walk("", table, &mut out);
    out
}

/// A value so that 1 and 1.0 are the same.
fn text(value: &Value) -> String {
    match value {
        Value::Integer(integer) => integer.to_string(),
        Value::Float(float) => float.to_string(),
        Value::Array(values) => format!("[{}]", values.iter().map(text).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(process: &str, text: String) -> (String, Vec<u8>) {
        (format!("config/{process}.toml"), text.into_bytes())
    }

    #[test]
    fn shipped_files_have_no_changes_and_changed_keys_are_named() {
        let shipped: Vec<_> = SHIPPED.iter().map(|(process, text)| file(process, (*text).to_string())).collect();
        assert_eq!(changes(&shipped), []);
        let (_, planner) = SHIPPED[0];
        let mut table: Table = planner.parse().expect("it ships");
        table.insert("robot".to_string(), Value::String("/somewhere/else".to_string()));
        table.insert("news".to_string(), Value::Integer(3));
        let found = changes(&[file("planner", table.to_string())]);
        assert_eq!(found, [Change { key: "planner.news".to_string(), value: "3".to_string(), shipped: None }]);
    }
}
