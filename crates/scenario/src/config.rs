//! One process's configuration: layers of tables, merged, read into settings.

use crate::error::{ConfigError, Origin, Problem};
use crate::locate::{inline_tables, line_at, line_of};
use crate::retired;
use crate::setting::Setting;
use serde::de::DeserializeOwned;
use serde_path_to_error::Segment;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Reads the configuration file of a process, changes single keys, and reads the result into settings.
///
/// # Errors
/// Whatever is wrong with file, keys or values; the message names them and the remedy.
pub fn load<T: DeserializeOwned>(path: &Path, settings: &[Setting]) -> Result<T, ConfigError> {
    Config::read(path)?.with_settings(settings).parse()
}

/// A configuration in layers, the later ones replacing keys of the earlier ones.
#[derive(Debug, Clone)]
pub struct Config {
    layers: Vec<Layer>,
    merged: Table,
}

#[derive(Debug, Clone)]
struct Layer {
    source: Source,
    table: Table,
}

#[derive(Debug, Clone)]
enum Source {
    /// A file with its text; `below` are the tables of the file in which the layer stands, `at` those of the configuration.
    File {
        path: PathBuf,
        text: String,
        below: Vec<String>,
        at: Vec<String>,
    },
    CommandLine,
}

impl Source {
    fn origin_of(&self, key: &[String]) -> Origin {
        match self {
            Self::File { path, text, below, at } => {
                let full: Vec<String> = below.iter().chain(key.iter().skip(at.len())).cloned().collect();
                Origin::File { path: path.clone(), line: line_of(text, &full) }
            }
            Self::CommandLine => Origin::CommandLine,
        }
    }

    /// The same as a source of keys below a table.
    fn part(&self, name: &str) -> Self {
        let mut part = self.clone();
        if let Self::File { at, .. } = &mut part {
            at.insert(0, name.to_string());
        }
        part
    }
}

