//! Saving a buffer and loading it again.
//!
//! The file, all numbers little-endian and of 64 bits where nothing else is said: eight bytes of magic,
//! version (32 bits), bytes of an element (32 bits); capacity, observation, goal, action, environments,
//! number of fields; of each field the bytes of its name, the name and its length; 0, or 1 or 2 for
//! priorities of transitions or of episodes, and the new one (a double, negative for the highest); first and next live
//! transition, first and next kept episode; a record of each episode; the rows of the live states; for
//! each environment the number of rows of its unfinished episode, the rows and, if there are any, the
//! desired goal; if there are priorities the highest one, the places of their tree and all of them; and the
//! CRC-32 of all that (32 bits).

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::Path;

use crate::add::recorder::Recorder;
use crate::save::load_error::LoadError;
use crate::save::replace::replace;
use crate::save::stream::{Source, Target};
use crate::store::config::Layout;
use crate::store::episodes::Episodes;
use crate::store::fields::{Field, Fields};
use crate::store::priority_table::{
    NewPriority, Priorities, PriorityTable, PriorityUnit, is_priority,
};
use crate::store::storage::Storage;
use crate::store::sum_tree::SumTree;
use crate::store::tape::Tape;
use crate::{BufferConfig, Dims, HerBuffer, Scalar};

const MAGIC: [u8; 8] = *b"HERBUF\r\n";
pub(crate) const VERSION: u32 = 1;

/// Stands for [`NewPriority::Highest`].
const HIGHEST: f64 = -1.0;

/// The highest number of a transition, beyond what anyone can count up to and far from overflow.
const LAST: u64 = 1 << 60;

impl<T: Scalar> HerBuffer<T> {
    /// Saves everything, unfinished episodes too, to a file. A buffer that is loaded from it gives the
    /// batches that this one would have given, seed by seed.
    ///
    /// The file is written beside its place and then put there, so that a crash or a full disk leaves
    /// a previous file as it was.
    ///
    /// # Errors
    /// What the file system reports.
    pub fn save(&self, path: impl AsRef<Path>) -> io::Result<()> {
        replace(path.as_ref(), |file| self.write_to(BufWriter::new(file)))
    }

    /// Loads what [`save`](Self::save) saved. Memory is taken as the file's contents come, so that no
    /// file can ask for much more than its own size.
    ///
    /// # Errors
    /// [`LoadError`].
    pub fn load(path: impl AsRef<Path>) -> Result<Self, LoadError> {
        Self::read_from(BufReader::new(File::open(path)?))
    }

    /// Writes what [`save`](Self::save) would save.
    ///
    /// # Errors
    /// What the writer reports.
    pub fn write_to(&self, writer: impl Write) -> io::Result<()> {
        let Storage { layout, episodes, tape, .. } = &self.storage;
        let BufferConfig { capacity, dims, n_envs, fields, priorities } = &self.config;
        let mut target = Target::new(writer);
        target.bytes(&MAGIC)?;
        target.bytes(&VERSION.to_le_bytes())?;
        target.bytes(&(size_of::<T>() as u32).to_le_bytes())?;
        let sizes = [*capacity, dims.observation, dims.goal, dims.action, *n_envs, fields.len()];
        target.numbers(sizes.map(|size| size as u64))?;
        for Field { name, len } in fields {
            target.number(name.len() as u64)?;
            target.bytes(name.as_bytes())?;
            target.number(*len as u64)?;
        }
        target.numbers(code(*priorities))?;
        let (live, kept) = (episodes.live(), episodes.numbers());
        target.numbers([live.start, live.end, kept.start, kept.end])?;
        for record in episodes.records() {
            target.number(record)?;
        }
        for row in tape.rows() {
            target.elements(row)?;
        }
        for Recorder { rows, desired_goal } in &self.recorders {
            target.number((rows.len() / layout.row()) as u64)?;
            if !rows.is_empty() {
                target.elements(rows)?;
                target.elements(desired_goal)?;
            }
        }
        if let Some(PriorityTable { highest, tree, .. }) = &self.storage.priorities {
            target.numbers([highest.to_bits(), tree.size() as u64])?;
            for priority in tree.weights() {
                target.number(priority.to_bits())?;
            }
        }
        target.finish()
    }

