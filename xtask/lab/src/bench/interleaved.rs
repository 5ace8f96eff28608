//! Contenders that take turns.

use std::{
    ops::AddAssign,
    time::{Duration, Instant},
};

use rustix::time::{ClockId, clock_gettime};

use fetch_cli::shared::json::Metric;

/// A contender: something whose speed is measured.
pub trait Contender {
    /// Works once, and returns the amount of work done. An error ends the benchmark.
    fn work(&mut self) -> anyhow::Result<usize>;

    /// Times [`work`](Self::work). A contender in another process times itself there.
    fn timed(&mut self) -> anyhow::Result<Timed> {
        time(|| self.work())
    }
}

/// A closure that does the work and returns its amount is also a contender.
impl<F: FnMut() -> anyhow::Result<usize>> Contender for F {
    fn work(&mut self) -> anyhow::Result<usize> {
        self()
    }
}

/// The amount of work done, and its seconds on each [`Clock`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Timed {
    pub done: usize,
    pub wall: f64,
    pub cpu: f64,
}

impl AddAssign for Timed {
    fn add_assign(&mut self, more: Self) {
        self.done += more.done;
        self.wall += more.wall;
        self.cpu += more.cpu;
    }
}

/// Times work that returns its amount.
pub fn time(work: impl FnOnce() -> anyhow::Result<usize>) -> anyhow::Result<Timed> {
    let (start, cpu) = (Instant::now(), cpu_seconds());
    let done = work()?;
    Ok(Timed { done, wall: start.elapsed().as_secs_f64(), cpu: cpu_seconds() - cpu })
}

pub struct Entry {
    pub name: String,
    pub unit: &'static str,
    pub contender: Box<dyn Contender>,
}

impl Entry {
    pub fn new(name: &str, unit: &'static str, contender: impl Contender + 'static) -> Self {
        Self { name: name.into(), unit, contender: Box::new(contender) }
    }
}

/// The clock that a ratio uses.
#[derive(Clone, Copy, Debug)]
pub enum Clock {
    Wall,
    /// Processor time of the calling thread, or of all threads of another process. Other load
    /// disturbs it less. For contenders with one thread.
    Cpu,
}

/// The speed of every contender in every round.
pub struct Rounds(Vec<Speeds>);

struct Speeds {
    name: String,
    unit: &'static str,
    wall: Vec<f64>,
    cpu: Vec<f64>,
}

/// Lets the contenders take turns for a time and at least three rounds, after a warm-up round.
pub fn interleave(mut entries: Vec<Entry>, duration: Duration) -> anyhow::Result<Rounds> {
    const LEAST_ROUNDS: usize = 3;
    let mut speeds = Vec::new();
    for Entry { name, unit, contender } in &mut entries {
        contender.work()?;
        speeds.push(Speeds { name: name.clone(), unit, wall: Vec::new(), cpu: Vec::new() });
    }
    let start = Instant::now();
    let mut round = 0;
    while round < LEAST_ROUNDS || start.elapsed() < duration {
        for turn in 0..entries.len() {
            // The order changes, so that no contender always follows the same other one.
            let at = (turn + round) % entries.len();
            let timed = entries[at].contender.timed()?;
            speeds[at].cpu.push(timed.done as f64 / timed.cpu);
            speeds[at].wall.push(timed.done as f64 / timed.wall);
        }
        round += 1;
    }
    Ok(Rounds(speeds))
}

fn cpu_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

impl Rounds {
    /// Returns the median speed of each contender in wall time.
    pub fn figures(&self) -> impl Iterator<Item = (String, Metric)> + '_ {
        self.0.iter().map(|s| (s.name.clone(), Metric::new(median(&s.wall), s.unit)))
    }

    /// Returns the slowest and the fastest round of each contender in wall time.
    pub fn ranges(&self) -> impl Iterator<Item = (String, Metric)> + '_ {
        self.0.iter().flat_map(|Speeds { name, unit, wall, .. }| {
            let slowest = wall.iter().copied().fold(f64::INFINITY, f64::min);
            let fastest = wall.iter().copied().fold(0.0, f64::max);
            [("slowest", slowest), ("fastest", fastest)]
                .map(|(end, rate)| (format!("{name}/{end}"), Metric::new(rate, unit)))
        })
    }

    /// Returns the median, over the rounds, of the ratio of two speeds, under a name; `None` if one
    /// of the two did not take part.
    pub fn ratio(&self, name: &str, clock: Clock, of: &str, to: &str) -> Option<(String, Metric)> {
        let speeds = |wanted: &str| {
            let speeds = self.0.iter().find(|speeds| speeds.name == wanted)?;
            Some(match clock {
                Clock::Wall => &speeds.wall,
                Clock::Cpu => &speeds.cpu,
            })
        };
        let ratios: Vec<f64> = speeds(of)?.iter().zip(speeds(to)?).map(|(a, b)| a / b).collect();
        Some((name.into(), Metric::new(median(&ratios), "1")))
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    if sorted.len().is_multiple_of(2) {
        (sorted[middle - 1] + sorted[middle]) / 2.0
    } else {
        sorted[middle]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Fixed(usize);

    impl Contender for Fixed {
        fn work(&mut self) -> anyhow::Result<usize> {
            Ok(self.0)
        }

        fn timed(&mut self) -> anyhow::Result<Timed> {
            Ok(Timed { done: self.0, wall: 2.0, cpu: 1.0 })
        }
    }

    #[test]
    fn contenders_are_compared_round_by_round() -> anyhow::Result<()> {
        let entries = vec![Entry::new("a", "1/s", Fixed(6)), Entry::new("b", "1/s", Fixed(2))];
        let rounds = interleave(entries, Duration::ZERO)?;
        let ratio = |value| Some(("name".into(), Metric::new(value, "1")));
        assert_eq!(rounds.ratio("name", Clock::Wall, "a", "b"), ratio(3.0));
        assert_eq!(rounds.ratio("name", Clock::Cpu, "b", "a"), ratio(1.0 / 3.0));
        assert_eq!(rounds.ratio("name", Clock::Cpu, "a", "c"), None);
        let figures: Vec<_> = rounds.figures().collect();
        assert_eq!(figures[1], ("b".into(), Metric::new(1.0, "1/s")));
        assert_eq!(median(&[3.0, 1.0, 2.0, 10.0]), 2.5);
        Ok(())
    }
}
