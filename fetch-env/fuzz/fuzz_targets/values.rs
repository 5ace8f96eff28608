//! What can be deserialized works: environments are built from it, reset, restored and stepped.
#![no_main]

use std::{fmt::Debug, num::NonZeroUsize};

use arbitrary::Arbitrary;
use fetch_env::{
    BoxSpace, DictSpace, DiscreteSpace, Env, EnvError, EnvExt, EnvId, FetchConfig, FetchEnv,
    FetchObservation, FetchResetOptions, GoalObservation, KinematicEnv, KinematicSimulator,
    MultiBinarySpace, MultiDiscreteSpace, NpRandom, SnapshotEnv, Space, make_kinematic,
    spaces::ImageSpace,
    vec_env::{VecConfig, VecEnv, VecEnvError},
    wrappers::{FrameStack, NormalizeObservation, RecordEpisodeStatistics, RunningStatistics},
};
use libfuzzer_sys::fuzz_target;
use serde::{Serialize, de::DeserializeOwned};
use testing::Input;

/// The kind of the value.
#[derive(Arbitrary, Debug)]
enum Kind {
    Config,
    Simulator,
    Snapshot,
    WrappedSnapshot,
    VecSnapshot,
    Options,
    Statistics,
    Space,
}

/// The environment for which the value is, and the number of steps before the value is taken.
#[derive(Arbitrary, Debug)]
struct Place {
    id: u8,
    steps: u8,
}

impl Place {
    fn id(&self) -> EnvId {
        EnvId::ALL[usize::from(self.id) % EnvId::ALL.len()]
    }

    fn env(&self) -> KinematicEnv {
        make_kinematic(&self.id().to_string()).expect("a known name")
    }

    /// Brings an environment into the middle of an episode.
    fn begun<E: Steps>(&self, mut env: E) -> E {
        env.reset(Some(7)).expect("a reset");
        for _ in 0..self.steps % 60 {
            env.step_once();
        }
        env
    }
}

/// An environment with the actions of the Fetch environments.
trait Steps: Env<ActionSpace = BoxSpace<f32>> {
    /// Takes a step, or resets the environment where it needs one.
    fn step_once(&mut self) -> Option<Self::Observation> {
        match self.step(&[0.5, -0.3, -0.8, 0.1]) {
            Ok(step) => Some(step.observation),
            Err(EnvError::ResetNeeded | EnvError::EpisodeOver) => {
                Some(self.reset(None).expect("a reset").observation)
            }
            Err(EnvError::Other(_)) => None,
            Err(error) => panic!("{error}"),
        }
    }
}

impl<E: Env<ActionSpace = BoxSpace<f32>>> Steps for E {}

fn is_finite(observation: &FetchObservation) -> bool {
    let parts =
        [observation.observation(), observation.achieved_goal(), observation.desired_goal()];
    parts.concat().iter().all(|number| number.is_finite())
}

/// Steps and resets an environment that observes no NaN, and takes its own snapshot.
fn runs<E: Steps + SnapshotEnv>(env: &mut E, is_good: impl Fn(&E::Observation) -> bool) {
    for _ in 0..3 {
        let observation = env.step_once();
        assert!(observation.is_none_or(|observation| is_good(&observation)));
        accepts_its_own(env);
    }
    assert!(is_good(&env.reset(None).expect("a reset").observation));
    accepts_its_own(env);
}

fn accepts_its_own<E: SnapshotEnv>(env: &mut E) {
    let snapshot = env.snapshot();
    assert_eq!(survives_json(&snapshot), snapshot);
    env.restore(&snapshot).expect("its own snapshot");
}

fn survives_json<T: Serialize + DeserializeOwned + Debug>(value: &T) -> T {
    let json = serde_json::to_string(value).expect("a serializable value");
    serde_json::from_str(&json).unwrap_or_else(|error| panic!("{error}: {json}"))
}

/// Restores a changed snapshot, or changes nothing.
fn restores<E: Steps + SnapshotEnv>(
    env: &mut E,
    input: &Input,
    is_good: impl Fn(&E::Observation) -> bool,
) {
    let before = env.snapshot();
    let Some(changed) = input.apply(&before) else { return };
    match env.restore(&changed) {
        Ok(()) => runs(env, is_good),
        Err(EnvError::ForeignSnapshot { .. }) => assert_eq!(env.snapshot(), before),
        Err(error) => panic!("{error}"),
    }
}

fn spaces() -> Space {
    let dict = DictSpace::new([
        ("single", BoxSpace::uniform(vec![2, 3], -1.0_f32, f32::INFINITY).expect("a box").into()),
        ("double", BoxSpace::<f64>::unbounded(2).expect("a box").into()),
        ("image", ImageSpace::new([2, 3, 3]).expect("an image").into()),
        ("one", DiscreteSpace::from_start(3, -1).expect("choices").into()),
        ("many", MultiDiscreteSpace::new(vec![2, 5]).expect("choices").into()),
        ("answers", MultiBinarySpace::new(vec![4, 2]).expect("answers").into()),
    ]);
    dict.expect("different keys").into()
}

