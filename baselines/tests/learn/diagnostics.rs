//! The numbers in a row that show how a run goes.

use std::ops::ControlFlow;

use baselines::learn::{
    Algorithm, AlgorithmInit, CurveRow, Ddpg, DdpgSettings, Sac, SacSettings, TrainSettings,
    Trainer, Transitions,
};

use crate::runs::{Result, ddpg, make, sac, settings};

fn last_row(settings: TrainSettings) -> Result<CurveRow> {
    let mut trainer = Trainer::new(make, settings, 5, 1)?;
    trainer.run(600, None, |_, _| ControlFlow::Continue(()))?;
    Ok(trainer.rows().last().cloned().ok_or("no row")?)
}

#[test]
fn a_row_has_the_numbers_of_the_algorithm_and_of_the_buffer() -> Result {
    let of_buffer = ["buffer/distance", "buffer/relabeled_success", "buffer/success"];
    let of_ddpg = ["update/actor_gradient_norm", "update/critic_gradient_norm", "update/target"];
    let of_sac = [
        "update/actor_gradient_norm",
        "update/critic_1_gradient_norm",
        "update/critic_1_value",
        "update/critic_2_gradient_norm",
        "update/critic_2_value",
        "update/entropy",
        "update/target",
        "update/temperature",
    ];
    for (algorithm, own) in [(ddpg(), &of_ddpg[..]), (sac(), &of_sac)] {
        let row = last_row(settings(algorithm))?;
        let names: Vec<_> = row.diagnostics.keys().map(String::as_str).collect();
        assert_eq!(names, [&of_buffer, own].concat());
        // What a checkpoint keeps.
        let text = serde_json::to_string(&row)?;
        assert_eq!(serde_json::from_str::<CurveRow>(&text)?, row);
    }
    Ok(())
}

#[test]
fn hindsight_shows_in_the_rows_that_reach_their_goal() -> Result {
    let success = |assignments: &[&str]| -> Result<_> {
        let mut settings = settings(ddpg());
        settings.replay.keep_already_achieved = 1.0;
        for assignment in assignments {
            settings = settings.with(assignment)?;
        }
        let diagnostics = last_row(settings)?.diagnostics;
        Ok(diagnostics.get("buffer/relabeled_success").copied())
    };
    assert_eq!(success(&["future_k=0"])?, None);
    // The future goals of a transition are nearer than any of the buffer, and a stricter reward
    // counts fewer of them as reached.
    let [future, random] = [success(&[])?, success(&["goal_strategy=random"])?];
    assert!(future > random && random > Some(0.0), "{future:?}, {random:?}");
    let strict = success(&["distance_factor=4"])?;
    assert!(strict < future, "{strict:?}, {future:?}");
    Ok(())
}

#[test]
fn an_algorithm_reports_its_last_update() -> Result {
    let init = || AlgorithmInit {
        num_inputs: 1,
        num_actions: 1,
        reward_bounds: -1.0..=0.0,
        seed: 0,
        rank: 0,
    };
    // Nothing follows, so that the targets are the rewards.
    let batch = Transitions {
        len: 2,
        input: &[-1.0, 1.0],
        actor_input: &[-1.0, 1.0],
        action: &[0.4, 0.6],
        reward: &[-1.0, -0.5],
        discount: &[0.0; 2],
        next_input: &[0.0; 2],
        next_actor_input: &[0.0; 2],
        demonstrated: &[false; 2],
        ..Transitions::default()
    };
    let settings = SacSettings { hidden: vec![8], ..SacSettings::book() };
    let mut sac = Sac::new(settings, init())?;
    let losses = sac.update(batch, &mut |_| ());
    let of_sac = sac.diagnostics();
    let number =
        |name| of_sac.iter().find(|(own, _)| *own == name).map_or(f32::NAN, |found| found.1);
    assert_eq!(number("target"), -0.75);
    assert!((number("temperature") - 0.05).abs() < 1e-6);
    let values = 0.5 * number("critic_1_value") + 0.5 * number("critic_2_value");
    assert_eq!(values, losses.value);

    let settings = DdpgSettings { hidden: vec![8], ..DdpgSettings::default() };
    let mut ddpg = Ddpg::new(settings, init())?;
    // The gradients, and then the means.
    let mut norm = 0.0;
    ddpg.update(batch, &mut |numbers| {
        let gradients = &numbers[..numbers.len() - 4];
        norm = gradients.iter().map(|slope| slope * slope).sum::<f32>();
    });
    let [target, critic, actor] = ddpg.diagnostics()[..] else { panic!("other numbers") };
    assert_eq!(target, ("target", -0.75));
    let norms = critic.1 * critic.1 + actor.1 * actor.1;
    assert!(
        (norms - norm).abs() < 1e-4 * norm && critic.1 > 0.0 && actor.1 > 0.0,
        "{norms}, {norm}"
    );
    Ok(())
}
