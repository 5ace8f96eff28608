//! The parity of one recording, as a line and as figures.

use fetch_sim::{ModelSource, MujocoSimulator, MujocoVersion, Simulator, Task};

use super::{
    recording::Recording,
    replay::{Deviation, EpisodeParity, replay},
};
use fetch_cli::shared::json::Metric;

pub struct FileParity {
    pub name: String,
    episodes: Vec<EpisodeParity>,
    /// Deviation of the settled gripper position and object height, in meters.
    settled: f64,
    standard: Standard,
}

/// The standard that a file must meet.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Standard {
    /// Every bit is equal, for the reference model on the recording's own MuJoCo.
    Bits,
    /// The deviation is at most this while the real robot does not touch itself.
    Free(f64),
    /// No standard: the motion is chaotic, or the recording is from another MuJoCo.
    Nothing,
}

/// The largest accepted deviation of a start state (meters).
const SETTLED_TOLERANCE: f64 = 1e-6;

impl Standard {
    fn new(recording: &Recording, model: &ModelSource) -> Self {
        if MujocoVersion::of_headers()
            .is_none_or(|version| version.to_string() != recording.meta.mujoco)
        {
            return Self::Nothing;
        }
        if *model != ModelSource::Builtin {
            return Self::Bits;
        }
        match (recording.task, recording.meta.kind.as_str()) {
            (Task::Reach, _) | (Task::PickAndPlace, "grasp") => Self::Free(1e-6),
            (Task::Push | Task::PickAndPlace, "still" | "random" | "wild") => Self::Free(1e-4),
            _ => Self::Nothing,
        }
    }
}

impl FileParity {
    pub const HEADING: &str = "file                     bit-equal  self-contact  contacts  \
                               free motion   median  overall    reset    worst at";

    pub fn measure(recording: &Recording, simulator: MujocoSimulator) -> anyhow::Result<Self> {
        let settled = simulator.settled();
        let ours = settled.gripper_position.as_slice().iter().chain(&settled.object_height);
        let theirs = recording.initial_gripper_xpos.iter().chain(&recording.height_offset);
        let name =
            recording.path.file_stem().map_or_else(String::new, |name| name.display().to_string());
        let standard = Standard::new(recording, simulator.fetch_model().config().model());
        Ok(Self {
            name,
            settled: ours.zip(theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max),
            standard,
            episodes: replay(recording, simulator)?,
        })
    }

    pub fn passed(&self) -> bool {
        match self.standard {
            Standard::Bits => self.bit_equal() == self.episodes.len(),
            Standard::Free(limit) => {
                self.start() <= SETTLED_TOLERANCE && self.free().is_none_or(|d| d.size <= limit)
            }
            Standard::Nothing => true,
        }
    }

    fn bit_equal(&self) -> usize {
        self.episodes.iter().filter(|episode| episode.bit_equal).count()
    }

    /// Returns the largest deviation of a start state: settled, or after a reset.
    fn start(&self) -> f64 {
        self.episodes.iter().map(|e| e.at_reset.size).fold(self.settled, f64::max)
    }

    /// Returns the largest deviation of the episodes in which the real robot does not touch itself.
    fn free(&self) -> Option<Deviation> {
        let free = self.episodes.iter().filter(|e| e.self_contacts[1] == 0);
        Deviation::max(free.map(|e| &e.deviation))
    }

    fn overall(&self) -> Option<Deviation> {
        Deviation::max(self.episodes.iter().map(|e| &e.deviation))
    }

    /// Returns the median of the episodes' largest deviations.
    fn median(&self) -> f64 {
        let mut sizes: Vec<f64> = self.episodes.iter().map(|e| e.deviation.size).collect();
        sizes.sort_by(f64::total_cmp);
        match sizes.len() {
            0 => 0.0,
            n => 0.5 * (sizes[(n - 1) / 2] + sizes[n / 2]),
        }
    }

    /// Returns the number of episodes in which both robots touch themselves, or neither does.
    fn self_contact_agreement(&self) -> usize {
        let agrees = |e: &&EpisodeParity| (e.self_contacts[0] > 0) == (e.self_contacts[1] > 0);
        self.episodes.iter().filter(agrees).count()
    }

    /// Returns the largest relative difference in the contacts of an episode.
    fn contact_difference(&self) -> f64 {
        let difference = |e: &EpisodeParity| {
            let [ours, theirs] = e.contacts.map(|count| count as f64);
            (ours - theirs).abs() / theirs.max(1.0)
        };
        self.episodes.iter().map(difference).fold(0.0, f64::max)
    }

    /// Returns the line of the file below [`HEADING`](Self::HEADING).
    pub fn line(&self) -> String {
        let total = self.episodes.len();
        let size = |deviation: &Option<Deviation>| {
            deviation.as_ref().map_or_else(|| "-".into(), |d| format!("{:.1e}", d.size))
        };
        let overall = self.overall();
        format!(
            "{:<24} {:>9}  {:>12}  {:>7.1}%  {:>11}  {:>7.1e}  {:>7}  {:>7.1e}    {}",
            self.name,
            format!("{}/{total}", self.bit_equal()),
            format!("{}/{total}", self.self_contact_agreement()),
            100.0 * self.contact_difference(),
            size(&self.free()),
            self.median(),
            size(&overall),
            self.start(),
            overall.map_or_else(String::new, |d| d.place),
        )
    }

    pub fn figures(&self) -> Vec<(String, Metric)> {
        let returns = |side: usize| self.episodes.iter().map(|e| e.returns[side]).sum::<f64>();
        let total = self.episodes.len() as f64;
        let free = self.free().map(|d| ("free-motion-deviation", d.size, "1"));
        [
            ("episodes", total, "1"),
            ("bit-equal", self.bit_equal() as f64 / total, "1"),
            ("self-contact-agreement", self.self_contact_agreement() as f64 / total, "1"),
            ("contact-difference", self.contact_difference(), "1"),
            ("deviation", self.overall().map_or(0.0, |d| d.size), "1"),
            ("median-deviation", self.median(), "1"),
            ("reset-deviation", self.start(), "m"),
            ("return-mean", returns(0) / total, "1"),
            ("return-mean-recorded", returns(1) / total, "1"),
        ]
        .into_iter()
        .chain(free)
        .map(|(name, value, unit)| {
            (format!("parity/{}/{name}", self.name), Metric::new(value, unit))
        })
        .collect()
    }
}
