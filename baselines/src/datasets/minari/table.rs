//! An episode as a table of Arrow: a row for each state, as Minari lays it out.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_array::{
    Array, ArrayRef, BooleanArray, FixedSizeListArray, Float32Array, Float64Array, RecordBatch,
    StructArray,
};
use arrow_schema::{ArrowError, Field, FieldRef, Schema};

use crate::datasets::episode::EpisodeRecord;

/// Returns the table of an episode. Its last row has the last state, and no step.
pub(super) fn table(episode: &EpisodeRecord) -> Result<RecordBatch, ArrowError> {
    let states = episode.rewards.len() + 1;
    let doubles = |values: &[f64]| Float64Array::from(values.to_vec());
    let mut observations = Columns::new(states);
    observations.rows("observation", doubles(&episode.observations))?;
    observations.rows("achieved_goal", doubles(&episode.achieved_goals))?;
    observations.rows("desired_goal", doubles(&episode.desired_goals))?;
    let mut infos = Columns::new(states);
    // A number, as the environments of Python return it.
    let success = episode.is_success.iter().map(|success| f32::from(u8::from(*success)));
    // Rows of one number, because Minari cannot read its own copies of single ones.
    infos.shaped_rows("is_success", Float32Array::from_iter_values(success))?;
    infos.shaped_rows("distance", doubles(&episode.distances))?;
    infos.shaped_rows("sparse_reward", doubles(&episode.sparse_rewards))?;
    infos.shaped_rows("dense_reward", doubles(&episode.dense_rewards))?;
    infos.shaped_rows("qpos", doubles(&episode.qpos))?;
    infos.shaped_rows("qvel", doubles(&episode.qvel))?;
    let mut table = Columns::new(states);
    table.column("observations", observations.into_struct()?);
    table.rows("actions", Float32Array::from(padded(&episode.actions, states)))?;
    table.column("rewards", Float64Array::from(padded(&episode.rewards, states)));
    table.column("terminations", BooleanArray::from(padded(&episode.terminations, states)));
    table.column("truncations", BooleanArray::from(padded(&episode.truncations, states)));
    table.column("infos", infos.into_struct()?);
    RecordBatch::try_new(Arc::new(Schema::new(table.fields)), table.arrays)
}

/// Returns the rows of the steps with one more of zeros, which Minari ignores.
fn padded<T: Copy + Default>(rows: &[T], states: usize) -> Vec<T> {
    let width = rows.len().checked_div(states - 1).unwrap_or_default();
    let mut padded = rows.to_vec();
    padded.resize(states * width, T::default());
    padded
}

/// Columns with the same number of rows.
struct Columns {
    num_rows: usize,
    fields: Vec<FieldRef>,
    arrays: Vec<ArrayRef>,
}

impl Columns {
    const fn new(num_rows: usize) -> Self {
        Self { num_rows, fields: Vec::new(), arrays: Vec::new() }
    }

    fn column(&mut self, name: &str, array: impl Array + 'static) {
        self.fields.push(Arc::new(Field::new(name, array.data_type().clone(), true)));
        self.arrays.push(Arc::new(array));
    }

    /// Adds a matrix.
    fn rows(&mut self, name: &str, elements: impl Array + 'static) -> Result<(), ArrowError> {
        let width = i32::try_from(elements.len() / self.num_rows);
        let width =
            width.map_err(|_| ArrowError::InvalidArgumentError(format!("{name} is wide")))?;
        let item = Arc::new(Field::new("item", elements.data_type().clone(), true));
        self.column(name, FixedSizeListArray::try_new(item, width, Arc::new(elements), None)?);
        Ok(())
    }

    /// Adds a matrix of infos, of which Minari also writes the shape of a row.
    fn shaped_rows(
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

    fn into_struct(self) -> Result<StructArray, ArrowError> {
        StructArray::try_new(self.fields.into(), self.arrays, None)
    }
}
