//! Proximal policy optimization: what it learns from, what an update does, and what it refuses.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};

use baselines::learn::{
    Algorithm, AlgorithmInit, AlgorithmSettings, CheckpointError, Losses, Ppo, PpoSettings,
    Rollout, Target, TrainError, TrainSettings, Trainer, Transitions,
};
use baselines::workers::OneProcess;
use fetch_env::{EnvError, make_kinematic};
use serde::Deserialize;
use tempfile::tempdir;

use crate::runs::{Kinematic, Result, ddpg, make, ppo, settings};
use crate::watched;

fn make_dense() -> Result<Kinematic, EnvError> {
    Ok(make_kinematic("FetchReachDense-v4")?)
}

#[test]
fn it_learns_to_reach_from_dense_rewards() -> Result {
    for seed in [1, 2] {
        let mut settings = TrainSettings::fast_ppo();
        settings.schedule.evaluation_episodes = 20;
        let mut trainer = Trainer::new(make_dense, settings, seed, 2)?;
        let target = Target { success_rate: 1.0, evaluations: 2 };
        trainer.run(24_000, Some(target), |_, _| ControlFlow::Continue(()))?;
        let row = trainer.rows().last().ok_or("no row")?;
        assert!(target.is_reached(trainer.rows()), "{row:?}");
        assert_eq!(row.counters.updates, row.counters.steps / 800, "one in each cycle");
    }
    Ok(())
}

/// An update of Stable-Baselines3, which `ppo/sb3.py` writes. Matrices have a row for each step.
#[derive(Deserialize)]
struct TheirUpdate {
    settings: serde_json::Map<String, serde_json::Value>,
    before: BTreeMap<String, Vec<f32>>,
    after: BTreeMap<String, Vec<f32>>,
    /// Of all parameters, in each step of the optimizer.
    gradients: Vec<Vec<f32>>,
    input: Vec<f32>,
    noise: Vec<f32>,
    reward: Vec<f32>,
    discount: Vec<f32>,
    next_input: Vec<f32>,
    is_last: Vec<bool>,
    critic_loss: f32,
    actor_loss: f32,
    kl: f32,
    clip_fraction: f32,
}

fn close(own: &[f32], theirs: &[f32], what: &str) {
    assert_eq!(own.len(), theirs.len(), "{what}");
    for (index, (own, theirs)) in own.iter().zip(theirs).enumerate() {
        assert!((own - theirs).abs() < 1e-5, "{what} {index}: {own} {theirs}");
    }
}

/// An update of ours.
struct OwnUpdate {
    ppo: Ppo,
    losses: Losses,
    /// The gradients and the means, in each step of the optimizer.
    gradients: Vec<Vec<f32>>,
}

impl TheirUpdate {
    fn read() -> serde_json::Result<Self> {
        serde_json::from_str(include_str!("ppo/sb3.json"))
    }

    /// Performs the update from the same parameters and steps, with its settings changed.
    fn update(&self, change: impl FnOnce(&mut PpoSettings)) -> Result<OwnUpdate> {
        let mut settings = serde_json::to_value(PpoSettings::default())?;
        settings.as_object_mut().ok_or("no settings")?.extend(self.settings.clone());
        let mut settings = serde_json::from_value(settings)?;
        change(&mut settings);
        let (len, reward_bounds) = (self.reward.len(), f64::NEG_INFINITY..=0.0);
        let (num_inputs, num_actions) = (self.input.len() / len, self.noise.len() / len);
        let init = AlgorithmInit { num_inputs, num_actions, reward_bounds, seed: 0, rank: 0 };
        let mut ppo = Ppo::new(settings, init)?;
        for (part, parameters) in parameters(&mut ppo) {
            parameters.clone_from(&self.before[part]);
        }
        let batch = Transitions {
            len,
            input: &self.input,
            reward: &self.reward,
            discount: &self.discount,
            next_input: &self.next_input,
            noise: &self.noise,
            is_last: &self.is_last,
            ..Transitions::default()
        };
        let mut gradients = Vec::new();
        let losses = ppo.update(batch, &mut |numbers| gradients.push(numbers.to_vec()));
        Ok(OwnUpdate { ppo, losses, gradients })
    }
}

