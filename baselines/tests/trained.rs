//! Trained policies: their files, and what is refused.

use std::error::Error as _;
use std::fs;
#[cfg(unix)]
use std::process::Command;

use allocation_counter::measure;
use baselines::{
    Estimate, InputPart, LayerWeights, Policy, PolicyError, PolicyHeader, ScriptedPolicy,
    SuccessRate, TrainedPolicy, TrainedPolicyError, evaluate, evaluate_vec,
};
#[cfg(feature = "mujoco")]
use fetch_env::make_vec;
use fetch_env::vec_env::{BatchObservation, GoalRows, VecConfig};
use fetch_env::{Env, EnvId, GoalObservation, Reset, RewardKind, Task, VecEnv, make_kinematic};
#[cfg(feature = "mujoco")]
use fetch_sim::MujocoVersion;
use her_relabel::{Normalizer, NormalizerConfig, StateRows};
use proptest::prelude::*;
use serde_json::Value;

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

fn header() -> PolicyHeader {
    PolicyHeader {
        version: PolicyHeader::VERSION,
        env_id: "FetchReach-v4".into(),
        observation_len: 10,
        goal_len: 3,
        action_len: 4,
        inputs: vec![InputPart::Observation, InputPart::DesiredGoal],
        observation_normalizer: None,
        goal_normalizer: None,
        algorithm: "by hand".into(),
        settings: Value::Null,
        seed: 0,
        steps: 0,
        demonstrations: 0,
        success: None,
    }
}

/// A policy that moves straight to the goal: each action is the tangent of 20 times the distance.
fn straight() -> LayerWeights {
    let mut weights = vec![0.0; 13 * 4];
    for axis in 0..3 {
        weights[axis * 4 + axis] = -20.0;
        weights[(10 + axis) * 4 + axis] = 20.0;
    }
    LayerWeights { num_inputs: 13, weights, biases: vec![0.0; 4] }
}

fn policy() -> TrainedPolicy {
    TrainedPolicy::new(header(), &[straight()]).expect("the layer fits")
}

#[test]
fn the_way_to_the_goal_can_be_an_input() -> Result {
    let mut weights = vec![0.0; 3 * 4];
    (0..3).for_each(|axis| weights[axis * 4 + axis] = 20.0);
    let layer = LayerWeights { num_inputs: 3, weights, biases: vec![0.0; 4] };
    let header = PolicyHeader { inputs: vec![InputPart::RelativeGoal], ..header() };
    let mut relative = TrainedPolicy::new(header, &[layer])?;
    let mut env = make_kinematic("FetchReach-v4")?;
    let expected = evaluate(&mut env, &mut policy(), 20, 7, |_| ())?.summary()?;
    let summary = evaluate(&mut env, &mut relative, 20, 7, |_| ())?.summary()?;
    assert_eq!(summary.success_rate.value, 1.0);
    assert!((summary.episode_return_mean.value - expected.episode_return_mean.value).abs() < 1e-9);
    Ok(())
}

#[cfg(feature = "mujoco")]
#[test]
fn the_policies_of_this_crate_are_of_their_tasks_and_succeed() -> Result {
    let shipped = Task::ALL.map(|task| (task, TrainedPolicy::shipped(task)));
    let robust = [Task::Push, Task::PickAndPlace].map(|task| (task, TrainedPolicy::robust(task)));
    for (task, policy) in shipped.into_iter().chain(robust) {
        let mut policy = policy?;
        let least = if task == Task::Slide { 0.7 } else { 0.95 };
        let env_id = EnvId { task, reward: RewardKind::Sparse };
        assert_eq!(policy.header().env_id, env_id.to_string());
        assert!(policy.to_bytes()?.len() < 400_000);
        let success = policy.header().success.ok_or("its success has not been measured")?;
        assert!(success.rate.value >= least, "{env_id}: {success:?}");
        let mut envs = make_vec(env_id, 10, VecConfig::default())?;
        let measured = evaluate_vec(&mut envs, &mut policy, 40, 1 << 52, |_| ())?.summary()?;
        // How far a puck slides depends on MuJoCo's version, and the policy was trained on 3.6.0.
        let is_elsewhere = MujocoVersion::of_library()?.to_string() != "3.6.0";
        let least = if task == Task::Slide && is_elsewhere { 0.2 } else { success.rate.low };
        assert!(measured.success_rate.high >= least, "{env_id}: {measured:?}");
    }
    Ok(())
}

