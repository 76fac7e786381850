//! Plain values: what a message may be made of.

/// What a plain value is made of, for code that treats all messages alike: recording, comparing, printing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// An unsigned number of 4 bytes.
    U32,
    /// An unsigned number of 8 bytes.
    U64,
    /// A signed number of 8 bytes.
    I64,
    /// A floating-point number of 8 bytes.
    F64,
    /// So many of the same.
    Array(&'static Shape, usize),
    /// Fields one after the other.
    Struct {
        /// Name and version on the wire.
        wire_name: &'static str,
        /// What it is, for people.
        doc: &'static str,
        /// The fields in the order in which they lie.
        fields: &'static [Field],
    },
}

/// A field of a struct.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Field {
    /// Its name.
    pub name: &'static str,
    /// What it is made of.
    pub shape: &'static Shape,
    /// What it means, for people: unit, frame, order.
    pub doc: &'static str,
}

impl Shape {
    /// Size in bytes.
    pub fn size(&self) -> usize {
        match self {
            Self::U32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
            Self::Array(element, count) => element.size() * count,
            Self::Struct { fields, .. } => fields.iter().map(|field| field.shape.size()).sum(),
        }
    }
}

/// A value of fixed layout whose every bit pattern is valid.
pub trait Plain: Copy {
    /// All bits zero.
    const ZERO: Self;

    /// What it is made of.
    const SHAPE: &'static Shape;

    /// Appends the value as little-endian bytes in the order of its fields: on a little-endian machine exactly its memory.
    fn write_bytes(&self, out: &mut Vec<u8>);

    /// Takes the value from the front of `bytes`; `None` if they are too few.
    fn read_bytes(bytes: &mut &[u8]) -> Option<Self>;

    /// Whether every floating-point number in it is finite.
    fn all_finite(&self) -> bool;

    /// Calls `visit` with the name of every number below `name` and its value: `plan.zmp_m[1]`. Integers of more than 53 bits
    /// lose their lowest ones; for comparing values in a report, not for storing them.
    fn for_each_number(&self, name: &str, visit: &mut dyn FnMut(&str, f64));
}

macro_rules! plain_number {
    ($($type:ty, $shape:expr, $finite:expr;)*) => {$(
        impl Plain for $type {
            const ZERO: Self = 0 as $type;
            const SHAPE: &'static Shape = &$shape;
            fn write_bytes(&self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }
            fn read_bytes(bytes: &mut &[u8]) -> Option<Self> {
                let (head, tail) = bytes.split_first_chunk()?;
                *bytes = tail;
                Some(Self::from_le_bytes(*head))
            }
            fn all_finite(&self) -> bool {
                let finite: fn(&$type) -> bool = $finite;
                finite(self)
            }
            fn for_each_number(&self, name: &str, visit: &mut dyn FnMut(&str, f64)) {
                visit(name, *self as f64);
            }
        }
    )*};
}
plain_number! {
    u32, Shape::U32, |_| true;
    u64, Shape::U64, |_| true;
    i64, Shape::I64, |_| true;
    f64, Shape::F64, |x| x.is_finite();
}

impl<T: Plain, const N: usize> Plain for [T; N] {
    const ZERO: Self = [T::ZERO; N];
    const SHAPE: &'static Shape = &Shape::Array(T::SHAPE, N);
    fn write_bytes(&self, out: &mut Vec<u8>) {
        self.iter().for_each(|value| value.write_bytes(out));
    }
    fn read_bytes(bytes: &mut &[u8]) -> Option<Self> {
        let mut result = Self::ZERO;
        for value in &mut result {
            *value = T::read_bytes(bytes)?;
        }
        Some(result)
    }
    fn all_finite(&self) -> bool {
        self.iter().all(Plain::all_finite)
    }
    fn for_each_number(&self, name: &str, visit: &mut dyn FnMut(&str, f64)) {
        for (index, value) in self.iter().enumerate() {
            value.for_each_number(&format!("{name}[{index}]"), visit);
        }
    }
}

/// Declares a struct that may be placed in shared memory: C layout, name and size on the wire, no padding, and [`Plain`].
macro_rules! plain_struct {
    ($(#[doc = $doc:literal])* $wire_name:literal, $size:literal bytes, $name:ident {
        $($(#[doc = $field_doc:literal])* $field:ident: $type:ty,)*
    }) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
        #[type_name($wire_name)]
        #[repr(C)]
        pub struct $name {
            $($(#[doc = $field_doc])* pub $field: $type,)*
        }

        // A mismatch here means that the layout changed: give the type a new version.
        const _: [(); $size] = [(); size_of::<$name>()];
        const _: () = assert!(0 $(+ size_of::<$type>())* == size_of::<$name>(), "hidden padding");

        impl $crate::Plain for $name {
            const ZERO: Self = Self { $($field: <$type as $crate::Plain>::ZERO,)* };
            const SHAPE: &'static $crate::Shape = &$crate::Shape::Struct {
                wire_name: $wire_name,
                doc: concat!($($doc, "\n",)*),
                fields: &[$($crate::Field {
                    name: stringify!($field),
                    shape: <$type as $crate::Plain>::SHAPE,
                    doc: concat!($($field_doc, "\n",)*),
                },)*],
            };
            fn write_bytes(&self, out: &mut Vec<u8>) {
                $($crate::Plain::write_bytes(&self.$field, out);)*
            }
            fn read_bytes(bytes: &mut &[u8]) -> Option<Self> {
                Some(Self { $($field: $crate::Plain::read_bytes(bytes)?,)* })
            }
            fn all_finite(&self) -> bool {
                true $(&& $crate::Plain::all_finite(&self.$field))*
            }
            fn for_each_number(&self, name: &str, visit: &mut dyn FnMut(&str, f64)) {
                let dot = if name.is_empty() { "" } else { "." };
                $($crate::Plain::for_each_number(&self.$field, &format!("{name}{dot}{}", stringify!($field)), visit);)*
            }
        }

        impl Default for $name {
            fn default() -> Self {
                <Self as $crate::Plain>::ZERO
            }
        }
    };
}
pub(crate) use plain_struct;
