//! Protobuf on the wire: what [`crate::encode`] and [`crate::viewer`] write and [`crate::decode`] reads.

/// Wire types.
pub(crate) const VARINT: u64 = 0;
pub(crate) const FIXED64: u64 = 1;
pub(crate) const BYTES: u64 = 2;

pub(crate) fn put_varint(out: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

pub(crate) fn put_key(out: &mut Vec<u8>, number: u32, wire_type: u64) {
    put_varint(out, u64::from(number) << 3 | wire_type);
}

pub(crate) fn put_double(out: &mut Vec<u8>, number: u32, value: f64) {
    put_key(out, number, FIXED64);
    out.extend_from_slice(&value.to_bits().to_le_bytes());
}

pub(crate) fn put_text(out: &mut Vec<u8>, number: u32, text: &str) {
    put_key(out, number, BYTES);
    put_varint(out, text.len() as u64);
    out.extend_from_slice(text.as_bytes());
}

/// Writes a field with a length in front: a message, or packed numbers.
pub(crate) fn put_nested(out: &mut Vec<u8>, number: u32, content: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    content(out);
    let content_len = out.len() - start;
    put_key(out, number, BYTES);
    put_varint(out, content_len as u64);
    let head_len = out.len() - start - content_len;
    out[start..].rotate_right(head_len);
}

/// `google.protobuf.Timestamp`.
pub(crate) fn put_time(out: &mut Vec<u8>, number: u32, time_ns: u64) {
    put_nested(out, number, |out| {
        put_key(out, 1, VARINT);
        put_varint(out, time_ns / 1_000_000_000);
        put_key(out, 2, VARINT);
        put_varint(out, time_ns % 1_000_000_000);
    });
}

/// Signed numbers, small ones of either sign first.
pub(crate) fn zigzag(value: i64) -> u64 {
    (value << 1 ^ value >> 63) as u64
}

pub(crate) fn unzigzag(value: u64) -> i64 {
    (value >> 1) as i64 ^ -((value & 1) as i64)
}

pub(crate) fn take_varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let (first, rest) = bytes.split_first()?;
        *bytes = rest;
        value |= u64::from(first & 0x7f) << shift;
        if first & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}

pub(crate) fn take<'a>(bytes: &mut &'a [u8], count: usize) -> Option<&'a [u8]> {
    let (head, tail) = bytes.split_at_checked(count)?;
    *bytes = tail;
    Some(head)
}

/// A field as it lies on the wire.
pub(crate) enum Raw<'a> {
    Varint(u64),
    Fixed64([u8; 8]),
    Bytes(&'a [u8]),
}

/// Takes the next field: its number and content.
pub(crate) fn take_field<'a>(bytes: &mut &'a [u8]) -> Option<(u32, Raw<'a>)> {
    let key = take_varint(bytes)?;
    let raw = match key & 7 {
        VARINT => Raw::Varint(take_varint(bytes)?),
        FIXED64 => Raw::Fixed64(take(bytes, 8)?.try_into().ok()?),
        BYTES => {
            let count = usize::try_from(take_varint(bytes)?).ok()?;
            Raw::Bytes(take(bytes, count)?)
        }
        _ => return None,
    };
    Some((u32::try_from(key >> 3).ok()?, raw))
}
