//! The figures of an evaluation.

use baselines::{Episode, Estimate, Evaluation, EvaluationError, evaluate};
use fetch_env::{FetchObservation, GoalObservation, make_kinematic};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

/// An episode of `length` steps that ends at a distance.
const fn episode(length: usize, final_distance: f64, success: bool, success_any: bool) -> Episode {
    let episode_return = -(length as f64);
    Episode {
        seed: None,
        episode_return,
        episode_length: length,
        final_distance,
        success,
        success_any,
    }
}

fn evaluation() -> Evaluation {
    Evaluation {
        episodes: vec![
            episode(10, 0.01, true, true),
            episode(20, 0.25, false, true),
            episode(30, 0.5, false, true),
            episode(60, 1.0, false, false),
        ],
    }
}

#[test]
fn a_summary_has_the_means_of_the_episodes() -> Result {
    let summary = evaluation().summary()?;
    assert_eq!(summary.success_rate, Estimate::share(1, 4)?);
    assert_eq!(summary.success_any_rate, Estimate::share(3, 4)?);
    assert_eq!(summary.episode_return_mean, Estimate::mean(&[-10.0, -20.0, -30.0, -60.0])?);
    assert_eq!(summary.episode_length_mean, Estimate::mean(&[10.0, 20.0, 30.0, 60.0])?);
    assert_eq!(summary.final_distance_mean, Estimate::mean(&[0.01, 0.25, 0.5, 1.0])?);
    Ok(())
}

#[test]
fn success_is_a_distance_strictly_below_the_threshold() -> Result {
    let rates = evaluation().success_at(&[0.005, 0.25, 0.26, 1.0, f64::INFINITY])?;
    let expected = [0, 1, 2, 3, 4].map(|successes| Estimate::share(successes, 4));
    assert_eq!(rates, expected.into_iter().collect::<Result<Vec<_>, _>>()?);
    Ok(())
}

#[test]
fn without_episodes_there_are_no_figures() {
    let nothing = Evaluation { episodes: Vec::new() };
    assert!(matches!(nothing.summary(), Err(EvaluationError::NoEpisodes)));
    assert!(matches!(nothing.success_at(&[0.05]), Err(EvaluationError::NoEpisodes)));
}

/// The last step decides `success`, and all steps decide `success_any`.
#[test]
fn an_episode_adds_up_its_steps() -> Result {
    let mut env = make_kinematic("FetchReach-v4")?;
    for leaves in [false, true] {
        let (mut steps, mut reached) = (0, 0);
        let mut policy = |observation: &FetchObservation, action: &mut [f32]| {
            let goals = observation.desired_goal().iter().zip(observation.achieved_goal());
            let way: Vec<_> = goals.map(|(desired, achieved)| desired - achieved).collect();
            // The observation before a step is the one after the previous step.
            let is_reached = way.iter().map(|axis| axis * axis).sum::<f64>().sqrt() < 0.05;
            reached += usize::from(steps > 0 && is_reached);
            steps += 1;
            for (action, axis) in action.iter_mut().zip(&way) {
                *action = if leaves && steps > 25 { -1.0 } else { (10.0 * axis) as f32 };
            }
        };
        let episode = evaluate(&mut env, &mut policy, 1, 3, |_| ())?.episodes[0];
        assert_eq!((episode.seed, episode.episode_length, steps), (Some(3), 50, 50));
        assert_eq!((episode.success, episode.success_any), (!leaves, true));
        // A reward of -1 for all steps except those that end at the goal; the last one is not
        // observed.
        let at_goal = reached + usize::from(episode.success);
        assert_eq!(episode.episode_return, at_goal as f64 - 50.0);
        assert_eq!(episode.final_distance < 0.05, episode.success);
    }
    Ok(())
}
