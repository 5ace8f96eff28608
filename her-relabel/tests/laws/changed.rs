//! Mirrored rows and moved goals: what they change, and that everything else keeps its bits.

use goal_reward::{
    DistanceReward, GoalReward, Mirror, Mirrored, Symmetry, SymmetryError, goal_distance,
};
use her_relabel::{
    Batch, ColumnsMut, GoalNoise, GoalStrategy, JoinedGoal, Normalizers, SampleError, Sampler,
    Scalar, Transforms, UnitInterval,
};

use crate::common::{Result, assert_distribution, assert_uniform};
use crate::forms::{DIMS, ROWS, assert_formed, buffer, normalizers, reward, samplers};

const RADIUS: f64 = 0.04;

/// Elements that change places, that stay, that are negated, and that lie across a plane.
fn symmetry() -> Result<Symmetry, SymmetryError> {
    let observation = [
        Mirrored::same(1),
        Mirrored::same(0),
        Mirrored::across(2, 0.7),
        Mirrored::negated(3),
        Mirrored::same(4),
    ];
    Ok(Symmetry {
        observation: Mirror::new(observation)?,
        goal: Mirror::new([Mirrored::same(0), Mirrored::across(1, 0.03), Mirrored::negated(2)])?,
        action: Mirror::new([Mirrored::same(0), Mirrored::negated(1)])?,
    })
}

fn half() -> UnitInterval {
    UnitInterval::from_k(1)
}

fn noise(share: UnitInterval) -> GoalNoise {
    GoalNoise::new(RADIUS, share)
}

fn draw<T: Scalar>(sampler: &Sampler, seed: u64, normalizers: Normalizers<'_>) -> Result<Batch<T>> {
    let (buffer, symmetry, mut batch) = (buffer()?, symmetry()?, Batch::new());
    let transforms = Transforms { normalizers, symmetry: Some(&symmetry) };
    let columns = ColumnsMut::default();
    sampler.sample_into(&buffer, &reward(), seed, &mut batch, transforms, columns)?;
    Ok(batch)
}

fn plain(sampler: &Sampler, seed: u64) -> Result<Batch<f64>> {
    draw(sampler, seed, Normalizers::default())
}

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|number| number.to_bits()).collect()
}

/// Asserts that everything that follows from transitions, goals and rewards has the same bits.
fn assert_same_outcomes(one: &Batch<f64>, other: &Batch<f64>) -> Result {
    assert_eq!(bits(one.reward()), bits(other.reward()));
    assert_eq!(bits(one.discount()), bits(other.discount()));
    assert_eq!(bits(one.importance_weight()), bits(other.importance_weight()));
    assert_eq!(one.success(), other.success());
    assert_eq!(one.terminated(), other.terminated());
    assert_eq!(one.truncated(), other.truncated());
    assert_eq!(one.transition(), other.transition());
    assert_eq!(one.goal_source(), other.goal_source());
    for field in ["value", "latent"] {
        assert_eq!(bits(one.field(field)?), bits(other.field(field)?));
    }
    Ok(())
}

/// Returns the rows of a column, mirrored where `is_mirrored` says so.
fn mirrored(column: &[f64], mirror: &Mirror, is_mirrored: &[bool]) -> Result<Vec<f64>> {
    let mut expected = column.to_vec();
    let rows = expected.chunks_exact_mut(mirror.len()).zip(column.chunks_exact(mirror.len()));
    for ((to, from), is_mirrored) in rows.zip(is_mirrored) {
        if *is_mirrored {
            mirror.write(from, to)?;
        }
    }
    Ok(expected)
}

#[test]
fn a_mirrored_row_is_the_whole_row_in_the_mirror_with_the_same_reward() -> Result {
    let Symmetry { observation, goal, action } = &symmetry()?;
    for sampler in samplers()? {
        for noise in [None, Some(noise(half()))] {
            let sampler = sampler.with_goal_noise(noise);
            let straight = plain(&sampler, 3)?;
            let changed = plain(&sampler.with_mirrored(half()), 3)?;
            let pairs = straight.action().chunks_exact(2).zip(changed.action().chunks_exact(2));
            let is_mirrored: Vec<bool> = pairs.map(|(one, other)| one != other).collect();
            for (found, stored, mirror) in [
                (changed.observation(), straight.observation(), observation),
                (changed.next_observation(), straight.next_observation(), observation),
                (changed.achieved_goal(), straight.achieved_goal(), goal),
                (changed.next_achieved_goal(), straight.next_achieved_goal(), goal),
                (changed.desired_goal(), straight.desired_goal(), goal),
                (changed.action(), straight.action(), action),
            ] {
                assert_eq!(bits(found), bits(&mirrored(stored, mirror, &is_mirrored)?));
            }
            assert_same_outcomes(&straight, &changed)?;
            let count = is_mirrored.iter().filter(|is_mirrored| **is_mirrored).count();
            assert!((ROWS * 2 / 5..ROWS * 3 / 5).contains(&count), "{count}");
        }
    }
    Ok(())
}

