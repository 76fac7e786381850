//! The page: topics, then every struct once, then the codes.

use messages::topic::{self, Element, Topic, Visitor};
use messages::{Message, Shape, code};
use std::convert::Infallible;
use std::fmt::Write;

const HEAD: &str = "\
# Messages

Made by `cargo run -p messages --example messages_md > docs/messages.md`; a test keeps it true.

Every message is a C struct of `u32`, `u64`, `i64` and `f64` without padding, little-endian. Any bit pattern is a valid value.
Its name on the wire ends in the version of its layout. A changed layout gets a new version; recordings of older ones stay readable.

- Units are SI and radians. The last part of a field's name is its unit; six-vectors name both (`wrench_n_nm`).
- Rotations, shares, residuals, counts and codes are pure numbers and have no unit.
- The world frame has z up. Feet are left, right. Rotations are row-major. Six-vectors have their linear part first.
- State *k* gives deformation *k* and command *k*. The drives' ramps reach the references of command *k* at tick *k + 2*.

To add a field: change the struct in `crates/messages/src`, give it a new version there, add the new message to
`crates/recording/proto/soleus.proto`, list renamed fields in `crates/messages/src/older.rs`, make this page again, and
the layouts for Python: `soleus-inspect layout --python > python/soleus/layouts.py` (`--c` prints a C header).
";

/// The page.
pub fn page() -> String {
    let mut page = Page { text: HEAD.to_string(), structs: Vec::new() };
    page.line(
        "\n## Topics\n\nHertz are control ticks per second. *Kept* is how many past messages a late subscriber gets.\n",
    );
    page.line("| topic | message | Hz | kept | from | to |\n|---|---|---|---|---|---|");
    let Ok(()) = topic::visit(&mut page);
    page.line("\n## Layouts");
    let mut next = 0;
    while let Some(shape) = page.structs.get(next).copied() {
        page.layout(shape);
        next += 1;
    }
    page.line("\n## Codes");
    for table in code::TABLES {
        page.line(&format!("\n### {}\n\n{}\n\n| code | name | meaning |\n|---|---|---|", table.name, flat(table.doc)));
        for (code, name, doc) in table.rows {
            page.line(&format!("| {code} | {name} | {} |", flat(doc)));
        }
    }
    page.text
}

struct Page {
    text: String,
    /// Structs to be described, each once.
    structs: Vec<&'static Shape>,
}

impl Page {
    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    fn topic(&mut self, row: &topic::Row, message: &str) {
        let rate = if row.rate_hz == 0 { "once".to_string() } else { row.rate_hz.to_string() };
        let to: Vec<&str> = row.to.iter().map(|process| process.word()).collect();
        let to = if to.is_empty() { "-".to_string() } else { to.join(", ") };
        self.line(&format!("| `{}` | {message} | {rate} | {} | {} | {to} |", row.name, row.kept, row.from));
    }

    /// Name of a struct, which will be described.
    fn name(&mut self, shape: &'static Shape) -> String {
        match shape {
            Shape::Struct { wire_name, .. } => {
                if !self.structs.contains(&shape) {
                    self.structs.push(shape);
                }
                let name = wire_name.trim_start_matches("soleus.");
                format!("[{name}](#{})", name.to_lowercase())
            }
            Shape::Array(element, count) => format!("{} x {count}", self.name(element)),
            Shape::U32 => "u32".to_string(),
            Shape::U64 => "u64".to_string(),
            Shape::I64 => "i64".to_string(),
            Shape::F64 => "f64".to_string(),
        }
    }

    fn layout(&mut self, shape: &'static Shape) {
        let Shape::Struct { wire_name, doc, fields } = shape else { return };
        let name = wire_name.trim_start_matches("soleus.");
        self.line(&format!("\n### {name}\n\n{} `{wire_name}`, {} bytes.\n", flat(doc), shape.size()));
        self.line("| offset | field | type | meaning |\n|---|---|---|---|");
        let mut offset = 0;
        for field in *fields {
            let type_name = self.name(field.shape);
            let mut row = String::new();
            // Writing to a string cannot fail.
            let _ = write!(row, "| {offset} | `{}` | {type_name} | {} |", field.name, flat(field.doc));
            self.line(&row);
            offset += field.shape.size();
        }
    }
}

impl Visitor for Page {
    type Error = Infallible;

    fn message<T: Message>(&mut self, topic: Topic<T>) -> Result<(), Infallible> {
        let name = self.name(T::SHAPE);
        self.topic(&topic.row, &name);
        Ok(())
    }

    fn slice<H: Message, E: Element>(&mut self, topic: Topic<H>) -> Result<(), Infallible> {
        let (header, element) = (self.name(H::SHAPE), self.name(E::SHAPE));
        self.topic(&topic.row, &format!("{header}, then a slice of {element}"));
        Ok(())
    }
}

/// A doc comment as one line, its links as plain names.
fn flat(doc: &str) -> String {
    let words = doc.split_whitespace().collect::<Vec<_>>().join(" ");
    words
        .replace("[`crate::code::", "[`")
        .replace("[`crate::", "[`")
        .replace("[`", "`")
        .replace("`]", "`")
        .replace('|', "\\|")
}
