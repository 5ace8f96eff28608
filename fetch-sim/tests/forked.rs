//! Rendering in a process that was forked from one with renderers.
#![cfg(all(feature = "render", target_os = "linux", not(fetch_sim_no_shim)))]

use std::{
    sync::atomic::{AtomicBool, Ordering::SeqCst},
    thread,
};

use fetch_sim::{MujocoSimulator, RenderError, RenderOptions, Renderer, SimConfig, Task};
use testing::{Result, in_child, unless_blind};

/// A small picture of the task, for which every renderer draws the same bytes.
fn picture(renderer: &mut Renderer, simulator: &MujocoSimulator) -> Result<Vec<u8>, RenderError> {
    renderer.update_scene(simulator, &[])?;
    renderer.rgb().map(<[u8]>::to_vec)
}

#[test]
fn a_child_of_a_process_with_renderers_gets_an_error_and_never_hangs() -> Result {
    let config = SimConfig::new(Task::Reach);
    let simulator = MujocoSimulator::new(&config)?;
    let options = || RenderOptions::default().with_width(40).with_height(30).with_samples(0);
    let new = || Renderer::new(&config, options());

    // Before the parent uses OpenGL, a child may.
    in_child(|| match new() {
        Err(RenderError::NoOpenGl { .. }) => Ok(()),
        made => picture(&mut made?, &simulator).map(drop).map_err(Into::into),
    })?;

    let Some(mut renderer) = unless_blind(new())? else { return Ok(()) };
    let expected = picture(&mut renderer, &simulator)?;
    let done = AtomicBool::new(false);
    thread::scope(|scope| {
        // Another thread draws and makes renderers, and holds their locks most of the time.
        let other = scope.spawn(|| -> Result<(), RenderError> {
            while !done.load(SeqCst) {
                picture(&mut new()?, &simulator)?;
            }
            Ok(())
        });
        let mut kept = Some(renderer);
        let children = (0..10).try_for_each(|_| {
            in_child(|| {
                let mut renderer = kept.take().ok_or("it is the parent's copy")?;
                assert_eq!(picture(&mut renderer, &simulator), Err(RenderError::Forked));
                assert_eq!(renderer.depth().err(), Some(RenderError::Forked));
                assert_eq!(renderer.segmentation().err(), Some(RenderError::Forked));
                drop(renderer);
                assert_eq!(new().err(), Some(RenderError::Forked));
                assert_eq!(Renderer::backend(), None);
                Ok(())
            })
        });
        done.store(true, SeqCst);
        other.join().expect("no panic in the other thread")?;
        children?;
        assert!(picture(&mut kept.ok_or("the parent has it")?, &simulator)? == expected);
        Ok(())
    })
}
