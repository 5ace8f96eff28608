//! Trainers with an actor that sees pictures.

use std::path::Path;

use fetch_env::vec_env::BatchObservation;
use fetch_env::{EnvError, PictureRows, SnapshotEnv};
use rayon::ThreadPoolBuilder;

use super::actor::PixelActor;
use super::memory::{Goals, Memory};
use crate::learn::distill::pixels::pixel_student;
use crate::learn::error::{CheckpointError, TrainError};
use crate::learn::run::env::LearnEnv;
use crate::learn::run::seeds::{SeedUse, seed_for};
use crate::learn::run::trainer::Trainer;
use crate::learn::settings::algorithm::AlgorithmSettings;
use crate::learn::settings::pixels::PixelActorSettings;
use crate::learn::settings::train::TrainSettings;
use crate::trained::{PixelPolicy, Sight, TrainedPolicyError};
use crate::workers::OneProcess;

/// For environments whose observations have pictures, as those with an
/// [`AddRenderObservation`](fetch_env::AddRenderObservation) do.
impl<E: LearnEnv<Observation: BatchObservation<Rows: AsRef<PictureRows>>>> Trainer<E> {
    /// Prepares a run as [`new`](Self::new) does, with one more actor: it sees pictures, the fields of
    /// `sight` and the desired goal, and no teacher. This is an asymmetric actor-critic. The critic
    /// and the first actor see the state and learn as without pictures; the actor that sees pictures
    /// learns actions that the critic values, also for goals in hindsight, and acts in its share of
    /// the environments. Evaluations are its own. Source: Pinto et al., *Asymmetric actor critic for
    /// image-based robot learning*, 2018, whose critic's targets follow the actor that sees pictures
    /// and not one that sees the state.
    ///
    /// `make` makes environments with the pictures of `sight`, without the goal's marker, because
    /// hindsight changes goals and not pictures. The network has
    /// [`Convolution::defaults`](crate::network::Convolution::defaults). The actor's settings are
    /// [`TrainSettings::pixels`], or their defaults. A saved run is continued with
    /// [`resume_pixels`](Self::resume_pixels).
    ///
    /// ```no_run
    /// use std::ops::ControlFlow;
    ///
    /// use baselines::Sight;
    /// use baselines::learn::{TrainSettings, Trainer};
    /// use fetch_env::{AddRenderObservation, EnvExt, PixelOptions, RenderOptions, Task, make};
    ///
    /// let view = RenderOptions::default().with_width(64).with_height(64).with_goals_shown(false);
    /// let sight = Sight::robot(Task::Push, PixelOptions::default().with_render(view));
    /// let pixels = || AddRenderObservation::new(sight.pixels.clone());
    /// let make = || make("FetchPush-v4")?.wrap(pixels());
    /// let settings = TrainSettings::fast(Task::Push).with_pixels(Task::Push);
    /// let mut trainer = Trainer::with_pixels(make, &sight, settings, 0, 2)?;
    /// trainer.run(50_000, None, |_, row| {
    ///     println!("{} steps: {:?}", row.counters.steps, row.success_rate);
    ///     ControlFlow::Continue(())
    /// })?;
    /// trainer.pixel_policy("FetchPush-v4")?.save("push-pixels.safetensors")?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`new`](Self::new); [`TrainError::Frames`] or [`TrainError::Picture`] if there is no
    /// network for the pictures; [`TrainError::GoalShown`] if they show the goal's marker;
    /// [`TrainError::NoCritic`] if the algorithm has no
    /// [`value_slopes`](crate::learn::Algorithm::value_slopes).
    pub fn with_pixels(
        make: impl Fn() -> Result<E, EnvError>,
        sight: &Sight,
        mut settings: TrainSettings,
        seed: u64,
        num_threads: usize,
    ) -> Result<Self, TrainError> {
        let actor = settings.pixels.take().unwrap_or_default();
        let mut trainer = Self::new(make, settings, seed, num_threads)?;
        trainer.open_eyes(sight, actor, num_threads)?;
        Ok(trainer)
    }

    /// Continues a run of [`with_pixels`](Self::with_pixels), otherwise as [`resume`](Self::resume).
    ///
    /// # Errors
    /// As [`resume`](Self::resume), and [`CheckpointError::OtherSight`] if the actor of the
    /// checkpoint sees another picture, or other fields.
    pub fn resume_pixels(
        make: impl Fn() -> Result<E, EnvError>,
        sight: &Sight,
        folder: impl AsRef<Path>,
        num_threads: usize,
    ) -> Result<Self, CheckpointError>
    where
        E: SnapshotEnv,
    {
        let open = |trainer: &mut Self, actor| trainer.open_eyes(sight, actor, num_threads);
        let (workers, build) = (Box::new(OneProcess), AlgorithmSettings::build);
        let seeing = Some((sight, open));
        Self::resume_seeing(make, folder.as_ref(), num_threads, workers, build, seeing)
            .map(|(trainer, _)| trainer)
    }

    /// Adds an actor that sees pictures.
    fn open_eyes(
        &mut self,
        sight: &Sight,
        actor: PixelActorSettings,
        num_threads: usize,
    ) -> Result<(), TrainError> {
        actor.check()?;
        if sight.pixels.views().any(|(_, view)| view.goals_shown()) {
            return Err(TrainError::GoalShown);
        }
        let (dims, algorithm) = (self.replay.buffer.config().dims(), &mut self.updates.algorithm);
        let (input, mut action) = (vec![0.0; self.replay.inputs.dim()], vec![0.0; dims.action]);
        if algorithm.value_slopes(&input, &mut action).is_none() {
            return Err(TrainError::NoCritic { algorithm: algorithm.name().to_owned() });
        }
        let rates = [actor.pixel_learning_rate, actor.pixel_average_fraction];
        let first_weights = seed_for(self.seed, SeedUse::Algorithm, 1);
        let space = self.replay.template.observation_space();
        let (student, columns) =
            pixel_student(space, dims, sight, &actor.pixel_hidden, rates, first_weights)?;
        let TrainSettings { replay, schedule, pixels, .. } = &mut self.settings;
        let threads = ThreadPoolBuilder::new().num_threads(num_threads.max(1)).build();
        *pixels = Some(actor.clone());
        self.eyes = Some(Box::new(PixelActor {
            sight: sight.clone(),
            columns,
            inputs: PixelActor::new_inputs(dims)?,
            student,
            memory: Memory::new(actor.pixel_capacity, schedule.num_envs),
            resumed: None,
            goals: Goals {
                relabeled: replay.future_k / (replay.future_k + 1.0),
                keep_already_achieved: replay.keep_already_achieved,
            },
            dims,
            threads: threads.map_err(TrainError::Threads)?,
            seed: self.seed,
            num_updates: 0,
            settings: actor,
        }));
        Ok(())
    }
}

impl<E: LearnEnv> Trainer<E> {
    /// Returns the greedy policy that sees pictures, as it is now, of a trainer
    /// [with pixels](Self::with_pixels).
    ///
    /// # Errors
    /// [`TrainedPolicyError::NotFinite`] if it has diverged, and [`TrainedPolicyError::Sight`] if
    /// none sees pictures.
    pub fn pixel_policy(&self, env_id: &str) -> Result<PixelPolicy, TrainedPolicyError> {
        match &self.eyes {
            Some(eyes) => eyes.policy(self.header(env_id)),
            None => {
                let reason = "the actor sees no pictures".to_owned();
                Err(TrainedPolicyError::Sight { reason })
            }
        }
    }
}
