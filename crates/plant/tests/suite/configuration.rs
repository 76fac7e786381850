//! The file that ships says what the code does.

use plant::{PlantSettings, PlantSoleSettings};
use serde::Deserialize;

/// What the file says to the plant; the rest is for the process around it.
#[derive(Debug, PartialEq, Deserialize)]
struct File {
    plant: PlantSettings,
    sole: PlantSoleSettings,
}

#[test]
fn the_shipped_file_shows_every_default() {
    let text = include_str!("../../../../config/simulator.toml");
    let file: File = toml::from_str(text).unwrap();
    assert_eq!(file, File { plant: PlantSettings::default(), sole: PlantSoleSettings::default() });
    // Every key of every table that is written out by the code is in the file, too.
    let written: toml::Table = toml::Table::try_from(PlantSettings::default()).unwrap();
    let shown: toml::Table = toml::from_str(text).unwrap();
    for (name, table) in &written {
        for key in table.as_table().into_iter().flat_map(toml::Table::keys) {
            let missing = name == "servo" || shown["plant"][name].get(key).is_some();
            assert!(missing, "plant.{name}.{key} is not in config/simulator.toml");
        }
    }
}
