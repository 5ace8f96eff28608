//! Saving a buffer and loading it again.
//!
//! The file format, with little-endian numbers, of 64 bits unless stated otherwise:
//! 1. eight bytes of magic, the version (32 bits), the bytes of an element (32 bits);
//! 2. capacity, lengths of observation, goal and action, number of environments, number of fields;
//! 3. for each field the length of its name in bytes, the name, and the field's length; in version 3,
//!    which has a description of the task, its length in bytes and the description;
//! 4. 0 without priorities, 1 or 2 for priorities of transitions or of episodes, and the new
//!    priority (a double, negative for the highest);
//! 5. for motionless episodes the distance (a double, negative if all episodes are kept), the kept
//!    share (a double) and the seed, and the number of episodes that have ended;
//! 6. first and next live transition, first and next kept episode;
//! 7. a record of each episode;
//! 8. the rows of the live states;
//! 9. for each environment the number of rows of its unfinished episode (all bits set if it was
//!    discarded), the rows and, if there are any, the desired goal;
//! 10. with priorities, the highest one, the number of places of their tree, and all priorities;
//! 11. the CRC-32 of everything before it (32 bits).

use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::Path;

use goal_reward::Dims;

use crate::add::check::is_reward;
use crate::files::{open, replace};
use crate::save::stream::{LoadError, Source, Target, VERSIONS};
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;
use crate::store::config::{BufferConfig, MAX_TASK};
use crate::store::episodes::Episodes;
use crate::store::fields::{Field, Fields, MAX_NAME};
use crate::store::layout::Layout;
use crate::store::motionless::MotionlessEpisodes;
use crate::store::priorities::{NewPriority, Priorities, PriorityUnit, is_priority};
use crate::store::priority_table::PriorityTable;
use crate::store::storage::{Storage, Unfinished};
use crate::store::sum_tree::SumTree;
use crate::store::tape::Tape;
use crate::unit_interval::UnitInterval;

const MAGIC: [u8; 8] = *b"HERBUF\r\n";

/// The code of [`NewPriority::Highest`].
const HIGHEST: f64 = -1.0;

/// The distance that says that all motionless episodes are kept.
const ALL_KEPT: f64 = -1.0;

/// The number of rows of an unfinished episode that was discarded.
const DISCARDED: u64 = u64::MAX;

/// The highest number of a transition: more than anyone can store, and far from overflow.
const LAST: u64 = 1 << 60;

impl<T: Scalar> HerBuffer<T> {
    /// Saves everything, including unfinished episodes, to a file. A buffer loaded from it gives
    /// the same batches as this one, seed by seed. To go on recording numbered rows in its
    /// unfinished episodes, call [`resume`](Self::resume).
    ///
    /// The file appears whole or not at all: a crash or a full disk leaves a previous file as it
    /// was. A previous file's permissions stay, and a symbolic link is followed. No other file is
    /// changed or removed.
    ///
    /// Only a process that is killed can leave a file behind: `.NAME.xxxxxx` with six letters or
    /// digits, which you may remove. On a file system with unnamed files (`O_TMPFILE`: ext4, XFS,
    /// Btrfs, tmpfs), this can happen only between naming the new file and renaming it.
    ///
    /// # Errors
    /// Errors of the file system, and [`io::ErrorKind::InvalidInput`] if the path is a directory, a
    /// device or the like.
    pub fn save(&self, path: impl AsRef<Path>) -> io::Result<()> {
        replace(path, |file| self.write_to(BufWriter::new(file)))
    }

    /// Loads a buffer that [`save`](Self::save) saved. Memory is allocated only as contents are
    /// read, so no file can claim much more than its own size. The file is a regular one, and no pipe
    /// or device.
    ///
    /// # Errors
    /// [`LoadError`].
    pub fn load(path: impl AsRef<Path>) -> Result<Self, LoadError> {
        Self::read_from(BufReader::new(open(path)?))
    }

