//! Declarations for Python.

use super::{bottom, code_of, everything, plain, struct_name, wrapped};
use messages::{CONTROL_PERIOD_NS, MAX_CONTACT_NODES, MAX_JOINTS, MAX_PHASES, Shape, code};
use recording::{Labels, labels};

const HEAD: &str = r#""""Layouts, codes and topics of all messages.

Made by `soleus-inspect layout --python > python/soleus/layouts.py`; a test keeps it true.

SI units and radians; the last part of a field's name is its unit. World frame with z up; feet left, right; rotations
row-major; six-vectors linear part first.
"""

from ctypes import Structure, c_double, c_int64, c_uint32, c_uint64, sizeof
from enum import IntEnum
from typing import NamedTuple

"#;

const BETWEEN: &str = r#"

# What the elements of arrays are called in tables. Joints have the names of the robot's description.
JOINTS = "joints"
NODES = "nodes"


class Layout(Structure):
    """A message, or a part of one. LABELS: what the elements of its arrays are called, outermost first. CODES: which
    numbers are codes."""

    WIRE_NAME = ""
    LABELS = {}
    CODES = {}

    @classmethod
    def type_name(cls):
        """What iceoryx2 compares."""
        return cls.WIRE_NAME

"#;

/// Columns of a line, as in the rest of the project.
const WIDTH: usize = 116;

/// The module.
pub fn module() -> String {
    let (topics, structs) = everything();
    let mut out = HEAD.to_string();
    let mut line = |text: &str| {
        out.push_str(text);
        out.push('\n');
    };
    line("# Control period: one tick (s).");
    line(&format!("CONTROL_PERIOD_S = {}", CONTROL_PERIOD_NS as f64 * 1e-9));
    line("# Most joints of a robot, contact nodes of a foot, phases of a walking pattern.");
    line(&format!("MAX_JOINTS = {MAX_JOINTS}\nMAX_CONTACT_NODES = {MAX_CONTACT_NODES}\nMAX_PHASES = {MAX_PHASES}"));
    for table in code::TABLES {
        line(&format!("\n\nclass {}(IntEnum):", table.name));
        docstring(table.doc, &mut line);
        line("");
        for (code, name, doc) in table.rows {
            wrapped(&plain(doc), WIDTH - 6).iter().for_each(|part| line(&format!("    # {part}")));
            line(&format!("    {} = {code}", constant(name)));
        }
    }
    line(BETWEEN.trim_end());
    for shape in structs {
        structure(shape, &mut line);
    }
    line("\n\nclass Topic(NamedTuple):");
    line("    \"\"\"What travels where.\"\"\"\n");
    line("    name: str");
    line("    # The message, or the header of a slice.");
    line("    message: type");
    line("    # What the slice is made of.");
    line("    element: type | None");
    line("    # Messages per second; zero: once.");
    line("    rate_hz: int");
    line("    # How many past messages a late subscriber gets.");
    line("    kept: int");
    line("    # Whether publishing wakes those who wait.");
    line("    wakes: bool");
    line("    # Who publishes.");
    line("    publisher: Process");
    line("\n\nTOPICS = {\n    topic.name: topic\n    for topic in (");
    for topic in &topics {
        let of = |shape: &Shape| match shape {
            Shape::Struct { wire_name, .. } => struct_name(wire_name).to_string(),
            _ => unreachable!("messages are structs"),
        };
        let (message, element) = (of(topic.message), topic.element.map_or("None".to_string(), of));
        let row = &topic.row;
        let wakes = if row.wakes { "True" } else { "False" };
        let from = code::Process::TABLE.rows.iter().find(|(number, ..)| *number == row.from.code());
        let from = from.map_or(String::new(), |(_, name, _)| constant(name));
        line(&format!(
            "        Topic({:?}, {message}, {element}, {}, {}, {wakes}, Process.{from}),",
            row.name, row.rate_hz, row.kept
        ));
    }
    line("    )\n}");
    out
}

fn structure(shape: &'static Shape, line: &mut impl FnMut(&str)) {
    let Shape::Struct { wire_name, doc, fields } = shape else { return };
    line(&format!("\n\nclass {}(Layout):", struct_name(wire_name)));
    docstring(doc, line);
    line(&format!("\n    WIRE_NAME = {wire_name:?}"));
    let named: Vec<(&str, Vec<String>)> =
        fields.iter().map(|field| (field.name, label_lists(field.shape, field.name))).collect();
    let named: Vec<_> = named.iter().filter(|(_, lists)| !lists.is_empty()).collect();
    if !named.is_empty() {
        line("    LABELS = {");
        for (name, lists) in named {
            let short = format!("        {name:?}: ({},),", lists.join(", "));
            if short.len() <= WIDTH {
                line(&short);
            } else {
                line(&format!("        {name:?}: ("));
                for list in lists {
                    for part in wrapped(&format!("{list},"), WIDTH - 12) {
                        line(&format!("            {part}"));
                    }
                }
                line("        ),");
            }
        }
        line("    }");
    }
    let codes: Vec<_> =
        fields.iter().filter_map(|field| Some((field.name, code_of(field.doc)?, field.shape))).collect();
    let codes: Vec<_> = codes.iter().filter(|(_, _, shape)| matches!(bottom(shape).0, Shape::U32)).collect();
    if !codes.is_empty() {
        let pairs: Vec<String> = codes.iter().map(|(field, code, _)| format!("{field:?}: {code}")).collect();
        line(&format!("    CODES = {{{}}}", pairs.join(", ")));
    }
    line("    _fields_ = [");
    for field in *fields {
        for part in wrapped(&plain(field.doc), WIDTH - 10) {
            line(&format!("        # {part}"));
        }
        line(&format!("        ({:?}, {}),", field.name, type_name(field.shape)));
    }
    line("    ]");
    line(&format!("\n\nassert sizeof({}) == {}", struct_name(wire_name), shape.size()));
}

fn docstring(doc: &str, line: &mut impl FnMut(&str)) {
    let text = format!("\"\"\"{}\"\"\"", plain(doc));
    wrapped(&text, WIDTH - 4).iter().for_each(|part| line(&format!("    {part}")));
}

/// `c_double * 6 * 2` for two arrays of six.
fn type_name(shape: &'static Shape) -> String {
    let (bottom, counts) = bottom(shape);
    let base = match bottom {
        Shape::U32 => "c_uint32",
        Shape::U64 => "c_uint64",
        Shape::I64 => "c_int64",
        Shape::F64 => "c_double",
        Shape::Struct { wire_name, .. } => struct_name(wire_name),
        Shape::Array(..) => unreachable!("the bottom is no array"),
    };
    counts.iter().rev().fold(base.to_string(), |name, count| format!("{name} * {count}"))
}

/// The labels of each level of an array as Python writes them, outermost first.
fn label_lists(shape: &'static Shape, field: &str) -> Vec<String> {
    let Shape::Array(element, count) = shape else { return Vec::new() };
    let list = match labels(element, *count, field) {
        Labels::Joints => "JOINTS".to_string(),
        Labels::Nodes => "NODES".to_string(),
        Labels::Named(names) => {
            let quoted: Vec<String> = names.iter().map(|name| format!("{name:?}")).collect();
            format!("({})", quoted.join(", "))
        }
    };
    [vec![list], label_lists(element, field)].concat()
}

/// `SafetyStop` is `SAFETY_STOP`.
fn constant(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_ascii_uppercase() && !out.is_empty() {
            out.push('_');
        }
        out.push(c.to_ascii_uppercase());
    }
    out
}
