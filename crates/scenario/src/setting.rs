//! One key changed on the command line.

use std::str::FromStr;
use toml::{Table, Value};

/// `a.b.c=value`: a key and its new value.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// The key, table by table.
    pub key: Vec<String>,
    /// The value, read as TOML; what is no TOML value is a text.
    pub value: Value,
}

/// A setting that can be copied: a key of the planner that ships.
pub(crate) const EXAMPLE: &str = "planner.gait.cost.lambda=0.8";

/// What is no setting.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error("`{found}` is no setting: write KEY=VALUE, like {EXAMPLE}")]
pub struct SettingError {
    /// What was given.
    pub found: String,
}

impl FromStr for Setting {
    type Err = SettingError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let error = || SettingError { found: text.to_string() };
        let (key, value) = text.split_once('=').ok_or_else(error)?;
        let key: Vec<String> = key.trim().split('.').map(str::to_string).collect();
        if key.iter().any(String::is_empty) {
            return Err(error());
        }
        let value = value.trim();
        let parsed =
            toml::from_str::<Table>(&format!("value = {value}")).ok().and_then(|mut table| table.remove("value"));
        Ok(Self { key, value: parsed.unwrap_or_else(|| Value::String(value.to_string())) })
    }
}

impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}={}", self.key.join("."), self.value)
    }
}

impl Setting {
    /// The setting as a table of tables.
    pub(crate) fn as_table(&self) -> Table {
        let (last, tables) = self.key.split_last().expect("a setting has a key");
        let mut table = Table::from_iter([(last.clone(), self.value.clone())]);
        for name in tables.iter().rev() {
            table = Table::from_iter([(name.clone(), Value::Table(table))]);
        }
        table
    }

    /// The setting without the first part of its key, which is `first`.
    pub(crate) fn below(&self, first: &str) -> Option<Self> {
        match self.key.split_first() {
            Some((head, rest)) if head == first && !rest.is_empty() => {
                Some(Self { key: rest.to_vec(), value: self.value.clone() })
            }
            _ => None,
        }
    }
}
