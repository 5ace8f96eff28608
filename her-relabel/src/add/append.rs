//! Adding the episodes of another buffer.

use crate::add::check::{AddError, check_len};
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;

impl<T: Scalar> HerBuffer<T> {
    /// Appends copies of all finished episodes of another buffer, in order: a buffer that another
    /// process has filled, for example. The oldest transitions make room, as for any other episode.
    ///
    /// The copies get the priority of new transitions. The other buffer has already decided which
    /// [motionless episodes](crate::MotionlessEpisodes) to keep, so all of its episodes are added.
    ///
    /// # Errors
    /// [`AddError::OtherTask`] if both buffers describe their task, and not the same one,
    /// [`AddError::WrongLength`] if observations, goals, actions or fields have different lengths,
    /// [`AddError::MissingField`] and [`AddError::UnknownField`] if the other buffer has different
    /// fields, or the same in a different order; then nothing has been added.
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
        let mut rows = Vec::new();
        for episode in other.storage.episodes.iter() {
            other.storage.copy_episode(&episode, self.config.capacity(), &mut rows);
            self.storage.store_episode(&rows, episode.ending);
        }
        Ok(())
    }

    fn check_same_rows(&self, other: &Self) -> Result<(), AddError> {
        let (own, others) = (self.config.task(), other.config.task());
        if own != others && !own.is_empty() && !others.is_empty() {
            return Err(AddError::OtherTask { own: own.to_owned(), other: others.to_owned() });
        }
        let (own, others) = (self.config.dims(), other.config.dims());
        check_len("observation", others.observation, own.observation)?;
        check_len("goals", others.goal, own.goal)?;
        check_len("action", others.action, own.action)?;
        let (own, others) = (self.config.fields(), other.config.fields());
        for (position, field) in own.iter().enumerate() {
            match others.get(position).filter(|other| other.name == field.name) {
                Some(other) => check_len(&field.name, other.len, field.len)?,
                None => return Err(AddError::MissingField { name: field.name.clone() }),
            }
        }
        if let Some(unknown) = others.get(own.len()) {
            self.storage.fields.place(&unknown.name)?;
        }
        Ok(())
    }
}
