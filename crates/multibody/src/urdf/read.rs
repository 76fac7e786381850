//! `urdf-rs`, with the name of the link or joint that it could not read.

use super::clean::{Document, Element};
use crate::{Item, ModelError};
use quick_xml::Reader;
use quick_xml::events::Event;

pub(super) fn read(document: &Document) -> Result<urdf_rs::Robot, ModelError> {
    let whole = match urdf_rs::read_from_string(&document.text(document.elements.iter())) {
        Ok(robot) => return Ok(robot),
        Err(error) => error,
    };
    // The message does not say where it happened: read the elements one by one until one fails alone.
    for element in &document.elements {
        if let Err(source) = urdf_rs::read_from_string(&document.text(std::iter::once(element))) {
            return Err(wrong_number(element).unwrap_or(ModelError::Unreadable { item: element.item.clone(), source }));
        }
    }
    Err(ModelError::Unreadable { item: Item::Document, source: whole })
}

/// `urdf-rs` does not say which number it could not read: the first attribute that should be one and is none.
fn wrong_number(element: &Element) -> Option<ModelError> {
    const ONE: [&str; 13] = [
        "value",
        "ixx",
        "ixy",
        "ixz",
        "iyy",
        "iyz",
        "izz",
        "lower",
        "upper",
        "effort",
        "velocity",
        "multiplier",
        "offset",
    ];
    const THREE: [&str; 2] = ["xyz", "rpy"];
    let mut reader = Reader::from_str(&element.text);
    loop {
        let tag = match reader.read_event().ok()? {
            Event::Start(tag) | Event::Empty(tag) => tag,
            Event::Eof => return None,
            _ => continue,
        };
        for attribute in tag.attributes().flatten() {
            let name = String::from_utf8_lossy(attribute.key.as_ref()).into_owned();
            let found = String::from_utf8_lossy(&attribute.value).into_owned();
            let numbers = found.split_whitespace().filter(|word| word.parse::<f64>().is_ok()).count();
            let is_all = numbers == found.split_whitespace().count();
            let expected = match name.as_str() {
                one if ONE.contains(&one) && !(is_all && numbers == 1) => {
                    "one number with a decimal point, without unit,"
                }
                three if THREE.contains(&three) && !(is_all && numbers == 3) => {
                    "three numbers with decimal points and spaces between them"
                }
                _ => continue,
            };
            let tag = String::from_utf8_lossy(tag.name().as_ref()).into_owned();
            return Some(ModelError::Number {
                item: element.item.clone(),
                element: tag,
                attribute: name,
                found,
                expected,
            });
        }
    }
}
