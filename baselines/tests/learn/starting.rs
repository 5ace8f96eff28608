//! Runs that start from a policy.

use baselines::learn::{TrainError, TrainSettings, Trainer};
use baselines::{InputPart, PolicyHeader, TrainedPolicy};

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

/// Statistics of other states would change what the actor does in all of them.
#[test]
fn the_normalizers_of_a_policy_stay_as_they_are() -> Result {
    for (taught, learns) in [(sac(), ddpg()), (ddpg(), ppo())] {
        let mut teacher = Trainer::new(make, settings(taught), 0, 1)?;
        while teacher.counters().updates == 0 {
            teacher.cycle()?;
        }
        let policy = teacher.policy("FetchReach-v4")?;
        let settings = settings(learns).with("min_std=0.02")?.with("clip=4")?;
        let mut trainer = Trainer::new(make, settings, 1, 1)?;
        trainer.start_from(&policy)?;
        let header_after_cycles = |trainer: &mut Trainer<_>| -> Result<PolicyHeader> {
            let updates = trainer.counters().updates;
            while trainer.counters().updates == updates {
                trainer.cycle()?;
            }
            Ok(trainer.policy("FetchReach-v4")?.header().clone())
        };
        let own = header_after_cycles(&mut trainer)?;
        let folder = tempfile::tempdir()?;
        trainer.save(folder.path())?;
        let mut resumed = Trainer::resume(make, folder.path(), 1)?;
        for own in [own, header_after_cycles(&mut resumed)?] {
            assert_eq!(own.observation_normalizer, policy.header().observation_normalizer);
            assert_eq!(own.goal_normalizer, policy.header().goal_normalizer);
        }
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
