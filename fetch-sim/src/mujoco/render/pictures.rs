//! Pictures: colors, depth and segments.

use std::{ffi::c_int, ptr};

use super::{
    super::binding::{
        ffi::{self, RawGoals, RawSegment},
        library::check_as,
    },
    error::RenderError,
    renderer::{Renderer, failed},
    segment::Segment,
};

/// The part of a picture that is read back.
enum Picture {
    Rgb,
    Depth,
    Segments,
}

impl Renderer {
    /// Draws and returns the colors: height x width x 3 (red, green, blue).
    ///
    /// # Errors
    /// [`RenderError::Failed`] with MuJoCo's or OpenGL's message; [`RenderError::Forked`].
    pub fn rgb(&mut self) -> Result<&[u8], RenderError> {
        self.draw(Picture::Rgb)?;
        flip(&mut self.rgb, self.options.height());
        Ok(&self.rgb)
    }

    /// Draws and returns the distance of each pixel, height x width: meters along the direction in
    /// which the camera looks. The sky is at the farthest distance that the camera sees.
    ///
    /// # Errors
    /// [`RenderError::Failed`] with MuJoCo's or OpenGL's message; [`RenderError::Forked`].
    pub fn depth(&mut self) -> Result<&[f32], RenderError> {
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
        flip(&mut self.depth, self.options.height());
        Ok(&self.depth)
    }

    /// Draws and returns what each pixel shows, height x width. Edges are hard, whatever the number
    /// of samples.
    ///
    /// # Errors
    /// [`RenderError::Failed`] with MuJoCo's or OpenGL's message; [`RenderError::Forked`].
    pub fn segmentation(&mut self) -> Result<&[Segment], RenderError> {
        self.draw(Picture::Segments)?;
        flip(&mut self.rgb, self.options.height());
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
        Self::check_process()?;
        let (segments, rgb, depth) = match picture {
            Picture::Rgb => (0, self.rgb.as_mut_ptr(), ptr::null_mut()),
            Picture::Depth => (0, ptr::null_mut(), self.depth.as_mut_ptr()),
            Picture::Segments => (1, self.rgb.as_mut_ptr(), ptr::null_mut()),
        };
        let (raw, model, data) =
            (self.raw.as_ptr(), self.data.model().as_ptr(), self.data.as_ptr());
        let num_goals = if self.looks.shows_goals() { self.goals.len() } else { 0 };
        let goals = RawGoals {
            site: self.target(0).map_or(-1, |site| site.0 as c_int),
            count: c_int::try_from(num_goals).unwrap_or(c_int::MAX),
            color: self.looks.goal_color(),
            positions: self.goals.as_ptr().cast(),
        };
        let looks = self.looks.raw();
        let looks = looks.as_ref().map_or(ptr::null(), ptr::from_ref);
        // SAFETY: renderer, model and data are alive and belong together, and the renderer is
        // borrowed mutably; the goals are valid for reads of at most `count` positions, and the
        // looks, if any, of their objects; a buffer that is not null has room for the picture.
        let status = unsafe {
            ffi::fs_draw(raw, model, data, &raw const goals, looks, segments, rgb, depth)
        };
        check_as(status, failed)
    }
}

/// Reverses the order of the rows, because OpenGL starts with the bottom one.
fn flip<T>(pixels: &mut [T], height: u32) {
    let height = height as usize;
    let row = pixels.len() / height;
    let (upper, lower) = pixels.split_at_mut(height / 2 * row);
    for (top, bottom) in upper.chunks_exact_mut(row).zip(lower.rchunks_exact_mut(row)) {
        top.swap_with_slice(bottom);
    }
}
