//! Policies in environments that they do not fit are refused before the first step.

use baselines::{
    CollectError, Collector, CollectorError, EvaluationError, Policy, PolicyError, RandomPolicy,
    ScriptedPolicy, TrainedPolicy, buffer_config, collect, evaluate, evaluate_across_workers,
    evaluate_vec, workers::OneProcess,
};
use fetch_env::wrappers::TimeAwareObservation;
use fetch_env::{BoxSpace, EnvExt, Space, Task, VecEnv, make_kinematic, vec_env::VecConfig};
use her_relabel::HerBuffer;

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

/// Reach rejects Push's policy everywhere a policy is passed.
#[test]
fn a_trained_policy_of_other_lengths_is_refused() -> Result {
    let is_refusal = |error: &PolicyError| {
        let PolicyError::Trained { expected, actual, .. } = error else {
            return false;
        };
        (*expected, *actual) == ([25, 3, 4], [10, 3, 4])
    };
    let mut policy = TrainedPolicy::shipped(Task::Push)?;
    let mut env = make_kinematic("FetchReach-v4")?;
    let error = evaluate(&mut env, &mut policy, 0, 0, |_| ()).expect_err("it does not fit");
    assert!(matches!(&error, EvaluationError::Policy(error) if is_refusal(error)), "{error}");
    assert!(error.to_string().contains("FetchPush-v4"), "{error}");

    let config = buffer_config(100, &env)?;
    let mut buffer = HerBuffer::<f32>::new(config)?;
    let error = collect(&mut env, &mut policy, 1, 0, &mut buffer, 0, |_| ()).err();
    assert!(matches!(&error, Some(CollectError::Policy(error)) if is_refusal(error)), "{error:?}");

    let mut envs = VecEnv::new([env], VecConfig::default())?;
    let error = evaluate_vec(&mut envs, &mut policy, 1, 0, |_| ()).err();
    assert!(matches!(&error, Some(EvaluationError::Policy(e)) if is_refusal(e)), "{error:?}");
    let error =
        evaluate_across_workers(&mut OneProcess, &mut envs, &mut policy, 1, 0, |_| ()).err();
    assert!(matches!(&error, Some(EvaluationError::Policy(e)) if is_refusal(e)), "{error:?}");
    let error = Collector::new(envs).collect(1, &mut policy, &mut buffer, |_, _| ()).err();
    assert!(matches!(&error, Some(CollectorError::Policy(e)) if is_refusal(e)), "{error:?}");
    assert!(buffer.is_empty());
    Ok(())
}

#[test]
fn a_scripted_policy_takes_what_begins_with_its_columns() -> Result {
    let mut reach = make_kinematic("FetchReach-v4")?;
    let error = evaluate(&mut reach, &mut ScriptedPolicy::new(Task::Push), 1, 0, |_| ()).err();
    let Some(EvaluationError::Policy(PolicyError::Scripted { task, expected, actual })) = error
    else {
        return Err(format!("{error:?}").into());
    };
    assert_eq!((task, expected, actual), (Task::Push, [25, 3, 4], [10, 3, 4]));

    // The script of Reach reads the columns that all tasks begin with.
    let mut push = make_kinematic("FetchPush-v4")?;
    evaluate(&mut push, &mut ScriptedPolicy::new(Task::Reach), 1, 0, |_| ())?;

    // Another column after those of the task changes no action.
    for (id, task) in [("FetchReach-v4", Task::Reach), ("FetchPush-v4", Task::Push)] {
        let mut plain = make_kinematic(id)?;
        let timed = TimeAwareObservation::new(plain.max_episode_steps());
        let mut timed = make_kinematic(id)?.wrap(timed)?;
        let mut expected = evaluate(&mut plain, &mut ScriptedPolicy::new(task), 3, 7, |_| ())?;
        // Its vector does not say where the gripper is.
        let controls = expected.episodes.iter_mut().filter_map(|e| e.controls.as_mut());
        controls.for_each(|controls| controls.path = None);
        let episodes = evaluate(&mut timed, &mut ScriptedPolicy::new(task), 3, 7, |_| ())?;
        assert_eq!(episodes, expected, "{id}");
    }
    Ok(())
}

#[test]
fn a_random_policy_of_another_space_is_refused() -> Result {
    let mut env = make_kinematic("FetchReach-v4")?;
    let mut policy = RandomPolicy::new(&BoxSpace::uniform(vec![4], -1.0, 0.5)?, 0);
    let error = evaluate(&mut env, &mut policy, 1, 0, |_| ()).err();
    assert!(
        matches!(error, Some(EvaluationError::Policy(PolicyError::ActionSpace { .. }))),
        "{error:?}"
    );
    Ok(())
}

/// Fits no environment.
struct Picky;

impl<O> Policy<O> for Picky {
    fn check_spaces(&self, _: &Space, _: &Space) -> Result<(), PolicyError> {
        Err(PolicyError::Other("it is never content".into()))
    }

    fn act(&mut self, _: &O, _: &mut [f32]) {
        unreachable!("the check comes first");
    }
}

#[test]
fn a_policy_of_ones_own_says_what_is_wrong() -> Result {
    let error = evaluate(&mut make_kinematic("FetchReach-v4")?, &mut Picky, 1, 0, |_| ()).err();
    assert_eq!(error.ok_or("it was taken")?.to_string(), "it is never content");
    Ok(())
}