    /// Reads what [`write_to`](Self::write_to) wrote, to the end of the reader.
    ///
    /// # Errors
    /// [`LoadError`].
    pub fn read_from(reader: impl Read) -> Result<Self, LoadError> {
        let mut source = Source::new(reader);
        if source.bytes::<8>()? != MAGIC {
            return Err(LoadError::Foreign);
        }
        let version = u32::from_le_bytes(source.bytes()?);
        if version != VERSION {
            return Err(LoadError::Version { version });
        }
        let actual = u32::from_le_bytes(source.bytes()?);
        if actual as usize != size_of::<T>() {
            return Err(LoadError::ElementSize { expected: size_of::<T>(), actual });
        }
        let config = read_config(&mut source)?;
        let (layout, fields) = (Layout::new::<T>(&config)?, Fields::new(&config.fields)?);
        let capacity = config.capacity;
        let live = source.number()?..source.number()?;
        let kept = source.number()?..source.number()?;
        let n_live = live.end.checked_sub(live.start).ok_or(LoadError::Damaged)?;
        let n_kept = kept.end.checked_sub(kept.start).ok_or(LoadError::Damaged)?;
        // An episode that is gone had a transition at least.
        let is_early = live.end <= LAST && kept.start <= live.start;
        if n_live > capacity as u64 || n_kept > n_live || !is_early {
            return Err(LoadError::Damaged);
        }
        let mut records = Vec::new();
        for _ in kept.clone() {
            records.push(source.number()?);
        }
        let mut tape = Tape::starting_at(layout.row(), capacity, live.start + kept.start);
        let mut row = Vec::new();
        for _ in 0..n_live + n_kept {
            source.elements(layout.row(), &mut row)?;
            tape.push_rows(&row);
        }
        // The rows have come, so there is memory for what is made of their number.
        let episodes = Episodes::restore(live, kept.start, &records).ok_or(LoadError::Damaged)?;
        let mut recorders = Vec::new();
        for _ in 0..config.n_envs {
            recorders.push(read_recorder(&mut source, &layout, capacity)?);
        }
        let priorities = match config.priorities {
            Some(settings) => Some(read_priorities(&mut source, settings, &episodes)?),
            None => None,
        };
        source.finish()?;
        let storage = Storage { layout, fields, capacity, episodes, tape, priorities };
        Ok(Self { config, storage, recorders, whole: Recorder::default() })
    }
}

fn read_config<R: Read>(source: &mut Source<R>) -> Result<BufferConfig, LoadError> {
    let [capacity, observation, goal, action, n_envs, n_fields] = source.sizes()?;
    let dims = Dims { observation, goal, action };
    let mut config = BufferConfig::new(capacity, dims).with_n_envs(n_envs);
    for _ in 0..n_fields {
        let name = source.text()?;
        let [len] = source.sizes()?;
        config = config.with_field(name, len);
    }
    let unit = match source.number()? {
        0 => None,
        1 => Some(PriorityUnit::Transition),
        2 => Some(PriorityUnit::Episode),
        _ => return Err(LoadError::Damaged),
    };
    let new = match f64::from_bits(source.number()?) {
        HIGHEST => NewPriority::Highest,
        priority => NewPriority::Given(priority),
    };
    config.priorities = unit.map(|unit| Priorities { unit, new });
    config.priorities.map_or(Ok(()), Priorities::check)?;
    Ok(config)
}

/// What the file says of priorities: the unit and the new one.
fn code(priorities: Option<Priorities>) -> [u64; 2] {
    let unit = match priorities.map(|priorities| priorities.unit) {
        None => 0,
        Some(PriorityUnit::Transition) => 1,
        Some(PriorityUnit::Episode) => 2,
    };
    let new = match priorities.map(|priorities| priorities.new) {
        Some(NewPriority::Given(priority)) => priority,
        None | Some(NewPriority::Highest) => HIGHEST,
    };
    [unit, new.to_bits()]
}

fn read_priorities<R: Read>(
    source: &mut Source<R>,
    settings: Priorities,
    episodes: &Episodes,
) -> Result<PriorityTable, LoadError> {
    let highest = f64::from_bits(source.number()?);
    let [size] = source.sizes()?;
    let live = settings.unit.live(episodes);
    let mut weights = Vec::new();
    for _ in live.clone() {
        weights.push(f64::from_bits(source.number()?));
    }
    let transitions = episodes.live();
    // There were never more episodes than there are transitions now.
    let is_needed = size <= SumTree::size_for((transitions.end - transitions.start) as usize);
    if !(is_needed && is_priority(highest) && weights.iter().copied().all(is_priority)) {
        return Err(LoadError::Damaged);
    }
    let tree = SumTree::restore(size, live, &weights).ok_or(LoadError::Damaged)?;
    Ok(PriorityTable { settings, highest, tree })
}

fn read_recorder<T: Scalar, R: Read>(
    source: &mut Source<R>,
    layout: &Layout,
    capacity: usize,
) -> Result<Recorder<T>, LoadError> {
    let mut recorder = Recorder::default();
    let [n_rows] = source.sizes()?;
    if n_rows > capacity.saturating_mul(2) {
        return Err(LoadError::Damaged);
    }
    if n_rows > 0 {
        let elements = n_rows.checked_mul(layout.row()).ok_or(LoadError::Damaged)?;
        source.elements(elements, &mut recorder.rows)?;
        source.elements(layout.dims().goal, &mut recorder.desired_goal)?;
    }
    Ok(recorder)
}