impl Config {
    /// Reads a file as the only layer.
    ///
    /// # Errors
    /// If it cannot be read or is no TOML.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let text = files::read_text(path, files::CONFIG_MAX_BYTES).map_err(|source| ConfigError::Read {
            path: path.to_path_buf(),
            wanted_by: None,
            source,
        })?;
        Self::from_text(path, text)
    }

    /// Reads a file of somebody else as the only layer: no other file that it may name is opened.
    ///
    /// # Errors
    /// If it cannot be read or is no TOML.
    pub fn read_alone(path: &Path) -> Result<Self, ConfigError> {
        let text = files::read_text(path, files::CONFIG_MAX_BYTES).map_err(|source| ConfigError::Read {
            path: path.to_path_buf(),
            wanted_by: None,
            source,
        })?;
        Self::only_layer(path, text)
    }

    fn only_layer(path: &Path, text: String) -> Result<Self, ConfigError> {
        let table = parse_table(path, &text)?;
        let source = Source::File { path: path.to_path_buf(), text, below: Vec::new(), at: Vec::new() };
        // There is nothing yet that it could replace.
        Ok(Self { layers: Vec::new(), merged: Table::new() }.with_layer(source, table, |_| true))
    }

    /// Without any key.
    pub(crate) fn empty() -> Self {
        Self { layers: Vec::new(), merged: Table::new() }
    }

    /// Takes a text as the only layer; `path` says where it comes from. A table whose key `config` names a file is that file's content, with
    /// the table's other keys as changes: so a process is told what another one is told.
    ///
    /// # Errors
    /// If it, or a file it names so, is no TOML.
    pub fn from_text(path: &Path, text: String) -> Result<Self, ConfigError> {
        let mut table = parse_table(path, &text)?;
        let source = Source::File { path: path.to_path_buf(), text: text.clone(), below: Vec::new(), at: Vec::new() };
        let mut config = Self { layers: Vec::new(), merged: Table::new() };
        let mut parts = Vec::new();
        for (name, value) in &mut table {
            let Some(Value::String(base)) = value.as_table_mut().and_then(|table| table.remove("config")) else {
                continue;
            };
            let base = path.parent().unwrap_or(Path::new(".")).join(base);
            let key = [name.clone(), "config".to_string()];
            let read = files::read_text(&base, files::CONFIG_MAX_BYTES).map_err(|error| ConfigError::Read {
                path: base.clone(),
                wanted_by: Some(source.origin_of(&key)),
                source: error,
            })?;
            config = config.with_part(name, &Self::only_layer(&base, read)?);
            parts.push(vec![name.clone()]);
        }
        let inline = inline_tables(&text);
        Ok(config.with_layer(source, table, |key| inline.contains(key) && !parts.iter().any(|part| part == key)))
    }

    /// Puts another configuration below a table of this one, in place of what is there.
    pub(crate) fn with_part(mut self, name: &str, part: &Self) -> Self {
        let below = |table: &Table| Table::from_iter([(name.to_string(), Value::Table(table.clone()))]);
        for layer in &mut self.layers {
            layer.table.remove(name);
        }
        self.merged.extend(below(&part.merged));
        let layers = part.layers.iter();
        self.layers.extend(layers.map(|layer| Layer { source: layer.source.part(name), table: below(&layer.table) }));
        self
    }

    /// Adds keys from a table of another file.
    pub(crate) fn with_table(self, path: &Path, text: &str, below: &[&str], table: Table) -> Self {
        let below: Vec<String> = below.iter().map(|name| (*name).to_string()).collect();
        let inline = inline_tables(text);
        let is_whole = |key: &[String]| inline.contains(&[&below, key].concat());
        self.with_layer(
            Source::File { path: path.to_path_buf(), text: text.to_string(), below: below.clone(), at: Vec::new() },
            table,
            is_whole,
        )
    }

    /// Changes single keys, as `--set` does.
    pub fn with_settings(self, settings: &[Setting]) -> Self {
        settings.iter().fold(self, |config, setting| {
            config.with_layer(Source::CommandLine, setting.as_table(), |key| key.len() >= setting.key.len())
        })
    }

    /// `is_whole` says of which keys the layer has the whole table, which replaces the one there was.
    fn with_layer(mut self, source: Source, mut table: Table, is_whole: impl Fn(&[String]) -> bool) -> Self {
        let folder = match &source {
            Source::File { path, .. } => path.parent().unwrap_or(Path::new(".")).to_path_buf(),
            Source::CommandLine => PathBuf::from("."),
        };
        make_paths_absolute(&mut table, &folder);
        let mut replaced = Vec::new();
        merge(&mut self.merged, &table, &mut Vec::new(), &is_whole, &mut replaced);
        // What was replaced is not where anything comes from.
        for layer in &mut self.layers {
            replaced.iter().for_each(|key| forget(&mut layer.table, key));
        }
        self.layers.push(Layer { source, table });
        self
    }

    /// The merged table.
    pub fn table(&self) -> &Table {
        &self.merged
    }

    /// The merged configuration as TOML text.
    pub fn effective_text(&self) -> String {
        toml::to_string_pretty(&self.merged).expect("what was read from TOML can be written as TOML")
    }

    /// Reads the merged configuration into settings.
    ///
    /// # Errors
    /// [`ConfigError::Key`] for the first key that is unknown, missing or has a wrong value.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, ConfigError> {
        serde_path_to_error::deserialize(Value::Table(self.merged.clone())).map_err(|error| {
            let path: Vec<String> = error.path().iter().filter_map(segment_name).collect();
            self.explain(path, error.inner().message())
        })
    }

    /// An error of ours out of serde's: where the key comes from and what it should have been.
    fn explain(&self, mut key: Vec<String>, message: &str) -> ConfigError {
        let message = message.trim();
        let problem = if let Some((kind @ ("field" | "variant"), found, known)) = unknown_name(message) {
            if kind == "field" && key.last() != Some(&found) {
                key.push(found.clone());
            }
            match retired::advice(&key.join(".")) {
                Some(advice) => Problem::Retired { advice },
                None => Problem::Unknown { nearest: nearest(&found, &known), known },
            }
        } else if let Some(name) = message.strip_prefix("missing field `").and_then(|rest| rest.split('`').next()) {
            key.push(name.to_string());
            Problem::Missing
        } else {
            Problem::Invalid { reason: message.to_string() }
        };
        ConfigError::Key { origin: self.origin_of(&key), key: key.join("."), problem }
    }

    /// An error about the value of a key, for checks that settings make themselves after reading.
    pub fn invalid(&self, key: &str, reason: impl std::fmt::Display) -> ConfigError {
        let path: Vec<String> = key.split('.').map(str::to_string).collect();
        let problem = Problem::Invalid { reason: reason.to_string() };
        ConfigError::Key { origin: self.origin_of(&path), key: key.to_string(), problem }
    }

    /// Where a key comes from: the last layer that has it, else the one that has most of its tables, else the first.
    fn origin_of(&self, key: &[String]) -> Origin {
        let depth = |layer: &Layer| depth_of(&Value::Table(layer.table.clone()), key);
        // `max_by_key` takes the last of equals; a key that no layer has belongs into the first.
        let best = self.layers.iter().max_by_key(|layer| depth(layer));
        let best = best.filter(|layer| depth(layer) > 0).or(self.layers.first());
        best.map_or(Origin::CommandLine, |layer| layer.source.origin_of(key))
    }
}

