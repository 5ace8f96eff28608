//! Memory that is asked for before it is needed.

use std::hint::black_box;

use crate::error::SimError;

/// Checks that the process would get `len` bytes in one piece now. Rust ends a
/// process whose small allocations fail, so ask before you make many objects.
///
/// # Errors
/// [`SimError::NoMemory`], which says that it was for `what`.
pub fn check_memory(len: usize, what: &str) -> Result<(), SimError> {
    let mut piece = Vec::<u8>::new();
    let got = piece.try_reserve_exact(len);
    // So that it is really asked for.
    black_box(&piece);
    got.map_err(|_| SimError::NoMemory { what: what.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_any_machine_has_is_refused() {
        assert_eq!(check_memory(1 << 20, "a part"), Ok(()));
        let error = check_memory(usize::MAX / 4, "all of it").unwrap_err();
        assert_eq!(error, SimError::NoMemory { what: "all of it".to_owned() });
    }
}
