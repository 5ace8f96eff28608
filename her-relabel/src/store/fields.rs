//! Further named numbers of a transition.

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::add::arguments::{AddError, check};
use crate::{ConfigError, Scalar};

/// The most bytes of a field's name.
pub(crate) const MAX_NAME: usize = 64;

/// A vector that every transition has besides the usual ones, such as the log-probability of its
/// action.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Field {
    /// Its name: up to 64 letters, digits and underscores of ASCII, and unlike the other names.
    pub name: String,
    /// Its length in elements; at least 1.
    pub len: usize,
}

/// The name of a field and its numbers: for one step `len` of them, for several steps a row-major
/// matrix with `len` columns.
pub type FieldRows<'a, S> = (&'a str, &'a [S]);

/// There is no field of this name.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{name}` is no field: there are [{}]; name it in `fields` of the configuration", known.join(", "))]
#[non_exhaustive]
pub struct UnknownField {
    /// The name asked for.
    pub name: String,
    /// The names that there are.
    pub known: Vec<String>,
}

/// The fields of a buffer, in the order of its configuration, side by side. Cheap to clone.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Fields(Arc<[Field]>);

impl Fields {
    pub(crate) fn new(fields: &[Field]) -> Result<Self, ConfigError> {
        let mut names = BTreeSet::new();
        for Field { name, len } in fields {
            let is_plain = name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
            if !(is_plain && (1..=MAX_NAME).contains(&name.len()) && names.insert(name)) {
                return Err(ConfigError::FieldName { name: name.clone() });
            }
            if *len == 0 {
                return Err(ConfigError::Zero { name: "fields.len" });
            }
        }
        Ok(Self(fields.into()))
    }

    pub(crate) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// Whether one field is all there is, or none.
    pub(crate) fn is_plain(&self) -> bool {
        self.0.len() < 2
    }

    /// The fields, each with its place among the elements of all of them.
    pub(crate) fn places(&self) -> impl Iterator<Item = (&Field, Range<usize>)> {
        self.0.iter().scan(0, |end, field| {
            let start = *end;
            *end += field.len;
            Some((field, start..*end))
        })
    }

    /// The place of a field among the elements of all of them.
    pub(crate) fn place(&self, name: &str) -> Result<Range<usize>, UnknownField> {
        let found = self.places().find(|(field, _)| field.name == name);
        found.map(|(_, place)| place).ok_or_else(|| UnknownField {
            name: name.to_owned(),
            known: self.0.iter().map(|field| field.name.clone()).collect(),
        })
    }

    /// Checks that every field is given for `rows` steps, as elements of `T`, and nothing else.
    pub(crate) fn check<T: Scalar, S: Scalar>(
        &self,
        given: &[FieldRows<'_, S>],
        rows: usize,
    ) -> Result<(), AddError> {
        for (at, (name, values)) in given.iter().enumerate() {
            let len = self.place(name)?.len();
            if given[..at].iter().any(|(other, _)| other == name) {
                return Err(AddError::RepeatedField { name: (*name).to_owned() });
            }
            check::<T, S>(name, values, rows.saturating_mul(len))?;
        }
        let is_missing = |field: &&Field| given.iter().all(|(name, _)| *name != field.name);
        match self.0.iter().find(is_missing) {
            Some(field) => Err(AddError::MissingField { name: field.name.clone() }),
            None => Ok(()),
        }
    }
}
