//! Adding the episodes of another buffer.

use crate::add::check::AddError;
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;

impl<T: Scalar> HerBuffer<T> {
    /// Appends copies of all finished episodes of another buffer, such as one that another process
    /// has filled, in their order. If there is no room, the oldest transitions are overwritten, as
    /// for any other episode.
    ///
    /// The copies get the priority of new transitions. The other buffer has already decided which
    /// [still episodes](crate::StillEpisodes) to keep, so all of its episodes are added.
    ///
    /// # Errors
    /// [`AddError::WrongLength`] if observations, goals, actions or fields have other lengths,
    /// [`AddError::MissingField`] and [`AddError::UnknownField`] if the other buffer has other
    /// fields, or has them in another order; then nothing has been added.
    ///
    /// ```
    /// use her_relabel::{BufferConfig, Dims, HerBuffer};
    ///
    /// let config = BufferConfig::new(100, Dims { observation: 3, goal: 2, action: 1 });
    /// let mut all = HerBuffer::<f32>::new(config.clone())?;
    /// let part = HerBuffer::<f32>::new(config)?;
    /// all.append(&part)?;
    /// # assert!(all.is_empty());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn append(&mut self, other: &Self) -> Result<(), AddError> {
        self.check_same_rows(other)?;
        let (episodes, tape) = (&other.storage.episodes, &other.storage.tape);
        let mut rows = Vec::new();
        for number in episodes.numbers() {
            let episode = episodes.get(number);
            // The last steps of an episode that is longer than this buffer.
            let most = self.config.capacity() as u64;
            let first = episode.start.max(episode.end.saturating_sub(most));
            rows.clear();
            for row in episode.row(first)..=episode.last_row() {
                rows.extend_from_slice(tape.row(row));
            }
            self.storage.store_episode(&rows, episode.ending);
        }
        Ok(())
    }

    fn check_same_rows(&self, other: &Self) -> Result<(), AddError> {
        let (own, others) = (self.config.dims(), other.config.dims());
        let mut lens = vec![
            ("observation", own.observation, others.observation),
            ("goals", own.goal, others.goal),
            ("action", own.action, others.action),
        ];
        let (own, others) = (self.config.fields(), other.config.fields());
        for (position, field) in own.iter().enumerate() {
            match others.get(position).filter(|other| other.name == field.name) {
                Some(other) => lens.push((&field.name, field.len, other.len)),
                None => return Err(AddError::MissingField { name: field.name.clone() }),
            }
        }
        if let Some(unknown) = others.get(own.len()) {
            self.storage.fields.place(&unknown.name)?;
        }
        match lens.into_iter().find(|(_, expected, actual)| expected != actual) {
            None => Ok(()),
            Some((field, expected, actual)) => {
                Err(AddError::WrongLength { field: field.to_owned(), expected, actual })
            }
        }
    }
}