    /// Writes the contents of a [saved](Self::save) file to a writer.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn write_to(&self, writer: impl Write) -> io::Result<()> {
        let Storage { layout, episodes, tape, motionless, ended, .. } = &self.storage;
        let config = &self.config;
        let mut target = Target::new(writer);
        target.bytes(&MAGIC)?;
        let task = config.task();
        target.bytes(&VERSIONS[usize::from(!task.is_empty())].to_le_bytes())?;
        target.bytes(&(size_of::<T>() as u32).to_le_bytes())?;
        let (num_envs, num_fields) = (config.num_envs(), config.fields().len());
        let Dims { observation, goal, action } = config.dims();
        let sizes = [config.capacity(), observation, goal, action, num_envs, num_fields];
        target.numbers(sizes.map(|size| size as u64))?;
        for Field { name, len } in config.fields() {
            target.number(name.len() as u64)?;
            target.bytes(name.as_bytes())?;
            target.number(*len as u64)?;
        }
        if !task.is_empty() {
            target.number(task.len() as u64)?;
            target.bytes(task.as_bytes())?;
        }
        target.numbers(priorities_code(config.priorities()))?;
        target.numbers(motionless_code(*motionless))?;
        target.number(*ended)?;
        let (live, kept) = (episodes.live(), episodes.numbers());
        target.numbers([live.start, live.end, kept.start, kept.end])?;
        episodes.records().try_for_each(|record| target.number(record))?;
        tape.rows().try_for_each(|row| target.elements(row))?;
        for Unfinished { rows, desired_goal, is_discarded, .. } in &self.unfinished {
            let num_rows = (rows.len() / layout.row()) as u64;
            target.number(if *is_discarded { DISCARDED } else { num_rows })?;
            if !rows.is_empty() {
                target.elements(rows)?;
                target.elements(desired_goal)?;
            }
        }
        if let Some(PriorityTable { highest, tree, .. }) = &self.storage.priorities {
            target.numbers([highest.to_bits(), tree.size() as u64])?;
            tree.weights().try_for_each(|priority| target.number(priority.to_bits()))?;
        }
        target.finish()
    }

    /// Reads what [`write_to`](Self::write_to) wrote, up to the end of the reader.
    ///
    /// # Errors
    /// [`LoadError`].
    pub fn read_from(reader: impl Read) -> Result<Self, LoadError> {
        let mut source = Source::new(reader);
        if source.bytes::<8>()? != MAGIC {
            return Err(LoadError::Foreign);
        }
        let version = u32::from_le_bytes(source.bytes()?);
        let [plain, with_task] = VERSIONS;
        if version != plain && version != with_task {
            return Err(LoadError::Version { version });
        }
        let actual = u32::from_le_bytes(source.bytes()?);
        if actual as usize != size_of::<T>() {
            return Err(LoadError::ElementSize { expected: size_of::<T>(), actual });
        }
        let config = read_config(&mut source, version == with_task)?;
        let ended = source.number()?;
        let (layout, fields) = (Layout::new::<T>(&config)?, Fields::new(config.fields()));
        let capacity = config.capacity();
        let live = source.number()?..source.number()?;
        let kept = source.number()?..source.number()?;
        let num_live = live.end.checked_sub(live.start).ok_or(LoadError::Damaged)?;
        let num_kept = kept.end.checked_sub(kept.start).ok_or(LoadError::Damaged)?;
        // A dropped episode had at least one transition.
        let is_early = live.end <= LAST && kept.start <= live.start;
        if num_live > capacity as u64 || num_kept > num_live || !is_early {
            return Err(LoadError::Damaged);
        }
        let records = kept.clone().map(|_| source.number()).collect::<Result<Vec<_>, _>>()?;
        let mut tape = Tape::new(layout.row(), capacity, live.start + kept.start);
        let mut row = Vec::new();
        for _ in 0..num_live + num_kept {
            source.elements(layout.row(), &mut row)?;
            tape.push_rows(&row);
        }
        // The rows were read, so there is memory for what depends on their number.
        let episodes = Episodes::restore(live, kept.start, &records).ok_or(LoadError::Damaged)?;
        let unfinished = (0..config.num_envs())
            .map(|_| read_unfinished(&mut source, &layout, capacity))
            .collect::<Result<Vec<_>, _>>()?;
        let finished = episodes.iter().flat_map(|episode| {
            (episode.row(episode.start)..episode.last_row()).map(|number| tape.row(number))
        });
        // The last state of an episode has no reward.
        let under_way = unfinished.iter().flat_map(|episode: &Unfinished<T>| {
            episode.rows.chunks_exact(layout.row()).take(episode.steps(&layout))
        });
        if !finished.chain(under_way).all(|row| is_reward(row[layout.reward()].to_f64())) {
            return Err(LoadError::Damaged);
        }
        let priorities = match config.priorities() {
            Some(settings) => Some(read_priorities(&mut source, settings, &episodes)?),
            None => None,
        };
        source.finish()?;
        let motionless = config.motionless_episodes();
        let storage =
            Storage { layout, fields, capacity, episodes, tape, priorities, motionless, ended };
        let has_row = vec![false; config.num_envs()];
        Ok(Self { config, storage, unfinished, has_row, whole: Unfinished::default() })
    }
}