#[test]
fn a_policy_acts_the_same_alone_among_many_and_loaded() -> Result {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("straight.safetensors");
    fs::write(&path, policy().to_bytes()?)?;
    let mut loaded = TrainedPolicy::load(&path)?;
    assert!(loaded == policy());
    let mut env = make_kinematic("FetchReach-v4")?;
    let alone = evaluate(&mut env, &mut policy(), 20, 7, |_| ())?;
    assert_eq!(alone.summary()?.success_rate.value, 1.0);
    assert!(evaluate(&mut env, &mut loaded, 20, 7, |_| ())? == alone);
    let envs = (0..6).map(|_| make_kinematic("FetchReach-v4"));
    let mut envs = VecEnv::new(envs.collect::<Result<Vec<_>, _>>()?, VecConfig::default())?;
    assert!(evaluate_vec(&mut envs, &mut loaded, 20, 7, |_| ())? == alone);
    Ok(())
}

#[test]
fn rows_have_the_actions_of_each_and_their_lengths_are_checked() -> Result {
    let (mut policy, mut alone) = (policy(), policy());
    let mut env = make_kinematic("FetchReach-v4")?;
    let starts = [env.reset(Some(1))?.observation, env.reset(None)?.observation];
    let all =
        |part: fn(&fetch_env::FetchObservation) -> &[f64]| starts.each_ref().map(part).concat();
    let (observation, achieved_goal, desired_goal) =
        (all(|o| o.observation()), all(|o| o.achieved_goal()), all(|o| o.desired_goal()));
    let states = StateRows {
        observation: &observation,
        achieved_goal: &achieved_goal,
        desired_goal: &desired_goal,
    };
    let mut actions = [0.0; 8];
    policy.act_rows(&states, &mut actions)?;
    for (start, action) in starts.iter().zip(actions.chunks(4)) {
        let mut expected = [0.0; 4];
        alone.act(start, &mut expected);
        assert_eq!(action, expected);
    }
    for short in [
        StateRows { observation: &observation[1..], ..states },
        StateRows { desired_goal: &desired_goal[..3], ..states },
    ] {
        let refused = policy.act_rows(&short, &mut actions);
        assert!(matches!(refused, Err(TrainedPolicyError::Rows { rows: 2, .. })), "{refused:?}");
    }
    assert!(policy.act_rows(&states, &mut actions[..7]).is_err());
    Ok(())
}

/// An observation whose numbers a test chooses.
#[derive(Clone, Debug, PartialEq)]
struct Chosen {
    observation: Vec<f64>,
    goals: [[f64; 3]; 2],
}

impl BatchObservation for Chosen {
    type Rows = GoalRows<f64>;
}

impl GoalObservation for Chosen {
    type Element = f64;

    fn observation(&self) -> &[f64] {
        &self.observation
    }

    fn achieved_goal(&self) -> &[f64] {
        &self.goals[0]
    }

    fn desired_goal(&self) -> &[f64] {
        &self.goals[1]
    }
}

#[test]
fn no_policy_acts_on_numbers_that_are_not_finite() -> Result {
    for task in Task::ALL {
        let id = EnvId { task, reward: RewardKind::Sparse }.to_string();
        let start = make_kinematic(&id)?.reset(Some(0))?.observation;
        let seen = Chosen {
            observation: start.observation().to_vec(),
            goals: [start.achieved_goal().try_into()?, start.desired_goal().try_into()?],
        };
        let mut trained = TrainedPolicy::shipped(task)?;
        let mut scripted = ScriptedPolicy::new(task);
        let mut action = [0.0_f32; 4];
        for act in [&mut trained as &mut dyn Policy<Chosen>, &mut scripted] {
            act.act(&seen, &mut action);
            assert!(action.iter().all(|element| element.is_finite()), "{task}");
        }
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for at in 0..seen.observation.len() + 6 {
                let mut seen = seen.clone();
                let len = seen.observation.len();
                match at.checked_sub(len) {
                    None => seen.observation[at] = bad,
                    Some(at) => seen.goals[at / 3][at % 3] = bad,
                }
                trained.act(&seen, &mut action);
                assert!(action.iter().all(|element| element.is_nan()), "{task} {at} {bad}");
                // The scripts do not read the achieved goal, which the observation repeats.
                if !(len..len + 3).contains(&at) {
                    scripted.act(&seen, &mut action);
                    assert!(action.iter().all(|element| element.is_nan()), "{task} {at} {bad}");
                }
                let states = StateRows {
                    observation: &[start.observation(), &seen.observation].concat(),
                    achieved_goal: &[start.achieved_goal(), &seen.goals[0]].concat(),
                    desired_goal: &[start.desired_goal(), &seen.goals[1]].concat(),
                };
                let mut actions = [0.5; 8];
                let refused = trained.act_rows(&states, &mut actions);
                let (part, index) = match at.checked_sub(len) {
                    None => ("observation", at),
                    Some(at) if at < 3 => ("achieved_goal", at),
                    Some(at) => ("desired_goal", at - 3),
                };
                let expected = format!("{part}[{index}] of row 1 is {bad:?}: pass numbers");
                assert!(refused.is_err_and(|error| error.to_string().starts_with(&expected)));
                assert_eq!(actions, [0.5; 8]);
            }
        }
        let huge = Chosen { observation: vec![1e300; seen.observation.len()], ..seen };
        trained.act(&huge, &mut action);
        assert!(action.iter().all(|element| element.is_nan()));
    }
    Ok(())
}

