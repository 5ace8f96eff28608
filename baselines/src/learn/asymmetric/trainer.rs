//! Trainers with an actor that sees pictures.

use fetch_env::vec_env::BatchObservation;
use fetch_env::{EnvError, PictureRows};
use rayon::ThreadPoolBuilder;

use super::actor::PixelActor;
use super::memory::{Goals, Memory};
use super::settings::PixelActorSettings;
use crate::learn::distill::pixels::pixel_student;
use crate::learn::error::TrainError;
use crate::learn::run::env::LearnEnv;
use crate::learn::run::seeds::{SeedUse, seed_for};
use crate::learn::run::trainer::Trainer;
use crate::learn::settings::train::TrainSettings;
use crate::trained::{PixelPolicy, Sight, TrainedPolicyError};

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
    /// [`Convolution::defaults`](crate::network::Convolution::defaults). The run cannot be
    /// [saved](Self::save); it keeps the promise of the same bits on any number of threads.
    ///
    /// ```no_run
    /// use std::ops::ControlFlow;
    ///
    /// use baselines::Sight;
    /// use baselines::learn::{PixelActorSettings, TrainSettings, Trainer};
    /// use fetch_env::{AddRenderObservation, EnvExt, PixelOptions, RenderOptions, Task, make};
    ///
    /// let view = RenderOptions::default().with_width(64).with_height(64).with_goals_shown(false);
    /// let sight = Sight::robot(Task::Push, PixelOptions::default().with_render(view));
    /// let pixels = || AddRenderObservation::new(sight.pixels.clone());
    /// let make = || make("FetchPush-v4")?.wrap(pixels());
    /// let (settings, actor) =
    ///     (TrainSettings::fast(Task::Push), PixelActorSettings::of_task(Task::Push));
    /// let mut trainer = Trainer::with_pixels(make, &sight, settings, actor, 0, 2)?;
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
    /// network for the pictures; [`TrainError::NoCritic`] if the algorithm has no
    /// [`value_slopes`](crate::learn::Algorithm::value_slopes).
    pub fn with_pixels(
        make: impl Fn() -> Result<E, EnvError>,
        sight: &Sight,
        settings: TrainSettings,
        actor: PixelActorSettings,
        seed: u64,
        num_threads: usize,
    ) -> Result<Self, TrainError> {
        actor.check()?;
        let mut trainer = Self::new(make, settings, seed, num_threads)?;
        let (dims, algorithm) =
            (trainer.replay.buffer.config().dims(), &mut trainer.updates.algorithm);
        let (input, mut action) = (vec![0.0; trainer.replay.inputs.dim()], vec![0.0; dims.action]);
        if algorithm.value_slopes(&input, &mut action).is_none() {
            return Err(TrainError::NoCritic { algorithm: algorithm.name().to_owned() });
        }
        let rates = [actor.learning_rate, actor.average_fraction];
        let first_weights = seed_for(seed, SeedUse::Algorithm, 1);
        let space = trainer.replay.template.observation_space();
        let (student, columns) =
            pixel_student(space, dims, sight, &actor.hidden, rates, first_weights)?;
        let TrainSettings { replay, schedule, .. } = &trainer.settings;
        let threads = ThreadPoolBuilder::new().num_threads(num_threads.max(1)).build();
        trainer.eyes = Some(Box::new(PixelActor {
            sight: sight.clone(),
            columns,
            inputs: PixelActor::new_inputs(dims)?,
            student,
            memory: Memory::new(actor.capacity, schedule.num_envs),
            goals: Goals {
                relabeled: replay.future_k / (replay.future_k + 1.0),
                keep_already_achieved: replay.keep_already_achieved,
            },
            dims,
            threads: threads.map_err(TrainError::Threads)?,
            seed,
            num_updates: 0,
            settings: actor,
        }));
        Ok(trainer)
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
