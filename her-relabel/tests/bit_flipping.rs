//! Relabeling makes learning possible: the bit flipping task with hindsight and without.

#[path = "../examples/bit_flipping/learner.rs"]
mod learner;

use her_relabel::UnitInterval;

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

#[test]
fn with_hindsight_it_is_solved_and_without_it_is_not() -> Result {
    for seed in [1, 2] {
        let with = learner::learn(UnitInterval::from_k(4), 500, seed)?;
        assert!(with >= 0.95, "seed {seed}: {with}");
        let without = learner::learn(UnitInterval::ZERO, 500, seed)?;
        assert!(without <= 0.1, "seed {seed}: {without}");
    }
    Ok(())
}
