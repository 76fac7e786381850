//! From protobuf to the bytes of a message.

use crate::plan::{Kind, Number, Plan};
use crate::wire::{Raw, take_field, take_varint, unzigzag};

/// Fills the zeroed memory of a message; `None` if the content does not fit the plan. Fields the plan does not know are skipped.
pub(crate) fn decode(plan: &Plan, mut content: &[u8], bytes: &mut [u8]) -> Option<()> {
    // How many structs of each field have come.
    let mut come = vec![0; plan.fields.len()];
    while !content.is_empty() {
        let (number, raw) = take_field(&mut content)?;
        let Some(index) = plan.fields.iter().position(|field| field.number == number) else { continue };
        let field = &plan.fields[index];
        let bytes = &mut bytes[field.offset..field.offset + field.size];
        match (&field.kind, raw) {
            (Kind::Number(Number::F64), Raw::Fixed64(value)) => bytes.copy_from_slice(&value),
            (Kind::Number(number), Raw::Varint(value)) => put(*number, value, bytes)?,
            (Kind::Packed(Number::F64, _), Raw::Bytes(packed)) => {
                bytes.get_mut(..packed.len())?.copy_from_slice(packed)
            }
            (Kind::Packed(number, _), Raw::Bytes(mut packed)) => {
                let mut places = bytes.chunks_exact_mut(number.size());
                while !packed.is_empty() {
                    put(*number, take_varint(&mut packed)?, places.next()?)?;
                }
            }
            (Kind::Structs(plan), Raw::Bytes(nested)) => {
                let start = come[index] * plan.size;
                come[index] += 1;
                decode(plan, nested, bytes.get_mut(start..start + plan.size)?)?;
            }
            _ => return None,
        }
    }
    Some(())
}

fn put(number: Number, value: u64, bytes: &mut [u8]) -> Option<()> {
    match number {
        Number::U32 => bytes.copy_from_slice(&u32::try_from(value).ok()?.to_le_bytes()),
        Number::U64 => bytes.copy_from_slice(&value.to_le_bytes()),
        Number::I64 => bytes.copy_from_slice(&unzigzag(value).to_le_bytes()),
        Number::F64 => return None,
    }
    Some(())
}

/// The field of a number in a message, as often as it is there; `None` also if that is more than `most` times.
pub(crate) fn nested(mut content: &[u8], number: u32, most: usize) -> Option<Vec<&[u8]>> {
    let mut found = Vec::new();
    while !content.is_empty() {
        if let (found_number, Raw::Bytes(bytes)) = take_field(&mut content)?
            && found_number == number
        {
            if found.len() == most {
                return None;
            }
            found.push(bytes);
        }
    }
    Some(found)
}
