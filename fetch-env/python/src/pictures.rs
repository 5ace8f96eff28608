//! Pictures of environments as arrays.

use fetch_env::{RenderEnv, RenderOptions, Renderer};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

use crate::error::Result;
use crate::exclusive::Exclusive;

/// The renderer of one or many environments, made with the first picture.
pub(crate) struct Pictures {
    options: RenderOptions,
    renderer: Exclusive<Option<Renderer>>,
}

impl Pictures {
    pub(crate) const fn new(options: RenderOptions) -> Self {
        Self { options, renderer: Exclusive::new(None) }
    }

    pub(crate) fn close(&mut self) {
        *self.renderer.get() = None;
    }

    /// Draws colors: height x width x 3.
    pub(crate) fn rgb<'py>(
        &mut self,
        py: Python<'py>,
        env: &(impl RenderEnv + Sync),
    ) -> Result<Bound<'py, PyArray3<u8>>> {
        let [height, width] = self.shape();
        let renderer = self.renderer(py, env)?;
        let picture = py.detach(|| env.render(renderer))?;
        Ok(PyArray1::from_slice(py, picture).reshape([height, width, 3])?)
    }

    /// Draws distances from the camera in meters: height x width.
    pub(crate) fn depth<'py>(
        &mut self,
        py: Python<'py>,
        env: &(impl RenderEnv + Sync),
    ) -> Result<Bound<'py, PyArray2<f32>>> {
        let shape = self.shape();
        let renderer = self.renderer(py, env)?;
        let picture = py.detach(|| env.render_depth(renderer))?;
        Ok(PyArray1::from_slice(py, picture).reshape(shape)?)
    }

    const fn shape(&self) -> [usize; 2] {
        [self.options.height() as usize, self.options.width() as usize]
    }

    fn renderer(&mut self, py: Python<'_>, env: &(impl RenderEnv + Sync)) -> Result<&mut Renderer> {
        let renderer = self.renderer.get();
        let made = match renderer.take() {
            Some(made) => made,
            None => py.detach(|| env.renderer(self.options.clone()))?,
        };
        Ok(renderer.insert(made))
    }
}