#[test]
fn an_action_takes_no_memory_after_the_first() -> Result {
    for task in Task::ALL {
        let mut policy = TrainedPolicy::shipped(task)?;
        let name = policy.header().env_id.clone();
        let Reset { observation, .. } = make_kinematic(&name)?.reset(Some(0))?;
        let mut action = [0.0_f32; 4];
        policy.act(&observation, &mut action);
        let taken = measure(|| policy.act(&observation, &mut action));
        assert_eq!(taken.count_total, 0, "{name}");
    }
    Ok(())
}

#[test]
fn normalizers_and_the_order_of_inputs_count() -> Result {
    let mut goal = Normalizer::new(NormalizerConfig::new(3))?;
    goal.update(&[1.0, 1.0, 1.0, 3.0, 3.0, 3.0])?;
    let mut header = header();
    header.inputs = vec![InputPart::AchievedGoal, InputPart::DesiredGoal];
    header.goal_normalizer = Some(goal);
    let mut weights = vec![0.0; 6 * 4];
    // The first action sees the first element of the desired goal, the last one of the achieved.
    weights[3 * 4] = 0.5;
    weights[3] = 0.25;
    let layer = LayerWeights { num_inputs: 6, weights, biases: vec![0.0; 4] };
    let mut policy = TrainedPolicy::new(header, &[layer])?;
    let Reset { observation, .. } = make_kinematic("FetchReach-v4")?.reset(Some(0))?;
    let mut action = [0.0_f32; 4];
    policy.act(&observation, &mut action);
    // The mean of the scale is 2 and its standard deviation 1.
    let [achieved, desired] = [observation.achieved_goal()[0], observation.desired_goal()[0]];
    let expected = [0.5 * (desired - 2.0) as f32, 0.0, 0.0, 0.25 * (achieved - 2.0) as f32];
    // As an actor computes it, in double precision.
    assert_eq!(action, expected.map(|output| libm::tanh(f64::from(output)) as f32));
    Ok(())
}

#[test]
fn there_is_no_action_for_observations_of_another_task() -> Result {
    let Reset { observation, .. } = make_kinematic("FetchPush-v4")?.reset(Some(0))?;
    let mut header = header();
    header.inputs = vec![InputPart::Observation];
    let layer = LayerWeights { num_inputs: 10, weights: vec![1.0; 40], biases: vec![0.5; 4] };
    for normalizer in [None, Some(Normalizer::new(NormalizerConfig::new(10))?)] {
        header.observation_normalizer = normalizer;
        let mut action = [0.0_f32; 4];
        TrainedPolicy::new(header.clone(), std::slice::from_ref(&layer))?
            .act(&observation, &mut action);
        assert!(action.iter().all(|element| element.is_nan()));
    }
    Ok(())
}

#[test]
fn layers_that_do_not_fit_are_refused() {
    let changes: [fn(&mut PolicyHeader, &mut LayerWeights); 8] = [
        |header, _| header.version = 2,
        |header, _| header.action_len = 3,
        |header, _| header.goal_len = 0,
        |header, _| header.inputs = vec![InputPart::Observation],
        |header, _| {
            header.goal_normalizer = Normalizer::new(NormalizerConfig::new(2)).ok();
        },
        |_, layer| layer.biases.clear(),
        |_, layer| layer.weights.truncate(51),
        |_, layer| layer.weights[3] = f32::INFINITY,
    ];
    for (number, change) in changes.into_iter().enumerate() {
        let (mut header, mut layer) = (header(), straight());
        change(&mut header, &mut layer);
        assert!(TrainedPolicy::new(header, &[layer]).is_err(), "{number}");
    }
    assert!(TrainedPolicy::new(header(), &[]).is_err());
    let lengths = policy().check_lengths(25, 3, 4);
    assert!(matches!(lengths, Err(PolicyError::Trained { .. })));
    assert!(policy().check_lengths(10, 3, 4).is_ok());
}

