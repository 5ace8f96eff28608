//! Observations with pictures: one, and many, row after row.

use std::{
    fmt,
    ops::{Deref, Range},
    sync::Arc,
};

use crate::gym::env::observation::{ArrayRows, BatchObservation, GoalObservation, GoalRows, Rows};
use crate::gym::spaces::{Space, Value};
use crate::gym::vec_env::step::VecStep;
use crate::gym::wrappers::array::SharedArray;
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// The key of each view, and its bytes among those of all.
pub(super) type Layout = [(Option<String>, Range<usize>)];

/// The pictures in an observation, of one view or several. Clones share their bytes.
///
/// It is the bytes of the first view's picture; [`of`](Self::of) returns those of any view.
#[derive(Clone, PartialEq)]
pub struct Pixels {
    bytes: SharedArray<u8>,
    layout: Arc<Layout>,
}

impl Pixels {
    pub(super) const fn new(bytes: SharedArray<u8>, layout: Arc<Layout>) -> Self {
        Self { bytes, layout }
    }

    /// Returns the picture of the view with this key.
    #[must_use]
    pub fn of(&self, key: &str) -> Option<&[u8]> {
        self.views().find_map(|(known, picture)| (known == Some(key)).then_some(picture))
    }

    fn views(&self) -> impl Iterator<Item = (Option<&str>, &[u8])> {
        self.layout.iter().map(|(key, bytes)| (key.as_deref(), &self.bytes[bytes.clone()]))
    }
}

impl Deref for Pixels {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.views().next().map_or(&[], |(_, picture)| picture)
    }
}

impl fmt::Debug for Pixels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Pixels").field("bytes", &self.bytes).finish_non_exhaustive()
    }
}

impl BatchObservation for Pixels {
    type Rows = PictureRows;
}

/// Key of the pictures in the space.
pub(super) const PIXELS: &str = "pixels";
/// Key of the state in the space, if the state is not a dictionary itself.
pub(super) const STATE: &str = "state";

/// Observation of an [`AddRenderObservation`](crate::AddRenderObservation).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PixelObservation<O> {
    /// The pictures.
    pub pixels: Pixels,
    /// Observation of the wrapped environment.
    pub state: O,
}

/// The vectors are those of the state; the pixels are a field.
impl<O: GoalObservation> GoalObservation for PixelObservation<O> {
    type Element = O::Element;

    fn observation(&self) -> &[O::Element] {
        self.state.observation()
    }

    fn achieved_goal(&self) -> &[f64] {
        self.state.achieved_goal()
    }

    fn desired_goal(&self) -> &[f64] {
        self.state.desired_goal()
    }

    fn position(observation: &[Self::Element]) -> Option<[f64; 3]> {
        O::position(observation)
    }
}

/// The pictures of many observations, those of each view row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureRows {
    views: Vec<(Option<String>, ArrayRows<u8>)>,
}

impl PictureRows {
    /// Returns the pictures of the first `num_rows` rows, of the first view.
    #[must_use]
    pub fn pixels(&self, num_rows: usize) -> &[u8] {
        self.views.first().map_or(&[], |(_, rows)| rows.array(num_rows))
    }

    /// Returns the pictures of the first `num_rows` rows, of the view with this key.
    #[must_use]
    pub fn pixels_of(&self, key: &str, num_rows: usize) -> Option<&[u8]> {
        let (_, rows) = self.views.iter().find(|(known, _)| known.as_deref() == Some(key))?;
        Some(rows.array(num_rows))
    }
}

impl AsRef<Self> for PictureRows {
    fn as_ref(&self) -> &Self {
        self
    }
}

impl Rows<Pixels> for PictureRows {
    fn new(space: &Space, num_rows: usize) -> Result<Self, SpaceError> {
        let rows = |space| <ArrayRows<u8> as Rows<SharedArray<u8>>>::new(space, num_rows);
        let Some(images) = space.as_dict() else {
            return Ok(Self { views: vec![(None, rows(space)?)] });
        };
        let views = images.iter().map(|(key, image)| Ok((Some(key.to_owned()), rows(image)?)));
        Ok(Self { views: views.collect::<Result<_, _>>()? })
    }

