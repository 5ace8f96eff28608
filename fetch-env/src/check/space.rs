use super::{
    report::{Failure, Outcome, ensure},
    subject::Subject,
};
use crate::{BoxSpace, EnvError, GoalEnv, Space};

/// As Gymnasium and Stable-Baselines3 recommend: bounded, symmetric, not beyond ±1.
pub(super) fn action_space<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let env = subject.env()?;
    let space = env.action_space();
    ensure(!space.is_empty(), || "it has no element".into())?;
    for (index, (&low, &high)) in space.low().iter().zip(space.high()).enumerate() {
        ensure(-high == low && 0.0 < high && high <= 1.0, || {
            format!("element {index} is between {low} and {high}, not symmetric within [-1, 1]")
        })?;
    }
    ensure_samples(space, subject)?;
    Ok(format!("{:?} numbers within [-1, 1]", space.shape()))
}

fn ensure_samples<E: GoalEnv>(
    space: &BoxSpace<f32>,
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Result<(), Failure> {
    let mut rng = subject.rng();
    for _ in 0..100 {
        let sample = space.sample(&mut rng);
        ensure(space.contains(&sample), || format!("its sample {sample:?} lies outside"))?;
    }
    Ok(())
}

/// A dictionary of `observation`, `achieved_goal` and `desired_goal`, and whatever else; the goals
/// are of one shape.
pub(super) fn observation_space<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    const KEYS: [&str; 3] = ["achieved_goal", "desired_goal", "observation"];
    let env = subject.env()?;
    let dict =
        env.observation_space().as_dict().ok_or_else(|| Failure::new("it is no dictionary"))?;
    let keys: Vec<_> = dict.iter().map(|(key, _)| key).collect();
    let all = KEYS.iter().all(|key| keys.contains(key));
    ensure(all, || format!("its keys are {keys:?}, {KEYS:?} should be among them"))?;
    let mut shapes = Vec::new();
    for key in KEYS {
        let Some(Space::BoxF64(space)) = dict.get(key) else {
            return Err(Failure::new(format!("{key} is not a box of double precision")));
        };
        ensure(!space.is_empty(), || format!("{key} has no element"))?;
        let open = space.low().iter().zip(space.high()).all(|(low, high)| low < high);
        ensure(open, || format!("an element of {key} can have one value only"))?;
        shapes.push(space.shape());
    }
    ensure(shapes[0] == shapes[1], || format!("the goals' shapes differ: {shapes:?}"))?;
    Ok(format!("{:?} numbers, goals of {:?}", shapes[2], shapes[0]))
}
