//! Keeps of a URDF what dynamics need.
//!
//! Shapes, materials, textures, transmissions and simulator extensions are dropped *before* `urdf-rs` sees the text: a
//! robot must not become unreadable because a `<texture/>` has no file name. The text is cut at element borders by a
//! streaming XML reader, never by searching for strings, so comments, CDATA and quoting are handled as XML defines them.

use crate::error::{Item, ModelError};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// A link or a joint, as text.
pub(super) struct Element {
    pub item: Item,
    pub text: String,
    /// The joint has a `<limit>` element.
    pub has_limit: bool,
}

/// The links and joints of a robot, in the file's order.
pub(super) struct Document {
    /// Opening tag of the root with its attributes (the URDF version decides what numbers mean).
    pub opening: String,
    pub elements: Vec<Element>,
}

impl Document {
    /// A complete URDF made of some of the elements.
    pub fn text<'a>(&'a self, elements: impl Iterator<Item = &'a Element>) -> String {
        let mut text = self.opening.clone();
        elements.for_each(|element| text.push_str(&element.text));
        text.push_str("</robot>");
        text
    }
}

pub(super) fn clean(text: &str) -> Result<Document, ModelError> {
    // Some editors begin a file with a byte-order mark, some with another; the reader would skip one and count places from behind it.
    let text = text.trim_start_matches('\u{feff}');
    let mut reader = Reader::from_str(text);
    let mut document = None;
    loop {
        let begin = position(&reader);
        match next(&mut reader, text)? {
            Event::Start(start) | Event::Empty(start) if document.is_some() => {
                return Err(ModelError::SeveralElements { second: local_name(&start), line: line(text, begin as u64) });
            }
            Event::Start(start) if start.name().as_ref() == b"robot" => {
                document = Some(robot(&mut reader, text, &start)?);
            }
            Event::Empty(start) if start.name().as_ref() == b"robot" => {
                document = Some(Document { opening: "<robot>".to_owned(), elements: Vec::new() });
            }
            Event::Start(start) | Event::Empty(start) => {
                return Err(ModelError::NotARobot { found: local_name(&start) });
            }
            Event::Eof => return document.ok_or(ModelError::NotARobot { found: String::new() }),
            _ => {}
        }
    }
}

/// Everything up to `</robot>`.
fn robot<'a>(reader: &mut Reader<&'a [u8]>, text: &'a str, start: &BytesStart) -> Result<Document, ModelError> {
    let opening = format!("<{}>", String::from_utf8_lossy(start));
    let mut elements = Vec::new();
    loop {
        let begin = position(reader);
        match next(reader, text)? {
            Event::Start(start) => match start.name().as_ref() {
                b"link" => elements.push(link(reader, text, begin, &start)?),
                b"joint" => elements.push(joint(reader, text, begin, &start)?),
                _ => skip(reader, text, &start)?,
            },
            Event::Empty(start) => {
                let item = match start.name().as_ref() {
                    b"link" => Item::Link(name(&start, text, begin)),
                    b"joint" => Item::Joint(name(&start, text, begin)),
                    _ => {
                        refuse_macro(&start)?;
                        continue;
                    }
                };
                elements.push(Element { item, text: text[begin..position(reader)].to_owned(), has_limit: false });
            }
            Event::End(_) => return Ok(Document { opening, elements }),
            Event::Eof => return Err(unclosed(reader, text, "robot")),
            _ => {}
        }
    }
}

/// A link with nothing but its `<inertial>`.
fn link<'a>(
    reader: &mut Reader<&'a [u8]>,
    text: &'a str,
    begin: usize,
    start: &BytesStart,
) -> Result<Element, ModelError> {
    let mut kept = text[begin..position(reader)].to_owned();
    loop {
        let child_begin = position(reader);
        match next(reader, text)? {
            Event::Start(child) => {
                skip(reader, text, &child)?;
                if child.name().as_ref() == b"inertial" {
                    kept.push_str(&text[child_begin..position(reader)]);
                }
            }
            Event::Empty(child) if child.name().as_ref() == b"inertial" => {
                kept.push_str(&text[child_begin..position(reader)]);
            }
            Event::Empty(child) => refuse_macro(&child)?,
            Event::End(_) => {
                kept.push_str("</link>");
                return Ok(Element { item: Item::Link(name(start, text, begin)), text: kept, has_limit: false });
            }
            Event::Eof => return Err(unclosed(reader, text, "link")),
            _ => {}
        }
    }
}

/// A joint as it is.
fn joint<'a>(
    reader: &mut Reader<&'a [u8]>,
    text: &'a str,
    begin: usize,
    start: &BytesStart,
) -> Result<Element, ModelError> {
    let mut has_limit = false;
    loop {
        match next(reader, text)? {
            Event::Start(child) => {
                has_limit |= child.name().as_ref() == b"limit";
                skip(reader, text, &child)?;
            }
            Event::Empty(child) => {
                has_limit |= child.name().as_ref() == b"limit";
                refuse_macro(&child)?;
            }
            Event::End(_) => {
                let item = Item::Joint(name(start, text, begin));
                return Ok(Element { item, text: text[begin..position(reader)].to_owned(), has_limit });
            }
            Event::Eof => return Err(unclosed(reader, text, "joint")),
            _ => {}
        }
    }
}

fn next<'a>(reader: &mut Reader<&'a [u8]>, text: &str) -> Result<Event<'a>, ModelError> {
    reader.read_event().map_err(|source| ModelError::Xml { line: line(text, reader.error_position()), source })
}

fn skip(reader: &mut Reader<&[u8]>, text: &str, start: &BytesStart) -> Result<(), ModelError> {
    refuse_macro(start)?;
    reader
        .read_to_end(start.name())
        .map(drop)
        .map_err(|source| ModelError::Xml { line: line(text, reader.error_position()), source })
}

/// The line, from 1, of a place in the text (bytes).
fn line(text: &str, place: u64) -> usize {
    let before = usize::try_from(place).map_or(text.len(), |place| place.min(text.len()));
    text.as_bytes()[..before].iter().filter(|byte| **byte == b'\n').count() + 1
}

fn refuse_macro(start: &BytesStart) -> Result<(), ModelError> {
    if start.name().as_ref().starts_with(b"xacro:") {
        return Err(ModelError::Macro { element: local_name(start) });
    }
    Ok(())
}

fn unclosed(reader: &Reader<&[u8]>, text: &str, element: &str) -> ModelError {
    let source = quick_xml::errors::IllFormedError::MissingEndTag(element.to_owned()).into();
    ModelError::Xml { line: line(text, reader.buffer_position()), source }
}

fn position(reader: &Reader<&[u8]>) -> usize {
    usize::try_from(reader.buffer_position()).expect("the text is in memory, so its length is a usize")
}

fn local_name(start: &BytesStart) -> String {
    String::from_utf8_lossy(start.name().as_ref()).into_owned()
}

/// The `name` attribute of the element that begins at a place in the text; `urdf-rs` complains where it is missing.
fn name(start: &BytesStart, text: &str, begin: usize) -> String {
    match start.try_get_attribute("name") {
        Ok(Some(attribute)) => String::from_utf8_lossy(&attribute.value).into_owned(),
        _ => format!("without a name in line {}", line(text, begin as u64)),
    }
}
