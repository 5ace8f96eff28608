//! The bit flipping task of the paper, learned with and without hindsight, from the same number of
//! steps.
//!
//! `cargo run --release -p her-relabel --example bit_flipping`
#![allow(clippy::print_stdout, reason = "an example that prints is the point")]

mod learner;

use her_relabel::UnitInterval;

fn main() -> Result<(), learner::Failure> {
    println!("share of {}-bit goals reached, by episodes learned from", learner::BITS);
    println!("{:>9} {:>15} {:>15}", "episodes", "with hindsight", "without");
    for episodes in [100, 250, 500, 1000] {
        let with = learner::learn(UnitInterval::from_k(4), episodes, 0)?;
        let without = learner::learn(UnitInterval::ZERO, episodes, 0)?;
        println!("{episodes:>9} {with:>15.2} {without:>15.2}");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn with_hindsight_it_is_solved_and_without_it_is_not() -> Result<(), learner::Failure> {
        for seed in [1, 2] {
            let with = learner::learn(UnitInterval::from_k(4), 500, seed)?;
            assert!(with >= 0.95, "seed {seed}: {with}");
            let without = learner::learn(UnitInterval::ZERO, 500, seed)?;
            assert!(without <= 0.1, "seed {seed}: {without}");
        }
        Ok(())
    }
}
