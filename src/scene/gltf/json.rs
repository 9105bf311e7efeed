//! Reads JSON into the types of the schema: what a message says about a wrong value names its place, what was found and what is
//! expected.
//!
//! Numbers are read as JSON has them: `4`, `4.0` and `4e0` are the same whole number. Objects and lists may nest as deep as they
//! like where they are skipped; where they are read, the schema says how deep.

use std::fmt::{self, Display};
use std::io::{BufReader, Read};
use std::marker::PhantomData;
use std::ops::Deref;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, DeserializeOwned, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::error::Category;

use crate::scene::error::FileLocation;
use crate::text::quoted;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Bytes between two cancellation checks.
pub(super) const POLL_INTERVAL_BYTES: usize = 1 << 18;

/// The reason why JSON was not read.
pub(super) enum JsonError {
    /// Reading was cancelled.
    Cancelled(Cancelled),
    /// Place, problem and what to do.
    Wrong(FileLocation, String, &'static str),
}

/// A reader over a byte slice that fails once its token is cancelled.
struct CancellableReader<'a> {
    rest: &'a [u8],
    token: &'a CancelToken,
}

impl Read for CancellableReader<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.token.check().map_err(std::io::Error::other)?;
        self.rest.read(buffer)
    }
}

/// Reads the JSON object `text`.
pub(super) fn parse<T: DeserializeOwned>(text: &[u8], token: &CancelToken) -> Result<T, JsonError> {
    let reader = BufReader::with_capacity(POLL_INTERVAL_BYTES, CancellableReader { rest: text, token });
    let mut parser = serde_json::Deserializer::from_reader(reader);
    let root = serde_path_to_error::deserialize::<_, Object<T>>(&mut parser);
    let result = root.map_err(|error| (error.path().to_string(), error.into_inner()));
    match result.and_then(|root| parser.end().map(|()| root).map_err(|error| (String::new(), error))) {
        Ok(Object(root)) => Ok(root),
        Err(_) if token.is_cancelled() => Err(JsonError::Cancelled(Cancelled)),
        Err((path, error)) => Err(explain(path, &error)),
    }
}

/// An error of the parser in words that do not need its source code.
fn explain(path: String, error: &serde_json::Error) -> JsonError {
    let (line, column) = (error.line() as u64, error.column() as u64);
    let text = error.to_string();
    let text = text.strip_suffix(&format!(" at line {line} column {column}")).unwrap_or(&text).replace('`', "'");
    match error.classify() {
        Category::Data => {
            let problem = match text.strip_prefix("duplicate field ") {
                Some(name) => format!("has {name} twice"),
                None => text,
            };
            let place = if path == "." || path.is_empty() { "the outermost object".to_owned() } else { path };
            JsonError::Wrong(FileLocation::Json(place), problem, "export the model again")
        }
        Category::Eof => JsonError::Wrong(
            FileLocation::Column(line, column),
            "the JSON ends too early".to_owned(),
            "the file is cut off: copy or download it again",
        ),
        Category::Syntax | Category::Io => JsonError::Wrong(
            FileLocation::Column(line, column),
            format!("is not JSON: {text}"),
            "export the model again, or correct it with a text editor",
        ),
    }
}

/// What stands where something else is expected.
enum Found {
    Bool(bool),
    Whole(u64),
    Negative(i64),
    Real(f64),
    Text(String),
    Null,
    List,
    Object,
}

impl Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(value) => write!(f, "{value}"),
            Self::Whole(number) => write!(f, "{number}"),
            Self::Negative(number) => write!(f, "{number}"),
            Self::Real(number) => write!(f, "{number:?}"),
            Self::Text(text) => write!(f, "the text {}", quoted(text)),
            Self::Null => f.write_str("null"),
            Self::List => f.write_str("a list"),
            Self::Object => f.write_str("an object"),
        }
    }
}

impl Found {
    fn instead_of<E: Error>(&self, expected: impl Display) -> E {
        E::custom(format_args!("is {self} instead of {expected}"))
    }
}

/// The methods of a visitor for scalars, each made into a [`Found`] and given to `$accept`.
macro_rules! visit_scalars {
    ($accept:expr) => {
        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a value")
        }

        fn visit_bool<E: Error>(self, value: bool) -> Result<Self::Value, E> {
            $accept(Found::Bool(value))
        }

        fn visit_u64<E: Error>(self, number: u64) -> Result<Self::Value, E> {
            $accept(Found::Whole(number))
        }

        fn visit_i64<E: Error>(self, number: i64) -> Result<Self::Value, E> {
            $accept(Found::Negative(number))
        }

        fn visit_f64<E: Error>(self, number: f64) -> Result<Self::Value, E> {
            $accept(Found::Real(number))
        }

        fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
            $accept(Found::Text(text.to_owned()))
        }

        fn visit_unit<E: Error>(self) -> Result<Self::Value, E> {
            $accept(Found::Null)
        }
    };
}

impl<'de> Deserialize<'de> for Found {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Any;
        impl<'de> Visitor<'de> for Any {
            type Value = Found;

            visit_scalars!(Ok);

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Found, A::Error> {
                while list.next_element::<IgnoredAny>()?.is_some() {}
                Ok(Found::List)
            }

            fn visit_map<A: MapAccess<'de>>(self, mut object: A) -> Result<Found, A::Error> {
                while object.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
                Ok(Found::Object)
            }
        }
        deserializer.deserialize_any(Any)
    }
}