/// Whether a sample is small enough to be drawn.
fn is_small(space: &Space) -> bool {
    match space {
        Space::Image(space) => space.len() <= 1 << 16,
        Space::MultiBinary(space) => space.len() <= 1 << 16,
        Space::Dict(space) => space.iter().all(|(_, space)| is_small(space)),
        _ => true,
    }
}

fn check(kind: &Kind, place: &Place, input: &Input) {
    match kind {
        Kind::Config => {
            let Some(config) = input.apply::<FetchConfig>(&place.id().config()) else { return };
            let simulator = KinematicSimulator::new(config.sim());
            let mut env = FetchEnv::new(config.clone(), simulator)
                .expect("a simulator of these settings")
                .time_limited();
            env.reset(Some(0)).expect("a reset");
            runs(&mut env, is_finite);
            assert_eq!(survives_json(&config), config);
        }
        Kind::Simulator => {
            let config = place.id().config();
            let simulator = KinematicSimulator::new(config.sim());
            let Some(simulator) = input.apply(&simulator) else { return };
            let Ok(env) = FetchEnv::new(config, simulator) else { return };
            let mut env = env.time_limited();
            env.reset(Some(0)).expect("a reset");
            runs(&mut env, is_finite);
        }
        Kind::Snapshot => restores(&mut place.begun(place.env()), input, is_finite),
        Kind::WrappedSnapshot => {
            let two = NonZeroUsize::MIN.saturating_add(1);
            let stacked = place.env().wrap(FrameStack::new(two)).expect("a vector");
            let normalized = stacked.wrap(NormalizeObservation::new()).expect("a vector");
            let env = normalized.wrap(RecordEpisodeStatistics::new()).expect("any environment");
            restores(&mut place.begun(env), input, |observation| {
                !observation.observation().iter().any(|number| number.is_nan())
            });
        }
        Kind::VecSnapshot => {
            let singles = [place.env(), place.begun(place.env())];
            let mut envs = VecEnv::new(singles, VecConfig::default().with_num_threads(1))
                .expect("environments of one kind");
            envs.reset(Some(3)).expect("a reset");
            let before = envs.snapshot().expect("idle environments");
            let Some(changed) = input.apply(&before) else { return };
            if envs.restore(&changed).is_err() {
                assert_eq!(envs.snapshot(), Ok(before));
            }
            for _ in 0..3 {
                match envs.step(&[0.1; 8]) {
                    Ok(batch) => {
                        // The row of one with an error is NaN, as where the changed snapshot says
                        // that its first episode has not begun.
                        let failed: Vec<_> = batch.errors().map(|(row, _)| row).collect();
                        let rows = batch.observation().chunks(batch.observation().len() / 2);
                        for (row, observation) in rows.enumerate() {
                            let is_finite = observation.iter().all(|number| number.is_finite());
                            assert!(is_finite || failed.contains(&row), "row {row}");
                        }
                    }
                    // Or that none of them has.
                    Err(VecEnvError::ResetNeeded { .. }) => {}
                    Err(error) => panic!("{error}"),
                }
            }
            assert_eq!(envs.reset(None).expect("a reset").errors().count(), 0);
            let own = envs.snapshot().expect("idle environments");
            assert_eq!(survives_json(&own), own);
        }
        Kind::Options => {
            let valid = FetchResetOptions::default()
                .with_desired_goal([1.3, 0.7, 0.5])
                .with_object_position([1.2, 0.8]);
            let Some(options) = input.apply(&valid) else { return };
            let mut env = place.begun(place.env());
            let before = env.snapshot();
            match env.reset_with(None, &options) {
                Ok(reset) => {
                    assert!(is_finite(&reset.observation));
                    runs(&mut env, is_finite);
                }
                Err(_) => assert_eq!(env.snapshot(), before),
            }
        }
        Kind::Statistics => {
            let env = place.env();
            let len = FetchObservation::len_of(place.id().task);
            let Some(statistics) = input.apply(&RunningStatistics::new(len)) else { return };
            let Ok(mut env) = env.wrap(NormalizeObservation::frozen(statistics)) else { return };
            env.set_frozen(place.steps % 2 == 0);
            env.reset(Some(0)).expect("a reset");
            runs(&mut env, |observation| {
                !observation.observation().iter().any(|number| number.is_nan())
            });
        }
        Kind::Space => {
            let Some(space) = input.apply::<Space>(&spaces()) else { return };
            assert_eq!(survives_json(&space), space);
            if is_small(&space) {
                let mut random = NpRandom::new(place.steps.into());
                let sample = space.sample(&mut random);
                assert!(space.contains(&sample), "{sample:?} is not in {space:?}");
            }
        }
    }
}

fuzz_target!(|input: (Kind, Place, Input)| {
    let (kind, place, input) = input;
    check(&kind, &place, &input);
});
