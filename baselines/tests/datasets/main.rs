//! Data sets for other projects.

mod import;
mod laws;
mod minari;
mod ogbench;
#[cfg(feature = "learn")]
mod replay;
mod whole;

use std::path::Path;

use baselines::datasets::{
    DatasetWriter, EpisodeRecord, Metadata, MinariWriter, OgBenchWriter, SetKind, SetPolicy,
};
use baselines::{buffer_config, collect};
use fetch_env::{FetchObservation, make};
use her_relabel::HerBuffer;

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

const NAME: &str = "fetch/push/mixed-v0";

/// Records episodes of Push with the seeds from 0 on.
fn records(count: u64) -> Result<Vec<EpisodeRecord>> {
    let mut env = make("FetchPush-v4")?;
    let mut policy = SetPolicy::new(SetKind::Mixed, &env)?;
    let mut records = Vec::new();
    for seed in 0..count {
        let mut record = EpisodeRecord::default();
        policy.begin(seed);
        record.record(&mut env, &mut policy, seed)?;
        records.push(record);
    }
    Ok(records)
}

fn metadata() -> Result<Metadata> {
    Ok(Metadata::new(NAME, &make("FetchPush-v4")?, "four policies", "")?)
}

/// Begins a data set in each format.
fn writers(folder: &Path) -> Result<[Box<dyn DatasetWriter>; 2]> {
    let minari = MinariWriter::create(folder.join("minari"), metadata()?)?;
    let ogbench = OgBenchWriter::create(folder.join("ogbench"), metadata()?)?;
    Ok([Box::new(minari), Box::new(ogbench)])
}

/// Writes episodes in each format.
fn write(folder: &Path, records: &[EpisodeRecord]) -> Result {
    for mut writer in writers(folder)? {
        records.iter().try_for_each(|record| writer.write(record))?;
        writer.finish()?;
    }
    Ok(())
}

/// Returns a buffer for episodes of Push.
fn buffer() -> Result<HerBuffer<f64>> {
    Ok(HerBuffer::new(buffer_config(1000, &make("FetchPush-v4")?)?)?)
}

/// Collects the episodes of records anew.
fn collected<'a>(records: impl IntoIterator<Item = &'a EpisodeRecord>) -> Result<HerBuffer<f64>> {
    let mut env = make("FetchPush-v4")?;
    let mut buffer = buffer()?;
    for record in records {
        let mut actions = record.actions.chunks(4);
        let mut replay = |_: &FetchObservation, action: &mut [f32]| {
            action.copy_from_slice(actions.next().unwrap_or(&[f32::NAN; 4]));
        };
        collect(&mut env, &mut replay, 1, record.seed, &mut buffer, 0, |_| ())?;
    }
    Ok(buffer)
}

/// Returns all that is in a buffer.
fn archive(buffer: &HerBuffer<f64>) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    buffer.write_npz(&mut bytes)?;
    Ok(bytes)
}

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|number| number.to_bits()).collect()
}
