//! Loading any file gives a working buffer or an error.
#![no_main]

mod common;
mod files;

use common::{add_whole, begin, draw};
use files::{Input, template};
use her_relabel::{HerBuffer, LoadError, Scalar};
use libfuzzer_sys::fuzz_target;

fn check<T: Scalar>(is_sealed: bool, input: Input) {
    let mut good = Vec::new();
    template::<T>().write_to(&mut good).expect("memory takes everything");
    let mut bytes = input.apply(good);
    if is_sealed && bytes.len() > 4 {
        let end = bytes.len() - 4;
        let checksum = crc32fast::hash(&bytes[..end]);
        bytes[end..].copy_from_slice(&checksum.to_le_bytes());
    }
    let cut = HerBuffer::<T>::read_from(&bytes[..bytes.len().min(15)]);
    assert!(matches!(
        cut,
        Err(LoadError::Truncated | LoadError::Foreign | LoadError::Version { .. })
    ));
    let Ok(mut buffer) = HerBuffer::<T>::read_from(&bytes[..]) else { return };
    let drawn = draw(&buffer);
    let mut saved = Vec::new();
    buffer.write_to(&mut saved).expect("memory takes everything");
    let again = HerBuffer::<T>::read_from(&saved[..]).expect("a saved buffer");
    assert_eq!(drawn, draw(&again));
    // The buffer accepts more episodes, if its sizes are those of the common episodes.
    let config = buffer.config();
    if config.dims() == common::DIMS && config.capacity() < 1000 {
        let fits = config.fields().iter().all(|field| field.name == "value" && field.len == 1);
        for episode in 0..3 {
            let _ = begin(&mut buffer, 0, episode);
            if fits {
                add_whole(&mut buffer, episode, 5);
            }
            let _ = buffer.end_episode(0);
        }
        let _ = draw(&buffer);
    }
}

fuzz_target!(|input: (bool, bool, Input)| {
    let (is_single, is_sealed, input) = input;
    if is_single { check::<f32>(is_sealed, input) } else { check::<f64>(is_sealed, input) }
});
