//! From the bytes of a message to protobuf.

use crate::plan::{Kind, Number, Plan, Stored};
use crate::wire::{FIXED64, VARINT, put_key, put_nested, put_varint, zigzag};

/// Appends the message whose memory is `bytes`. Single numbers whose bits are all zero are left out; a negative zero
/// is not among them. Arrays have the length that [`Stored`] says.
pub(crate) fn encode(plan: &Plan, bytes: &[u8], out: &mut Vec<u8>) {
    assert_eq!(bytes.len(), plan.size, "the bytes of another message");
    let whole = bytes;
    for field in &plan.fields {
        let bytes = &whole[field.offset..field.offset + field.size];
        match &field.kind {
            Kind::Number(number) => {
                if bytes.iter().any(|byte| *byte != 0) {
                    put_key(out, field.number, if *number == Number::F64 { FIXED64 } else { VARINT });
                    put_number(*number, bytes, out);
                }
            }
            Kind::Packed(number, stored) => {
                let all = bytes.len() / number.size();
                let wanted = match *stored {
                    Stored::Whole => all,
                    Stored::Counted { offset, numbers } => {
                        let count = whole[offset..offset + 4].try_into().expect("four bytes");
                        (u32::from_le_bytes(count) as usize).saturating_mul(numbers).min(all)
                    }
                };
                let used = bytes.iter().rposition(|byte| *byte != 0).map_or(0, |last| last / number.size() + 1);
                let stored = used.max(wanted);
                if stored > 0 {
                    put_nested(out, field.number, |out| {
                        for bytes in bytes[..stored * number.size()].chunks_exact(number.size()) {
                            put_number(*number, bytes, out);
                        }
                    });
                }
            }
            Kind::Structs(plan) => {
                for bytes in bytes.chunks_exact(plan.size) {
                    put_nested(out, field.number, |out| encode(plan, bytes, out));
                }
            }
        }
    }
}

fn put_number(number: Number, bytes: &[u8], out: &mut Vec<u8>) {
    let eight = || u64::from_le_bytes(bytes.try_into().expect("eight bytes, by the plan"));
    match number {
        Number::U32 => put_varint(out, u32::from_le_bytes(bytes.try_into().expect("four bytes, by the plan")).into()),
        Number::U64 => put_varint(out, eight()),
        Number::I64 => put_varint(out, zigzag(eight() as i64)),
        Number::F64 => out.extend_from_slice(bytes),
    }
}
