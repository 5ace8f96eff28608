//! Offline learning: a script's episodes of FetchPush-v4 go to a file, and another process learns
//! from only the file, by imitation and hindsight. `cargo run --release --example offline collect
//! episodes.buffer`, which takes half a minute, and then `cargo run --release --example offline
//! learn episodes.buffer`.

use std::error::Error;
use std::path::Path;

use baselines::learn::{AlgorithmSettings, CurveRow, DdpgSettings, TrainSettings, Trainer};
use baselines::{Policy, ScriptedPolicy, buffer_config};
use fetch_env::{EnvError, FetchObservation, MujocoEnv, Task, make};
use her_relabel::HerBuffer;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const EPISODES: usize = 1_000;
/// The seed of the first episode, which no evaluation uses.
const FIRST_SEED: u64 = 1 << 45;
/// The largest noise of a scripted action, so that mistakes and their correction are seen, too.
const NOISE: f32 = 0.1;

fn push() -> Result<MujocoEnv, EnvError> {
    Ok(make("FetchPush-v4")?)
}

/// Writes scripted episodes to a file.
fn collect(path: &Path) -> Result<(), Box<dyn Error>> {
    let mut env = push()?;
    let mut buffer = HerBuffer::<f32>::new(buffer_config(50 * EPISODES, &env)?)?;
    let mut script = ScriptedPolicy::new(Task::Push);
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let mut noisy = |observation: &FetchObservation, action: &mut [f32]| {
        script.act(observation, action);
        for element in action {
            let noise = random.random_range(-NOISE..=NOISE);
            *element = (*element + noise).clamp(-1.0, 1.0);
        }
    };
    let count = EPISODES;
    let all = baselines::collect(&mut env, &mut noisy, count, FIRST_SEED, &mut buffer, 0, |_| ())?;
    println!("the script's success rate is {:.2}", all.summary()?.success_rate.value);
    Ok(buffer.save(path)?)
}

/// Learns from only the episodes of a file, and evaluates what it has learned in new episodes.
fn learn(path: &Path, seed: u64) -> Result<CurveRow, Box<dyn Error>> {
    let mut settings = TrainSettings::fast(Task::Push);
    settings.algorithm = AlgorithmSettings::Ddpg(DdpgSettings {
        imitation_weight: 100.0,
        actor_learning_rate: 0.001,
        critic_learning_rate: 0.001,
        ..DdpgSettings::default()
    });
    settings.replay.batch_size = 256;
    settings.replay.n_step = 1;
    // The script shows how to reach the episode's own goal, not those of other episodes.
    settings.replay.past_goal_weight = 0.0;
    settings.schedule.evaluation_episodes = 200;
    let mut trainer = Trainer::new(push, settings, seed, 2)?;
    let episodes = HerBuffer::load(path)?;
    trainer.add_demonstrations(|buffer| -> Result<(), Box<dyn Error>> {
        Ok(buffer.append(&episodes)?)
    })?;
    trainer.update(6_000)?;
    Ok(trainer.evaluate()?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["collect", path] => collect(path.as_ref()),
        ["learn", path, ref seed @ ..] => {
            let seed = seed.first().map_or(Ok(0), |seed| seed.parse())?;
            let CurveRow { success_rate, counters, .. } = learn(path.as_ref(), seed)?;
            let (updates, seconds) = (counters.updates, counters.seconds);
            println!("{updates} updates in {seconds:.0} s: success rate {:.3}", success_rate.value);
            Ok(())
        }
        _ => Err("pass `collect FILE`, or `learn FILE` and optionally a seed".into()),
    }
}
