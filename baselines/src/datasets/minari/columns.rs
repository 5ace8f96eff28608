//! Columns of an Arrow table.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_array::{Array, ArrayRef, FixedSizeListArray, RecordBatch};
use arrow_schema::{ArrowError, Field, FieldRef, Schema};

/// Columns with the same number of rows, at least one.
pub(super) struct Columns {
    num_rows: usize,
    fields: Vec<FieldRef>,
    arrays: Vec<ArrayRef>,
}

impl Columns {
    pub(super) const fn new(num_rows: usize) -> Self {
        Self { num_rows, fields: Vec::new(), arrays: Vec::new() }
    }

    pub(super) fn column(&mut self, name: &str, array: impl Array + 'static) {
        self.fields.push(Arc::new(Field::new(name, array.data_type().clone(), true)));
        self.arrays.push(Arc::new(array));
    }

    /// Adds a matrix.
    pub(super) fn rows(
        &mut self,
        name: &str,
        elements: impl Array + 'static,
    ) -> Result<(), ArrowError> {
        let width = i32::try_from(elements.len() / self.num_rows);
        let width =
            width.map_err(|_| ArrowError::InvalidArgumentError(format!("{name} is wide")))?;
        let item = Arc::new(Field::new("item", elements.data_type().clone(), true));
        self.column(name, FixedSizeListArray::try_new(item, width, Arc::new(elements), None)?);
        Ok(())
    }

    /// Adds a matrix of infos and, as Minari does, the shape of its rows.
    pub(super) fn shaped_rows(
        &mut self,
        name: &str,
        elements: impl Array + 'static,
    ) -> Result<(), ArrowError> {
        let width = elements.len() / self.num_rows;
        self.rows(name, elements)?;
        if let Some(field) = self.fields.last_mut() {
            let shape = HashMap::from([("shape".to_owned(), width.to_string())]);
            *field = Arc::new(field.as_ref().clone().with_metadata(shape));
        }
        Ok(())
    }

    pub(super) fn into_struct(self) -> Result<arrow_array::StructArray, ArrowError> {
        arrow_array::StructArray::try_new(self.fields.into(), self.arrays, None)
    }

    pub(super) fn into_table(self) -> Result<RecordBatch, ArrowError> {
        RecordBatch::try_new(Arc::new(Schema::new(self.fields)), self.arrays)
    }
}