fn check_forms<T: Scalar>() -> Result {
    let [observation, goal] = &normalizers()?;
    for sampler in samplers()? {
        let sampler = sampler.with_mirrored(half()).with_goal_noise(noise(half()));
        for changed in [sampler, sampler.with_mirrored(UnitInterval::ZERO)] {
            let stored = plain(&changed, 3)?;
            for joined_goal in [None, Some(JoinedGoal::Desired), Some(JoinedGoal::Relative)] {
                for (observation, goal) in
                    [(None, None), (Some(observation), None), (Some(observation), Some(goal))]
                {
                    let normalizers = Normalizers { observation, goal };
                    let sampler = changed.with_joined_goal(joined_goal);
                    let batch = draw::<T>(&sampler, 3, normalizers)?;
                    assert_formed(&batch, &stored, normalizers, joined_goal)?;
                }
            }
        }
    }
    Ok(())
}

#[test]
fn changed_rows_are_normalized_and_joined_as_others() -> Result {
    check_forms::<f32>()?;
    check_forms::<f64>()
}

#[test]
fn a_moved_goal_is_near_its_source_and_decides_the_outcome() -> Result {
    let relabel_all = Sampler::new(ROWS, GoalStrategy::Future, UnitInterval::ONE);
    for sampler in samplers()?.into_iter().chain([relabel_all.with_success(true)]) {
        // Drawing again depends on moved goals.
        let sampler = sampler.with_keep_already_achieved(UnitInterval::ONE);
        let (straight, changed) =
            (plain(&sampler, 3)?, plain(&sampler.with_goal_noise(noise(half())), 3)?);
        assert_eq!(straight.transition(), changed.transition());
        assert_eq!(straight.goal_source(), changed.goal_source());
        assert_eq!(bits(straight.achieved_goal()), bits(changed.achieved_goal()));
        assert_eq!(bits(straight.action()), bits(changed.action()));
        let mut moved = 0;
        for (row, is_relabeled) in changed.relabeled().enumerate() {
            let goal = |column: &[f64]| column[row * 3..][..3].to_vec();
            let (from, to) = (goal(straight.desired_goal()), goal(changed.desired_goal()));
            let distance = goal_distance(&from, &to);
            assert!(distance <= RADIUS * (1.0 + 1e-12), "{distance}");
            if from == to {
                assert_eq!(straight.reward()[row].to_bits(), changed.reward()[row].to_bits());
                continue;
            }
            assert!(is_relabeled);
            moved += 1;
            let next = goal(changed.next_achieved_goal());
            if sampler.n_step().is_none() {
                assert_eq!(changed.reward()[row], reward().reward(&next, &to));
            }
            if sampler.success() {
                assert_eq!(changed.success()[row], reward().is_success(&next, &to));
            }
        }
        let relabeled = changed.relabeled().filter(|is_relabeled| *is_relabeled).count();
        assert!((relabeled * 2 / 5..relabeled * 3 / 5).contains(&moved), "{moved} of {relabeled}");
    }
    Ok(())
}

