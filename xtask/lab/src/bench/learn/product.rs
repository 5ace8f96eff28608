//! A plain product of matrices, by faer, to compare updates with.
//!
//! faer and its dependencies take a third of the lab's build, so only `bench learn` builds them.

/// A contender that multiplies matrices, and returns the number of floating-point operations.
type Contender = Box<dyn FnMut() -> anyhow::Result<usize>>;

/// Creates a contender with threads that wait for each other as often as those of an update do.
#[cfg(feature = "product")]
pub fn contender(num_threads: usize) -> anyhow::Result<Contender> {
    use std::hint::black_box;

    use faer::{Accum, Mat, Par, linalg::matmul::matmul};
    use rayon::{ThreadPoolBuilder, prelude::*};

    use super::SIZE;

    const PRODUCTS: usize = 2048;
    const BETWEEN_WAITS: usize = 8;
    let pool = ThreadPoolBuilder::new().num_threads(num_threads).build()?;
    let matrix = |value: f32| Mat::from_fn(SIZE, SIZE, |_, _| value);
    let mut targets = vec![matrix(0.0); num_threads];
    let (left, right) = (matrix(0.5), matrix(0.25));
    Ok(Box::new(move || {
        pool.install(|| {
            for _ in 0..PRODUCTS / BETWEEN_WAITS {
                targets.par_iter_mut().for_each(|target| {
                    for _ in 0..BETWEEN_WAITS {
                        let (left, right) = (black_box(&left), black_box(&right));
                        matmul(target.as_mut(), Accum::Replace, left, right, 1.0, Par::Seq);
                    }
                });
            }
        });
        Ok(num_threads * PRODUCTS * 2 * SIZE.pow(3))
    }))
}

/// Returns the error of a build without faer.
#[cfg(not(feature = "product"))]
pub fn contender(_num_threads: usize) -> anyhow::Result<Contender> {
    anyhow::bail!("built without the feature `product`: run `cargo xtask bench learn`")
}
