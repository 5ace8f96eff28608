//! The states that a distiller has seen, and the teacher's actions in them.

use std::io::{self, Write};

use her_relabel::{Dims, StateRows};

use crate::trained::file::from_bytes;

/// The newest states: pictures, observations, goals and the teacher's actions, a row for each.
pub(in crate::learn) struct Frames {
    capacity: usize,
    /// The number of all states so far; more than the capacity if the oldest were replaced.
    pub(in crate::learn) total: u64,
    /// Bytes, until they are used.
    pub(in crate::learn) pictures: Vec<u8>,
    pub(in crate::learn) observation: Vec<f64>,
    pub(in crate::learn) achieved_goal: Vec<f64>,
    pub(in crate::learn) desired_goal: Vec<f64>,
    pub(in crate::learn) action: Vec<f32>,
}

impl Frames {
    pub(in crate::learn) const fn new(capacity: usize) -> Self {
        Self {
            capacity,
            total: 0,
            pictures: Vec::new(),
            observation: Vec::new(),
            achieved_goal: Vec::new(),
            desired_goal: Vec::new(),
            action: Vec::new(),
        }
    }

    /// Returns the number of rows.
    pub(in crate::learn) fn len(&self) -> usize {
        self.capacity.min(usize::try_from(self.total).unwrap_or(usize::MAX))
    }

    /// Adds `count` rows, each after the one before or in the place of the oldest one.
    pub(in crate::learn) fn add(
        &mut self,
        count: usize,
        pictures: &[u8],
        states: &StateRows<'_, f64>,
        action: &[f32],
    ) {
        for row in 0..count {
            let to = (self.total % self.capacity as u64) as usize;
            put(&mut self.pictures, to, pictures, row, count);
            put(&mut self.observation, to, states.observation, row, count);
            put(&mut self.achieved_goal, to, states.achieved_goal, row, count);
            put(&mut self.desired_goal, to, states.desired_goal, row, count);
            put(&mut self.action, to, action, row, count);
            self.total += 1;
        }
    }

    /// Replaces these rows by rows of others.
    pub(in crate::learn) fn gather(&mut self, others: &Self, rows: &[usize]) {
        let len = others.len();
        gather(&mut self.pictures, &others.pictures, rows, len);
        gather(&mut self.observation, &others.observation, rows, len);
        gather(&mut self.achieved_goal, &others.achieved_goal, rows, len);
        gather(&mut self.desired_goal, &others.desired_goal, rows, len);
        gather(&mut self.action, &others.action, rows, len);
    }

    /// Writes all rows, column after column.
    pub(in crate::learn) fn write_to(&self, to: &mut (impl Write + ?Sized)) -> io::Result<()> {
        to.write_all(&self.pictures)?;
        for number in
            [&self.observation, &self.achieved_goal, &self.desired_goal].into_iter().flatten()
        {
            to.write_all(&number.to_le_bytes())?;
        }
        self.action.iter().try_for_each(|number| to.write_all(&number.to_le_bytes()))
    }

    /// Replaces all rows by the newest of `total`, which [`write_to`](Self::write_to) wrote. Returns
    /// the bytes after them, or `None`, and replaces nothing, if there are too few.
    pub(in crate::learn) fn read<'a>(
        &mut self,
        total: u64,
        picture_len: usize,
        dims: Dims,
        bytes: &'a [u8],
    ) -> Option<&'a [u8]> {
        let read = Self { total, ..Self::new(self.capacity) };
        let rows = read.len();
        let doubles = dims.observation + 2 * dims.goal;
        let (pictures, rest) = bytes.split_at_checked(rows * picture_len)?;
        let (states, rest) = rest.split_at_checked(rows * 8 * doubles)?;
        let (actions, rest) = rest.split_at_checked(rows * 4 * dims.action)?;
        let (states, _) = states.as_chunks::<8>();
        let mut states = states.iter().map(|number| f64::from_le_bytes(*number));
        *self = Self {
            pictures: pictures.to_vec(),
            observation: states.by_ref().take(rows * dims.observation).collect(),
            achieved_goal: states.by_ref().take(rows * dims.goal).collect(),
            desired_goal: states.collect(),
            action: from_bytes(actions).collect(),
            ..read
        };
        Some(rest)
    }

    /// Returns observations and goals.
    pub(in crate::learn) fn states(&self) -> StateRows<'_, f64> {
        StateRows {
            observation: &self.observation,
            achieved_goal: &self.achieved_goal,
            desired_goal: &self.desired_goal,
        }
    }
}

/// Writes row `row` of `count` to row `to`, which may be the next new one.
fn put<T: Copy>(column: &mut Vec<T>, to: usize, rows: &[T], row: usize, count: usize) {
    let len = rows.len() / count;
    let row = &rows[row * len..][..len];
    match column.get_mut(to * len..(to + 1) * len) {
        Some(place) => place.copy_from_slice(row),
        None => column.extend_from_slice(row),
    }
}

fn gather<T: Copy>(column: &mut Vec<T>, other: &[T], rows: &[usize], count: usize) {
    let len = other.len() / count;
    column.clear();
    rows.iter().for_each(|row| column.extend_from_slice(&other[row * len..][..len]));
}