pub(crate) fn parse_table(path: &Path, text: &str) -> Result<Table, ConfigError> {
    toml::from_str(text).map_err(|error| {
        let line = error.span().map(|span| line_at(text, span.start));
        let origin = Origin::File { path: path.to_path_buf(), line };
        ConfigError::Syntax { origin, reason: error.message().trim().to_string() }
    })
}

/// How many parts of the key are there.
fn depth_of(value: &Value, key: &[String]) -> usize {
    let Some((first, rest)) = key.split_first() else { return 0 };
    let below = match value {
        Value::Table(table) => table.get(first),
        Value::Array(array) => first.parse().ok().and_then(|index: usize| array.get(index)),
        _ => None,
    };
    below.map_or(0, |below| 1 + depth_of(below, rest))
}

/// Replaces keys of `base` by those of `layer`, table by table; arrays and whole tables are replaced as they are. Collects the keys of the
/// tables that were replaced.
fn merge(
    base: &mut Table,
    layer: &Table,
    above: &mut Vec<String>,
    is_whole: &impl Fn(&[String]) -> bool,
    replaced: &mut Vec<Vec<String>>,
) {
    for (key, value) in layer {
        above.push(key.clone());
        match (base.get_mut(key), value) {
            (Some(Value::Table(base)), Value::Table(layer)) if !is_whole(above) => {
                merge(base, layer, above, is_whole, replaced);
            }
            (before, _) => {
                if before.is_some_and(|value| value.is_table()) {
                    replaced.push(above.clone());
                }
                base.insert(key.clone(), value.clone());
            }
        }
        above.pop();
    }
}

/// Removes a key from a table, if it is there.
fn forget(table: &mut Table, key: &[String]) {
    match key {
        [] => {}
        [last] => drop(table.remove(last)),
        [first, rest @ ..] => {
            if let Some(Value::Table(below)) = table.get_mut(first) {
                forget(below, rest);
            }
        }
    }
}

/// Makes the paths in a table absolute against the folder of the file in which they stand.
fn make_paths_absolute(table: &mut Table, folder: &Path) {
    for (key, value) in table.iter_mut() {
        let is_path = key == "robot" || key.ends_with("_file") || key.ends_with("_folder");
        match value {
            Value::Table(below) => make_paths_absolute(below, folder),
            Value::String(path) if is_path && !path.is_empty() => {
                // Without a working directory the path stays relative, and reading the file will say so.
                if let Ok(absolute) = std::path::absolute(folder.join(&*path)) {
                    *path = tidy(&absolute).display().to_string();
                }
            }
            _ => {}
        }
    }
}

/// Takes `..` and `.` out of an absolute path.
fn tidy(path: &Path) -> PathBuf {
    let mut tidy = PathBuf::new();
    for part in path.components() {
        match part {
            std::path::Component::ParentDir => {
                tidy.pop();
            }
            std::path::Component::CurDir => {}
            other => tidy.push(other),
        }
    }
    tidy
}

fn segment_name(segment: &Segment) -> Option<String> {
    match segment {
        Segment::Map { key } => Some(key.clone()),
        Segment::Seq { index } => Some(index.to_string()),
        Segment::Enum { .. } | Segment::Unknown => None,
    }
}

/// Takes serde's "unknown field `x`, expected one of `a`, `b`" apart: what kind of name, which, and the known ones.
fn unknown_name(message: &str) -> Option<(&str, String, Vec<String>)> {
    let (kind, rest) = message.strip_prefix("unknown ")?.split_once(' ')?;
    let mut quoted = rest.split('`').skip(1).step_by(2).map(str::to_string);
    let found = quoted.next()?;
    Some((kind, found, quoted.collect()))
}

/// The known name with the fewest letters wrong, if at most a third are.
pub(crate) fn nearest(found: &str, known: &[String]) -> Option<String> {
    let distance = |name: &String| strsim::damerau_levenshtein(found, name);
    let best = known.iter().min_by_key(|name| distance(name))?;
    (distance(best) <= (found.len() / 3).max(1)).then(|| best.clone())
}