    fn write_row(&mut self, row: usize, pixels: &Pixels) -> Result<(), EnvError> {
        let mut views = self.views.iter_mut().zip(pixels.views());
        views.try_for_each(|((_, rows), (_, picture))| rows.write_row(row, &picture))
    }

    fn copy_row(&mut self, row: usize, from: &Self, from_row: usize) {
        for ((_, rows), (_, from)) in self.views.iter_mut().zip(&from.views) {
            Rows::<SharedArray<u8>>::copy_row(rows, row, from, from_row);
        }
    }

    fn value(&self, row: usize) -> Value {
        let value = |rows| Rows::<SharedArray<u8>>::value(rows, row);
        if let [(None, rows)] = &*self.views {
            return value(rows);
        }
        let images = self.views.iter().map(|(key, rows)| (key.clone(), value(rows)));
        Value::Dict(images.map(|(key, image)| (key.unwrap_or_default(), image)).collect())
    }
}

/// Observations with pictures, the pictures and the states each row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelRows<R> {
    pixels: PictureRows,
    state: R,
    /// Whether the pictures are one more part of the state's dictionary.
    in_dict: bool,
}

impl<T, R: AsRef<GoalRows<T>>> AsRef<GoalRows<T>> for PixelRows<R> {
    fn as_ref(&self) -> &GoalRows<T> {
        self.state.as_ref()
    }
}

impl<R> AsRef<PictureRows> for PixelRows<R> {
    fn as_ref(&self) -> &PictureRows {
        &self.pixels
    }
}

/// The pictures in observations that have them, or that are only pictures.
impl<O: BatchObservation<Rows: AsRef<PictureRows>>, I, A> VecStep<O, I, A> {
    /// Returns the pictures of the first view: `len` rows.
    #[must_use]
    pub fn pixels(&self) -> &[u8] {
        self.observation_rows().as_ref().pixels(self.len())
    }

    /// Returns the pictures of the view with this key: `len` rows.
    #[must_use]
    pub fn pixels_of(&self, key: &str) -> Option<&[u8]> {
        self.observation_rows().as_ref().pixels_of(key, self.len())
    }

    /// Returns the pictures of the first view to which the actions led, the last of each episode
    /// included: `len` rows.
    #[must_use]
    pub fn next_pixels(&self) -> &[u8] {
        self.next_observation_rows().as_ref().pixels(self.len())
    }

    /// Returns the pictures to which the actions led, of the view with this key: `len` rows.
    #[must_use]
    pub fn next_pixels_of(&self, key: &str) -> Option<&[u8]> {
        self.next_observation_rows().as_ref().pixels_of(key, self.len())
    }
}

impl<O, R: Rows<O>> Rows<PixelObservation<O>> for PixelRows<R> {
    fn new(space: &Space, num_rows: usize) -> Result<Self, SpaceError> {
        let part = |key| space.as_dict().and_then(|dict| dict.get(key));
        let pixels = part(PIXELS).unwrap_or(space);
        let state = part(STATE);
        Ok(Self {
            pixels: PictureRows::new(pixels, num_rows)?,
            state: R::new(state.unwrap_or(space), num_rows)?,
            in_dict: state.is_none(),
        })
    }

    fn write_row(&mut self, row: usize, observation: &PixelObservation<O>) -> Result<(), EnvError> {
        self.pixels.write_row(row, &observation.pixels)?;
        self.state.write_row(row, &observation.state)
    }

    fn copy_row(&mut self, row: usize, from: &Self, from_row: usize) {
        self.pixels.copy_row(row, &from.pixels, from_row);
        self.state.copy_row(row, &from.state, from_row);
    }

    fn value(&self, row: usize) -> Value {
        let pixels = (PIXELS.into(), self.pixels.value(row));
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
