//! Runs that start from a policy.

use baselines::learn::{TrainError, TrainSettings, Trainer};
use baselines::{InputPart, TrainedPolicy};

use crate::runs::{Result, ddpg, make, ppo, sac, settings};

fn start(settings: TrainSettings, policy: &TrainedPolicy) -> Result<TrainedPolicy, TrainError> {
    let mut trainer = Trainer::new(make, settings, 1, 1)?;
    trainer.start_from(policy)?;
    Ok(trainer.policy("FetchReach-v4")?)
}

#[test]
fn a_run_starts_with_the_actor_and_the_normalizers_of_a_policy() -> Result {
    let [ddpg, sac, ppo] = [ddpg(), sac(), ppo()];
    for (taught, learns) in
        [(&ddpg, &ddpg), (&sac, &sac), (&ddpg, &sac), (&sac, &ppo), (&ppo, &ppo), (&ppo, &ddpg)]
    {
        let mut trainer = Trainer::new(make, settings(taught.clone()), 0, 1)?;
        while trainer.counters().updates == 0 {
            trainer.cycle()?;
        }
        let policy = trainer.policy("FetchReach-v4")?;
        let started = start(settings(learns.clone()), &policy)?;
        assert_eq!(started.layers(), policy.layers());
        let [own, theirs] = [started.header(), policy.header()];
        assert_eq!(own.observation_normalizer, theirs.observation_normalizer);
        assert_eq!(own.goal_normalizer, theirs.goal_normalizer);
        assert!(theirs.goal_normalizer.as_ref().is_some_and(|goal| goal.count() > 0));
        assert_eq!(own.steps, 0);
    }
    Ok(())
}

#[test]
fn a_policy_of_another_form_is_refused() -> Result {
    let policy = Trainer::new(make, settings(ddpg()), 0, 1)?.policy("FetchReach-v4")?;
    let refused = |change: &dyn Fn(&mut TrainSettings), policy: &TrainedPolicy, expected: &str| {
        let mut settings = settings(ddpg());
        change(&mut settings);
        let started = start(settings, policy).map(|policy| policy.header().clone());
        assert!(
            matches!(&started, Err(error) if error.to_string().contains(expected)),
            "{started:?}"
        );
    };
    let none = |_: &mut TrainSettings| ();
    refused(&|own| *own = TrainSettings::fast(fetch_env::Task::Reach), &policy, "[32, 32, 4]");
    refused(&|own| own.inputs.relative_goal = false, &policy, "[Observation, DesiredGoal]");
    refused(&|own| own.inputs.left_out = vec![1], &policy, "uses elements that the run leaves out");
    let mut header = policy.header().clone();
    header.goal_normalizer = None;
    refused(&none, &TrainedPolicy::new(header.clone(), policy.layers())?, "does not normalize all");
    header.inputs = vec![InputPart::DesiredGoal, InputPart::Observation];
    refused(&none, &TrainedPolicy::new(header, policy.layers())?, "[DesiredGoal, Observation]");
    refused(&none, &TrainedPolicy::shipped(fetch_env::Task::Push)?, "[25, 3, 4]");
    Ok(())
}
