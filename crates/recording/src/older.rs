//! Reading what former versions wrote: the schema's own names, joined with today's shapes by [`Older`]'s list of renamed fields.

use crate::decode::decode;
use crate::error::SchemaError;
use crate::plan::{Plan, innermost, plan_field, written};
use crate::wire::{Raw, take_field, unzigzag};
use messages::{Gone, Message, Older, Shape};
use prost_types::DescriptorProto;
use prost_types::field_descriptor_proto::Type;

/// How an older version of a message is read.
#[derive(Debug)]
pub(crate) struct OlderPlan {
    plan: Plan,
    /// Fields that have no place any more: number, name and whether they are signed.
    gone: Vec<(u32, String, bool)>,
}

impl OlderPlan {
    pub(crate) fn new(shape: &Shape, older: &Older) -> Result<Self, SchemaError> {
        let messages = written();
        let plan = of_struct(shape, older, &messages)?;
        let message = find(&messages, older.wire_name)?;
        let taken = |number: i32| plan.fields.iter().any(|field| i64::from(field.number) == i64::from(number));
        let gone = message.field.iter().filter(|field| !taken(field.number()));
        let gone = gone.map(|field| (field.number() as u32, field.name().to_string(), field.r#type() == Type::Sint64));
        Ok(Self { gone: gone.collect(), plan })
    }

    /// The message as it is today; `None` if the content is damaged.
    pub(crate) fn read<T: Message>(&self, content: &[u8]) -> Option<T> {
        let mut bytes = vec![0; self.plan.size];
        decode(&self.plan, content, &mut bytes)?;
        let mut message = T::read_bytes(&mut bytes.as_slice())?;
        message.complete(&self.gone(content)?);
        Some(message)
    }

    fn gone(&self, mut content: &[u8]) -> Option<Gone> {
        let mut gone = Gone::new();
        while !content.is_empty() {
            let (number, raw) = take_field(&mut content)?;
            let Some((_, name, signed)) = self.gone.iter().find(|(gone, ..)| *gone == number) else { continue };
            let whole = |value: u64| if *signed { unzigzag(value) as f64 } else { value as f64 };
            let numbers = match raw {
                Raw::Varint(value) => vec![whole(value)],
                Raw::Fixed64(bytes) => vec![f64::from_le_bytes(bytes)],
                // Only arrays of doubles have lost their place so far.
                Raw::Bytes(packed) => {
                    packed.chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().expect("eight"))).collect()
                }
            };
            gone.insert(name.clone(), numbers);
        }
        Some(gone)
    }
}

fn find<'a>(messages: &'a [DescriptorProto], name: &str) -> Result<&'a DescriptorProto, SchemaError> {
    let found = messages.iter().find(|message| name.strip_prefix("soleus.") == Some(message.name()));
    found.ok_or_else(|| SchemaError::NoMessage { message: name.to_string() })
}

fn of_struct(shape: &Shape, older: &Older, messages: &[DescriptorProto]) -> Result<Plan, SchemaError> {
    let Shape::Struct { wire_name, fields, .. } = shape else {
        return Err(SchemaError::NoMessage { message: format!("{shape:?}") });
    };
    let then = older.structs.iter().find(|(now, ..)| now == wire_name);
    let (name_then, renamed) = then.map_or((*wire_name, &[][..]), |(_, then, renamed)| (*then, *renamed));
    let Ok(message) = find(messages, name_then) else {
        // A struct that is new: nothing of it was stored.
        return Ok(Plan { fields: Vec::new(), size: shape.size() });
    };
    let (mut offset, mut plans) = (0, Vec::new());
    for field in *fields {
        let name = renamed.iter().find(|(now, _)| *now == field.name).map_or(field.name, |(_, then)| *then);
        if let Some(written) = message.field.iter().find(|written| written.name() == name) {
            let nested = match innermost(field.shape).0 {
                element @ Shape::Struct { .. } => Some(of_struct(element, older, messages)?),
                _ => None,
            };
            plans.push(plan_field(fields, field, written, offset, nested).ok_or_else(|| SchemaError::OtherType {
                message: message.name().to_string(),
                field: name.to_string(),
            })?);
        }
        offset += field.shape.size();
    }
    Ok(Plan { fields: plans, size: offset })
}
