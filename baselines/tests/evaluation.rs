//! The figures of an evaluation.

use baselines::{
    Episode, Estimate, Evaluation, EvaluationError, Summary, ZeroPolicy, evaluate, evaluate_vec,
    strata_of, stratum,
};
use fetch_env::vec_env::{VecConfig, VecStep};
use fetch_env::{FetchObservation, GoalObservation, Task, VecEnv, make_kinematic};

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
        controls: None,
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
        let episode = evaluate(&mut env, &mut policy, 1, 3, |_| ())?.episodes.remove(0);
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

/// Three actions that move the gripper, and then none.
const ACTIONS: [[f32; 4]; 3] = [[0.5, 0.0, 0.0, 0.0], [0.5, -1.0, 0.0, 0.0], [0.0, 0.0, 2.0, 0.0]];

#[test]
fn a_controller_is_measured_by_its_actions_and_the_path_of_the_gripper() -> Result {
    let mut env = make_kinematic("FetchReach-v4")?;
    let (mut positions, mut step) = (Vec::new(), 0);
    let mut policy = |observation: &FetchObservation, action: &mut [f32]| {
        positions.push(observation.grip_position());
        action.copy_from_slice(ACTIONS.get(step).unwrap_or(&[0.0; 4]));
        step += 1;
    };
    let evaluation = evaluate(&mut env, &mut policy, 1, 0, |_| ())?;
    let controls = evaluation.episodes[0].controls.as_ref().ok_or("it is measured")?;
    assert_eq!(controls.largest_action, 2.0);
    assert_eq!(controls.energy, 0.25 + (0.25 + 1.0) + 4.0);
    // Between 50 actions there are 49 changes.
    assert_eq!(controls.action_change, (1.0 + (0.25 + 1.0 + 4.0) + 4.0) / 49.0);
    let ways = positions.windows(2).map(|pair| {
        let square: f64 = pair[0].iter().zip(pair[1]).map(|(a, b)| (b - a).powi(2)).sum();
        square.sqrt()
    });
    let (path, length) = (controls.path.ok_or("observed")?, ways.sum::<f64>());
    // The last step, which the policy does not see, moves nothing.
    assert!(length > 0.05 && (path - length).abs() < 1e-12, "{path}, not {length}");
    assert_eq!(controls.steps_to_success, None);

    // Two environments at a time measure the same.
    let mut step = 0;
    let mut policy = |batch: &VecStep<FetchObservation>, actions: &mut [f32]| {
        step = if batch.started()[0] { 0 } else { step + 1 };
        let action = ACTIONS.get(step).unwrap_or(&[0.0; 4]);
        actions.chunks_exact_mut(4).for_each(|row| row.copy_from_slice(action));
    };
    let envs = [make_kinematic("FetchReach-v4")?, make_kinematic("FetchReach-v4")?];
    let mut envs = VecEnv::new(envs, VecConfig::default())?;
    let many = evaluate_vec(&mut envs, &mut policy, 3, 0, |_| ())?;
    assert_eq!(many.episodes[0], evaluation.episodes[0]);
    Ok(())
}

#[test]
fn actions_too_large_to_square_leave_the_other_figures() -> Result {
    let mut evaluation =
        evaluate(&mut make_kinematic("FetchReach-v4")?, &mut ZeroPolicy, 2, 0, |_| ())?;
    let measured = evaluation.summary()?;
    evaluation.episodes[0].controls.as_mut().ok_or("it is measured")?.energy = f64::INFINITY;
    assert!(measured.controls.is_some());
    assert_eq!(evaluation.summary()?, Summary { controls: None, ..measured });
    Ok(())
}

#[test]
fn files_without_controls_are_read() -> Result {
    let old = serde_json::json!({
        "seed": 1, "episode_return": -3.0, "episode_length": 3, "final_distance": 0.25,
        "success": false, "success_any": true,
    });
    let episode = Episode { seed: Some(1), ..episode(3, 0.25, false, true) };
    assert_eq!(serde_json::from_value::<Episode>(old)?, episode);
    let mut env = make_kinematic("FetchReach-v4")?;
    let measured = evaluate(&mut env, &mut ZeroPolicy, 2, 0, |_| ())?.summary()?;
    for summary in [measured, Evaluation { episodes: vec![episode.clone(), episode] }.summary()?] {
        let json = serde_json::to_value(summary)?;
        assert_eq!(json.get("energy_mean").is_some(), summary.controls.is_some());
        assert_eq!(serde_json::from_value::<Summary>(json)?, summary);
    }
    Ok(())
}

#[test]
fn strata_are_parts_of_the_episodes_by_their_goals() -> Result {
    for task in Task::ALL {
        let mut env = make_kinematic(&format!("Fetch{task}-v4"))?;
        let evaluation = evaluate(&mut env, &mut ZeroPolicy, 60, 0, |_| ())?;
        let strata = evaluation.strata(|episode| stratum(task, episode));
        let mut episodes: Vec<_> = strata.values().flat_map(|part| &part.episodes).collect();
        episodes.sort_by_key(|episode| episode.seed);
        assert!(episodes.into_iter().eq(&evaluation.episodes), "{task}");
        for (name, part) in &strata {
            assert!(name.is_none_or(|name| strata_of(task).contains(&name)), "{task}: {name:?}");
            for controls in part.episodes.iter().filter_map(|episode| episode.controls.as_ref()) {
                let way = controls.desired_goal.iter().zip(&controls.start_goal);
                let [x, y, z] = way.map(|(to, from)| to - from).collect::<Vec<_>>()[..] else {
                    return Err("a goal is a position".into());
                };
                let distance = (x * x + y * y + z * z).sqrt();
                match *name {
                    None => assert!(strata_of(task).is_empty()),
                    Some("table") => assert!(z.abs() < 0.01),
                    Some("air") => assert!(z > 0.01),
                    Some("0 to 0.3 m") => assert!(distance < 0.3),
                    Some("0.5 to 0.6 m") => assert!((0.5..0.6).contains(&distance)),
                    Some("from 0.7 m") => assert!(distance >= 0.7),
                    Some(_) => assert!((0.3..0.7).contains(&distance)),
                }
            }
        }
        assert!(task != Task::PickAndPlace || strata.len() == 2, "both in 60 episodes");
    }
    Ok(())
}
