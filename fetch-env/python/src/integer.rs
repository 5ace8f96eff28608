//! Integers on their way in.

use pyo3::{
    Borrowed,
    exceptions::{PyOverflowError, PyTypeError, PyValueError},
    prelude::*,
    types::PyBool,
};

use crate::error::Error;

/// An integer from 0 on, and not a `bool`. Integers out of range are a `ValueError`, like all
/// arguments out of their range; PyO3's own conversion raises an `OverflowError`.
pub(crate) struct Integer<T>(pub(crate) T);

impl<'a, 'py, T: FromPyObject<'a, 'py>> FromPyObject<'a, 'py> for Integer<T> {
    type Error = PyErr;

    fn extract(number: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if number.is_instance_of::<PyBool>() {
            return Err(PyTypeError::new_err(format!(
                "{} is not an integer: pass a number",
                &*number
            )));
        }
        let extracted = number.extract().map(Self).map_err(Into::into);
        extracted.map_err(|error: PyErr| {
            if !error.is_instance_of::<PyOverflowError>(number.py()) {
                return error;
            }
            let bits = 8 * size_of::<T>();
            let shown = Error::shown(&number);
            PyValueError::new_err(format!(
                "{shown} is out of range: pass an integer from 0 to 2**{bits} - 1"
            ))
        })
    }
}