/// Returns all parameters, by their names in the file.
fn parameters(ppo: &mut Ppo) -> Vec<(&'static str, &mut Vec<f32>)> {
    const NAMES: [(&str, &str); 3] = [
        ("actor", "actor.parameters"),
        ("deviations", "deviations.logarithms"),
        ("critic", "critic.parameters"),
    ];
    let named = |(name, vector)| {
        let (part, _) = NAMES.iter().find(|(_, own)| *own == name)?;
        Some((*part, vector))
    };
    ppo.state_mut().vectors.into_iter().filter_map(named).collect()
}

#[test]
fn an_update_is_that_of_stable_baselines3() -> Result {
    let theirs = TheirUpdate::read()?;
    let OwnUpdate { mut ppo, losses, gradients } = theirs.update(|_| ())?;
    close(&[losses.critic, losses.actor], &[theirs.critic_loss, theirs.actor_loss], "loss");
    assert_eq!(gradients.len(), theirs.gradients.len());
    for (step, (own, theirs)) in gradients.iter().zip(&theirs.gradients).enumerate() {
        close(&own[..theirs.len()], theirs, &format!("gradient of step {step}"));
    }
    let after = parameters(&mut ppo);
    assert_eq!(after.len(), 3);
    for (part, own) in after {
        close(own, &theirs.after[part], part);
        assert_ne!(theirs.before[part], theirs.after[part]);
    }
    let diagnostics: BTreeMap<_, _> = ppo.diagnostics().into_iter().collect();
    let own = ["kl", "clip_fraction"].map(|name| diagnostics[name]);
    close(&own, &[theirs.kl, theirs.clip_fraction], "diagnostics");
    assert!(theirs.clip_fraction > 0.0, "nothing is clipped");
    Ok(())
}

/// The columns of a cycle, without its normalization: nothing has been seen before the first one.
#[derive(Default)]
struct Cycle {
    action: Vec<[f32; 4]>,
    reward: Vec<f32>,
    discount: Vec<f32>,
    input: Vec<[f32; 13]>,
    next_input: Vec<[f32; 13]>,
    is_last: Vec<bool>,
}

fn keep(cycle: &mut Cycle, batch: Transitions<'_>) {
    *cycle = Cycle {
        action: batch.action.as_chunks().0.to_vec(),
        reward: batch.reward.to_vec(),
        discount: batch.discount.to_vec(),
        input: batch.input.as_chunks().0.to_vec(),
        next_input: batch.next_input.as_chunks().0.to_vec(),
        is_last: batch.is_last.to_vec(),
    };
}

/// Returns the distance from the goal in an input that ends with the way to it.
fn distance(input: &[f32; 13]) -> f32 {
    input[10..].iter().map(|element| element * element).sum::<f32>().sqrt()
}

#[test]
fn a_cycle_has_every_step_and_a_cut_off_episode_keeps_the_value_of_its_last_observation() -> Result
{
    let kept = Arc::<Mutex<Cycle>>::default();
    let mut settings = settings(ppo());
    settings.schedule.num_envs = 3;
    settings.schedule.steps_per_cycle = 120;
    let build = watched::build(&kept, keep);
    let mut trainer =
        Trainer::with_algorithm(make_dense, settings, 0, 1, Box::new(OneProcess), build)?;
    trainer.cycle()?;
    let cycle = kept.lock().expect("no thread panics");
    // Two episodes of each environment are cut off, and one is under way.
    let ends: Vec<_> = (0..360).filter(|step| cycle.is_last[*step]).map(|step| step + 1).collect();
    assert_eq!(ends, [50, 100, 120, 170, 220, 240, 290, 340, 360]);
    // Tasks never end.
    assert_eq!(cycle.discount, [0.99; 360]);
    for (step, next_input) in cycle.next_input.iter().enumerate() {
        // The observation to which the action led, which determines the reward.
        assert!((cycle.reward[step] + distance(next_input)).abs() < 1e-5, "{step}");
        let follows = cycle.input.get(step + 1).is_some_and(|input| input == next_input);
        assert_eq!(follows, !cycle.is_last[step], "{step}");
    }
    assert!(cycle.action.iter().flatten().all(|element| element.abs() < 1.0));

    // With the reward itself as the value of a state, by hand for the end of the first episode.
    let of = |inputs: &[[f32; 13]]| inputs.iter().map(|input| -distance(input)).collect::<Vec<_>>();
    let (value, next_value) = (of(&cycle.input), of(&cycle.next_input));
    let rollout =
        Rollout::new(&cycle.reward, &cycle.discount, &value, &next_value, &cycle.is_last)?;
    let advantages = rollout.advantages(0.95);
    let [before, first, last] = [47, 48, 49].map(|step| cycle.reward[step]);
    let cut_off = last + 0.99 * last - first;
    assert!((advantages[49] - cut_off).abs() < 1e-5, "{} {cut_off}", advantages[49]);
    let one_before = first + 0.99 * first - before + 0.99 * 0.95 * cut_off;
    assert!((advantages[48] - one_before).abs() < 1e-5, "{} {one_before}", advantages[48]);
    Ok(())
}

