//! The shim's renderer: an OpenGL context, the state that it draws, and the pictures.

use std::{
    ffi::{CStr, c_int},
    ptr::{self, NonNull},
    sync::{Arc, Mutex, PoisonError},
};

use super::{
    super::{
        data::Data,
        ffi::{self, RawRenderer, RawSegment},
        ids::{GeomId, SiteId},
        library,
        model::Model,
    },
    error::RenderError,
    options::{FreeCamera, RenderOptions},
};
use crate::error::SimError;

/// What a pixel shows.
///
/// The ids belong to the renderer's [`model`](super::Renderer::model), which has shapes that the
/// simulation lacks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Segment {
    /// No part of the model: the sky.
    #[default]
    Background,
    /// A geom.
    Geom(GeomId),
    /// A site, such as the goal's red sphere.
    Site(SiteId),
    /// Something else that MuJoCo draws.
    Other,
}

impl From<RawSegment> for Segment {
    fn from(RawSegment { kind, id }: RawSegment) -> Self {
        match (kind, usize::try_from(id)) {
            (ffi::FS_BACKGROUND, _) => Self::Background,
            (ffi::FS_SEGMENT_GEOM, Ok(id)) => Self::Geom(GeomId(id)),
            (ffi::FS_SEGMENT_SITE, Ok(id)) => Self::Site(SiteId(id)),
            _ => Self::Other,
        }
    }
}

/// Draws the state in `data`, and owns the pictures. Stays on its thread, as its OpenGL context does.
pub(super) struct Canvas {
    raw: NonNull<RawRenderer>,
    pub(super) data: Data,
    height: usize,
    rgb: Vec<u8>,
    depth: Vec<f32>,
    segments: Vec<Segment>,
    /// The objects to which the numbers in a segmented picture refer.
    objects: Vec<RawSegment>,
}

/// Locked while a renderer is made, because MuJoCo looks up OpenGL's functions for the first one.
static MAKING: Mutex<()> = Mutex::new(());

impl Canvas {
    pub(super) fn new(mut model: Model, options: &RenderOptions) -> Result<Self, RenderError> {
        let (width, height) = (options.width(), options.height());
        let samples = c_int::from(options.samples());
        // SAFETY: the model is alive and borrowed mutably.
        unsafe {
            ffi::fs_prepare_model(model.as_mut_ptr(), width as c_int, height as c_int, samples);
        }
        let data = Data::new(Arc::new(model))?;
        let raw = make(data.model())?;
        let rgb = vec![0; 3 * width as usize * height as usize];
        let (height, depth) = (height as usize, Vec::new());
        Ok(Self { raw, data, height, rgb, depth, segments: Vec::new(), objects: Vec::new() })
    }

