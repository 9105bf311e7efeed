//! Declarations in the header of a PLY file: tables of elements, their columns, and how numbers are written.

/// How numbers are written.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    Little,
    Big,
}

/// The type of a number.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Number {
    pub(super) fn bytes(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }
}

/// A column of an element.
pub(super) struct Property {
    pub(super) name: String,
    /// Type of the element count of a list property; `None` for a scalar.
    pub(super) list: Option<Number>,
    pub(super) number: Number,
}

/// A table of the file, as in "vertex" or "face".
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
    /// Line of the header that declares it.
    pub(super) line: u64,
}

impl Element {
    /// Minimum number of bytes of one element in the file.
    pub(super) fn min_bytes(&self, encoding: Encoding) -> u64 {
        let min = |property: &Property| match encoding {
            Encoding::Text => 2,
            _ => property.list.unwrap_or(property.number).bytes(),
        };
        self.properties.iter().map(min).sum()
    }

    /// The scalar property called `name`.
    pub(super) fn scalar(&self, name: &str) -> Option<&Property> {
        self.properties.iter().find(|property| property.name == name && property.list.is_none())
    }
}
