//! How a message becomes protobuf: its shape and the written schema, joined by field names.

use crate::error::SchemaError;
use messages::Shape;
use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FileDescriptorSet};

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
    Packed(Number),
    /// One struct, or several of the same one after the other.
    Structs(Plan),
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
        let files = FileDescriptorSet::decode(SOLEUS).expect("our own build made it");
        let messages: Vec<DescriptorProto> = files.file.into_iter().flat_map(|file| file.message_type).collect();
        Self::of_struct(shape, &messages)
    }

    fn of_struct(shape: &Shape, messages: &[DescriptorProto]) -> Result<Self, SchemaError> {
        let Shape::Struct { wire_name, fields } = shape else {
            return Err(SchemaError::NoMessage { message: format!("{shape:?}") });
        };
        let message = messages
            .iter()
            .find(|message| wire_name.strip_prefix("soleus.") == Some(message.name()))
            .ok_or_else(|| SchemaError::NoMessage { message: (*wire_name).to_string() })?;
        let named = |field: &str| (message.name().to_string(), field.to_string());
        let mut offset = 0;
        let mut plans = Vec::with_capacity(fields.len());
        for field in *fields {
            let written = message.field.iter().find(|written| written.name() == field.name).ok_or_else(|| {
                let (message, field) = named(field.name);
                SchemaError::NoField { message, field }
            })?;
            let other_type = || {
                let (message, field) = named(field.name);
                SchemaError::OtherType { message, field }
            };
            let (element, repeated) = innermost(field.shape);
            let kind = match (element, written.r#type()) {
                (Shape::U32, Type::Uint32) => Kind::Number(Number::U32),
                (Shape::U64, Type::Uint64) => Kind::Number(Number::U64),
                (Shape::I64, Type::Sint64) => Kind::Number(Number::I64),
                (Shape::F64, Type::Double) => Kind::Number(Number::F64),
                (Shape::Struct { wire_name, .. }, Type::Message) if written.type_name() == format!(".{wire_name}") => {
                    Kind::Structs(Self::of_struct(element, messages)?)
                }
                _ => return Err(other_type()),
            };
            let kind = match kind {
                Kind::Number(number) if repeated => Kind::Packed(number),
                kind => kind,
            };
            if repeated != (written.label() == Label::Repeated) {
                return Err(other_type());
            }
            let size = field.shape.size();
            plans.push(FieldPlan { offset, size, number: written.number() as u32, kind });
            offset += size;
        }
        if let Some(unused) =
            message.field.iter().find(|written| !fields.iter().any(|field| field.name == written.name()))
        {
            let (message, field) = named(unused.name());
            return Err(SchemaError::Unused { message, field });
        }
        Ok(Self { fields: plans, size: offset })
    }
}

/// What arrays of arrays are made of, and whether it is an array at all.
fn innermost(shape: &Shape) -> (&Shape, bool) {
    match shape {
        Shape::Array(element, _) => (innermost(element).0, true),
        other => (other, false),
    }
}
