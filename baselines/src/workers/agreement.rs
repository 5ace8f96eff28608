//! What all processes of a run must have in common.

use super::{Workers, gather_values};

/// The processes of a run do not agree.
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "rank {rank} has a different {what} than rank 0: {theirs} instead of {first}; start all ranks \
     with the same program, files and flags"
)]
#[non_exhaustive]
pub struct Disagreement {
    /// The first process that differs from process 0.
    pub rank: usize,
    /// What differs.
    pub what: String,
    /// What the process has.
    pub theirs: String,
    /// What process 0 has.
    pub first: String,
}

debug_as_display!(Disagreement);

/// Checks that all processes have the same facts, each with its name. All of them get the same
/// answer.
///
/// # Errors
/// [`Disagreement`] with the first fact that differs, or that one of the processes does not have.
pub fn agree(workers: &mut dyn Workers, facts: &[(&str, String)]) -> Result<(), Disagreement> {
    let own: Vec<_> = facts.iter().map(|(name, fact)| ((*name).to_owned(), fact.clone())).collect();
    let all = gather_values(workers, &own).map_err(|error| Disagreement {
        rank: error.rank,
        what: "program".to_owned(),
        theirs: format!("one whose facts cannot be read ({})", error.reason),
        first: "this one".to_owned(),
    })?;
    for (rank, facts) in all.iter().enumerate() {
        if let Some([what, theirs, first]) = difference(facts, &all[0]) {
            let [what, theirs, first] = [what, theirs, first].map(str::to_owned);
            return Err(Disagreement { rank, what, theirs, first });
        }
    }
    Ok(())
}

type Fact = (String, String);

/// Returns the name of the first fact that differs, and its value in either list.
fn difference<'a>(theirs: &'a [Fact], first: &'a [Fact]) -> Option<[&'a str; 3]> {
    const NONE: &str = "none";
    let index = (0..theirs.len().max(first.len())).find(|&i| theirs.get(i) != first.get(i))?;
    Some(match (theirs.get(index), first.get(index)) {
        (Some((name, theirs)), Some((same, first))) if name == same => [name, theirs, first],
        (_, Some((name, first))) => [name, NONE, first],
        (Some((name, theirs)), None) => [name, theirs, NONE],
        (None, None) => return None,
    })
}
