//! `urdf-rs`, with the name of the link or joint that it could not read.

use super::clean::Document;
use crate::{Item, ModelError};

pub(super) fn read(document: &Document) -> Result<urdf_rs::Robot, ModelError> {
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
