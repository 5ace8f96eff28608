//! Additional named vectors of a transition.

use std::ops::Range;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The maximal length of a field's name, in bytes.
pub(crate) const MAX_NAME: usize = 64;

/// An additional vector of every transition, such as the log-probability of its action.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Field {
    /// Its unique name: up to 64 ASCII letters, digits and underscores.
    pub name: String,
    /// Its length in elements; at least 1.
    pub len: usize,
}

/// Error returned for a field that is not in the configuration.
#[derive(Clone, PartialEq, Eq, Error)]
#[error(
    "there is no field `{name}` among [{}]: declare it with `BufferConfig::with_field`",
    known.join(", ")
)]
#[non_exhaustive]
pub struct UnknownField {
    /// The requested name.
    pub name: String,
    /// The names of the existing fields.
    pub known: Vec<String>,
}
debug_as_display!(UnknownField);

/// The fields of a buffer, side by side in the order of its configuration. Cheap to clone.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Fields(Arc<[Field]>);

impl Fields {
    /// Creates the fields of a checked configuration.
    pub(crate) fn new(fields: &[Field]) -> Self {
        Self(fields.into())
    }

    pub(crate) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// Returns whether there is at most one field.
    pub(crate) fn is_plain(&self) -> bool {
        self.0.len() < 2
    }

    /// Returns the fields, each with its place among the elements of all fields.
    pub(crate) fn places(&self) -> impl Iterator<Item = (&Field, Range<usize>)> {
        self.0.iter().scan(0, |end, field| {
            let start = *end;
            *end += field.len;
            Some((field, start..*end))
        })
    }

    /// Returns the place of a field among the elements of all fields.
    pub(crate) fn place(&self, name: &str) -> Result<Range<usize>, UnknownField> {
        let found = self.places().find(|(field, _)| field.name == name);
        found.map(|(_, place)| place).ok_or_else(|| UnknownField {
            name: name.to_owned(),
            known: self.0.iter().map(|field| field.name.clone()).collect(),
        })
    }
}