#[test]
fn files_of_other_kinds_are_refused() -> Result {
    let folder = tempfile::tempdir()?;
    let missing = TrainedPolicy::load(folder.path().join("missing"));
    assert!(matches!(missing, Err(TrainedPolicyError::Io { .. })));
    for bytes in [&b""[..], b"{}", b"\x02\0\0\0\0\0\0\0{}", &[0xff; 100]] {
        assert!(TrainedPolicy::from_bytes(bytes).is_err(), "{bytes:?}");
    }
    let damaged = folder.path().join("damaged");
    fs::write(&damaged, b"{}")?;
    for path in [folder.path().join("missing"), damaged] {
        let error = TrainedPolicy::load(&path).expect_err("there is no policy");
        let reason = error.source().ok_or("it has no reason")?;
        assert!(error.to_string().contains(&path.display().to_string()), "{error}");
        assert_eq!(format!("{error:?}"), format!("{error}: {reason}"));
    }
    let huge = folder.path().join("huge");
    fs::File::create(&huge)?.set_len(65 << 20)?;
    assert!(matches!(TrainedPolicy::load(huge), Err(TrainedPolicyError::TooLarge { .. })));
    Ok(())
}

#[test]
fn a_saved_policy_is_whole_or_the_previous_one() -> Result {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("policy.safetensors");
    for _ in 0..2 {
        policy().save(&path)?;
        assert!(TrainedPolicy::load(&path)? == policy());
    }
    assert_eq!(fs::read_dir(folder.path())?.count(), 1, "nothing is left over");
    for path in [folder.path().to_owned(), path.join("in a file")] {
        let error = policy().save(&path).expect_err("it is no place for a file");
        assert!(error.to_string().contains(&path.display().to_string()), "{error}");
        assert!(matches!(error, TrainedPolicyError::Write { .. }), "{error}");
    }
    Ok(())
}

/// A value in as many lists.
fn nested(depth: usize) -> Value {
    (0..depth).fold(Value::Null, |value, _| Value::Array(vec![value]))
}

#[test]
fn what_is_written_can_be_loaded_and_the_rest_is_refused() -> Result {
    let file = |header: PolicyHeader| TrainedPolicy::new(header, &[straight()])?.to_bytes();
    for depth in [0, 100, 125, 126, 127, 128, 200] {
        let header = PolicyHeader { settings: nested(depth), ..header() };
        match file(header.clone()) {
            Ok(bytes) => assert_eq!(TrainedPolicy::from_bytes(&bytes)?.header(), &header),
            Err(TrainedPolicyError::Header { .. }) => assert!(depth > 120, "{depth}"),
            Err(error) => panic!("{depth}: {error}"),
        }
    }
    let estimate = Estimate { value: 0.5, low: f64::NEG_INFINITY, high: f64::INFINITY };
    let nan = f64::NAN;
    for (rate, fits) in [
        (estimate, true),
        (Estimate { value: nan, ..estimate }, false),
        (Estimate { value: f64::INFINITY, ..estimate }, false),
        (Estimate { low: nan, ..estimate }, false),
        (Estimate { high: nan, ..estimate }, false),
    ] {
        let policy = policy().with_success(SuccessRate { rate, episodes: 1, first_seed: 0 });
        match policy.to_bytes() {
            Ok(bytes) => assert!(fits && TrainedPolicy::from_bytes(&bytes)? == policy),
            Err(error) => assert!(!fits && error.to_string().contains("success rate"), "{error}"),
        }
    }
    let settings = Value::String(" ".repeat(65 << 20));
    let refused = file(PolicyHeader { settings, ..header() });
    assert!(matches!(refused, Err(TrainedPolicyError::Size { .. })), "{refused:?}");
    Ok(())
}

#[cfg(unix)]
#[test]
fn a_pipe_or_a_device_is_no_policy() -> Result {
    let folder = tempfile::tempdir()?;
    let (pipe, zero) = (folder.path().join("pipe"), folder.path().join("zero"));
    assert!(Command::new("mkfifo").arg(&pipe).status()?.success());
    std::os::unix::fs::symlink("/dev/zero", &zero)?;
    for path in [&pipe, &zero] {
        let error = TrainedPolicy::load(path).expect_err("no regular file");
        assert!(format!("{error:?}").contains("regular file"), "{error:?}");
    }
    Ok(())
}

proptest! {
    /// A file that is cut off is refused, and one with a changed byte is refused or still a policy.
    #[test]
    fn a_cut_file_is_refused_and_a_changed_one_too_or_it_fits(
        cut in 0.0..1.0_f64,
        at in 0.0..1.0_f64,
        byte in any::<u8>(),
    ) {
        let bytes = policy().to_bytes().expect("it can be written");
        let len = (cut * bytes.len() as f64) as usize;
        prop_assert!(TrainedPolicy::from_bytes(&bytes[..len]).is_err());
        let mut changed = bytes.clone();
        changed[(at * bytes.len() as f64) as usize] = byte;
        if let Ok(policy) = TrainedPolicy::from_bytes(&changed) {
            prop_assert!(policy.check_lengths(10, 3, 4).is_ok());
        }
    }
}
