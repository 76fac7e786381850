//! Declarations for C and C++.

use super::{bottom, everything, plain, struct_name, wrapped};
use messages::{CONTROL_PERIOD_NS, MAX_CONTACT_NODES, MAX_JOINTS, MAX_PHASES, Shape, code};

const HEAD: &str = r#"/* Layouts, codes and topics of all messages of Soleus. Made by `soleus-inspect layout --c`.
 *
 * SI units and radians; the last part of a field's name is its unit. World frame with z up; feet left, right;
 * rotations row-major; six-vectors linear part first. Little-endian, without padding. How a process belongs to a
 * domain: `soleus-launch domain --domain NAME`.
 */
#ifndef SOLEUS_MESSAGES_H
#define SOLEUS_MESSAGES_H

#include <assert.h>
#include <stddef.h>
#include <stdint.h>
"#;

/// Columns of a line.
const WIDTH: usize = 116;

/// The header.
pub fn header() -> String {
    let (topics, structs) = everything();
    let mut out = HEAD.to_string();
    let mut line = |text: &str| {
        out.push_str(text);
        out.push('\n');
    };
    line("\n/* Control period: one tick (ns). */");
    line(&format!("#define SOLEUS_CONTROL_PERIOD_NS {CONTROL_PERIOD_NS}"));
    line("/* Most joints of a robot, contact nodes of a foot, phases of a walking pattern. */");
    line(&format!("#define SOLEUS_MAX_JOINTS {MAX_JOINTS}\n#define SOLEUS_MAX_CONTACT_NODES {MAX_CONTACT_NODES}"));
    line(&format!("#define SOLEUS_MAX_PHASES {MAX_PHASES}"));
    for table in code::TABLES {
        line("");
        comment(table.doc, "", &mut line);
        line("enum {");
        for (code, name, doc) in table.rows {
            comment(doc, "    ", &mut line);
            line(&format!("    SOLEUS_{}_{} = {code},", snake(table.name), snake(name)));
        }
        line("};");
    }
    for shape in structs {
        let Shape::Struct { wire_name, doc, fields } = shape else { continue };
        let name = format!("Soleus{}", struct_name(wire_name));
        line("");
        comment(&format!("{doc} On the wire: {wire_name}."), "", &mut line);
        line(&format!("typedef struct {name} {{"));
        for field in *fields {
            comment(field.doc, "    ", &mut line);
            let (bottom, counts) = bottom(field.shape);
            let base = match bottom {
                Shape::U32 => "uint32_t".to_string(),
                Shape::U64 => "uint64_t".to_string(),
                Shape::I64 => "int64_t".to_string(),
                Shape::F64 => "double".to_string(),
                Shape::Struct { wire_name, .. } => format!("Soleus{}", struct_name(wire_name)),
                Shape::Array(..) => unreachable!("the bottom is no array"),
            };
            let counts: String = counts.iter().map(|count| format!("[{count}]")).collect();
            line(&format!("    {base} {}{counts};", field.name));
        }
        line(&format!("}} {name};"));
        line(&format!("#define SOLEUS_TYPE_{} \"{wire_name}\"", snake(struct_name(wire_name))));
        line(&format!("static_assert(sizeof({name}) == {}, \"size of {name}\");", shape.size()));
        let mut offset = 0;
        for field in *fields {
            let of = format!("offsetof({name}, {})", field.name);
            line(&format!("static_assert({of} == {offset}, \"place of {}\");", field.name));
            offset += field.shape.size();
        }
    }
    line("\n/* Topics. A topic that wakes has an iceoryx2 event of the same name: notify it after each message. */");
    for topic in &topics {
        let Shape::Struct { wire_name, .. } = topic.message else { continue };
        let row = &topic.row;
        let slice = match topic.element {
            Some(Shape::Struct { wire_name, .. }) => format!(" before a slice of {}", struct_name(wire_name)),
            _ => String::new(),
        };
        let wakes = if row.wakes { ", wakes" } else { "" };
        let rate = if row.rate_hz == 0 { "once".to_string() } else { format!("{} Hz", row.rate_hz) };
        comment(&format!("{}{slice}; {rate}{wakes}; from the {}.", struct_name(wire_name), row.from), "", &mut line);
        line(&format!("#define SOLEUS_TOPIC_{} {:?}", row.name.replace('/', "_").to_uppercase(), row.name));
    }
    line("\n#endif");
    out
}

fn comment(doc: &str, indent: &str, line: &mut impl FnMut(&str)) {
    let lines = wrapped(&plain(doc).replace("*/", "* /"), WIDTH - 6 - indent.len());
    for (at, text) in lines.iter().enumerate() {
        let start = if at == 0 { "/*" } else { " *" };
        let end = if at + 1 == lines.len() { " */" } else { "" };
        line(&format!("{indent}{start} {text}{end}"));
    }
}

/// `RobotState` is `ROBOT_STATE`.
fn snake(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_ascii_uppercase() && !out.is_empty() {
            out.push('_');
        }
        out.push(c.to_ascii_uppercase());
    }
    out
}