fn read_config<R: Read>(source: &mut Source<R>, has_task: bool) -> Result<BufferConfig, LoadError> {
    let [capacity, observation, goal, action, num_envs, num_fields] = source.sizes()?;
    let dims = Dims { observation, goal, action };
    let mut config = BufferConfig::new(capacity, dims).with_num_envs(num_envs);
    for _ in 0..num_fields {
        let name = source.text(MAX_NAME)?;
        let [len] = source.sizes()?;
        config = config.with_field(name, len);
    }
    if has_task {
        let task = source.text(MAX_TASK)?;
        if task.is_empty() {
            return Err(LoadError::Damaged);
        }
        config = config.with_task(task);
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
    config = config.with_priorities(unit.map(|unit| Priorities::new(unit).with_new_priority(new)));
    let distance = f64::from_bits(source.number()?);
    let kept = UnitInterval::new(f64::from_bits(source.number()?));
    let motionless = MotionlessEpisodes::new(distance, kept.map_err(|_| LoadError::Damaged)?)
        .with_seed(source.number()?);
    config = config.with_motionless_episodes((distance != ALL_KEPT).then_some(motionless));
    config.check()?;
    Ok(config)
}

/// Returns the code of the settings of priorities: the unit and the new priority.
fn priorities_code(priorities: Option<Priorities>) -> [u64; 2] {
    let Some(settings) = priorities else { return [0, HIGHEST.to_bits()] };
    let unit = match settings.unit() {
        PriorityUnit::Transition => 1,
        PriorityUnit::Episode => 2,
    };
    let new = match settings.new_priority() {
        NewPriority::Given(priority) => priority,
        NewPriority::Highest => HIGHEST,
    };
    [unit, new.to_bits()]
}

/// Returns the code of the settings of motionless episodes: distance, kept share and seed.
fn motionless_code(motionless: Option<MotionlessEpisodes>) -> [u64; 3] {
    let Some(motionless) = motionless else { return [ALL_KEPT.to_bits(), 0, 0] };
    [motionless.max_distance().to_bits(), motionless.kept().get().to_bits(), motionless.seed()]
}

fn read_priorities<R: Read>(
    source: &mut Source<R>,
    settings: Priorities,
    episodes: &Episodes,
) -> Result<PriorityTable, LoadError> {
    let highest = f64::from_bits(source.number()?);
    let [size] = source.sizes()?;
    let live = settings.unit().live(episodes);
    let weights = live.clone().map(|_| source.number().map(f64::from_bits));
    let weights = weights.collect::<Result<Vec<_>, _>>()?;
    let transitions = episodes.live();
    // There are never more episodes than transitions.
    let is_needed = size <= SumTree::size_for((transitions.end - transitions.start) as usize);
    if !(is_needed && is_priority(highest) && weights.iter().copied().all(is_priority)) {
        return Err(LoadError::Damaged);
    }
    let tree = SumTree::restore(size, live, &weights).ok_or(LoadError::Damaged)?;
    Ok(PriorityTable { settings, highest, tree })
}

fn read_unfinished<T: Scalar, R: Read>(
    source: &mut Source<R>,
    layout: &Layout,
    capacity: usize,
) -> Result<Unfinished<T>, LoadError> {
    let mut unfinished = Unfinished::default();
    let num_rows = source.number()?;
    if num_rows == DISCARDED {
        unfinished.is_discarded = true;
        return Ok(unfinished);
    }
    let num_rows = usize::try_from(num_rows).map_err(|_| LoadError::Damaged)?;
    if num_rows > capacity.saturating_mul(2) {
        return Err(LoadError::Damaged);
    }
    if num_rows > 0 {
        let elements = num_rows.checked_mul(layout.row()).ok_or(LoadError::Damaged)?;
        source.elements(elements, &mut unfinished.rows)?;
        source.elements(layout.dims().goal, &mut unfinished.desired_goal)?;
    }
    Ok(unfinished)
}
