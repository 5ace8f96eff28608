//! Serialized values that are almost valid.

use arbitrary::Arbitrary;
use serde::{Serialize, de::DeserializeOwned};
use serde_json::Value;

use crate::numbers::{Number, numbers, with_number_replaced};

/// A serialized value: any text, or a valid value with some changes.
#[derive(Arbitrary, Debug)]
pub enum Input {
    /// Any text.
    Text(String),
    /// Changes of nodes, each by the node's number.
    Nodes(Vec<(u16, Node)>),
    /// One number replaced by a fraction, which may be NaN.
    Fraction(u16, f64),
    /// One number replaced by an integer.
    Integer(u16, u64),
}

/// What replaces a node.
#[derive(Arbitrary, Debug)]
pub enum Node {
    /// `null`.
    Null,
    /// A Boolean.
    Flag(bool),
    /// A fraction; `null` if it is not finite.
    Fraction(f64),
    /// An integer.
    Integer(u64),
    /// A string.
    Text(String),
    /// An array loses its last element, an object its first field.
    Shorter,
    /// An array gets a copy of its last element.
    Longer,
}

impl Input {
    /// Returns the value, given a valid one, if it can be deserialized.
    pub fn apply<T: Serialize + DeserializeOwned>(&self, valid: &T) -> Option<T> {
        let mut value = serde_json::to_value(valid).expect("a serializable value");
        match self {
            Self::Text(text) => serde_json::from_str(text).ok(),
            Self::Nodes(changes) => {
                for (at, node) in changes {
                    node.put(&mut value, usize::from(*at));
                }
                serde_json::from_value(value).ok()
            }
            Self::Fraction(at, number) => replaced(&value, *at, Number::Float(*number)),
            Self::Integer(at, number) => replaced(&value, *at, Number::Integer(*number)),
        }
    }
}

fn replaced<T: DeserializeOwned>(value: &Value, at: u16, number: Number) -> Option<T> {
    let numbers = numbers(value);
    let replaced = numbers.get(usize::from(at) % numbers.len().max(1))?;
    with_number_replaced(value, replaced, number).ok()
}

impl Node {
    /// Replaces the node of this number, modulo the number of nodes.
    fn put(&self, value: &mut Value, at: usize) {
        let mut left = at % count(value);
        if let Some(node) = node(value, &mut left) {
            match (self, &mut *node) {
                (Self::Null, _) => *node = Value::Null,
                (Self::Flag(flag), _) => *node = (*flag).into(),
                (Self::Fraction(number), _) => *node = (*number).into(),
                (Self::Integer(number), _) => *node = (*number).into(),
                (Self::Text(text), _) => *node = text.as_str().into(),
                (Self::Shorter, Value::Array(values)) => drop(values.pop()),
                (Self::Shorter, Value::Object(fields)) => {
                    let key = fields.keys().next().cloned();
                    drop(key.and_then(|key| fields.remove(&key)));
                }
                (Self::Longer, Value::Array(values)) => values.extend(values.last().cloned()),
                (Self::Shorter | Self::Longer, _) => {}
            }
        }
    }
}

fn count(value: &Value) -> usize {
    1 + match value {
        Value::Array(values) => values.iter().map(count).sum(),
        Value::Object(fields) => fields.values().map(count).sum(),
        _ => 0,
    }
}

/// Returns the node that has `left` others before it.
fn node<'a>(value: &'a mut Value, left: &mut usize) -> Option<&'a mut Value> {
    if *left == 0 {
        return Some(value);
    }
    *left -= 1;
    match value {
        Value::Array(values) => values.iter_mut().find_map(|value| node(value, left)),
        Value::Object(fields) => fields.values_mut().find_map(|value| node(value, left)),
        _ => None,
    }
}
