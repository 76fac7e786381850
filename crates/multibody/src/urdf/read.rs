//! `urdf-rs`, with the name of the link or joint that it could not read.

use super::clean::{Document, Element};
use crate::error::{Item, ModelError};
use quick_xml::Reader;
use quick_xml::events::Event;

pub(super) fn read(document: &Document) -> Result<urdf_rs::Robot, ModelError> {
    document.elements.iter().try_for_each(check_numbers)?;
    let whole = match urdf_rs::read_from_string(&document.text(document.elements.iter())) {
        Ok(robot) => return Ok(robot),
        Err(error) => error,
    };
    // The message does not say where it happened: read the elements one by one until one fails alone.
    for element in &document.elements {
        if let Err(source) = urdf_rs::read_from_string(&document.text(std::iter::once(element))) {
            return Err(ModelError::Unreadable { item: element.item.clone(), source });
        }
    }
    Err(ModelError::Unreadable { item: Item::Document, source: whole })
}

/// `urdf-rs` passes over what is no number among those of a vector ("1 0,5 2 3" becomes 1, 2, 3), and does not say which number it could not
/// read.
fn check_numbers(element: &Element) -> Result<(), ModelError> {
    let mut reader = Reader::from_str(&element.text);
    // What is no XML any more, `urdf-rs` refuses.
    while let Ok(event) = reader.read_event() {
        let tag = match event {
            Event::Start(tag) | Event::Empty(tag) => tag,
            Event::Eof => break,
            _ => continue,
        };
        for attribute in tag.attributes().flatten() {
            let (count, expected) = match (tag.name().as_ref(), attribute.key.as_ref()) {
                (b"mass", b"value")
                | (b"inertia", b"ixx" | b"ixy" | b"ixz" | b"iyy" | b"iyz" | b"izz")
                | (b"limit", b"lower" | b"upper" | b"effort" | b"velocity")
                | (b"mimic", b"multiplier" | b"offset") => (1, "one number with a decimal point, without unit,"),
                (b"origin", b"xyz" | b"rpy") | (b"axis", b"xyz") => {
                    (3, "three numbers with decimal points, without units, spaces between them,")
                }
                _ => continue,
            };
            let found = String::from_utf8_lossy(&attribute.value).into_owned();
            let is_number = |word: &str| word.parse::<f64>().is_ok();
            if !found.split_whitespace().all(is_number) || found.split_whitespace().count() != count {
                let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
                let (item, element) = (element.item.clone(), text(tag.name().as_ref()));
                let attribute = text(attribute.key.as_ref());
                return Err(ModelError::Number { item, element, attribute, found, expected });
            }
        }
    }
    Ok(())
}
