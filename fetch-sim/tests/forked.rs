//! What a process meets that was forked from one with renderers.
#![cfg(all(feature = "render", target_os = "linux", not(fetch_sim_no_shim)))]

use std::{
    env,
    error::Error,
    ffi::{c_int, c_uint},
    io,
    os::unix::process::ExitStatusExt,
    panic::{AssertUnwindSafe, catch_unwind},
    process::ExitStatus,
    sync::atomic::{AtomicBool, Ordering::SeqCst},
    thread,
};

use fetch_sim::{MujocoSimulator, RenderError, RenderOptions, Renderer, SimConfig, Task};

type Result<T = (), E = Box<dyn Error>> = std::result::Result<T, E>;

unsafe extern "C" {
    fn fork() -> c_int;
    fn waitpid(child: c_int, status: *mut c_int, options: c_int) -> c_int;
    fn alarm(seconds: c_uint) -> c_uint;
    fn _exit(status: c_int) -> !;
}

/// Runs a part of the test in a forked child, and fails if that fails, crashes or hangs.
fn in_child(part: impl FnOnce() -> Result) -> Result {
    // SAFETY: the child calls this crate and the C library's allocator alone, which work after a
    // fork.
    let child = unsafe { fork() };
    if child == 0 {
        // SAFETY: no handler is set, so that the signal ends a child that waits forever.
        unsafe { alarm(120) };
        let result = catch_unwind(AssertUnwindSafe(|| part().expect("no error in the child")));
        // SAFETY: it ends the process without the handlers of the parent's libraries.
        unsafe { _exit(result.is_err().into()) };
    }
    let mut status = 0;
    // SAFETY: `status` is valid for writes.
    if child < 0 || unsafe { waitpid(child, &raw mut status, 0) } != child {
        return Err(io::Error::last_os_error().into());
    }
    let status = ExitStatus::from_raw(status);
    if status.success() { Ok(()) } else { Err(format!("the child: {status}").into()) }
}

/// A small picture of the task, of which every renderer draws the same bytes.
fn picture(renderer: &mut Renderer, simulator: &MujocoSimulator) -> Result<Vec<u8>, RenderError> {
    renderer.update_scene(simulator, None)?;
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

    let mut renderer = match new() {
        Err(RenderError::NoOpenGl { .. }) if env::var_os("MUJOCO_GL").is_none() => return Ok(()),
        made => made?,
    };
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