/// A whole number of at least 0: a count, a length in bytes or an index into a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Whole(pub(super) u64);

impl Whole {
    /// The number as an index or length; numbers that no list can have become the largest.
    pub(super) fn get(self) -> usize {
        usize::try_from(self.0).unwrap_or(usize::MAX)
    }
}

impl<'de> Deserialize<'de> for Whole {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        // Above 2^53 a floating-point number no longer says which whole number is meant.
        const EXACT: f64 = 9_007_199_254_740_992.0;
        match Found::deserialize(deserializer)? {
            Found::Whole(number) => Ok(Self(number)),
            Found::Real(number) if number.fract() == 0.0 && (0.0..=EXACT).contains(&number) => Ok(Self(number as u64)),
            other => Err(other.instead_of("a whole number of at least 0")),
        }
    }
}

/// A number, rounded to 32 bits.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Real(pub(super) f32);

impl<'de> Deserialize<'de> for Real {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match Found::deserialize(deserializer)? {
            Found::Whole(number) => Ok(Self(number as f32)),
            Found::Negative(number) => Ok(Self(number as f32)),
            Found::Real(number) => Ok(Self(number as f32)),
            other => Err(other.instead_of("a number")),
        }
    }
}

/// A list of `N` numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reals<const N: usize>(pub(super) [f32; N]);

impl<'de, const N: usize> Deserialize<'de> for Reals<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let List(list) = List::<Real>::deserialize(deserializer)?;
        let numbers: Vec<f32> = list.iter().map(|number| number.0).collect();
        let numbers = <[f32; N]>::try_from(numbers);
        numbers.map(Self).map_err(|all| D::Error::custom(format_args!("has {} numbers instead of {N}", all.len())))
    }
}

/// A text.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Text(pub(super) String);

impl<'de> Deserialize<'de> for Text {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match Found::deserialize(deserializer)? {
            Found::Text(text) => Ok(Self(text)),
            other => Err(other.instead_of("a text")),
        }
    }
}

impl Deref for Text {
    type Target = str;

    fn deref(&self) -> &str {
        &self.0
    }
}

/// A text, or the text of a number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Label(pub(super) String);

impl<'de> Deserialize<'de> for Label {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match Found::deserialize(deserializer)? {
            Found::Text(text) => Ok(Self(text)),
            number @ (Found::Whole(_) | Found::Real(_)) => Ok(Self(number.to_string())),
            other => Err(other.instead_of("a text")),
        }
    }
}

/// True or false.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Flag(pub(super) bool);

impl<'de> Deserialize<'de> for Flag {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match Found::deserialize(deserializer)? {
            Found::Bool(value) => Ok(Self(value)),
            other => Err(other.instead_of("true or false")),
        }
    }
}

/// Something that is only counted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Present;

impl<'de> Deserialize<'de> for Present {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        IgnoredAny::deserialize(deserializer).map(|_| Self)
    }
}

/// A list.
#[derive(Debug, Clone)]
pub(super) struct List<T>(pub(super) Vec<T>);

impl<T> Default for List<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Deref for List<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for List<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Items<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Items<T> {
            type Value = List<T>;

            visit_scalars!(|found: Found| Err(found.instead_of("a list")));

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<List<T>, A::Error> {
                let mut items = Vec::new();
                while let Some(item) = list.next_element()? {
                    items.push(item);
                }
                Ok(List(items))
            }

            fn visit_map<A: MapAccess<'de>>(self, _: A) -> Result<List<T>, A::Error> {
                Err(Found::Object.instead_of("a list"))
            }
        }
        deserializer.deserialize_any(Items(PhantomData))
    }
}

/// An object with the fields of `T`; others are skipped.
#[derive(Debug, Clone, Default)]
pub(super) struct Object<T>(pub(super) T);

impl<T> Deref for Object<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Object<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Fields<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Fields<T> {
            type Value = Object<T>;

            visit_scalars!(|found: Found| Err(found.instead_of("an object")));

            fn visit_seq<A: SeqAccess<'de>>(self, _: A) -> Result<Object<T>, A::Error> {
                Err(Found::List.instead_of("an object"))
            }

            fn visit_map<A: MapAccess<'de>>(self, object: A) -> Result<Object<T>, A::Error> {
                T::deserialize(MapAccessDeserializer::new(object)).map(Object)
            }
        }
        deserializer.deserialize_any(Fields(PhantomData))
    }
}

/// An object whose fields are named by the file and hold indices.
#[derive(Debug, Clone, Default)]
pub(super) struct Named(pub(super) Vec<(String, Whole)>);

impl Named {
    /// The index called `name`; of several the last.
    pub(super) fn get(&self, name: &str) -> Option<usize> {
        self.0.iter().rfind(|(key, _)| key == name).map(|(_, index)| index.get())
    }
}

impl<'de> Deserialize<'de> for Named {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries;
        impl<'de> Visitor<'de> for Entries {
            type Value = Named;

            visit_scalars!(|found: Found| Err(found.instead_of("an object")));

            fn visit_seq<A: SeqAccess<'de>>(self, _: A) -> Result<Named, A::Error> {
                Err(Found::List.instead_of("an object"))
            }

            fn visit_map<A: MapAccess<'de>>(self, mut object: A) -> Result<Named, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = object.next_entry()? {
                    entries.push(entry);
                }
                Ok(Named(entries))
            }
        }
        deserializer.deserialize_any(Entries)
    }
}
