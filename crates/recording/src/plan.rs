//! How a message becomes protobuf: its shape and the written schema, joined by field names.

use crate::error::SchemaError;
use messages::{Field, MAX_CONTACT_NODES, MAX_JOINTS, Shape};
use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorSet};
use std::collections::HashSet;
use std::sync::LazyLock;

/// The compiled `proto/soleus.proto` with everything it needs.
pub(crate) const SOLEUS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/soleus.bin"));
/// The compiled `proto/foxglove.proto` with everything it needs.
pub(crate) const FOXGLOVE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/foxglove.bin"));

/// How the bytes of a struct become the fields of a protobuf message.
#[derive(Debug)]
pub(crate) struct Plan {
    pub(crate) fields: Vec<FieldPlan>,
    /// Bytes of the struct.
    pub(crate) size: usize,
}

/// One field: where it lies, what it becomes.
#[derive(Debug)]
pub(crate) struct FieldPlan {
    pub(crate) offset: usize,
    pub(crate) size: usize,
    pub(crate) number: u32,
    pub(crate) kind: Kind,
}

#[derive(Debug)]
pub(crate) enum Kind {
    Number(Number),
    /// An array of numbers, or of arrays of them.
    Packed(Number, Stored),
    /// One struct, or several of the same one after the other.
    Structs(Plan),
}

/// How much of an array is stored. Whatever is beyond it and not zero is stored as well, so that every bit comes back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stored {
    /// All of it: plotters need arrays of one length.
    Whole,
    /// As many elements as a number at this offset of the struct says, each of so many numbers.
    Counted { offset: usize, numbers: usize },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Number {
    U32,
    U64,
    I64,
    F64,
}

impl Number {
    pub(crate) fn size(self) -> usize {
        if self == Self::U32 { 4 } else { 8 }
    }
}

impl Plan {
    /// The plan for a message of `proto/soleus.proto`.
    pub(crate) fn new(shape: &Shape) -> Result<Self, SchemaError> {
        let Shape::Struct { wire_name, .. } = shape else { return Err(no_message(&format!("{shape:?}"))) };
        Self::of_struct(shape, wire_name, &written(), Fit::Exact)
    }

    /// The plan for reading what was written after a message of `proto/soleus.proto` that may be an older version of
    /// the shape: fields that only one of both has are left out.
    pub(crate) fn reading(shape: &Shape, message: &str) -> Result<Self, SchemaError> {
        let Shape::Struct { wire_name, .. } = shape else { return Err(no_message(&format!("{shape:?}"))) };
        let fit = if *wire_name == message { Fit::Exact } else { Fit::Common };
        Self::of_struct(shape, message, &written(), fit)
    }

    /// Whether `proto/soleus.proto` has a message.
    pub(crate) fn has(message: &str) -> bool {
        static NAMES: LazyLock<HashSet<String>> =
            LazyLock::new(|| written().iter().map(|message| format!("soleus.{}", message.name())).collect());
        NAMES.contains(message)
    }

    fn of_struct(shape: &Shape, message: &str, messages: &[DescriptorProto], fit: Fit) -> Result<Self, SchemaError> {
        let Shape::Struct { fields, .. } = shape else { return Err(no_message(&format!("{shape:?}"))) };
        let message = messages
            .iter()
            .find(|found| message.strip_prefix("soleus.") == Some(found.name()))
            .ok_or_else(|| no_message(message))?;
        let named = |field: &str| (message.name().to_string(), field.to_string());
        let mut offset = 0;
        let mut plans = Vec::with_capacity(fields.len());
        for field in *fields {
            let size = field.shape.size();
            let written = message.field.iter().find(|written| written.name() == field.name);
            let Some(written) = written else {
                if fit == Fit::Common {
                    offset += size;
                    continue;
                }
                let (message, field) = named(field.name);
                return Err(SchemaError::NoField { message, field });
            };
            let other_type = || {
                let (message, field) = named(field.name);
                SchemaError::OtherType { message, field }
            };
            let nested = match innermost(field.shape).0 {
                element @ Shape::Struct { wire_name, .. } => {
                    let nested = written.type_name().trim_start_matches('.');
                    if fit == Fit::Exact && nested != *wire_name {
                        return Err(other_type());
                    }
                    Some(Self::of_struct(element, nested, messages, fit)?)
                }
                _ => None,
            };
            plans.push(plan_field(fields, field, written, offset, nested).ok_or_else(other_type)?);
            offset += size;
        }
        let unused = message.field.iter().find(|written| !fields.iter().any(|field| field.name == written.name()));
        if let (Fit::Exact, Some(unused)) = (fit, unused) {
            let (message, field) = named(unused.name());
            return Err(SchemaError::Unused { message, field });
        }
        Ok(Self { fields: plans, size: offset })
    }
}