#[test]
fn a_divergence_above_the_target_ends_an_update() -> Result {
    let theirs = TheirUpdate::read()?;
    // Before the first step of the optimizer there is none.
    assert_eq!(theirs.update(|ppo| ppo.target_kl = Some(1e-6))?.gradients.len(), 2);
    assert_eq!(theirs.update(|ppo| ppo.target_kl = Some(theirs.kl))?.gradients.len(), 6);
    Ok(())
}

#[test]
fn batches_can_be_more_than_steps() -> Result {
    let theirs = TheirUpdate::read()?;
    let OwnUpdate { ppo, losses, gradients } = theirs.update(|ppo| ppo.minibatches = 50)?;
    assert_eq!(gradients.len(), 6 * 50);
    assert!(losses.critic > 0.0 && losses.actor.is_finite(), "{losses:?}");
    assert!(ppo.diagnostics().iter().all(|(_, number)| number.is_finite()));
    Ok(())
}

#[test]
fn settings_without_effect_are_refused() -> Result {
    let settings = TrainSettings::fast_ppo();
    for (assignment, expected) in [
        ("batch_size=64", "ppo does not use batch_size, which is 64: leave it at 256"),
        ("future_k=4", "ppo does not use future_k, which is 4.0: leave it at 0.0"),
        ("random_episodes=20", "ppo does not use random_episodes, which is 20: leave it at 0"),
        ("updates_per_cycle=2", "ppo does not use updates_per_cycle, which is 2: leave it at 1"),
        ("actor_observation_noise=0.1", "ppo does not use actor_observation_noise, which is 0.1"),
    ] {
        let error = settings.with(assignment).expect_err(assignment).to_string();
        assert!(error.starts_with(expected), "{error}");
    }
    for used in ["capacity=100", "far_start_share=0.5", "left_out=[1]", "num_envs=3", "epochs=2"] {
        settings.with(used)?;
    }
    // An algorithm of your own is known only when it is built.
    let own = TrainSettings { algorithm: AlgorithmSettings::Other(1.into()), ..settings };
    let build = |settings: &AlgorithmSettings, init| {
        assert_eq!(settings.name(), "other");
        ppo().build(init)
    };
    let new = |settings| {
        Trainer::with_algorithm(make, settings, 0, 1, Box::new(OneProcess), build).map(drop)
    };
    new(own.clone())?;
    let mut mirrored = own;
    mirrored.replay.mirrored = 0.5;
    let refused = new(mirrored);
    assert!(matches!(&refused, Err(TrainError::Unused { name, .. }) if name == "mirrored"));
    Ok(())
}

#[test]
fn demonstrations_are_refused() -> Result {
    let mut trainer = Trainer::new(make, settings(ppo()), 0, 1)?;
    let added = trainer.add_demonstrations(|_| -> Result<(), TrainError> { unreachable!() });
    assert!(matches!(added, Err(TrainError::OnPolicy { .. })), "{added:?}");
    let updated = trainer.update(1);
    assert!(matches!(updated, Err(TrainError::OnPolicy { .. })), "{updated:?}");
    Ok(())
}

#[test]
fn a_checkpoint_of_another_algorithm_is_refused() -> Result {
    let folder = tempdir()?;
    for (own, other) in [(ppo(), ddpg()), (ddpg(), ppo())] {
        let folder = folder.path().join(own.name());
        let mut trainer = Trainer::new(make, settings(own), 1, 1)?;
        trainer.cycle()?;
        trainer.save(&folder)?;
        let build = |_: &AlgorithmSettings, init| other.build(init);
        let resumed =
            Trainer::resume_with_algorithm(make, &folder, 1, Box::new(OneProcess), build).map(drop);
        let is_refused = matches!(
            &resumed,
            Err(CheckpointError::Foreign { .. } | CheckpointError::Train(TrainError::Unused { .. }))
        );
        assert!(is_refused, "{resumed:?}");
    }
    Ok(())
}