    pub(super) fn backend() -> Option<&'static str> {
        let _alone = MAKING.lock().unwrap_or_else(PoisonError::into_inner);
        let name = ffi::fs_gl_backend();
        // SAFETY: null, or a C string that lives as long as the program.
        (!name.is_null()).then(|| unsafe { CStr::from_ptr(name) }.to_str().ok())?
    }

    pub(super) fn set_free_camera(&mut self, camera: &FreeCamera) {
        let numbers = camera.numbers().map(|(_, value)| value);
        // SAFETY: the renderer is alive and `numbers` is valid for reads.
        unsafe { ffi::fs_set_free_camera(self.raw.as_ptr(), &raw const numbers) };
    }

    /// # Panics
    /// If the model has no camera of this id.
    pub(super) fn set_fixed_camera(&mut self, id: usize) {
        assert!(id < self.data.model().sizes.ncam as usize, "a camera of another model");
        // SAFETY: the renderer is alive and the model has a camera of this id.
        unsafe { ffi::fs_set_fixed_camera(self.raw.as_ptr(), id as c_int) };
    }

    /// Computes from the positions in `data` what is drawn.
    pub(super) fn place(&mut self) -> Result<(), RenderError> {
        let model = self.data.model().as_ptr();
        // SAFETY: the data is alive, borrowed mutably, and was made from this model.
        check(unsafe { ffi::fs_place(model, self.data.as_ptr()) })
    }

    pub(super) fn rgb(&mut self) -> Result<&[u8], RenderError> {
        self.draw(Picture::Rgb)?;
        flip(&mut self.rgb, self.height);
        Ok(&self.rgb)
    }

    pub(super) fn depth(&mut self) -> Result<&[f32], RenderError> {
        self.depth.resize(self.rgb.len() / 3, 0.0);
        self.draw(Picture::Depth)?;
        let mut planes = [0.0; 2];
        // SAFETY: the renderer is alive and `planes` is valid for writes.
        let parallel = unsafe { ffi::fs_planes(self.raw.as_ptr(), &raw mut planes) } != 0;
        let [near, far] = planes;
        for depth in &mut self.depth {
            *depth = if parallel {
                near + *depth * (far - near)
            } else {
                near / (1.0 - *depth * (1.0 - near / far))
            };
        }
        flip(&mut self.depth, self.height);
        Ok(&self.depth)
    }

    pub(super) fn segmentation(&mut self) -> Result<&[Segment], RenderError> {
        self.draw(Picture::Segments)?;
        flip(&mut self.rgb, self.height);
        let room = self.objects.len();
        // SAFETY: the renderer is alive and `objects` has room for `room` segments.
        let count = unsafe {
            ffi::fs_segments(self.raw.as_ptr(), self.objects.as_mut_ptr(), room as c_int)
        };
        if room < count as usize {
            self.objects.resize(count as usize, RawSegment::default());
            // SAFETY: as above.
            unsafe { ffi::fs_segments(self.raw.as_ptr(), self.objects.as_mut_ptr(), count) };
        }
        self.segments.clear();
        self.segments.extend(self.rgb.chunks_exact(3).map(|rgb| {
            let number =
                usize::from(rgb[0]) + 256 * usize::from(rgb[1]) + 65536 * usize::from(rgb[2]);
            let object = number.checked_sub(1).and_then(|index| self.objects.get(index));
            object.copied().map(Segment::from).unwrap_or_default()
        }));
        Ok(&self.segments)
    }

    fn draw(&mut self, picture: Picture) -> Result<(), RenderError> {
        let (rgb, depth) = match picture {
            Picture::Rgb | Picture::Segments => (self.rgb.as_mut_ptr(), ptr::null_mut()),
            Picture::Depth => (ptr::null_mut(), self.depth.as_mut_ptr()),
        };
        let segments = c_int::from(picture == Picture::Segments);
        let (model, data) = (self.data.model().as_ptr(), self.data.as_ptr());
        // SAFETY: renderer, model and data are alive and belong together, on the thread that made
        // them (a canvas is not `Send`); a buffer that is not null has room for the picture.
        check(unsafe { ffi::fs_draw(self.raw.as_ptr(), model, data, segments, rgb, depth) })
    }
}

/// The part of a picture that is read back.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Picture {
    Rgb,
    Depth,
    Segments,
}

fn make(model: &Model) -> Result<NonNull<RawRenderer>, RenderError> {
    let _alone = MAKING.lock().unwrap_or_else(PoisonError::into_inner);
    let (mut raw, mut has_gl) = (ptr::null_mut(), 0);
    // SAFETY: the library is loaded because a model is; the model is alive and prepared, and both
    // results are valid for writes.
    let status = unsafe { ffi::fs_make_renderer(model.as_ptr(), &raw mut raw, &raw mut has_gl) };
    check(status).map_err(|error| match error {
        RenderError::Failed { message } if has_gl == 0 => RenderError::NoOpenGl { reason: message },
        error => error,
    })?;
    Ok(library::allocated(raw, "a renderer")?)
}

fn check(status: c_int) -> Result<(), RenderError> {
    library::check(status).map_err(|error| match error {
        SimError::Mujoco { message } => RenderError::Failed { message },
        error => error.into(),
    })
}

/// Reverses the order of the rows, because OpenGL starts with the bottom one.
fn flip<T>(pixels: &mut [T], height: usize) {
    let row = pixels.len() / height;
    let (upper, lower) = pixels.split_at_mut(height / 2 * row);
    for (top, bottom) in upper.chunks_exact_mut(row).zip(lower.rchunks_exact_mut(row)) {
        top.swap_with_slice(bottom);
    }
}

impl Drop for Canvas {
    fn drop(&mut self) {
        // SAFETY: `raw` is owned, and dropped on the thread that made it.
        unsafe { ffi::fs_delete_renderer(self.raw.as_ptr()) };
    }
}