#[test]
fn goals_are_moved_uniformly_in_a_ball() -> Result {
    const SHELLS: usize = 20;
    let sampler = Sampler::new(50_000, GoalStrategy::Future, UnitInterval::ONE);
    let (straight, changed) =
        (plain(&sampler, 9)?, plain(&sampler.with_goal_noise(noise(UnitInterval::ONE)), 9)?);
    let (mut shells, mut octants, mut slices) = ([0; SHELLS], [0; 8], [0; 12]);
    for (from, to) in
        straight.desired_goal().chunks_exact(3).zip(changed.desired_goal().chunks_exact(3))
    {
        let offset: Vec<f64> = from.iter().zip(to).map(|(from, to)| (to - from) / RADIUS).collect();
        let squares: f64 = offset.iter().map(|offset| offset * offset).sum();
        shells[((squares.powf(1.5) * SHELLS as f64) as usize).min(SHELLS - 1)] += 1;
        let sides = offset.iter().enumerate();
        octants[sides.map(|(axis, offset)| usize::from(*offset > 0.0) << axis).sum::<usize>()] += 1;
        // A sphere's area is the same between planes at equal distances.
        let height = offset[1] / squares.sqrt();
        slices[(((height + 1.0) * 6.0) as usize).min(11)] += 1;
    }
    assert_uniform(&shells, "shells of equal volume");
    assert_uniform(&octants, "octants");
    assert_uniform(&slices, "directions");
    // In other dimensions, too.
    for len in [1, 2, 6] {
        check_ball(len)?;
    }
    Ok(())
}

/// Counts the distances of moved goals of `len` elements.
fn check_ball(len: usize) -> Result {
    use her_relabel::{BufferConfig, Dims, EpisodeData, HerBuffer};
    let dims = Dims { observation: 1, goal: len, action: 1 };
    let mut buffer = HerBuffer::<f64>::new(BufferConfig::new(9, dims))?;
    buffer.add_episode(&EpisodeData {
        observation: &[0.0; 2],
        achieved_goal: &vec![0.0; 2 * len],
        desired_goal: &vec![1.0; len],
        action: &[0.0],
        reward: &[0.0],
        terminated: false,
        truncated: true,
        fields: &[],
    })?;
    let noise = GoalNoise::new(2.0, UnitInterval::ONE);
    let sampler =
        Sampler::new(20_000, GoalStrategy::Final, UnitInterval::ONE).with_goal_noise(noise);
    let mut batch = Batch::<f64>::new();
    sampler.sample(&buffer, &DistanceReward::sparse(), 1, &mut batch)?;
    let mut shells = [0; 10];
    for goal in batch.desired_goal().chunks_exact(len) {
        let squares: f64 = goal.iter().map(|element| element * element / 4.0).sum();
        shells[((squares.powf(len as f64 / 2.0) * 10.0) as usize).min(9)] += 1;
    }
    assert_uniform(&shells, &format!("{len} dimensions"));
    Ok(())
}

/// Counts rows by whether they are relabeled, moved and mirrored, each of which is drawn
/// independently.
#[test]
fn mirroring_moving_and_relabeling_are_independent() -> Result {
    let quarter = UnitInterval::new(0.25)?;
    let sampler = Sampler::new(50_000, GoalStrategy::Future, UnitInterval::from_k(4));
    let straight = plain(&sampler, 9)?;
    let moved = plain(&sampler.with_goal_noise(noise(quarter)), 9)?;
    let mirrored = plain(&sampler.with_mirrored(half()), 9)?;
    let mut counts = [0; 6];
    for (row, is_relabeled) in straight.relabeled().enumerate() {
        let differ = |one: &[f64], other: &[f64], len: usize| {
            one[row * len..][..len] != other[row * len..][..len]
        };
        let is_moved = differ(straight.desired_goal(), moved.desired_goal(), 3);
        let is_mirrored = differ(straight.action(), mirrored.action(), 2);
        assert!(is_relabeled || !is_moved);
        let kind = usize::from(is_relabeled) + usize::from(is_moved);
        counts[2 * kind + usize::from(is_mirrored)] += 1;
    }
    assert_distribution(&counts, &[0.1, 0.1, 0.3, 0.3, 0.1, 0.1], "kinds of rows");
    Ok(())
}

#[test]
fn rows_are_drawn_again_by_their_moved_goals() -> Result {
    let sampler = Sampler::new(20_000, GoalStrategy::Future, UnitInterval::ONE)
        .with_goal_noise(noise(half()));
    let share_achieved = |sampler: &Sampler| -> Result<f64> {
        let batch = plain(sampler, 5)?;
        let pairs = batch.achieved_goal().chunks_exact(3).zip(batch.desired_goal().chunks_exact(3));
        let achieved = pairs.filter(|(achieved, goal)| reward().is_success(achieved, goal)).count();
        Ok(achieved as f64 / batch.len() as f64)
    };
    // A row is always kept after three rejections.
    let rejected = share_achieved(&sampler)?;
    let left = share_achieved(&sampler.with_keep_already_achieved(UnitInterval::ZERO))?;
    assert!(rejected > 0.2 && (left - rejected.powi(4)).abs() < 0.01, "{rejected} {left}");
    Ok(())
}

