//! `bench her`: measures the replay buffer on one thread. Transitions have FetchPush's shape
//! (observation 25, goals 3, action 4, episodes of 50 steps); sampling has k = 4, future goals and
//! the sparse reward, and adds a step after each batch.

mod contenders;
mod episodes;

use std::{cell::RefCell, rc::Rc, time::Duration};

use her_relabel::Scalar;
use serde::Serialize;

use self::{
    contenders::{
        ENV_OF_STEPS, ENVS_OF_STEPS_8, Table, add_episodes, add_steps, bare_gather, forms, record,
        sampling,
    },
    episodes::{Episode, STEPS, full_buffer},
};
use super::{
    interleaved::{Clock::Cpu, Entry, interleave},
    measure_in_new_process,
    peer::{Orders, Peer},
    report,
};
use crate::shared::{process::Held, python};
use fetch_cli::shared::{choice::flag_name, json::Metric};

const SIZES: [usize; 3] = [256, 1024, 4096];
/// Size of the batches whose forms are compared.
const SIZE_OF_FORMS: usize = 1024;
/// Size of the batches whose time is compared between tables of [`TABLES`] transitions.
const SIZE_OF_GROWTH: usize = 1024;
const TABLES: [usize; 3] = [100_000, 1_000_000, 10_000_000];
const SB3: &str = "stable-baselines3";

#[derive(Debug, clap::Args, Serialize)]
pub struct Args {
    /// Measure only this element type
    #[arg(long, value_enum)]
    element: Option<Element>,
    /// Number of transitions in the buffer
    #[arg(long, default_value_t = 1_000_000)]
    #[arg(value_parser = clap::value_parser!(u32).range(1000..=1_000_000_000))]
    transitions: u32,
    /// Seconds for each element type, and again for `--growth`
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u16).range(..3600))]
    seconds: u16,
    /// Also time a batch with 100,000, 1,000,000 and 10,000,000 transitions (needs 3 GB)
    #[arg(long)]
    growth: bool,
    /// Also draw batches in the forms that networks take: joined, of f32, normalized
    #[arg(long)]
    forms: bool,
    /// Also measure Stable-Baselines3 with f64, in a Python environment in the cache
    #[arg(long)]
    peers: bool,
    /// Measure memory in this process, and print it
    #[arg(long, hide = true, requires = "element")]
    #[serde(skip)]
    footprint: bool,
}

#[derive(Clone, Copy, Debug, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
enum Element {
    F32,
    F64,
}

pub fn run(args: &Args) -> anyhow::Result<Vec<(String, Metric)>> {
    if let (true, Some(element)) = (args.footprint, args.element) {
        let bytes = match element {
            Element::F32 => bytes_per_transition::<f32>(args.transitions as usize),
            Element::F64 => bytes_per_transition::<f64>(args.transitions as usize),
        };
        say!("{}", bytes?)?;
        return Ok(Vec::new());
    }
    let sb3 = if args.peers { Some(stable_baselines3(args.transitions)?) } else { None };
    let mut figures = Vec::new();
    for element in args.element.map_or_else(|| vec![Element::F32, Element::F64], |e| vec![e]) {
        let measured = match element {
            Element::F32 => measure::<f32>(args, element, sb3.as_ref()),
            Element::F64 => measure::<f64>(args, element, sb3.as_ref()),
        };
        report(&mut figures, &format!("her/{}", flag_name(element)), measured?)?;
    }
    Ok(figures)
}

/// Starts a full buffer of Stable-Baselines3, with the same number of transitions, of `f64`.
fn stable_baselines3(transitions: u32) -> anyhow::Result<Rc<RefCell<Peer>>> {
    let python = python::environment("python-sb3", &python::STABLE_BASELINES3)?;
    say!("filling the buffer of Stable-Baselines3 step by step")?;
    let arguments = ["time".into(), transitions.to_string()];
    Peer::start(&python, ("sb3.py", python::SB3_SCRIPT), &arguments, "disable")
}

