//! Observations with pictures of many environments, row after row.

use super::pixels::{PIXELS, PixelObservation, STATE};
use crate::gym::env::observation::{ArrayRows, BatchObservation, GoalRows, Rows};
use crate::gym::spaces::{Space, Value};
use crate::gym::vec_env::step::VecStep;
use crate::gym::wrappers::array::SharedArray;
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// Observations with pictures, the pictures and the states each row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelRows<R> {
    pixels: ArrayRows<u8>,
    state: R,
    /// Whether the pictures are one more part of the state's dictionary.
    in_dict: bool,
}

impl<R> PixelRows<R> {
    /// Returns the pictures of the first `num_rows` rows.
    #[must_use]
    pub fn pixels(&self, num_rows: usize) -> &[u8] {
        self.pixels.array(num_rows)
    }
}

impl<T, R: AsRef<GoalRows<T>>> AsRef<GoalRows<T>> for PixelRows<R> {
    fn as_ref(&self) -> &GoalRows<T> {
        self.state.as_ref()
    }
}

impl<R> AsRef<ArrayRows<u8>> for PixelRows<R> {
    fn as_ref(&self) -> &ArrayRows<u8> {
        &self.pixels
    }
}

/// The pictures in observations that have them, or that are only pictures.
impl<O: BatchObservation<Rows: AsRef<ArrayRows<u8>>>, I, A> VecStep<O, I, A> {
    /// Returns the pictures: `len` rows.
    #[must_use]
    pub fn pixels(&self) -> &[u8] {
        self.observation_rows().as_ref().array(self.len())
    }

    /// Returns the pictures to which the actions led, the last of each episode included: `len`
    /// rows.
    #[must_use]
    pub fn next_pixels(&self) -> &[u8] {
        self.next_observation_rows().as_ref().array(self.len())
    }
}

impl<O, R: Rows<O>> Rows<PixelObservation<O>> for PixelRows<R> {
    fn new(space: &Space, num_rows: usize) -> Result<Self, SpaceError> {
        let part = |key| space.as_dict().and_then(|dict| dict.get(key));
        let pixels = part(PIXELS).unwrap_or(space);
        let state = part(STATE);
        Ok(Self {
            pixels: Rows::<SharedArray<u8>>::new(pixels, num_rows)?,
            state: R::new(state.unwrap_or(space), num_rows)?,
            in_dict: state.is_none(),
        })
    }

    fn write_row(&mut self, row: usize, observation: &PixelObservation<O>) -> Result<(), EnvError> {
        self.pixels.write_row(row, &observation.pixels)?;
        self.state.write_row(row, &observation.state)
    }

    fn copy_row(&mut self, row: usize, from: &Self, from_row: usize) {
        Rows::<SharedArray<u8>>::copy_row(&mut self.pixels, row, &from.pixels, from_row);
        self.state.copy_row(row, &from.state, from_row);
    }

    fn value(&self, row: usize) -> Value {
        let pixels = (PIXELS.into(), Rows::<SharedArray<u8>>::value(&self.pixels, row));
        match self.state.value(row) {
            Value::Dict(mut parts) if self.in_dict => {
                parts.push(pixels);
                Value::Dict(parts)
            }
            state => Value::Dict(vec![(STATE.into(), state), pixels]),
        }
    }
}

impl<O: BatchObservation> BatchObservation for PixelObservation<O> {
    type Rows = PixelRows<O::Rows>;
}