#[test]
fn what_is_off_changes_no_bit() -> Result {
    let zero = UnitInterval::ZERO;
    for sampler in samplers()? {
        let expected = plain(&sampler, 7)?;
        // No symmetry is needed, and none is used.
        let mut batch = Batch::<f64>::new();
        sampler.with_mirrored(zero).sample(&buffer()?, &reward(), 7, &mut batch)?;
        assert_eq!(batch, expected);
        for off in [noise(zero), GoalNoise::new(0.0, UnitInterval::ONE)] {
            assert_eq!(plain(&sampler.with_goal_noise(off), 7)?, expected);
        }
        let all = sampler.with_mirrored(half()).with_goal_noise(noise(half()));
        assert_ne!(plain(&all, 7)?, expected);
        assert_eq!(all.with_mirrored(zero).with_goal_noise(None), sampler);
    }
    Ok(())
}

#[test]
fn any_number_of_threads_changes_the_same_rows() -> Result {
    for sampler in samplers()? {
        let sampler = sampler
            .with_batch_size(5001)
            .with_mirrored(half())
            .with_goal_noise(noise(half()))
            .with_parallel(false);
        let alone = plain(&sampler, 7)?;
        // Threads do not draw the same rows.
        let (first, second) = alone.transition().split_at(2500);
        assert_ne!(first, &second[..2500]);
        for threads in 1..=4 {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
            // The error of a draw cannot leave the pool's threads.
            let together = pool.install(|| plain(&sampler.with_parallel(true), 7).ok());
            assert_eq!(together.as_ref(), Some(&alone));
        }
    }
    Ok(())
}

#[test]
fn rows_are_not_mirrored_without_the_symmetry_of_the_task() -> Result {
    let sampler = samplers()?[0].with_mirrored(half());
    let mut batch = Batch::<f64>::new();
    let refused = sampler.sample(&buffer()?, &reward(), 3, &mut batch);
    assert_eq!(refused, Err(SampleError::NoSymmetry));
    let same = |len| Mirror::new((0..len).map(Mirrored::same).collect::<Vec<_>>());
    let (right, wrong) = (symmetry()?, same(4)?);
    for (symmetry, expected) in [
        (Symmetry { observation: wrong.clone(), ..right.clone() }, DIMS.observation),
        (Symmetry { goal: wrong.clone(), ..right.clone() }, DIMS.goal),
        (Symmetry { action: wrong, ..right }, DIMS.action),
    ] {
        let transforms = Transforms { symmetry: Some(&symmetry), ..Transforms::default() };
        let columns = ColumnsMut::default();
        let refused =
            sampler.sample_into(&buffer()?, &reward(), 3, &mut batch, transforms, columns);
        assert_eq!(refused, Err(SampleError::SymmetryDim { expected, actual: 4 }));
        assert!(batch.is_empty());
    }
    Ok(())
}

#[test]
fn a_radius_is_finite_and_a_goal_stays_where_it_cannot_be_moved() -> Result {
    let sampler = samplers()?[0];
    let mut batch = Batch::<f64>::new();
    for radius in [-1.0, f64::NAN, f64::INFINITY] {
        let noise = GoalNoise::new(radius, UnitInterval::ONE);
        let refused = sampler.with_goal_noise(noise).sample(&buffer()?, &reward(), 3, &mut batch);
        assert!(matches!(refused, Err(SampleError::BadRadius { .. })), "{refused:?}");
    }
    // The type of the buffer holds no number of this size.
    let mut buffer = her_relabel::HerBuffer::<f32>::new(buffer()?.config().clone())?;
    buffer.add_episode(&her_relabel::EpisodeData {
        observation: &[0.0; 2 * DIMS.observation],
        achieved_goal: &[0.25; 2 * DIMS.goal],
        desired_goal: &[0.5; DIMS.goal],
        action: &[0.0; DIMS.action],
        reward: &[0.0],
        terminated: false,
        truncated: true,
        fields: &[("value", &[0.0]), ("latent", &[0.0; 2])],
    })?;
    let noise = GoalNoise::new(f64::MAX, UnitInterval::ONE);
    sampler.with_goal_noise(noise).sample(&buffer, &reward(), 3, &mut batch)?;
    assert!(batch.desired_goal().iter().all(|element| [0.25, 0.5].contains(element)));
    Ok(())
}
