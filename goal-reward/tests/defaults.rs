//! Default methods of the reward trait, and the properties of a batch.

use std::rc::Rc;

use goal_reward::{
    DistanceReward, GoalError, GoalPairs, GoalReward, GoalRole, check_goals, goal_distance,
};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

/// A task whose required methods and flags all depend on the order of its two goals.
struct Ahead;

impl GoalReward for Ahead {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        achieved_goal[0] - 2.0 * desired_goal[0]
    }
    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        achieved_goal[0] > desired_goal[0]
    }
    fn terminated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        achieved_goal[0] > desired_goal[0] + 1.0
    }
    fn truncated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        achieved_goal[0] < desired_goal[0]
    }
}

/// A task that defines only the required methods.
struct Endless;

impl GoalReward for Endless {
    fn reward(&self, _: &[f64], _: &[f64]) -> f64 {
        0.0
    }
    fn is_success(&self, _: &[f64], _: &[f64]) -> bool {
        true
    }
}

const ACHIEVED: [f64; 4] = [1.0, 3.0, 2.0, 5.0];
const DESIRED: [f64; 4] = [2.0, 2.0, 2.0, 2.0];

/// Checks all batched forms of [`Ahead`] against the values for [`ACHIEVED`] and [`DESIRED`].
fn check_ahead(reward: &dyn GoalReward) -> Result {
    let pairs = GoalPairs::new(&ACHIEVED, &DESIRED, 1)?;
    let mut rewards = [f64::NAN; 4];
    reward.reward_batch(pairs, &mut rewards)?;
    assert_eq!(rewards, [-3.0, -1.0, -2.0, 1.0]);
    rewards = [f64::NAN; 4];
    reward.try_reward_batch(pairs, &mut rewards)?;
    assert_eq!(rewards, [-3.0, -1.0, -2.0, 1.0]);
    let mut flags = [true; 4];
    reward.is_success_batch(pairs, &mut flags)?;
    assert_eq!(flags, [false, true, false, true]);
    reward.terminated_batch(pairs, &mut flags)?;
    assert_eq!(flags, [false, false, false, true]);
    reward.truncated_batch(pairs, &mut flags)?;
    assert_eq!(flags, [true, false, false, false]);
    assert_eq!(reward.try_reward(&[1.0], &[2.0]), Ok(-3.0));
    Ok(())
}

#[test]
fn batched_forms_call_the_single_ones_row_by_row() -> Result {
    check_ahead(&Ahead)?;
    check_ahead(&&Ahead)?;
    check_ahead(&Rc::new(Ahead))
}

#[test]
fn a_task_never_ends_unless_it_says_so() -> Result {
    let pairs = GoalPairs::new(&ACHIEVED, &DESIRED, 1)?;
    for reward in [&Endless as &dyn GoalReward, &&Endless, &DistanceReward::sparse()] {
        assert!(!reward.terminated(&[1.0], &[1.0]) && !reward.truncated(&[1.0], &[1.0]));
        let mut flags = [true; 4];
        reward.terminated_batch(pairs, &mut flags)?;
        assert_eq!(flags, [false; 4]);
        flags = [true; 4];
        reward.truncated_batch(pairs, &mut flags)?;
        assert_eq!(flags, [false; 4]);
    }
    Ok(())
}

#[test]
fn a_reward_is_unbounded_unless_it_says_so() {
    assert_eq!(Endless.bounds(), f64::NEG_INFINITY..=f64::INFINITY);
}

#[test]
fn a_batch_knows_its_size() -> Result {
    for (dim, len) in [(1, 6), (2, 3), (3, 2), (6, 1)] {
        let pairs = GoalPairs::new(&[1.0; 6], &[2.0; 6], dim)?;
        assert_eq!((pairs.dim(), pairs.len(), pairs.is_empty()), (dim, len, false));
        assert_eq!((pairs.achieved(), pairs.desired()), (&[1.0; 6][..], &[2.0; 6][..]));
        assert_eq!(pairs.iter().len(), len);
        assert!(pairs.iter().all(|pair| pair == (&[1.0; 6][..dim], &[2.0; 6][..dim])));
    }
    let empty = GoalPairs::new(&[], &[], 3)?;
    assert_eq!((empty.dim(), empty.len(), empty.is_empty()), (3, 0, true));
    Ok(())
}

/// The batched success of goals of `dim` elements at `distance`.
fn is_success(dim: usize, distance: f64) -> Result<bool> {
    let (mut achieved, desired) = (vec![0.0; 5 * dim], vec![0.0; 5 * dim]);
    achieved.iter_mut().step_by(dim).for_each(|element| *element = distance);
    let mut flags = [false; 5];
    DistanceReward::sparse()
        .is_success_batch(GoalPairs::new(&achieved, &desired, dim)?, &mut flags)?;
    assert!(flags == [true; 5] || flags == [false; 5]);
    Ok(flags[0])
}

#[test]
fn a_batch_compares_the_threshold_as_one_pair_does() -> Result {
    for dim in [1, 2, 3, 4, 9] {
        assert!(is_success(dim, 0.05_f64.next_down())?);
        assert!(!is_success(dim, 0.05)?, "at the threshold itself");
        assert!(!is_success(dim, 0.05_f64.next_up())?);
    }
    Ok(())
}

/// Checks every position of an element, in batches of any number of goals.
#[test]
fn the_first_element_that_is_not_finite_is_named_wherever_it_is() -> Result {
    const LEN: usize = 200;
    // Every place would take Miri minutes.
    let step = if cfg!(miri) { 37 } else { 1 };
    for (role, dim) in [(GoalRole::Achieved, 1), (GoalRole::Desired, 2), (GoalRole::Desired, 200)] {
        for at in (0..LEN).step_by(step) {
            let mut goals = [0.5; LEN];
            goals[at..].fill(f64::INFINITY);
            let finite = [0.5; LEN];
            let sides = match role {
                GoalRole::Achieved => (&goals, &finite),
                GoalRole::Desired => (&finite, &goals),
            };
            let error = GoalPairs::new(sides.0, sides.1, dim)?.check_finite();
            let (row, index, value) = (at / dim, at % dim, f64::INFINITY);
            assert_eq!(error, Err(GoalError::NotFinite { role, row, index, value }));
            let error = check_goals(sides.0, sides.1);
            let (row, index) = (0, at);
            assert_eq!(error, Err(GoalError::NotFinite { role, row, index, value }));
        }
    }
    Ok(())
}

/// As in numpy, 128 squares are added in one block. Two blocks of 64 would often give other bits.
#[test]
fn the_longest_block_is_not_split() {
    let step_of_seeds = if cfg!(miri) { 20 } else { 1 };
    for seed in (1..50_u64).step_by(step_of_seeds) {
        let goal = |factor: u64| -> Vec<f64> {
            (seed..seed + 128).map(|i| (i * factor % 1009) as f64 / 97.0).collect()
        };
        let (a, b) = (goal(370), goal(531));
        let mut lanes = [0.0; 8];
        for (i, (a, b)) in a.iter().zip(&b).enumerate() {
            lanes[i % 8] += (a - b) * (a - b);
        }
        let [s0, s1, s2, s3, s4, s5, s6, s7] = lanes;
        let sum: f64 = ((s0 + s1) + (s2 + s3)) + ((s4 + s5) + (s6 + s7));
        assert_eq!(goal_distance(&a, &b).to_bits(), sum.sqrt().to_bits(), "seed {seed}");
    }
}
