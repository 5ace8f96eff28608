//! The OpenGL context that is current on a thread before drawing is current again afterwards.
#![cfg(all(feature = "render", target_os = "linux", not(fetch_sim_no_shim)))]

use std::{
    env,
    ffi::{CStr, c_char, c_int, c_uint, c_void},
    mem::transmute,
    process::Command,
    ptr::null_mut,
};

use fetch_sim::{RenderError, RenderOptions, Renderer, SimConfig, Task};
use testing::Result;

type Pointer = *mut c_void;
const NULL: Pointer = null_mut();

unsafe extern "C" {
    fn dlopen(name: *const c_char, flags: c_int) -> Pointer;
    fn dlsym(library: Pointer, name: *const c_char) -> Pointer;
}

/// A library that provides OpenGL.
#[derive(Clone, Copy)]
struct Library(Pointer);

impl Library {
    fn open(name: &CStr) -> Option<Self> {
        // SAFETY: the name is a C string; 2 is RTLD_NOW.
        let library = unsafe { dlopen(name.as_ptr(), 2) };
        (!library.is_null()).then_some(Self(library))
    }

    /// Returns a function of the library.
    ///
    /// # Safety
    /// The library declares it with the signature `F`.
    unsafe fn function<F: Copy>(self, name: &CStr) -> F {
        // SAFETY: the library is open, and the name is a C string.
        let address = unsafe { dlsym(self.0, name.as_ptr()) };
        assert!(!address.is_null() && size_of::<F>() == size_of::<Pointer>(), "{name:?}");
        // SAFETY: the caller vouches for the signature.
        unsafe { *(&raw const address).cast::<F>() }
    }

    /// Returns the version of the context that OpenGL draws with, by the function that looks up
    /// OpenGL's.
    fn version(self, look_up: &CStr) -> Option<String> {
        type LookUp = extern "C" fn(*const c_char) -> Option<extern "C" fn()>;
        type GetString = extern "C" fn(c_uint) -> *const c_char;
        const GL_VERSION: c_uint = 0x1F02;
        // SAFETY: both libraries declare it so.
        let look_up: LookUp = unsafe { self.function(look_up) };
        let get_string = look_up(c"glGetString".as_ptr())?;
        // SAFETY: OpenGL declares it so.
        let text = unsafe { transmute::<extern "C" fn(), GetString>(get_string) }(GL_VERSION);
        // SAFETY: OpenGL returns a C string, or null without a context.
        let text = (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) });
        text.map(|text| text.to_string_lossy().into_owned())
    }
}

/// A library, and how a caller makes a context of it current and looks at it.
struct Caller {
    name: &'static CStr,
    enter: fn(Library) -> Option<()>,
    look: fn(Library) -> (usize, c_uint, Option<String>),
}

const CALLERS: [Caller; 3] = [
    Caller { name: c"libEGL.so.1", enter: |egl| enter_egl(egl, 0x30A0), look: look_at_egl },
    Caller { name: c"libEGL.so.1", enter: |egl| enter_egl(egl, 0x30A2), look: look_at_egl },
    Caller { name: c"libOSMesa.so.8", enter: enter_osmesa, look: look_at_osmesa },
];

/// Makes a context of an API (OpenGL ES or OpenGL) current.
fn enter_egl(egl: Library, api: c_uint) -> Option<()> {
    type GetDisplay = extern "C" fn(c_uint, Pointer, *const c_int) -> Pointer;
    type Initialize = extern "C" fn(Pointer, *mut c_int, *mut c_int) -> c_uint;
    type Choose = extern "C" fn(Pointer, *const c_int, *mut Pointer, c_int, *mut c_int) -> c_uint;
    type Create = extern "C" fn(Pointer, Pointer, Pointer, *const c_int) -> Pointer;
    type MakeCurrent = extern "C" fn(Pointer, Pointer, Pointer, Pointer) -> c_uint;
    // SAFETY: EGL declares these functions so.
    let get_display: GetDisplay = unsafe { egl.function(c"eglGetPlatformDisplay") };
    // SAFETY: as above.
    let initialize: Initialize = unsafe { egl.function(c"eglInitialize") };
    // SAFETY: as above.
    let bind_api: extern "C" fn(c_uint) -> c_uint = unsafe { egl.function(c"eglBindAPI") };
    // SAFETY: as above.
    let choose: Choose = unsafe { egl.function(c"eglChooseConfig") };
    // SAFETY: as above.
    let create: Create = unsafe { egl.function(c"eglCreateContext") };
    // SAFETY: as above.
    let make_current: MakeCurrent = unsafe { egl.function(c"eglMakeCurrent") };
    let display = get_display(0x31DD, NULL, std::ptr::null()); // without a surface
    let (mut config, mut count) = (NULL, 0);
    let renderable = if api == 0x30A0 { 4 } else { 8 };
    let wanted = [0x3040, renderable, 0x3033, 1, 0x3038];
    let made = initialize(display, &mut 0, &mut 0) != 0
        && bind_api(api) != 0
        && choose(display, wanted.as_ptr(), &mut config, 1, &mut count) != 0
        && count == 1;
    let context = made.then(|| create(display, config, NULL, [0x3038].as_ptr()))?;
    (make_current(display, NULL, NULL, context) != 0).then_some(())
}

