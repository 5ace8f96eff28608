//! The results of `verify`.

use baselines::page::{Column, escape, table};

use crate::{shared::check::Check, verify::Group};

/// The number of checks, and those of each environment to unfold.
pub fn section(groups: &[Group]) -> String {
    let all = || groups.iter().flat_map(|group| &group.checks);
    let failed = all().filter(|check| !check.passed).count();
    let mut html = format!(
        "<p>{} checks, each made by stepping the environments (<code>cargo xtask verify</code>): {}.</p>\n",
        all().count(),
        verdict(failed),
    );
    for group in groups {
        let failed = group.checks.iter().filter(|check| !check.passed).count();
        html += &format!(
            "<details{}><summary>{}: {} checks, {}</summary>\n{}</details>\n",
            if failed > 0 { " open" } else { "" },
            escape(&group.heading),
            group.checks.len(),
            verdict(failed),
            checks_table(&group.checks),
        );
    }
    html
}

fn verdict(failed: usize) -> String {
    match failed {
        0 => "<span class=\"good\">all passed</span>".into(),
        _ => format!("<span class=\"bad\">{failed} failed</span>"),
    }
}

fn checks_table(checks: &[Check]) -> String {
    let mark = |passed| match passed {
        true => "<span class=\"good\">ok</span>",
        false => "<span class=\"bad\">failed</span>",
    };
    let rows = checks
        .iter()
        .map(|check| [mark(check.passed).into(), escape(&check.name), escape(&check.seen)]);
    table([Column::Text(""), Column::Text("Check"), Column::Text("Seen")], rows)
}
