use super::{
    report::{Outcome, ensure},
    subject::{Subject, ensure_same_reset, ensure_same_steps, random_steps},
};
use crate::{EnvError, GoalEnv, SnapshotEnv};

/// How far into an episode snapshots are taken.
const DEPTHS: [u32; 4] = [0, 1, 7, 30];

/// From a snapshot on, the same actions give the same results, resets without a seed included.
pub(super) fn replay<E: GoalEnv + SnapshotEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let steps = subject.options.steps;
    for depth in DEPTHS {
        let (mut env, _) = subject.started()?;
        let mut rng = subject.rng();
        random_steps(&mut env, &mut rng, depth)?;
        let snapshot = env.snapshot();
        let first = random_steps(&mut env, &mut rng.clone(), steps)?;
        env.restore(&snapshot)?;
        ensure(env.snapshot() == snapshot, || "a snapshot is not what was restored".into())?;
        ensure_same_steps(&first, &random_steps(&mut env, &mut rng, steps)?)?;
    }
    Ok(format!("{steps} steps, from {} places", DEPTHS.len()))
}

/// A snapshot goes on in another environment as in its own.
pub(super) fn other_environment<E: GoalEnv + SnapshotEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let steps = subject.options.steps;
    for depth in DEPTHS {
        let (mut env, _) = subject.started()?;
        let mut rng = subject.rng();
        random_steps(&mut env, &mut rng, depth)?;
        let mut other = subject.env()?;
        other.restore(&env.snapshot())?;
        ensure_same_steps(
            &random_steps(&mut env, &mut rng.clone(), steps)?,
            &random_steps(&mut other, &mut rng, steps)?,
        )?;
    }
    Ok(format!("{steps} steps, from {} places", DEPTHS.len()))
}

/// A snapshot from before the first reset brings that state back.
pub(super) fn before_reset<E: GoalEnv + SnapshotEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let mut env = subject.env()?;
    let snapshot = env.snapshot();
    let first = env.reset(Some(subject.options.seed))?;
    env.restore(&snapshot)?;
    let refusal = env.step(&env.action_space().sample(&mut subject.rng()));
    ensure(refusal == Err(EnvError::ResetNeeded), || format!("a step then gave {refusal:?}"))?;
    let again = env.reset(Some(subject.options.seed))?;
    ensure_same_reset("the resets before and after", &first, &again)?;
    Ok("a reset is needed again".into())
}