/// Returns the current context, the thread's API, and the version that OpenGL draws with.
fn look_at_egl(egl: Library) -> (usize, c_uint, Option<String>) {
    // SAFETY: EGL declares these functions so.
    let context: extern "C" fn() -> Pointer = unsafe { egl.function(c"eglGetCurrentContext") };
    // SAFETY: as above.
    let api: extern "C" fn() -> c_uint = unsafe { egl.function(c"eglQueryAPI") };
    (context() as usize, api(), egl.version(c"eglGetProcAddress"))
}

fn enter_osmesa(osmesa: Library) -> Option<()> {
    type Create = extern "C" fn(c_uint, c_int, c_int, c_int, Pointer) -> Pointer;
    type MakeCurrent = extern "C" fn(Pointer, Pointer, c_uint, c_int, c_int) -> c_uint;
    // SAFETY: OSMesa declares these functions so.
    let create: Create = unsafe { osmesa.function(c"OSMesaCreateContextExt") };
    // SAFETY: as above.
    let make_current: MakeCurrent = unsafe { osmesa.function(c"OSMesaMakeCurrent") };
    let pixels = Box::leak(Box::new([0_u8; 4 * 8 * 8]));
    let context = create(0x1908, 24, 8, 0, NULL);
    (make_current(context, pixels.as_mut_ptr().cast(), 0x1401, 8, 8) & 1 != 0).then_some(())
}

fn look_at_osmesa(osmesa: Library) -> (usize, c_uint, Option<String>) {
    // SAFETY: OSMesa declares it so.
    let context: extern "C" fn() -> Pointer =
        unsafe { osmesa.function(c"OSMesaGetCurrentContext") };
    (context() as usize, 0, osmesa.version(c"OSMesaGetProcAddress"))
}

fn renderer(task: Task) -> Result<Renderer, RenderError> {
    let options = RenderOptions::default().with_width(96).with_height(64).with_samples(0);
    Renderer::new(&SimConfig::new(task), options)
}

/// Draws between two looks at the caller's context, if this process is one of the next test's.
#[test]
fn draw_in_this_process() -> Result {
    let Some(caller) = env::var_os("FETCH_SIM_TEST_CALLER") else { return Ok(()) };
    let caller = &CALLERS[caller.to_string_lossy().parse::<usize>()?];
    let library = Library::open(caller.name).ok_or("the library is missing")?;
    let nothing = (caller.look)(library);
    assert_eq!(nothing.0, 0);
    let mut first = renderer(Task::Reach)?;
    let alone = first.rgb()?.to_vec();
    assert_eq!((caller.look)(library), nothing, "none was current, none is");
    (caller.enter)(library).ok_or("the caller has no context")?;
    let own = (caller.look)(library);
    assert!(own.0 != 0 && own.2.is_some(), "{own:?}");
    assert!(first.rgb()? == alone);
    assert_eq!((caller.look)(library), own, "after a picture");
    drop(renderer(Task::Push)?);
    assert_eq!((caller.look)(library), own, "after a renderer");
    Ok(())
}

#[test]
fn the_callers_context_stays_current() -> Result {
    let has_callers = CALLERS.iter().all(|caller| Library::open(caller.name).is_some());
    let has_all = has_callers && renderer(Task::Reach).is_ok();
    if !has_all && env::var_os("MUJOCO_GL").is_none() {
        return Ok(()); // EGL or OSMesa is missing, and MUJOCO_GL does not demand it
    }
    for library in ["egl", "osmesa"] {
        for caller in 0..CALLERS.len() {
            let output = Command::new(env::current_exe()?)
                .args(["--exact", "draw_in_this_process", "--nocapture"])
                .env("FETCH_SIM_TEST_CALLER", caller.to_string())
                .env("MUJOCO_GL", library)
                .output()?;
            let text = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{library}, caller {caller}: {text}");
        }
    }
    Ok(())
}
