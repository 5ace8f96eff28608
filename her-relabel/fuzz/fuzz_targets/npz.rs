//! Importing any archive gives episodes that can be sampled, or an error that changes nothing.
#![no_main]

mod common;
mod files;

use std::io::Cursor;

use common::draw;
use files::{Input, template};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: Input| {
    let mut buffer = template::<f32>();
    let mut good = Cursor::new(Vec::new());
    buffer.write_npz(&mut good).expect("memory takes everything");
    let bytes = input.apply(good.into_inner());
    let before = (draw(&buffer), buffer.transition_ids());
    match buffer.import_npz_bytes(&bytes) {
        Ok(_) => drop(draw(&buffer)),
        Err(_) => assert_eq!(before, (draw(&buffer), buffer.transition_ids())),
    }
});
