//! Serialized values as trees, which can hold the numbers that JSON cannot: NaN and infinities.

use serde::{
    Deserialize, Deserializer, Serialize,
    de::{
        IntoDeserializer, Visitor,
        value::{Error, MapAccessDeserializer, MapDeserializer, SeqDeserializer},
    },
    forward_to_deserialize_any,
};
use serde_json::Value;

/// A number to put in the place of another.
#[derive(Clone, Copy, Debug)]
pub enum Number {
    /// A fraction.
    Float(f64),
    /// An integer.
    Integer(u64),
}

/// A tree with one number replaced.
#[derive(Clone, Copy)]
struct Tree<'a> {
    value: &'a Value,
    replaced: &'a Value,
    number: Number,
}

/// Returns copies of `value`, in each of which one of its numbers is replaced: the fractions by
/// `fractions`, the integers by `integers`. Copies that cannot be deserialized are left out.
pub fn with_each_number_replaced<T: Serialize + for<'de> Deserialize<'de>>(
    value: &T,
    fractions: &[f64],
    integers: &[u64],
) -> serde_json::Result<Vec<T>> {
    let value = serde_json::to_value(value)?;
    let copies = numbers(&value).into_iter().flat_map(|replaced| {
        let numbers: Vec<_> = if replaced.is_f64() {
            fractions.iter().copied().map(Number::Float).collect()
        } else {
            integers.iter().copied().map(Number::Integer).collect()
        };
        let copy = |number| with_number_replaced(&value, replaced, number);
        numbers.into_iter().filter_map(|number| copy(number).ok()).collect::<Vec<_>>()
    });
    Ok(copies.collect())
}

/// Returns the value of a tree in which one of the tree's [numbers] is replaced.
pub fn with_number_replaced<T: for<'de> Deserialize<'de>>(
    value: &Value,
    replaced: &Value,
    number: Number,
) -> Result<T, Error> {
    T::deserialize(Tree { value, replaced, number })
}

/// Returns all numbers of a tree.
pub fn numbers(value: &Value) -> Vec<&Value> {
    match value {
        Value::Number(_) => vec![value],
        Value::Array(values) => values.iter().flat_map(numbers).collect(),
        Value::Object(fields) => fields.values().flat_map(numbers).collect(),
        _ => Vec::new(),
    }
}

impl<'a> Tree<'a> {
    fn fields(self) -> impl Iterator<Item = (&'a str, Self)> {
        let fields = self.value.as_object().into_iter().flatten();
        fields.map(move |(key, value)| (key.as_str(), Self { value, ..self }))
    }
}

impl<'de> Deserializer<'de> for Tree<'_> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self.value {
            value if std::ptr::eq(value, self.replaced) => match self.number {
                Number::Float(number) => visitor.visit_f64(number),
                Number::Integer(number) => visitor.visit_u64(number),
            },
            Value::Null => visitor.visit_unit(),
            Value::Bool(value) => visitor.visit_bool(*value),
            Value::String(text) => visitor.visit_str(text),
            Value::Number(number) => match number.as_u64() {
                Some(number) => visitor.visit_u64(number),
                None => visitor.visit_f64(number.as_f64().unwrap_or(f64::NAN)),
            },
            Value::Array(values) => {
                let values = values.iter().map(|value| Self { value, ..self });
                visitor.visit_seq(SeqDeserializer::new(values))
            }
            Value::Object(_) => visitor.visit_map(MapDeserializer::new(self.fields())),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        if self.value.is_null() { visitor.visit_none() } else { visitor.visit_some(self) }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Error> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        match self.value {
            Value::String(text) => visitor.visit_enum(text.as_str().into_deserializer()),
            _ => {
                let fields = MapDeserializer::new(self.fields());
                visitor.visit_enum(MapAccessDeserializer::new(fields))
            }
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit
        unit_struct seq tuple tuple_struct map struct identifier ignored_any
    }
}

impl<'de> IntoDeserializer<'de, Error> for Tree<'_> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}
