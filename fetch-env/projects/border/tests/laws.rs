//! The environment and the buffer behave in border as they do alone, and border trains with both.

use border_core::record::{NullRecorder, Record, Recorder};
use border_core::{
    Agent, DefaultEvaluator, Env, Evaluator, ExperienceBufferBase, Policy, ReplayBufferBase,
    Sampler, StepProcessor, Trainer, TrainerConfig, TransitionBatch,
};
use fetch_env::{DistanceReward, Env as _, make_kinematic};
use her_relabel::{
    BufferConfig, Dims, GoalStrategy, Priorities, PriorityUnit, TransitionId, UnitInterval,
};
use with_border::{
    Config, FetchAct, FetchObs, GoalEnvironment, HerReplay, HerReplayConfig, HerSteps,
};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;
type BoxedAgent = Box<dyn Agent<GoalEnvironment, HerReplay>>;

const ROWS: usize = 32;

fn config() -> Config {
    Config("FetchPush-v4".into())
}

fn replay() -> Result<HerReplay> {
    let dims = Dims { observation: 25, goal: 3, action: 4 };
    let sampler = her_relabel::Sampler::new(ROWS, GoalStrategy::Future, UnitInterval::from_k(4));
    Ok(HerReplay::build(&HerReplayConfig {
        buffer: BufferConfig::new(1000, dims)
            .with_priorities(Priorities::new(PriorityUnit::Transition)),
        sampler: sampler.with_priorities(UnitInterval::new(0.4)?),
        reward: DistanceReward::sparse(),
        epsilon: 0.01,
        alpha: 0.6,
    }))
}

/// An agent that moves forward, and takes the rewards of a batch as its errors.
struct Forward;

impl Policy<GoalEnvironment> for Forward {
    fn sample(&mut self, _observation: &FetchObs) -> FetchAct {
        FetchAct(vec![0.5, 0.0, -0.2, 0.0])
    }
}

impl Agent<GoalEnvironment, HerReplay> for Forward {
    fn train(&mut self) {}

    fn eval(&mut self) {}

    fn opt_with_record(&mut self, buffer: &mut HerReplay) -> Record {
        let batch = buffer.batch(ROWS).expect("a finished episode");
        let (_, _, _, reward, _, _, ixs, _) = batch.unpack();
        buffer.update_priority(&ixs, &Some(reward));
        Record::empty()
    }
}

/// Collects `num_steps` steps as border does.
fn collected(num_steps: usize) -> Result<HerReplay> {
    let mut sampler = Sampler::new(GoalEnvironment::build(&config(), 3)?, HerSteps::build(&()));
    let (mut agent, mut replay): (BoxedAgent, _) = (Box::new(Forward), replay()?);
    for _ in 0..num_steps {
        sampler.sample_and_push(&mut agent, &mut replay)?;
    }
    Ok(replay)
}

#[test]
fn the_environment_gives_its_own_results() -> Result {
    let (mut env, mut alone) =
        (GoalEnvironment::build(&config(), 3)?, make_kinematic(&config().0)?);
    assert_eq!(env.reset(None)?.0, alone.reset(Some(3))?.observation);
    let action = FetchAct(vec![0.5; 4]);
    for _ in 0..120 {
        let (step, _) = env.step_with_reset(&action);
        let expected = alone.step(&action.0)?;
        assert_eq!(step.obs.0, expected.observation);
        assert_eq!(step.reward, [expected.reward as f32]);
        assert_eq!(step.is_truncated, [i8::from(expected.truncated)]);
        if expected.is_last() {
            let first = step.init_obs.ok_or("no first observation")?;
            assert_eq!(first.0, alone.reset(None)?.observation);
        }
    }
    Ok(())
}

#[test]
fn every_finished_episode_is_stored() -> Result {
    let replay = collected(120)?;
    assert_eq!((replay.len(), replay.buffer().num_episodes()), (100, 2));
    Ok(())
}

#[test]
fn batches_have_whole_rows() -> Result {
    let batch = collected(50)?.batch(ROWS)?;
    assert_eq!((batch.len(), batch.obs().width, batch.act().width), (ROWS, 28, 4));
    let (obs, _, next_obs, reward, is_terminated, _, ixs, weight) = batch.unpack();
    assert_eq!((obs.elements.len(), next_obs.elements.len()), (ROWS * 28, ROWS * 28));
    assert!(reward.iter().all(|reward| [0.0, -1.0].contains(reward)));
    assert!(is_terminated.iter().all(|flag| *flag == 0));
    assert!(ixs.is_some_and(|ixs| ixs.len() == ROWS));
    assert!(weight.is_some_and(|weights| weights.iter().all(|weight| *weight == 1.0)));
    Ok(())
}

#[test]
fn priorities_come_back_to_their_transitions() -> Result {
    let mut replay = collected(50)?;
    let (_, _, _, _, _, _, ixs, _) = replay.batch(ROWS)?.unpack();
    let chosen = ixs.ok_or("no numbers of transitions")?[0];
    replay.update_priority(&Some((1..=50).collect()), &Some(vec![0.0; 50]));
    replay.update_priority(&Some(vec![chosen]), &Some(vec![-1e6]));

    let id = TransitionId::new(chosen as u64).ok_or("number 0")?;
    let priority = replay.buffer().priority(id).ok_or("overwritten")?;
    assert_eq!(priority as f32, (1e6_f32 + 0.01).powf(0.6));
    // It outweighs all others by far.
    let (_, _, _, _, _, _, ixs, _) = replay.batch(ROWS)?.unpack();
    let ixs = ixs.ok_or("no numbers of transitions")?;
    assert!(ixs.iter().filter(|ix| **ix == chosen).count() > ROWS / 2);
    Ok(())
}

#[test]
fn border_trains_with_both() -> Result {
    let config = config();
    let mut evaluator = DefaultEvaluator::new(&config, 1, 2)?;
    // An agent may draw once the first episode has ended. A null recorder cannot save the best
    // model, so the trainer must not evaluate.
    let settings = TrainerConfig::default().warmup_period(50).max_opts(20).eval_interval(100);
    let mut agent: BoxedAgent = Box::new(Forward);
    let mut recorder: Box<dyn Recorder<_, _>> = Box::new(NullRecorder::new());
    let mut replay = replay()?;
    Trainer::build(settings).train(
        GoalEnvironment::build(&config, 0)?,
        HerSteps::build(&()),
        &mut agent,
        &mut replay,
        &mut recorder,
        &mut evaluator,
    )?;
    assert_eq!(replay.len(), 50);
    let (score, _) = evaluator.evaluate(&mut agent)?;
    assert!((-50.0..=0.0).contains(&score));
    Ok(())
}