/// How well shape and written message must fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fit {
    /// Field for field.
    Exact,
    /// What both have.
    Common,
}

/// How a field at an offset becomes one that is written; `nested` is the plan of its structs. `None` if its type is another.
pub(crate) fn plan_field(
    fields: &[Field],
    field: &Field,
    written: &FieldDescriptorProto,
    offset: usize,
    nested: Option<Plan>,
) -> Option<FieldPlan> {
    let (element, repeated) = innermost(field.shape);
    let kind = match (element, written.r#type()) {
        (Shape::U32, Type::Uint32 | Type::Enum) => Kind::Number(Number::U32),
        (Shape::U64, Type::Uint64) => Kind::Number(Number::U64),
        (Shape::I64, Type::Sint64) => Kind::Number(Number::I64),
        (Shape::F64, Type::Double) => Kind::Number(Number::F64),
        (Shape::Struct { .. }, Type::Message) => Kind::Structs(nested?),
        _ => return None,
    };
    let kind = match kind {
        Kind::Number(number) if repeated => Kind::Packed(number, stored(fields, field.shape, number)),
        kind => kind,
    };
    let same = repeated == (written.label() == Label::Repeated);
    same.then(|| FieldPlan { offset, size: field.shape.size(), number: written.number() as u32, kind })
}

/// The messages of the written schema.
pub(crate) fn written() -> Vec<DescriptorProto> {
    let files = FileDescriptorSet::decode(SOLEUS).expect("our own build made it");
    files.file.into_iter().flat_map(|file| file.message_type).collect()
}

fn no_message(message: &str) -> SchemaError {
    SchemaError::NoMessage { message: message.to_string() }
}

/// How much of an array among the fields of a struct is stored: joints and contact nodes are counted, everything else
/// is whole.
fn stored(fields: &[Field], array: &Shape, number: Number) -> Stored {
    let Shape::Array(element, capacity) = array else { return Stored::Whole };
    let count = match *capacity {
        MAX_JOINTS => "joint_count",
        MAX_CONTACT_NODES => "count",
        _ => return Stored::Whole,
    };
    let Some(index) = fields.iter().position(|field| field.name == count) else { return Stored::Whole };
    let offset = fields[..index].iter().map(|field| field.shape.size()).sum();
    Stored::Counted { offset, numbers: element.size() / number.size() }
}

/// What arrays of arrays are made of, and whether it is an array at all.
pub(crate) fn innermost(shape: &Shape) -> (&Shape, bool) {
    match shape {
        Shape::Array(element, _) => (innermost(element).0, true),
        other => (other, false),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::code::{ContactState, Fall, Limit, Mode, Order, Outcome, PhaseKind, Process, Reason, State};

    #[test]
    fn enumerations_are_those_of_the_messages() {
        let files = FileDescriptorSet::decode(SOLEUS).expect("our own build made it");
        let mut written: Vec<_> = files.file.into_iter().flat_map(|file| file.enum_type).collect();
        macro_rules! check {
            ($($code:ident),*) => {$({
                let index = written.iter().position(|found| found.name() == stringify!($code)).expect(stringify!($code));
                let found = written.remove(index);
                let plain = |name: &str| name.replace('_', "").to_lowercase();
                for code in $code::ALL {
                    let value = found.value.iter().find(|value| value.number() == code.code() as i32);
                    let name = plain(value.expect("every code is written").name());
                    assert_eq!(name, plain(concat!(stringify!($code), "_")) + &plain(&format!("{code:?}")));
                }
                let unknown = found.value.iter().filter(|value| value.name().ends_with("_UNKNOWN")).count();
                assert_eq!(found.value.len(), $code::ALL.len() + unknown, stringify!($code));
            })*};
        }
        check!(ContactState, Fall, Limit, Mode, Order, Outcome, PhaseKind, Process, Reason, State);
        assert!(written.is_empty(), "{written:?}");
    }
}
