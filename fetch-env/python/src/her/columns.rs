//! Columns of rows to add: numbers and fields.

use her_relabel::{Field, FieldRows};
use pyo3::{prelude::*, types::PyMapping};

use crate::arrays::{Numbers, Shape};
use crate::error::{Error, Result};

/// Takes an array of this shape in double precision.
pub(super) fn numbers(name: &str, array: &Bound<'_, PyAny>, shape: &[usize]) -> Result<Vec<f64>> {
    Ok(Numbers::of_shape(name, array, shape)?.to_double())
}

/// Takes an array with one number a row, of any number of rows, in double precision.
pub(super) fn column(name: &str, array: &Bound<'_, PyAny>, rows: &str) -> Result<Vec<f64>> {
    let taken = Numbers::take(name, array)?;
    match taken.shape() {
        [_] => Ok(taken.to_double()),
        shape => {
            let shape = Shape(shape);
            Err(Error::value(format!("{name} has the shape {shape}: pass ({rows},)")))
        }
    }
}

/// Numbers of several rows.
pub(super) struct Column {
    numbers: Vec<f64>,
    len: usize,
}

impl Column {
    pub(super) fn take(
        name: &str,
        array: &Bound<'_, PyAny>,
        rows: usize,
        len: usize,
    ) -> Result<Self> {
        Ok(Self { numbers: numbers(name, array, &[rows, len])?, len })
    }

    pub(super) fn row(&self, at: usize) -> &[f64] {
        &self.numbers[at * self.len..][..self.len]
    }
}

/// The fields of steps, by name.
pub(super) struct FieldColumns(Vec<(String, Vec<f64>)>);

impl FieldColumns {
    /// Takes the fields that are given for steps whose number has this shape. Those of one element
    /// may lack their last dimension. The buffer refuses fields that it does not have.
    pub(super) fn take(
        fields: &[Field],
        given: Option<&Bound<'_, PyMapping>>,
        steps: &[usize],
    ) -> Result<Self> {
        let Some(given) = given else { return Ok(Self(Vec::new())) };
        let take = |item: Bound<'_, PyAny>| {
            let (name, array): (String, Bound<'_, PyAny>) = item.extract()?;
            let taken = Numbers::take(&name, &array)?;
            let taken = match fields.iter().find(|field| field.name == name) {
                Some(field) if field.len != 1 || taken.shape() != steps => {
                    let shape = [steps, &[field.len]].concat();
                    Numbers::of_shape(&name, &array, &shape)?
                }
                _ => taken,
            };
            Ok((name, taken.to_double()))
        };
        Ok(Self(given.items()?.iter().map(take).collect::<Result<_>>()?))
    }

    pub(super) fn rows(&self) -> Vec<FieldRows<'_, f64>> {
        self.0.iter().map(|(name, numbers)| (&**name, &**numbers)).collect()
    }
}
