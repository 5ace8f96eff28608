//! Pictures of environments as arrays.

use fetch_env::{RenderEnv, RenderOptions, Renderer};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

use crate::error::Result;

/// The renderer of one or many environments, made with the first picture.
pub(crate) struct Pictures {
    options: RenderOptions,
    renderer: Option<Renderer>,
}

impl Pictures {
    /// Prepares to draw pictures of this size.
    pub(crate) fn new(width: u32, height: u32) -> Result<Self> {
        let options = RenderOptions::default().with_width(width).with_height(height);
        options.check()?;
        Ok(Self { options, renderer: None })
    }

    pub(crate) fn close(&mut self) {
        self.renderer = None;
    }

    /// Draws colors: height x width x 3.
    pub(crate) fn rgb<'py>(
        &mut self,
        py: Python<'py>,
        env: &(impl RenderEnv + Sync),
    ) -> Result<Bound<'py, PyArray3<u8>>> {
        let [height, width] = self.shape();
        self.draw(py, env, |renderer| {
            let picture = py.detach(|| env.render(renderer))?;
            Ok(PyArray1::from_slice(py, picture).reshape([height, width, 3])?)
        })
    }

    /// Draws distances from the camera in meters: height x width.
    pub(crate) fn depth<'py>(
        &mut self,
        py: Python<'py>,
        env: &(impl RenderEnv + Sync),
    ) -> Result<Bound<'py, PyArray2<f32>>> {
        let shape = self.shape();
        self.draw(py, env, |renderer| {
            let picture = py.detach(|| env.render_depth(renderer))?;
            Ok(PyArray1::from_slice(py, picture).reshape(shape)?)
        })
    }

    const fn shape(&self) -> [usize; 2] {
        [self.options.height() as usize, self.options.width() as usize]
    }

    /// Draws with the renderer, which is made anew after a failure.
    fn draw<T>(
        &mut self,
        py: Python<'_>,
        env: &(impl RenderEnv + Sync),
        draw: impl FnOnce(&mut Renderer) -> Result<T>,
    ) -> Result<T> {
        let mut renderer = match self.renderer.take() {
            Some(made) => made,
            None => py.detach(|| env.renderer(self.options.clone()))?,
        };
        let drawn = draw(&mut renderer)?;
        self.renderer = Some(renderer);
        Ok(drawn)
    }
}