/// Measures the figures of one element type.
fn measure<T: Scalar>(
    args: &Args,
    element: Element,
    sb3: Option<&Rc<RefCell<Peer>>>,
) -> anyhow::Result<Vec<(String, Metric)>> {
    const ROWS: &str = "rows/s";
    const ADDED: &str = "transitions/s";
    let footprint = format!(
        "bench her --footprint --element {} --transitions {}",
        flag_name(element),
        args.transitions
    );
    let bytes = measure_in_new_process(footprint.split(' '))?.trim().parse()?;
    let mut figures = vec![("bytes-per-transition".into(), Metric::new(bytes, "bytes"))];
    let table = Table::<T>::full(args.transitions as usize)?;
    let mut entries = Vec::new();
    for (size, batches) in sampling(&table, &SIZES) {
        entries.push(Entry::new(&format!("batch-{size}"), ROWS, batches));
        let bare = bare_gather::<T>(args.transitions as usize, size);
        entries.push(Entry::new(&format!("bare-gather-{size}"), ROWS, bare));
        if let Some(sb3) = sb3 {
            // Turns of about the same length for each size.
            let orders = Orders::new(sb3, format!("sample {size} {}", SIZES[2] / 256));
            entries.push(Entry::new(&format!("{SB3}-{size}"), ROWS, orders));
        }
    }
    let mut named = Vec::new();
    if args.forms {
        for (form, contender) in forms(&table, SIZE_OF_FORMS)? {
            let name = format!("batch-{SIZE_OF_FORMS}-{form}");
            entries.push(Entry { name: name.clone(), unit: ROWS, contender });
            named.push(name);
        }
    }
    entries.extend([
        Entry::new("insert-steps", ADDED, add_steps(&table, ENV_OF_STEPS, 1)),
        Entry::new("insert-steps-8-envs", ADDED, add_steps(&table, ENVS_OF_STEPS_8, 8)),
        Entry::new("record-8-envs", ADDED, record(&table)),
        Entry::new("insert-episodes", ADDED, add_episodes(table)),
    ]);
    if let Some(sb3) = sb3 {
        let orders = Orders::new(sb3, "add 5000".into());
        entries.push(Entry::new(&format!("{SB3}-insert-steps"), ADDED, orders));
    }
    let rounds = interleave(entries, Duration::from_secs(args.seconds.into()))?;
    figures.extend(rounds.figures());
    figures.extend(rounds.ranges());
    for size in SIZES {
        let ours = format!("batch-{size}");
        for peer in ["bare-gather", SB3] {
            let name = format!("ratio/{ours}-to-{peer}");
            figures.extend(rounds.ratio(&name, Cpu, &ours, &format!("{peer}-{size}")));
        }
    }
    for name in named {
        let plain = format!("batch-{SIZE_OF_FORMS}");
        figures.extend(rounds.ratio(&format!("ratio/{name}-to-plain"), Cpu, &name, &plain));
    }
    if args.growth {
        figures.extend(growth::<T>(args)?);
    }
    Ok(figures)
}

/// Measures the time of a batch in tables of several sizes, and that of the bare copy: the share
/// that caches explain.
fn growth<T: Scalar>(args: &Args) -> anyhow::Result<Vec<(String, Metric)>> {
    let mut entries = Vec::new();
    for transitions in TABLES {
        let table = Table::<T>::full(transitions)?;
        for (size, batches) in sampling(&table, &[SIZE_OF_GROWTH]) {
            entries.push(Entry::new(&format!("batch-{size}/{transitions}"), "rows/s", batches));
            let bare = bare_gather::<T>(transitions, size);
            entries.push(Entry::new(&format!("bare-gather-{size}/{transitions}"), "rows/s", bare));
        }
    }
    let rounds = interleave(entries, Duration::from_secs(args.seconds.into()))?;
    let time = |(name, rate): (String, Metric)| {
        (format!("time/{name}"), Metric::new(SIZE_OF_GROWTH as f64 / rate.value * 1e6, "us"))
    };
    let mut figures: Vec<_> = rounds.figures().map(time).collect();
    for contender in ["batch", "bare-gather"] {
        let [small, .., large] =
            TABLES.map(|transitions| format!("{contender}-{SIZE_OF_GROWTH}/{transitions}"));
        figures.extend(rounds.ratio(&format!("ratio/growth-of-{contender}"), Cpu, &small, &large));
    }
    Ok(figures)
}

fn bytes_per_transition<T: Scalar>(transitions: usize) -> anyhow::Result<f64> {
    let episodes = Episode::<T>::all();
    // Code is loaded when it is first used.
    drop(full_buffer(STEPS * episodes.len(), 1, &episodes)?);
    let before = Held::now()?.memory as f64;
    let buffer = full_buffer(transitions, 1, &episodes)?;
    Ok((Held::now()?.memory as f64 - before) / buffer.len() as f64)
}
