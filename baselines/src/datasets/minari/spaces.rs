//! Spaces as Minari writes them: Python's JSON, which has infinities.

use fetch_env::spaces::Element;
use fetch_env::{BoxSpace, Space};

/// Returns a space as JSON; `None` for one that no Fetch environment has.
pub(super) fn space_json(space: &Space) -> Option<String> {
    match space {
        Space::BoxF32(space) => Some(box_json("float32", space)),
        Space::BoxF64(space) => Some(box_json("float64", space)),
        Space::Dict(dict) => {
            let part = |(key, part)| Some(format!("\"{key}\": {}", space_json(part)?));
            let parts: Vec<_> = dict.iter().map(part).collect::<Option<_>>()?;
            Some(format!(r#"{{"type": "Dict", "subspaces": {{{}}}}}"#, parts.join(", ")))
        }
        _ => None,
    }
}

fn box_json<T: Element>(dtype: &str, space: &BoxSpace<T>) -> String {
    let bounds = |bounds: &[T]| {
        let numbers: Vec<_> = bounds.iter().map(|bound| number((*bound).into())).collect();
        numbers.join(", ")
    };
    format!(
        r#"{{"type": "Box", "dtype": "{dtype}", "shape": {:?}, "low": [{}], "high": [{}]}}"#,
        space.shape(),
        bounds(space.low()),
        bounds(space.high())
    )
}

fn number(number: f64) -> String {
    match number {
        f64::INFINITY => "Infinity".to_owned(),
        f64::NEG_INFINITY => "-Infinity".to_owned(),
        finite => format!("{finite:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spaces_are_as_python_writes_them() {
        let unbounded = Space::BoxF64(BoxSpace::unbounded(1).unwrap());
        let expected = r#"{"type": "Box", "dtype": "float64", "shape": [1], "low": [-Infinity], "high": [Infinity]}"#;
        assert_eq!(space_json(&unbounded).unwrap(), expected);
        let unit = Space::BoxF32(BoxSpace::uniform(vec![2], -1.0, 1.0).unwrap());
        let expected = r#"{"type": "Box", "dtype": "float32", "shape": [2], "low": [-1.0, -1.0], "high": [1.0, 1.0]}"#;
        assert_eq!(space_json(&unit).unwrap(), expected);
    }
}
